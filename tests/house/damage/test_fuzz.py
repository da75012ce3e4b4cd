"""Every file that a user can hand in, damaged at random: read or refused, quickly, in little memory, nothing written.

The quick version runs with the other tests; ``pytest -m long tests/house/damage/test_fuzz.py -s`` tries 1,500 of each
and prints the figures of docs/validation/reliability.md.
"""

from __future__ import annotations

import json
import re
import resource
import shutil
import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from ovines.camera import read_calibration, write_calibration
from ovines.errors import InputError
from ovines.importers.formats.marker_csv import read_csv
from ovines.importers.formats.opencv_cameras import read_cameras
from ovines.importers.formats.trc import read_trc
from ovines.plausibility.frame_files import refuse_strange_files
from ovines.plausibility.names import read_names
from ovines.plausibility.recording import plausibility_warnings, refuse_contradictions
from ovines.recording import read_recording, read_trigger
from ovines.scenario import read_scenario
from ovines.tables import TABLES, read_table
from tests.conftest import bouncing_motion, recording_toml, two_cameras
from vision.calibration.targets.boards import find_board
from vision.frames.image_header import ImageError
from vision.frames.sources import read_image

QUICK, LONG = 40, 1500
SLOWEST_S = 5.0  # of one input: milliseconds on an idle machine; a hang is what is looked for
MEMORY_MB = 600  # more than before the test: a claimed terabyte would show
SIZE_PX = (40, 30)
ODD = (
    "nan",
    "inf",
    "-1",
    "0",
    "1e400",
    "9" * 400,
    '""',
    "[]",
    "{}",
    "true",
    '"\\u0000"',
    "1979-05-27",
    "[[[]]]",
    '"../../../etc"',
    "0x7fffffffffffffff",
    "-0.0",
    "'" + "x" * 5000 + "'",
    "[nan, 1]",
    '["a", 1]',
    "1_000",
    '"ä<b>"',
)
EDITS = st.lists(
    st.tuples(
        st.sampled_from(("cut", "insert", "double", "value", "line")),
        st.floats(0, 1),
        st.sampled_from(ODD) | st.text(max_size=6),
    ),
    min_size=1,
    max_size=2,
)
BYTES = st.lists(
    st.tuples(
        st.sampled_from(("set", "cut", "insert", "end", "zero")), st.floats(0, 1), st.binary(min_size=1, max_size=8)
    ),
    min_size=1,
    max_size=3,
)


def damaged_text(text: str, edits: list) -> str:
    for kind, where, piece in edits:
        at = int(where * max(len(text) - 1, 0))
        if kind == "cut":
            text = text[:at] + text[at + len(piece) + 1 :]
        elif kind == "insert":
            text = text[:at] + piece + text[at:]
        elif kind == "double":
            text = text[:at] + text[at : at + 200] + text[at:]
        else:
            lines = text.split("\n")
            row = int(where * (len(lines) - 1))
            key, equals, _ = lines[row].partition("=")
            lines[row] = f"{key}= {piece}" if equals and kind == "value" else piece if kind == "line" else lines[row]
            text = "\n".join(lines)
    return text


def damaged_bytes(content: bytes, edits: list) -> bytes:
    for kind, where, piece in edits:
        at = int(where * max(len(content) - 1, 0))
        if kind == "set":
            content = content[:at] + piece + content[at + len(piece) :]
        elif kind == "cut":
            content = content[:at] + content[at + len(piece) :]
        elif kind == "insert":
            content = content[:at] + piece + content[at:]
        elif kind == "zero":
            content = content[:at] + bytes(64) + content[at + 64 :]
        else:
            content = content[:at]
    return content


SCENARIO = """format = 1
name = "shaken"
gravity_m_per_s2 = [0.0, 0.0]
[nes]
radius_m = 0.01
mass_kg = 0.0246
inertia_factor = 0.5
[host]
radius_m = 0.05
motion = "driven"
[host.drive]
x = [{amplitude_m = 0.0164, frequency_hz = 11.0, phase_rad = 0.3}]
[impact]
restitution = 0.72
wall_friction = 0.13
tangential_restitution = 0.49
[friction]
coefficient = 0.2
law = "farkas"
[initial]
nes = [0.03, -0.01, 0.1, 0.0, 0.0, 0.0]
[run]
duration_s = 1.0
sample_rate_hz = 800.0
"""
TRIGGER = "frame,time_s\n" + "\n".join(f"{i},{i / 800}" for i in range(20)) + "\n"
NAMES = "camera,marker,u_px,v_px\n" + "\n".join(f"VW{c},N{i},{100 + i},{200 + i}" for c in (1, 2) for i in (1, 2, 3))
BOARD = (Path(__file__).resolve().parents[3] / "calibration_boards" / "charuco_5x7_8mm.toml").read_text()


