"""`ovines new` writes a file that is valid; `ovines check` draws the chain and says which line to change."""

import json
import os
import pty
import re
import select
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ovines.__main__ import main
from ovines.commands.recording.check import drawing
from ovines.errors import InputError
from ovines.recording import read_recording
from tests.conftest import write_small_recording


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--name", 'x" <b> ä # [y]', "--images", "mp4", "--cameras", "left", "right", "top"),
        (
            "--calibration",
            "../calibration.json",
            "--frequency-hz",
            "11",
            "--acceleration-g",
            "8",
            "--host-radius-mm",
            "60",
        ),
    ],
)
def test_a_new_recording_is_valid(tmp_path, options):
    assert main(["new", str(tmp_path / "ä b"), *options]) == 0
    recording = read_recording(tmp_path / "ä b")
    assert recording.entry() == "frames"
    if "--name" in options:
        assert recording.name == 'x" <b> ä # [y]' and [one.name for one in recording.cameras] == [
            "left",
            "right",
            "top",
        ]
        assert recording.cameras[0].frames == "left.mp4"
    if "--calibration" in options:
        assert recording.excitation.frequency_hz == 11.0
        assert recording.bodies["host"].inner_radius_m == pytest.approx(0.06)
    else:
        assert recording.board == "charuco_5x7_8mm"


def test_every_commented_line_is_valid_too(tmp_path):
    """The lines to switch on by taking '# ' away (all that hold no '...' and no second choice)."""
    assert main(["new", str(tmp_path / "r")]) == 0
    path = tmp_path / "r" / "recording.toml"
    text = re.sub(
        r"^# (trigger|window_\w+|exposure_s|restitution|wall_friction|tangential_restitution|floor_friction) =",
        r"\1 =",
        path.read_text(),
        flags=re.MULTILINE,
    )
    assert text.count("\n# ") < path.read_text().count("\n# ") - 9
    path.write_text(text)
    assert read_recording(path).model.restitution == 0.72


@pytest.mark.parametrize(
    "options", [("--cameras", "a", "a"), ("--rate-hz", "nan"), ("--nes-radius-mm", "80"), ("--sensor", "0", "9")]
)
def test_options_that_no_recording_may_have_are_refused_and_leave_nothing(tmp_path, options, capsys):
    assert main(["new", str(tmp_path / "r"), *options]) == 2
    assert "correct the option" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def at_a_terminal(arguments: list[str], answers: list[str]) -> tuple[str, int]:
    """A real terminal (pty): each answer typed when a question waits for it, Ctrl-D after the last; what it showed,
    exit status.
    """
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "ovines", *arguments]
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs) as process:
        os.close(theirs)
        shown, left = b"", list(answers)
        while select.select([ours], [], [], 60)[0]:
            try:
                shown += os.read(ours, 4096)
            except OSError:  # how Linux says that the other end has gone
                break
            if shown.endswith(b"]: "):
                os.write(ours, left.pop(0).encode() + b"\n" if left else b"\x04")
        else:
            process.kill()
    os.close(ours)
    return shown.decode().replace("\r", ""), process.returncode


def test_new_asks_at_a_terminal(tmp_path):
    """What is left out is asked for; answers that cannot be are asked again with the reader's own reason."""
    folder = tmp_path / "r"
    answers = [
        "left, right",
        "4096x",
        "1280 x 1024",
        "-5",
        "quick",
        "1000",
        "tif",
        "",
        "",
        "6",
        "9",
        "1.5",
        "",
        "11",
        "8",
    ]
    shown, status = at_a_terminal(["new", str(folder)], answers)
    assert status == 0, shown
    assert "'4096x' cannot be read; an example: 4096 x 3072" in shown
    assert "'time.frame_rate_hz' is -5.0; expected greater than 0" in shown and "'quick' cannot be read" in shown
    assert "Radius of the NES in mm [1.2]" in shown and "expected an NES that fits inside the Host" in shown
    recording = read_recording(folder)
    assert [one.name for one in recording.cameras] == ["left", "right"] and recording.cameras[1].frames == "right/*.tif"
    assert recording.cameras[0].sensor_size_px == (1280, 1024) and recording.frame_rate_hz == 1000
    assert recording.bodies["host"].inner_radius_m == pytest.approx(0.006)
    assert recording.bodies["nes"].radius_m == pytest.approx(0.0015) and recording.bodies[
        "nes"
    ].mass_kg == pytest.approx(0.0246)
    assert (recording.excitation.frequency_hz, recording.excitation.acceleration_g) == (11, 8)
    assert recording.board == "charuco_5x7_8mm"


def test_new_asks_only_for_what_is_left_out(tmp_path):
    given = [
        "--cameras",
        "a",
        "b",
        "--sensor",
        "640",
        "480",
        "--rate-hz",
        "500",
        "--images",
        "avi",
        "--host-radius-mm",
        "40",
        "--nes-mass-g",
        "5",
    ]
    shown, status = at_a_terminal(["new", str(tmp_path / "r"), *given], ["../calibration.json", "", "none"])
    assert status == 0 and shown.count("]: ") == 3, shown  # the board is not asked for: the calibration is solved
    assert read_recording(tmp_path / "r").calibration_file == tmp_path / "r" / "../calibration.json"
    shown, status = at_a_terminal(["new", str(tmp_path / "usual"), "--usual"], [])
    assert status == 0 and "]: " not in shown and read_recording(tmp_path / "usual").frame_rate_hz == 800


def test_new_that_is_broken_off_leaves_nothing(tmp_path):
    shown, status = at_a_terminal(["new", str(tmp_path / "r")], ["", ""])
    assert status == 2 and "the input ended before the last question" in shown and "Traceback" not in shown
    assert list(tmp_path.iterdir()) == []


