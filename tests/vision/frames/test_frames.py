"""Frames: every format gives the same grey levels; what is broken is a named gap; what has the wrong size is
refused.
"""

import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import tifffile

from ovines.errors import InputError
from ovines.recording import read_recording
from vision.frames.image_header import ImageError
from vision.frames.sources import _CHUNK, open_sources, read_image, stream

SIZE = (64, 48)


def picture(k=0):
    return np.random.default_rng(k).integers(0, 255, SIZE[::-1], dtype=np.uint8)


@pytest.mark.parametrize("suffix", ["png", "bmp", "tif"])
def test_lossless_formats_keep_every_grey_level(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    cv2.imwrite(str(path), picture())
    assert np.array_equal(read_image(path, SIZE), picture())


def test_raw_tiff_8_and_16_bit_and_colour(tmp_path):
    tifffile.imwrite(tmp_path / "a.tif", picture(), photometric="minisblack")
    assert np.array_equal(read_image(tmp_path / "a.tif", SIZE), picture())
    wide = picture().astype(np.uint16) * 200
    for order in "<>":
        tifffile.imwrite(tmp_path / "b.tif", wide, byteorder=order, photometric="minisblack")
        read = read_image(tmp_path / "b.tif", SIZE)
        assert read.dtype == np.uint16 and np.array_equal(read, wide)
    colour = np.dstack([picture(k) for k in range(3)])
    cv2.imwrite(str(tmp_path / "c.png"), colour)
    luma = 0.114 * colour[..., 0] + 0.587 * colour[..., 1] + 0.299 * colour[..., 2]
    assert np.abs(read_image(tmp_path / "c.png", SIZE) - luma).max() <= 1


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif"])
def test_truncated_files_are_bad_images_not_half_pictures(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    if suffix == "tif":
        tifffile.imwrite(path, picture(), photometric="minisblack")
    else:
        cv2.imwrite(str(path), picture())
    path.write_bytes(path.read_bytes()[:-700])
    with pytest.raises(ImageError):
        read_image(path, SIZE)


@pytest.mark.parametrize(
    "content", [b"", b"no picture at all", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xd9", b"II*\0\xff\xff\xff\xff"]
)
def test_what_is_no_picture_is_a_bad_image(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(ImageError):
        read_image(tmp_path / "a.png", SIZE)


def test_a_header_of_a_terabyte_is_refused_before_memory_is_spent(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), picture())
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[16:24] = struct.pack(">II", 1_000_000, 1_000_000)
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(InputError, match="1000000 x 1000000"):
        read_image(tmp_path / "a.png", SIZE)


def recording(tmp_path, names_a, names_b, suffix="png"):
    for camera, names in (("A", names_a), ("B", names_b)):
        (tmp_path / camera).mkdir()
        for name in names:
            cv2.imwrite(str(tmp_path / camera / f"{name}.{suffix}"), picture(int(name.split("_")[-1])))
    text = "format = 1\n[time]\nframe_rate_hz = 800.0\n"
    for camera in "AB":
        text += (
            f'[[cameras]]\nname = "{camera}"\nframes = "{camera}/*.{suffix}"\nsensor_size_px = [64, 48]\n'
            "window_offset_px = [0, 0]\nwindow_size_px = [64, 48]\n"
        )
    (tmp_path / "recording.toml").write_text(text + "[bodies.ground]\nmarkers = ['G1']\n")
    return read_recording(tmp_path)


def test_frames_come_in_natural_order_with_the_number_of_their_names(tmp_path):
    rec = recording(tmp_path, [f"f_{k}" for k in range(8, 13)], [f"f_{k}" for k in range(8, 13)])
    sources, notes = open_sources(rec)
    seen = list(stream(sources, notes))
    assert [number for number, _ in seen] == [0, 1, 2, 3, 4] and notes == []
    assert all(np.array_equal(image, picture(8 + number)) for number, images in seen for image in images)


def test_one_frame_fewer_in_one_camera_is_a_named_gap(tmp_path):
    rec = recording(tmp_path, ["f_0", "f_1", "f_2", "f_3"], ["f_0", "f_1", "f_3"])
    sources, notes = open_sources(rec)
    assert len(notes) == 1 and "B has 3 frames of 4" in notes[0] and "frame 2" in notes[0]
    assert [images[1] is None for _, images in stream(sources, notes)] == [False, False, True, False]


def test_an_unreadable_picture_is_a_gap_and_a_wrong_size_an_error(tmp_path):
    rec = recording(tmp_path, ["f_0", "f_1", "f_2"], ["f_0", "f_1", "f_2"])
    (tmp_path / "A" / "f_1.png").write_bytes(b"broken")
    sources, notes = open_sources(rec)
    images = [pair for _, pair in stream(sources, notes)]
    assert images[1][0] is None and images[1][1] is not None
    assert any("A frame 1 (f_1.png)" in note for note in notes)
    cv2.imwrite(str(tmp_path / "B" / "f_2.png"), np.zeros((10, 10), np.uint8))
    with pytest.raises(InputError, match="10 x 10"):
        list(stream(*open_sources(rec)))


def test_no_frames_and_only_broken_frames_are_errors(tmp_path):
    rec = recording(tmp_path, ["f_0"], ["f_0"])
    (tmp_path / "A" / "f_0.png").write_bytes(b"broken")
    with pytest.raises(InputError, match="can be read"):
        list(stream(*open_sources(rec)))
    (tmp_path / "A" / "f_0.png").unlink()
    with pytest.raises(InputError, match="no frames of camera 'A'"):
        open_sources(rec)


def test_video_frames_and_a_video_that_ends_early(tmp_path):
    rec = recording(tmp_path, [f"f_{k}" for k in range(6)], ["f_0"])
    (tmp_path / "B" / "f_0.png").unlink()
    writer = cv2.VideoWriter(str(tmp_path / "B" / "b.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 30, SIZE)
    for _ in range(4):
        writer.write(np.full((*SIZE[::-1], 3), 90, np.uint8))
    writer.release()
    text = (tmp_path / "recording.toml").read_text().replace('"B/*.png"', '"B/b.avi"')
    (tmp_path / "recording.toml").write_text(text)
    rec = read_recording(tmp_path)
    sources, notes = open_sources(rec)
    images = [pair[1] for _, pair in stream(sources, notes)]
    assert [image is None for image in images] == [False] * 4 + [True] * 2
    assert np.abs(images[0].astype(int) - 90).max() < 4
    assert any("B" in note and "frame 4" in note for note in notes)


def test_memory_held_does_not_grow_with_the_recording(tmp_path):
    """However long the recording, no more than the chunk in hand and the one before are alive beside those read
    ahead.
    """
    import gc
    import weakref

    rec = recording(tmp_path, ["f_0"], ["f_0"])
    sources, notes = open_sources(rec)
    long = [
        SimpleNamespace(
            camera=s.camera, files=dict.fromkeys(range(200), s.files[0]), video=None, numbers=lambda: list(range(200))
        )
        for s in sources
    ]
    alive, most = [], 0
    for _, images in stream(long, notes):
        alive += [weakref.ref(image) for image in images]
        del images
        gc.collect(0)
        most = max(most, sum(ref() is not None for ref in alive))
    assert most <= 2 * 2 * _CHUNK  # both cameras' pictures
