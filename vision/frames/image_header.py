"""What an image file says of itself before it is decoded: its size, and where raw pixels lie.

A header that claims a terabyte, or a file cut short, is found out here, before memory is spent on it.
"""

from __future__ import annotations

import mmap
import struct
from dataclasses import dataclass

Bytes = bytes | memoryview | mmap.mmap


@dataclass(frozen=True)
class Header:
    """Width and height [px]; `raw_offset` and `raw_bits` where the pixels lie uncompressed in one run."""

    width: int
    height: int
    raw_offset: int | None = None
    raw_bits: int = 8


class ImageError(Exception):
    """One picture cannot be used; the recording goes on without it."""


def read_header(data: Bytes, size: int) -> Header | None:
    """Header from a file's bytes (`size`: of the whole file); None for a format not looked into.

    Raises `ImageError` for a header that breaks off or a file that ends before its picture does.
    """
    try:
        if data[:8] == b"\x89PNG\r\n\x1a\n":
            if data[size - 8 : size - 4] != b"IEND":
                raise ImageError("PNG file cut short")
            return Header(*struct.unpack(">II", data[16:24]))
        if data[:2] == b"\xff\xd8":
            return _jpeg(data, size)
        if data[:2] == b"BM":
            width, height = struct.unpack("<ii", data[18:26])
            if struct.unpack("<I", data[2:6])[0] > size:
                raise ImageError("BMP file cut short")
            return Header(width, abs(height))
        if data[:4] in (b"II*\0", b"MM\0*"):
            return _tiff(data, size)
    except (struct.error, IndexError, KeyError) as error:
        raise ImageError(f"broken header ({error})") from None
    return None


def _jpeg(data: Bytes, size: int) -> Header:
    if b"\xff\xd9" not in bytes(data[max(0, size - 64) : size]):  # a decoder would fill the rest with grey in silence
        raise ImageError("JPEG file cut short")
    at = 2
    while True:
        if data[at] != 0xFF:
            raise ImageError("broken JPEG header")
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return Header(width, height)
        at += 2 + struct.unpack(">H", data[at + 2 : at + 4])[0]


_TIFF_TYPES = {1: "B", 3: "H", 4: "I"}


def _tiff(data: Bytes, size: int) -> Header:
    order = "<" if data[:2] == b"II" else ">"
    at = struct.unpack(order + "I", data[4:8])[0]
    tags: dict[int, tuple[int, ...]] = {}
    for entry in range(struct.unpack(order + "H", data[at : at + 2])[0]):
        start = at + 2 + 12 * entry
        tag, kind, count = struct.unpack(order + "HHI", data[start : start + 8])
        code = _TIFF_TYPES.get(kind)
        if code is None or count > 100_000:
            continue
        length = struct.calcsize(code) * count
        where = start + 8 if length <= 4 else struct.unpack(order + "I", data[start + 8 : start + 12])[0]
        tags[tag] = struct.unpack(f"{order}{count}{code}", data[where : where + length])
    width, height = tags[256][0], tags[257][0]
    bits = tags.get(258, (1,))
    raw = (
        tags.get(259, (1,))[0] == 1
        and len(bits) == 1
        and (bits[0] == 8 or (bits[0] == 16 and order == "<"))
        and tags.get(262, (1,))[0] == 1
        and 273 in tags
    )
    if not raw:
        return Header(width, height)
    offsets, counts = tags[273], tags.get(279, (width * height * bits[0] // 8,))
    in_one_run = all(a + n == b for a, n, b in zip(offsets, counts, offsets[1:], strict=False))
    if in_one_run and offsets[0] + width * height * bits[0] // 8 > size:
        raise ImageError("TIFF file cut short")
    return Header(width, height, offsets[0] if in_one_run else None, bits[0])