def _text_file(name: str, good: str, read: Callable[[Path], object]) -> Callable:
    def attempt(folder: Path, data: st.DataObject) -> object:
        (folder / name).write_text(damaged_text(good, data.draw(EDITS)), encoding="utf-8", errors="surrogatepass")
        return read(folder)

    return attempt


def _recording(folder: Path) -> object:
    recording = read_recording(folder)
    (folder / "trigger.csv").write_text(TRIGGER)
    (folder / "tracks.parquet").touch()
    for camera in recording.cameras:
        recording.frame_files(camera.name)
    recording.entry()
    return recording.times_s(np.arange(3))


def _names(folder: Path) -> object:
    (folder / "recording.toml").write_text(recording_toml())
    return read_names(folder / "names.csv", read_recording(folder))


def _table(folder: Path, data: st.DataObject) -> object:
    """A table of any kind: a good file's bytes damaged, or a whole file whose columns hold what they should not."""
    name = data.draw(st.sampled_from(sorted(TABLES)))
    count = data.draw(st.integers(0, 4))
    columns = {}
    for column in TABLES[name].columns:
        good = {"str": [f"a{i}" for i in range(count)], "int": list(range(count)), "bool": [True] * count}
        columns[column.name] = good.get(column.type, [0.5 * i for i in range(count)])
    if data.draw(st.booleans()) and columns:
        odd = data.draw(st.sampled_from(sorted(columns)))
        kind = data.draw(
            st.sampled_from(
                [
                    st.floats(),
                    st.integers(-(2**63), 2**63 - 1),
                    st.text(max_size=5),
                    st.binary(max_size=5),
                    st.none(),
                    st.booleans(),
                ]
            )
        )
        columns[odd] = (
            [data.draw(kind | st.none()) for _ in range(count)]
            if data.draw(st.booleans())
            else [data.draw(kind)] * count
        )
    if data.draw(st.integers(0, 3)) == 0:
        columns.pop(data.draw(st.sampled_from(sorted(columns))))
    path = folder / f"{name}.parquet"
    try:
        pq.write_table(pa.Table.from_pandas(pd.DataFrame(columns), preserve_index=False), path)
    except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):
        return None  # no Parquet file can hold that
    if data.draw(st.booleans()):
        path.write_bytes(damaged_bytes(path.read_bytes(), data.draw(BYTES)))
    return read_table(path, name)


