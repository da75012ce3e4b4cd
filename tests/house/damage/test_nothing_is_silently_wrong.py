"""Values that cannot be are refused, doubtful ones are said with the line to change; what only looks odd works."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import tifffile
from PIL import Image

from ovines.__main__ import main
from ovines.plausibility.frame_files import pictures_in, refuse_strange_files
from ovines.plausibility.host_signal import dominant
from ovines.plausibility.recording import drive_warnings, plausibility_warnings
from ovines.recording import read_recording
from tests.conftest import bouncing_motion, recording_toml, refused, write_small_recording

GREY = np.random.default_rng(0).integers(0, 255, (688, 64)).astype(np.uint8)
SMALL = GREY[:30, :40]


def with_frames(folder: Path, pattern: str = "{camera}/*.png", count: int = 4) -> Path:
    """A recording that enters at frames: small pictures for both cameras."""
    folder.mkdir(parents=True)
    text = recording_toml().replace("4096, 688", "40, 30")
    for camera in ("VW1", "VW2"):
        (folder / camera).mkdir()
        text = text.replace(
            f'name = "{camera}"\n', f'name = "{camera}"\nframes = "{pattern.replace("{camera}", camera)}"\n'
        )
        for number in range(count):
            cv2.imwrite(str(folder / camera / f"frame_{number:05d}.png"), SMALL)
    (folder / "recording.toml").write_text(text)
    write_small_recording(folder.parent / "for the calibration", frames=3)
    return folder


def _pages(path: Path) -> None:
    tifffile.imwrite(path, np.stack([SMALL] * 3), photometric="minisblack")


def _big_pages(path: Path) -> None:
    with tifffile.TiffWriter(path, bigtiff=True) as writer:
        for _ in range(3):
            writer.write(SMALL, photometric="minisblack")


def _animated(path: Path) -> None:
    frames = [Image.fromarray(np.roll(SMALL, shift)) for shift in range(3)]
    frames[0].save(path, save_all=True, append_images=frames[1:])


STACKS = {
    "stack.tif": _pages,
    "big.tif": _big_pages,
    "film.gif": _animated,
    "film.png": _animated,
    "film.webp": _animated,
}


@pytest.mark.parametrize("name", STACKS)
def test_a_file_of_several_pictures_is_no_picture(name, tmp_path, capsys):
    folder = with_frames(tmp_path / "run", "{camera}/f*")
    STACKS[name](folder / "VW1" / name)
    (folder / "VW1" / name).rename(folder / "VW1" / f"frame_00004{Path(name).suffix}")
    for command in ("check", "track"):
        assert main([command, str(folder)]) == 2
        said = capsys.readouterr()
        assert f"frame_00004{Path(name).suffix} holds 3 pictures" in said.out + said.err


def test_one_picture_is_one_picture(tmp_path):
    """Of every format, also a TIFF with a thumbnail and a GIF of one frame."""
    with tifffile.TiffWriter(tmp_path / "thumb.tif") as writer:
        writer.write(SMALL, photometric="minisblack")
        writer.write(SMALL[::4, ::4], photometric="minisblack", subfiletype=1)
    Image.fromarray(SMALL).save(tmp_path / "one.gif")
    for ending in ("png", "jpg", "bmp", "tif", "webp", "pgm"):
        cv2.imwrite(str(tmp_path / f"one.{ending}"), SMALL)
    for path in tmp_path.iterdir():
        assert pictures_in(path, path.read_bytes()[:4096]) == 1, path


@pytest.mark.parametrize("kind", ["float16", "int16", "float32"])
def test_grey_levels_that_are_no_counts(kind, tmp_path, capsys):
    folder = with_frames(tmp_path / "run", "{camera}/f*")
    tifffile.imwrite(folder / "VW2" / "frame_00004.tif", -SMALL.astype(kind), photometric="minisblack")
    assert main(["check", str(folder)]) == 2
    assert "grey levels as" in capsys.readouterr().out


COPIES = {
    "frame_00001 (1).png": "(1 such copy)",
    "frame_00002 - Copy.png": "(1 such copy)",
    "frame_00002 copy 2.png": "(1 such copy)",
    "frame_1.png": "are both frame",
    "Thumbs.db": "is no picture",
    "frame_00001.bmp": "are both frame",
    "frame_99999999999999999999999999.png": "numbered from 0 to 9999",
}


@pytest.mark.parametrize("name", COPIES)
def test_files_that_are_no_frames_of_their_own(name, tmp_path, capsys):
    folder = with_frames(tmp_path / "run", "{camera}/*")
    first = folder / "VW1" / "frame_00001.png"
    if name.endswith(".bmp"):
        cv2.imwrite(str(first.with_name(name)), SMALL)
    else:
        first.with_name(name).write_bytes(b"cache" if name.endswith(".db") else first.read_bytes())
    for command in ("check", "track"):
        assert main([command, str(folder)]) == 2
        said = capsys.readouterr()
        assert COPIES[name] in said.out + said.err and name in said.out + said.err


def test_names_that_only_look_odd_are_taken(tmp_path):
    folder = with_frames(tmp_path / "run", "{camera}/*")
    for camera in ("VW1", "VW2"):
        for path in (folder / camera).iterdir():
            path.rename(
                path.with_name(f"set (1) {path.stem} (1).png")
            )  # all of them, as a browser saves a second download
    refuse_strange_files(read_recording(folder))


def test_mixed_endings_and_sizes_are_reported_with_counts(tmp_path, capsys):
    folder = with_frames(tmp_path / "run", "{camera}/*.png")
    for number in (2, 3):
        (folder / "VW1" / f"frame_{number:05d}.png").rename(folder / "VW1" / f"frame_{number:05d}.tif")
    main(["check", str(folder)])
    assert "VW1/*.png' names 2 .png pictures and leaves out 2 .tif in the same folder" in capsys.readouterr().out
    cv2.imwrite(str(folder / "VW2" / "frame_00003.png"), SMALL[:10])
    assert main(["check", str(folder)]) == 2
    printed = capsys.readouterr().out
    assert "pictures of VW2: 3 of 40 x 30 px, 1 of 40 x 10 px" in printed and "recording.toml, line" in printed


def test_a_damaged_first_picture_costs_only_itself(tmp_path):
    """The look at the first pictures takes the next frame where one is damaged."""
    from vision.calibration_check import _first_pictures

    folder = with_frames(tmp_path / "run", "{camera}/*.png")
    (folder / "VW1" / "frame_00000.png").write_bytes(b"")
    images = _first_pictures(read_recording(folder))
    assert images is not None and len(images) == 2


def write_motion(folder: Path, frame: pd.DataFrame, extra: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.Table.from_pandas(frame, preserve_index=False), folder / "motion.parquet")
    (folder / "recording.toml").write_text(
        "format = 1\n[time]\nframe_rate_hz = 800.0\n[bodies.host]\ninner_radius_m = 0.05\n"
        "[bodies.nes]\nradius_m = 0.01\nmass_kg = 0.0246\ninertia_factor = 0.5\n" + extra
    )
    return folder


MOTIONS = {
    "milliseconds": (lambda m: m.assign(time_s=1e3 * m["time_s"]), "are the times in milliseconds?"),
    "another rate, ten times": (lambda m: m.assign(time_s=0.1 * m["time_s"]), "run at 8000 frames per second"),
    "negative sd": (lambda m: m.assign(nes_x_sd_m=-1.0), "nes_x_sd_m is -1 in row 0"),
    "one negative sd": (
        lambda m: m.assign(host_y_sd_m=np.where(m["frame"] == 7, -1e-6, 1e-6)),
        "host_y_sd_m is -1e-06 in row 7",
    ),
    "a place a thousand kilometres off": (
        lambda m: m.assign(nes_x_m=m["nes_x_m"].where(m["frame"] != 7, 1e6)),
        "nes_x_m is 1e+06 in row 7",
    ),
    "sd 1e300": (lambda m: m.assign(nes_x_sd_m=1e300), "nes_x_sd_m is 1e+300"),
    "a frame far off": (
        lambda m: m.assign(frame=m["frame"].where(m["frame"] != 199, 10**8), time_s=m["frame"] / 800),
        "frame 198 is followed by frame 100000000",
    ),
    "a frame beyond all": (
        lambda m: m.assign(frame=m["frame"].where(m["frame"] != 199, 2 * 10**18)),
        "2000000000000000000",
    ),
}


@pytest.mark.parametrize("case", MOTIONS)
def test_a_motion_that_cannot_be(case, tmp_path, capsys):
    change, words = MOTIONS[case]
    folder = write_motion(tmp_path / "run", change(bouncing_motion(200, 800.0)))
    for command in ("check", "analyse", "diagnose"):
        assert main([command, str(folder), "--out", str(tmp_path / "out")]) == 2, command
        said = capsys.readouterr()
        assert words in said.out + said.err and "Traceback" not in said.err


@pytest.mark.parametrize("origin_s", [1e6, 1.7e9, -5.0])
def test_times_may_start_anywhere(origin_s, tmp_path, capsys):
    motion = bouncing_motion(200, 800.0)
    folder = write_motion(tmp_path / "run", motion.assign(time_s=motion["time_s"] + origin_s))
    assert main(["check", str(folder)]) == 0
    assert "caution" not in capsys.readouterr().out
    assert main(["analyse", str(folder), "--out", str(tmp_path / "out")]) == 0


# text of recording.toml, what replaces it, exit status of `check`, words, and the line to change
SETTINGS = {
    "mass in g": ("mass_kg = 0.0246", "mass_kg = 24.6", 0, "is it in g? then mass_kg = 0.0246"),
    "mass of a feather": ("mass_kg = 0.0246", "mass_kg = 1e-6", 0, "a disk of paper weighs"),
    "wall in mm": ("inner_radius_m = 0.05", "inner_radius_m = 50.0", 2, "is one of them in mm?"),
    "wall too wide": ("inner_radius_m = 0.05", "inner_radius_m = 0.5", 0, "a length like that of its layout_m"),
    "exposure of seconds": (
        'name = "VW2"\n',
        'name = "VW2"\nexposure_s = 0.8\n',
        2,
        "an exposure within the 0.00125 s",
    ),
    "no offset": ("window_offset_px = [0, 900]\n", "", 0, "VW2 has no window_offset_px"),
    "rate of the tracks": ("frame_rate_hz = 800.0", "frame_rate_hz = 8000.0", 2, "run at 800 frames per second"),
    "rate a little off": ("frame_rate_hz = 800.0", "frame_rate_hz = 400.0", 0, "run at 800 frames per second"),
}
ABOUT = {"exposure of seconds": "exposure_s", "no offset": "window_size_px"}


@pytest.mark.others_further
@pytest.mark.parametrize("case", SETTINGS)
def test_a_setting_out_of_proportion(case, tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run", frames=60).folder
    old, new, status, words = SETTINGS[case]
    text = (folder / "recording.toml").read_text()
    assert old in text
    (folder / "recording.toml").write_text(text.replace(old, new, 1))
    assert main(["check", str(folder)]) == status
    printed = capsys.readouterr().out
    assert (
        words in printed and ("  wrong:" in printed) == (status == 2) and ("  caution:" in printed) == (status == 0)
    ), printed
    line = int(printed.split("recording.toml, line ")[1].split(")")[0])
    assert ABOUT.get(case, new.split(" =")[0]) in (folder / "recording.toml").read_text().splitlines()[line - 1]
    out = str(tmp_path / "out")
    if status == 2:
        assert main(["run", str(folder), "--out", out]) == 2
        assert words in capsys.readouterr().err
    elif case != "no offset":  # those tracks do not meet: refused, see below
        assert main(["analyse", str(folder), "--out", out]) == 0
        assert words in capsys.readouterr().out, "the run repeats what concerns its result"


def test_a_contradiction_is_reported_once(tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run", frames=60).folder
    text = (folder / "recording.toml").read_text()
    (folder / "recording.toml").write_text(text.replace("inner_radius_m = 0.05", "inner_radius_m = 50.0"))
    assert main(["check", str(folder)]) == 2
    assert capsys.readouterr().out.count("found:    ") == 1


def test_a_usual_recording_raises_no_doubt(tmp_path):
    recording = read_recording(write_small_recording(tmp_path / "run", frames=3).folder)
    assert plausibility_warnings(recording) == []
    samples = Path(__file__).resolve().parents[3] / "sample_data"
    for folder in (samples / "rendered", *sorted((samples / "series_tilted").glob("run-*"))):
        assert plausibility_warnings(read_recording(folder)) == []


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("first", "second", "status", "words"),
    [
        ("[0, 900]", "[0, 1192]", 2, "intersect only with VW1 [0, 1192], VW2 [0, 900]"),
        ("[0, 1192]", "[0, 0]", 0, "check window_offset_px"),
        ("[0, 900]", "[0, 900]", 0, "check window_offset_px"),
        ("[0, 1192]", "[0, 900]", 0, None),
    ],
)
def test_a_wrong_window_is_named(first, second, status, words, tmp_path, capsys):
    """Exchanged: refused with the windows that fit; forgotten or the other's: the misfit is noted with what to
    check.
    """
    folder = write_small_recording(tmp_path / "run", frames=20).folder
    text = (folder / "recording.toml").read_text()
    text = (
        text.replace("[0, 1192]", "FIRST")
        .replace("[0, 900]", "SECOND")
        .replace("FIRST", first)
        .replace("SECOND", second)
    )
    (folder / "recording.toml").write_text(text)
    assert main(["triangulate", str(folder), "--out", str(tmp_path / "out")]) == status
    said = capsys.readouterr()
    assert words in said.out + said.err if words else "note" not in said.out


def test_the_drive_is_measured():
    """A sine of known frequency and amplitude with noise, gaps and a jittering clock; noise alone and a Host at rest
    have none.
    """
    rng = np.random.default_rng(5)
    times_s = np.sort(rng.choice(np.arange(800) / 800, 600, replace=False)) + 1.7e9
    wave = 0.0164 * np.sin(2 * np.pi * 11.0 * (times_s - 1.7e9) + 0.3)
    places = np.stack([0.8 * wave, 0.6 * wave], -1) + rng.normal(0, 2e-4, (600, 2)) + 0.3
    hz, amplitude_m = dominant(times_s, places)
    assert hz == pytest.approx(11.0, abs=0.1) and amplitude_m == pytest.approx(0.0164, rel=0.01)
    assert dominant(times_s, rng.normal(0, 1e-5, (600, 2))) is None
    assert dominant(times_s, np.zeros((600, 2))) is None


@pytest.mark.further
@pytest.mark.parametrize(
    ("frequency_hz", "acceleration_g", "words"),
    [
        (11.0, 8.0, None),
        (14.0, 8.0, "the Host shakes at 11"),
        (110.0, 8.0, "0.1 times that"),
        (11.0, 0.8, "which is 8.0"),
        (11.0, 80.0, "which is 8.0"),
    ],
)
def test_the_drive_that_was_asked_for_beside_the_measured_one(frequency_hz, acceleration_g, words, tmp_path, capsys):
    motion = bouncing_motion(400, 800.0)
    motion["host_x_m"] = 0.0164 * np.sin(2 * np.pi * 11.0 * motion["time_s"])
    extra = f"[excitation]\nfrequency_hz = {frequency_hz}\nacceleration_g = {acceleration_g}\n"
    folder = write_motion(tmp_path / "run", motion, extra)
    found = drive_warnings(motion, read_recording(folder))
    assert (found == []) if words is None else (len(found) == 1 and words in found[0]), found
    assert main(["check", str(folder)]) == 0
    printed = capsys.readouterr().out
    assert ("caution:" in printed) == (words is not None) and ("recording.toml, line" in printed) == (words is not None)


@pytest.mark.others_further
@pytest.mark.parametrize(("factor", "doubted"), [(1.0, False), (0.4, True), (2.5, False)])
@pytest.mark.parametrize("frequency_hz", [0.0, 20.0, 80.0])
def test_an_sd_that_is_too_small(factor, doubted, frequency_hz, tmp_path, capsys):
    """Noise of 5 um on a Host that shakes up to a tenth of the frame rate, stated as 0.4, 1 and 2.5 times that."""
    rng = np.random.default_rng(7)
    motion = bouncing_motion(200, 800.0)
    for axis in "xy":
        wave = 0.002 * np.sin(2 * np.pi * frequency_hz * motion["time_s"])
        motion[f"host_{axis}_m"] = wave + rng.normal(0, 5e-6, 200)
        motion[f"host_{axis}_sd_m"] = factor * 5e-6
    folder = write_motion(tmp_path / "run", motion)
    assert main(["check", str(folder)]) == 0
    printed = capsys.readouterr().out
    assert ("host_x_sd_m and host_y_sd_m: the Host's places scatter 2" in printed) == doubted, printed
    assert main(["analyse", str(folder), "--out", str(tmp_path / "out")]) == 0
    assert ("surer than they are" in capsys.readouterr().out) == doubted


@pytest.mark.further
def test_tracks_tell_the_drive_s_frequency(tmp_path, capsys):
    shutil.copytree(
        Path(__file__).resolve().parents[3] / "sample_data" / "series_tilted" / "run-01", tmp_path / "series" / "run"
    )
    shutil.copy(
        Path(__file__).resolve().parents[3] / "sample_data" / "series_tilted" / "calibration.json", tmp_path / "series"
    )
    path = tmp_path / "series" / "run" / "recording.toml"
    assert main(["check", str(path)]) == 0 and "caution" not in capsys.readouterr().out
    text = path.read_text()
    frequency = next(line for line in text.splitlines() if line.startswith("frequency_hz"))
    path.write_text(text.replace(frequency, "frequency_hz = 5.0"))
    assert (
        main(["check", str(path)]) == 0
        and "[excitation] frequency_hz = 5: the Host shakes at" in capsys.readouterr().out
    )


@pytest.mark.parametrize(
    "change", [("4096, 3072", "2048, 1536"), ("4096, 3072", "-4096, 3072"), ("4096, 3072", "1e300, 1e300")]
)
def test_a_calibration_of_another_sensor(change, tmp_path, ovines):
    folder = write_small_recording(tmp_path / "run", frames=20).folder
    path = tmp_path / "calibration.json"
    text = path.read_text().replace("4096,\n    3072", change[1].replace(", ", ",\n    "))
    assert change[1].split(",")[0] in text
    path.write_text(text)
    refused(ovines("triangulate", folder, "--out", tmp_path / "out"), "sensor")


@pytest.mark.parametrize("where", ["one place", "the origin"])
def test_two_cameras_at_one_place(where, tmp_path, capsys):
    import json

    folder = write_small_recording(tmp_path / "run", frames=20).folder
    content = json.loads((tmp_path / "calibration.json").read_text())
    for key in ("rotation", "translation_m"):
        content["cameras"][1][key] = content["cameras"][0][key]
    if where == "the origin":
        for camera in content["cameras"]:
            camera["translation_m"] = [0.0, 0.0, 0.0]
    (tmp_path / "calibration.json").write_text(json.dumps(content))
    for command in ("check", "run"):
        assert main([command, str(folder), "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr()
        assert "two places" in said.out + said.err


def test_a_camera_in_the_sliding_plane(tmp_path, capsys):
    """One at the world's origin: an index error before, from the lens that the run itself shows."""
    import json

    folder = write_small_recording(tmp_path / "run", frames=20).folder
    content = json.loads((tmp_path / "calibration.json").read_text())
    content["cameras"][0]["translation_m"] = [0.0, 0.0, 0.0]
    (tmp_path / "calibration.json").write_text(json.dumps(content))
    for command in ("check", "run"):
        assert main([command, str(folder), "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr()
        assert "camera VW1 stands at (" in said.out + said.err and "in the sliding plane z = 0" in said.out + said.err
