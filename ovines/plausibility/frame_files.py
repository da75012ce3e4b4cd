"""The files that `frames` of a camera names, before any is decoded: what cannot be one picture per frame is refused by
name.

Looks at names and at the first bytes only, so that a test day of 100,000 pictures takes seconds.
"""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ovines.errors import InputError
from ovines.recording import CameraSettings, Recording
from ovines.tables import widest_span

PICTURES = frozenset((".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg", ".pgm", ".ppm", ".webp", ".gif", ".jp2"))
MAGIC = (
    b"\x89PNG",
    b"\xff\xd8",
    b"BM",
    b"II*\0",
    b"MM\0*",
    b"II+\0",
    b"MM\0+",
    b"P2",
    b"P5",
    b"P6",
    b"RIFF",
    b"GIF8",
    b"\0\0\0\x0cjP",
)
# How file managers name a copy of a file that is there already: "frame (1).png", "frame - Copy.png", "frame copy
# 2.png", "frame~.png"
COPY = re.compile(r"(?: \(\d+\)| ?[-_]? ?(?:copy|kopie|copie|copia)(?: ?\(?\d+\)?)?|~)$", re.IGNORECASE)
HEAD_BYTES = 4096  # a PNG's chunks before its pixels, and the tags of a usual TIFF
READERS = 4  # files opened at a time: the disk is waited for, not the processor
LEAST_FRAME_BYTES = 8  # a frame's entry in a video's own index, however little changed in the picture
UNSIGNED = 1  # TIFF's SampleFormat: 2 signed, 3 floating point


def refuse_strange_files(recording: Recording) -> None:
    """`InputError` for the first camera whose files are not one picture per frame."""
    for camera in recording.cameras:
        files = recording.frame_files(camera.name)
        if len(files) == 1 and files[0].suffix.lower() not in PICTURES and not _is_picture(_head(files[0])):
            refuse_no_video(files[0], camera)
            continue
        refuse_copies(files, camera)
        with ThreadPoolExecutor(READERS) as pool:
            for path, why in zip(files, pool.map(strange_content, files, chunksize=64), strict=True):
                if why is not None:
                    found, expected, do = why
                    raise InputError(f"camera {camera.name}: {path} {found}", expected, do)


def refuse_no_video(path: Path, camera: CameraSettings) -> None:
    """`InputError` for a file that is no video, or whose header claims more frames than its bytes can hold."""
    import cv2

    from vision.video import VIDEO_SUFFIXES

    opened, count = False, 0.0
    if path.suffix.lower() in VIDEO_SUFFIXES:  # OpenCV takes other names for a pattern of pictures, and complains of it
        capture = cv2.VideoCapture(str(path.absolute()))
        opened, count = capture.isOpened(), capture.get(cv2.CAP_PROP_FRAME_COUNT)
        capture.release()
    size = path.stat().st_size
    if not opened:
        raise InputError(
            f"camera {camera.name}: {path} ({size} bytes) cannot be opened as a video or a picture",
            "a video that OpenCV reads, or image files",
            "check 'frames', or copy or convert the file again",
        )
    if count * LEAST_FRAME_BYTES > size:
        raise InputError(
            f"camera {camera.name}: {path} claims {count:.3g} frames in {size} bytes",
            "a whole video",
            "copy or convert the file again",
        )


def refuse_copies(files: Sequence[Path], camera: CameraSettings) -> None:
    """`InputError` where two files are one frame: a file manager's copy, or one number written in two ways."""
    names = {path.name for path in files}
    copies = [
        path for path in files if (plain := COPY.sub("", path.stem)) != path.stem and plain + path.suffix in names
    ]
    if copies:
        raise InputError(
            f"camera {camera.name}: {copies[0].name} beside {COPY.sub('', copies[0].stem) + copies[0].suffix} "
            f"({len(copies)} such cop{'y' if len(copies) == 1 else 'ies'})",
            "one file per frame: a copy would count as a frame of its own and shift all later ones",
            "remove the copies",
        )
    seen: dict[tuple[str, int, str], Path] = {}
    for path in files:
        parts = re.fullmatch(r"(.*?)(\d+)(\D*)", path.stem)
        if parts is None:
            continue
        key = (str(path.parent / parts[1]), int(parts[2]), parts[3])
        if key in seen:
            raise InputError(
                f"camera {camera.name}: {seen[key].name} and {path.name} are both frame {parts[2]}",
                "one file per frame",
                "remove one of them, or narrow 'frames' (VW1/*.png)",
            )
        seen[key] = path
    numbers = sorted(number for _, number, _ in seen)
    if numbers and numbers[-1] - numbers[0] > widest_span(len(numbers)):
        last = next(path for (_, number, _), path in seen.items() if number == numbers[-1])
        raise InputError(
            f"camera {camera.name}: {len(numbers)} pictures numbered from {numbers[0]} to {str(numbers[-1])[:30]} "
            f"({last.name})",
            "frame numbers that go on from picture to picture; some may be missing",
            "correct that file's name, or remove it",
        )