def claims(width: int, height: int) -> bytes:
    """A PNG whose header claims ``width`` x ``height`` pixels and which holds one row of zeros."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(100))) + chunk(b"IEND", b"")
    )


GREY = np.random.default_rng(0).integers(0, 255, (30, 40)).astype(np.uint8)
PICTURES = {
    ending: cv2.imencode(ending, picture)[1].tobytes()
    for ending, picture in (
        (".png", GREY),
        (".jpg", GREY),
        (".bmp", GREY),
        (".tiff", GREY),
        (".pgm", GREY),
        (".webp", np.dstack([GREY] * 3)),
    )
} | {
    ".16.png": cv2.imencode(".png", GREY.astype(np.uint16) * 257)[1].tobytes(),
    ".rgba.png": cv2.imencode(".png", np.dstack([GREY] * 4))[1].tobytes(),
}


def _image(folder: Path, data: st.DataObject) -> object:
    if data.draw(st.integers(0, 9)) == 0:
        content = claims(
            data.draw(st.sampled_from((40, 10**6, 2**31 - 1, 2**20))),
            data.draw(st.sampled_from((30, 10**6, 2**31 - 1, 2**20))),
        )
    else:
        ending = data.draw(st.sampled_from(sorted(PICTURES)))
        content = damaged_bytes(PICTURES[ending], data.draw(BYTES))
    (folder / "picture.png").write_bytes(content)
    try:
        image = read_image(folder / "picture.png", SIZE_PX)
    except ImageError as error:
        raise InputError(str(error), "a picture", "the recording goes on without it") from None
    assert image.shape == SIZE_PX[::-1] and image.dtype in (np.uint8, np.uint16)
    return image


def _calibration(folder: Path, data: st.DataObject) -> object:
    write_calibration(two_cameras(), folder / "good.json")
    good = json.dumps(json.loads((folder / "good.json").read_text()), indent=1)
    (folder / "calibration.json").write_text(
        damaged_text(good, data.draw(EDITS)), encoding="utf-8", errors="surrogatepass"
    )
    return read_calibration(folder / "calibration.json")


LENS_YAML = """%YAML:1.0
---
image_width: 40
image_height: 30
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 3000., 0., 20., 0., 3000., 15., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0.1, 0., 0., 0., 0. ]
rvec: [ 0.1, 0.2, 3.0 ]
tvec: [ 0.1, 0.0, 0.5 ]
"""
LENS_JSON = json.dumps(
    {
        "cameraMatrix": [[3000, 0, 20], [0, 3000, 15], [0, 0, 1]],
        "distCoeffs": [0.1, 0, 0, 0, 0],
        "rvec": [0.1, 0.2, 3.0],
        "tvec": [0.1, 0.0, 0.5],
        "imageWidth": 40,
        "imageHeight": 30,
        "newCameraMatrix": {"rows": 3, "cols": 3, "data": [3000, 0, 20, 0, 3000, 15, 0, 0, 1]},
        "rms": 0.2,
    },
    indent=1,
)
LENS_TOML = """[cam_0]
name = "VW1"
size = [40, 30]
matrix = [[3000.0, 0.0, 20.0], [0.0, 3000.0, 15.0], [0.0, 0.0, 1.0]]
distortions = [0.1, 0.0, 0.0, 0.0, 0.0]
rotation = [0.1, 0.2, 3.0]
translation = [0.1, 0.0, 0.5]
"""
LENSES = {"lens.yml": LENS_YAML, "lens.json": LENS_JSON, "lens.toml": LENS_TOML}
CSV = "frame,time_s,marker,u_px,v_px\n" + "\n".join(
    f"{i},{i / 800},N{j},{i}.5,{j}.25" for i in range(10) for j in (1, 2)
)
TRC = (
    "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n800\t800\t3\t1\tmm\n"
    "Frame#\tTime\tN1\t\t\n\t\tX1\tY1\tZ1\n\n"
    + "\n".join(f"{i + 1}\t{i / 800}\t1.0\t2.0\t{i}.5" for i in range(3))
    + "\n"
)


def _lens(folder: Path, data: st.DataObject) -> object:
    """A camera of another program, damaged; a part of it repeated as often as makes it deep."""
    name = data.draw(st.sampled_from(sorted(LENSES)))
    text = damaged_text(LENSES[name], data.draw(EDITS))
    if data.draw(st.integers(0, 4)) == 0:
        at, sign = (
            data.draw(st.integers(0, len(text))),
            data.draw(st.sampled_from(("[", "{a: ", '{"a":', "<a>", "- ", "a.", " "))),
        )
        text = text[:at] + sign * data.draw(st.sampled_from((3, 100, 20_000))) + text[at:]
    (folder / name).write_text(text, encoding="utf-8", errors="surrogatepass")
    found = read_cameras([f"VW1={folder / name}"], ["VW1"])
    assert np.isfinite(found["VW1"].matrix).all() and np.isfinite(found["VW1"].translation).all()
    return found


def _csv(folder: Path) -> object:
    rows = read_csv(folder / "a.csv")[0]
    assert not np.isinf(rows.select_dtypes("number").to_numpy(float)).any()
    return rows


def _frame_names(folder: Path, data: st.DataObject) -> object:
    """Pictures under drawn names: refused as a whole, or every one of them a frame of its own."""
    places = folder / "VW1"
    shutil.rmtree(places, ignore_errors=True)
    places.mkdir()
    stems = st.sampled_from(
        (
            "frame_1",
            "frame_01",
            "frame_2",
            "frame_3",
            "frame_2 (1)",
            "frame_3 - Copy",
            "x",
            "2026-01-01 12.00.01",
            "frame_99999999999",
            "Thumbs",
        )
    )
    for stem, ending, kind in data.draw(
        st.lists(
            st.tuples(stems, st.sampled_from((".png", ".tiff", ".db")), st.sampled_from(sorted(PICTURES))),
            min_size=1,
            max_size=4,
        )
    ):
        (places / f"{stem}{ending}").write_bytes(PICTURES[kind] if ending != ".db" else b"cache")
    (folder / "recording.toml").write_text(
        recording_toml().replace('name = "VW1"\n', 'name = "VW1"\nframes = "VW1/*"\n')
    )
    recording = read_recording(folder)
    refuse_strange_files(recording)
    numbers = [int(found[-1]) for path in recording.frame_files("VW1") if (found := re.findall(r"\d+", path.stem))]
    assert not any(path.suffix == ".db" for path in recording.frame_files("VW1"))
    assert max(numbers, default=0) - min(numbers, default=0) < 10**8 or len(numbers) < len(recording.frame_files("VW1"))
    return recording


def _motion(folder: Path, data: st.DataObject) -> object:
    """A motion with one thing out of proportion: what passes is finite, in seconds, and weighable."""
    motion = bouncing_motion(60, 800.0)
    column = data.draw(st.sampled_from(("time_s", "nes_x_m", "host_y_m", "nes_angle_rad", "nes_x_sd_m")))
    values = motion[column].to_numpy(float).copy() if column in motion else np.full(60, 1e-5)
    factor = data.draw(
        st.sampled_from((1.0, 1e3, -1.0, 0.0, 1e-300, 1e300, 1e6)) | st.floats(allow_nan=False, allow_infinity=False)
    )
    if data.draw(st.booleans()):
        values = values * factor if data.draw(st.booleans()) else values + factor
    else:
        values[data.draw(st.integers(0, 59))] = factor
    (folder / "recording.toml").write_text(
        "format = 1\n[time]\nframe_rate_hz = 800.0\n[bodies.host]\ninner_radius_m = 0.05\n[bodies.nes]\nradius_m = "
        "0.01\n"
    )
    with np.errstate(all="ignore"):
        pq.write_table(
            pa.Table.from_pandas(motion.assign(**{column: values}), preserve_index=False), folder / "motion.parquet"
        )
    recording = read_recording(folder)
    table = read_table(folder / "motion.parquet", "motion")
    refuse_contradictions(recording, table)
    plausibility_warnings(recording, table)
    sd = table["nes_x_sd_m"].to_numpy(float)
    assert (
        0.01 < np.median(np.diff(table["time_s"])) * 800 < 100
        and not (sd <= 0).any()
        and np.nanmax(np.abs(table["nes_x_m"])) <= 1e3
    )
    return table


KINDS: dict[str, Callable] = {
    "camera of another program": _lens,
    "CSV": _text_file("a.csv", CSV, _csv),
    "TRC": _text_file("a.trc", TRC, lambda folder: read_trc(folder / "a.trc")),
    "names of pictures": _frame_names,
    "motion out of proportion": _motion,
    "recording.toml": _text_file("recording.toml", recording_toml() + '\n[excitation]\nfrequency_hz = '
        '11.0\n[model]\neffects = ["air_drag"]\n', _recording),
    "scenario.toml": _text_file("scenario.toml", SCENARIO, lambda folder: read_scenario(folder / "scenario.toml")),
    "calibration.json": _calibration,
    "trigger.csv": _text_file("trigger.csv", TRIGGER, lambda folder: read_trigger(folder / "trigger.csv")),
    "names.csv": _text_file("names.csv", NAMES, _names),
    "board TOML": _text_file("board.toml", BOARD, lambda folder: find_board("board.toml", folder)),
    "Parquet tables": _table,
    "images": _image,
}  # fmt: skip


def attack(kind: str, tmp_path: Path, count: int) -> dict[str, float]:
    """Try ``count`` inputs of a kind; how many were read and refused, the slowest and the memory they took."""
    folder = tmp_path / "inside"
    folder.mkdir()
    figures = {"tried": 0, "read": 0, "refused": 0, "slowest_s": 0.0}
    start_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    @settings(
        max_examples=count, deadline=None, database=None, derandomize=True, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(st.data())
    def try_one(data: st.DataObject) -> None:
        began = time.process_time()
        try:
            KINDS[kind](folder, data)
            figures["read"] += 1
        except InputError as error:
            assert error.found and error.expected and error.do
            figures["refused"] += 1
        figures["slowest_s"] = max(figures["slowest_s"], time.process_time() - began)

    try_one()
    figures["tried"] = figures["read"] + figures["refused"]
    figures["memory_mb"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - start_kb) / 1024
    assert figures["slowest_s"] < SLOWEST_S and figures["memory_mb"] < MEMORY_MB, figures
    assert [path.name for path in tmp_path.iterdir()] == ["inside"], "something was written outside"
    return figures


@pytest.mark.parametrize("kind", KINDS)
def test_some_damaged_files(kind, tmp_path):
    figures = attack(kind, tmp_path, QUICK)
    assert figures["tried"] >= QUICK and figures["read"] and figures["refused"], figures


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_many_damaged_files(kind, tmp_path):
    figures = attack(kind, tmp_path, LONG)
    print(
        f"\n| {kind} | {figures['tried']} | {figures['read']} | {figures['refused']} | "
        f"{1e3 * figures['slowest_s']:.0f} ms | {figures['memory_mb']:.0f} MB |"
    )
    assert figures["tried"] >= LONG * 0.9