def test_an_existing_recording_is_kept(tmp_path):
    assert main(["new", str(tmp_path / "r")]) == 0
    before = (tmp_path / "r" / "recording.toml").read_text()
    assert main(["new", str(tmp_path / "r"), "--rate-hz", "500"]) == 2
    assert (tmp_path / "r" / "recording.toml").read_text() == before
    assert main(["new", str(tmp_path / "r"), "--rate-hz", "500", "--force"]) == 0
    assert read_recording(tmp_path / "r").frame_rate_hz == 500


def test_the_ending_of_the_images_is_that_of_the_calibration_too(tmp_path):
    for ending, intrinsic in (("jpg", "intrinsic/*.jpg"), ("mp4", "intrinsic.mp4")):
        assert main(["new", str(tmp_path / ending), "--images", ending, "--usual"]) == 0
        calibration = read_recording(tmp_path / ending).settings.calibration
        assert calibration.intrinsic == f"calibration/{{camera}}/{intrinsic}"
        assert calibration.extrinsic == f"calibration/{{camera}}/extrinsic.{ending}"


@pytest.mark.parametrize("cameras", [["a"]])
def test_check_and_run_say_alike_what_one_camera_lacks(tmp_path, cameras, capsys):
    """A new recording has no layout_m: one camera then knows no heights, and both say so before any picture is read."""
    assert main(["new", str(tmp_path), "--usual", "--cameras", *cameras, "--calibration", "calibration.json"]) == 0
    for name in cameras:
        (tmp_path / name).mkdir()
        (tmp_path / name / "1.png").touch()
    written = [{"name": name, "sensor_size_px": [4096, 3072], "matrix": [[9000, 0, 2047], [0, 9000, 1535], [0, 0, 1]],
                "distortion": [0] * 5, "rotation": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
                "translation_m": [0.1 * k, 0, 1], "rms_px": 0.1} for k, name in enumerate(cameras)]  # fmt: skip
    (tmp_path / "calibration.json").write_text(json.dumps({"format": 1, "world": "board", "cameras": written}))
    for command in ("check", "track"):
        assert main([command, str(tmp_path)]) == 2
        both = "".join(capsys.readouterr())
        assert "one camera in" in both and "add layout_m, or a second [[cameras]]" in both


def test_the_drawing():
    drawn = drawing(
        "tracks", {"triangulate": "up to date", "analyse": "would run", "report": "would run after analyse"}
    )
    assert drawn.splitlines()[0] == "  tracks -> [x] triangulate -> [ ] analyse -> [ ] report"


@pytest.mark.parametrize(
    ("spoil", "key"),
    [
        (lambda text: text.replace('"floor_friction"', '"flor_friction"'), "effects ="),
        (lambda text: text.replace("VW1/*", "nowhere/*"), 'frames = "nowhere'),
        (lambda text: text, "intrinsic ="),
    ],
)
def test_check_names_the_line_to_change(tmp_path, spoil, key, capsys):
    assert main(["new", str(tmp_path)]) == 0
    path = tmp_path / "recording.toml"
    path.write_text(spoil(path.read_text()))
    line = next(i for i, one in enumerate(path.read_text().splitlines(), 1) if one.startswith(key))
    assert main(["check", str(tmp_path)]) == 2
    assert f"recording.toml, line {line})" in capsys.readouterr().out


def test_a_missing_calibration_is_said_with_its_line(tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run-01", frames=20).folder
    (tmp_path / "calibration.json").unlink()
    assert main(["check", str(folder)]) == 2
    line = (folder / "recording.toml").read_text().splitlines().index('file = "../calibration.json"') + 1
    assert f"recording.toml, line {line})" in capsys.readouterr().out


def test_an_input_error_keeps_its_three_parts_in_a_pickle():
    import pickle

    error = pickle.loads(pickle.dumps(InputError("a", "b", "c")))
    assert (error.found, error.expected, error.do) == ("a", "b", "c")


@pytest.mark.parametrize(
    ("prototype", "level_g", "ground"), [("OVINES1", None, 0), ("OVINES2", 9.0, 0), ("OVINES3", 8.0, 3)]
)
def test_prototypes_of_the_thesis(prototype, level_g, ground, tmp_path):
    assert main(["new", str(tmp_path / "new"), "--prototype", prototype, "--usual"]) == 0
    recording = read_recording(tmp_path / "new")
    assert recording.settings.log is not None and recording.settings.log.pairs == [("Prototype", prototype)]
    assert (None if recording.excitation is None else recording.excitation.acceleration_g) == level_g
    markers = recording.bodies["ground"].markers if "ground" in recording.bodies else ()
    assert len(markers) == ground


@pytest.mark.further
def test_a_film_without_layouts_is_tracked_as_check_says(tmp_path, capsys):
    """Ten frames of the rendered sample: names come from the first frame's geometry, and nothing is held against a
    layout that nobody gave.
    """
    sample = Path(__file__).resolve().parents[3] / "sample_data" / "rendered"
    text = (sample / "recording.toml").read_text(encoding="utf-8")
    text = re.sub(r"(layout_m|layout_sd_m|board|intrinsic|extrinsic) = .*\n", "", text)
    text = text.replace("[calibration]\n", f'[calibration]\nfile = "{sample.as_posix()}/true_calibration.json"\n')
    (tmp_path / "recording.toml").write_text(text, encoding="utf-8")
    for camera in ("VW1", "VW2"):
        (tmp_path / camera).mkdir()
        for path in sorted((sample / camera).glob("*.png"))[:10]:
            shutil.copy(path, tmp_path / camera)
    assert main(["check", str(tmp_path)]) == 0
    assert re.search(r"track:\s+would run", capsys.readouterr().out)
    assert main(["track", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "named by the first frame's geometry" in said and "markers' layout" not in said