def strange_content(path: Path) -> tuple[str, str, str] | None:
    """(found, expected, do) of a file that is no picture, or more than one; None for a picture, also for one that is
    damaged.
    """
    head = _head(path)
    if not head:
        return None  # empty or not readable: a gap that the frames' reader names
    if not _is_picture(head):
        if path.suffix.lower() in PICTURES:
            return None  # damaged: as above
        return "is no picture", "picture files only", f"narrow 'frames' to the pictures' ending, or remove {path.name}"
    whole = "one picture per file, or one video per camera"
    split = "write every picture into a file of its own, or all of them into a video"
    if (count := pictures_in(path, head)) > 1:
        return f"holds {count} pictures" if count < MANY else f"holds {MANY} pictures or more", whole, split
    if (kind := sample_format(path, head)) != UNSIGNED:
        named = {2: "signed whole numbers", 3: "floating-point numbers"}.get(kind, f"numbers of TIFF format {kind}")
        return (
            f"has grey levels as {named}",
            "grey levels of 8 or 16 bit, unsigned",
            "convert the pictures to 16-bit PNG or TIFF",
        )
    return None


MANY = 1000


def pictures_in(path: Path, head: bytes) -> int:
    """How many pictures a file holds (at most `MANY` are counted): pages of a TIFF, frames of an animated PNG, GIF or
    WebP.
    """
    if head[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return len(_pages(path))
    animated = (
        (head[:4] == b"\x89PNG" and 0 < head.find(b"acTL") < _found(head, b"IDAT"))
        or head[:4] == b"GIF8"
        or (head[:4] == b"RIFF" and head[12:16] == b"VP8X" and bool(head[20] & 2))
    )
    if not animated:
        return 1
    from PIL import Image

    try:
        with Image.open(path) as picture:
            return min(int(getattr(picture, "n_frames", 1)), MANY)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
        return 1  # damaged: the reader of the frames names it


def sample_format(path: Path, head: bytes) -> int:
    """TIFF's SampleFormat of the first page; `UNSIGNED` for other files."""
    if head[:4] not in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return UNSIGNED
    pages = _pages(path, 1)
    return pages[0].get(339, UNSIGNED) if pages else UNSIGNED


def _pages(path: Path, most: int = MANY) -> list[dict[int, int]]:
    """Tags with a whole number inside (tag -> number) of each full page of a TIFF, BigTIFF included; what breaks off
    ends the list.
    """
    pages: list[dict[int, int]] = []
    try:
        with open(path, "rb") as handle:
            start = handle.read(16)
            order = "<" if start[:2] == b"II" else ">"
            big = start[2:4] in (b"+\0", b"\0+")
            count_code, entry_bytes, at_code = ("Q", 20, "Q") if big else ("H", 12, "I")
            at = struct.unpack(order + at_code, start[8:16] if big else start[4:8])[0]
            seen: set[int] = set()
            while at and at not in seen and len(seen) < most:
                seen.add(at)
                handle.seek(at)
                count = struct.unpack(order + count_code, handle.read(struct.calcsize(count_code)))[0]
                if count > 4096:  # no page has so many tags
                    break
                entries = handle.read(count * entry_bytes)
                tags = dict(
                    filter(
                        None, (_tag(entries[i * entry_bytes : (i + 1) * entry_bytes], order, big) for i in range(count))
                    )
                )
                at = struct.unpack(order + at_code, handle.read(struct.calcsize(at_code)))[0]
                if not tags.get(254, 0) & 1:  # a thumbnail beside the picture is no picture of its own
                    pages.append(tags)
    except (OSError, struct.error, ValueError, OverflowError):
        pass
    return pages


def _tag(entry: bytes, order: str, big: bool) -> tuple[int, int] | None:
    tag, kind = struct.unpack(order + "HH", entry[:4])
    code = {3: "H", 4: "I"}.get(kind)
    return (tag, struct.unpack_from(order + code, entry, 12 if big else 8)[0]) if code else None


def file_notes(recording: Recording) -> list[str]:
    """What is doubtful in the names of the pictures, in sentences: several endings, pictures that `frames` leaves
    out.
    """
    notes = []
    for camera in recording.cameras:
        files = recording.frame_files(camera.name)
        if not files:
            continue
        endings = Counter(path.suffix.lower() for path in files)
        if len(endings) > 1:
            notes.append(
                f"{camera.name}: {_counted(endings)} pictures among the {len(files)} that {camera.frames!r} names"
            )
        folders = {path.parent for path in files}
        others = (
            Counter(
                entry.suffix.lower()
                for folder in folders
                for entry in folder.iterdir()
                if entry.suffix.lower() in PICTURES - set(endings) and re.search(r"\d", entry.stem)
            )
            if endings.keys() <= PICTURES
            else Counter()
        )
        if others and len(folders) == 1:
            notes.append(
                f"{camera.name}: {camera.frames!r} names {_counted(endings)} pictures and leaves out "
                f"{_counted(others)} in the same folder: widen it, or put those elsewhere"
            )
    return notes


def sizes(files: Sequence[Path], read_size: Callable[[Path], tuple[int, int] | None]) -> Counter[tuple[int, int]]:
    """How many pictures there are of each size (width, height) [px]; those whose size cannot be read are left out."""
    with ThreadPoolExecutor(READERS) as pool:
        return Counter(size for size in pool.map(read_size, files, chunksize=64) if size is not None)


def _counted(endings: Counter[str]) -> str:
    return ", ".join(f"{count} {ending}" for ending, count in endings.most_common())


def _head(path: Path) -> bytes:
    try:
        with open(path, "rb") as handle:
            return handle.read(HEAD_BYTES)
    except OSError:
        return b""


def _is_picture(head: bytes) -> bool:
    return head.startswith(MAGIC) and (head[:4] != b"RIFF" or head[8:12] == b"WEBP")  # RIFF is AVI's, too


def _found(head: bytes, piece: bytes) -> int:
    at = head.find(piece)
    return at if at >= 0 else len(head)
