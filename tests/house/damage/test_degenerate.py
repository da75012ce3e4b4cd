"""Poor data that a rig really gives: the run ends with a named gap or a refusal, never with a traceback."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from ovines.tables import read_table, write_table
from tests.conftest import bouncing_motion, tracks_of, two_cameras, write_small_recording

Spoil = Callable[[pd.DataFrame], pd.DataFrame]


def only(*markers: str) -> Spoil:
    return lambda t: t[t["marker"].isin(markers)]


def lost(first: int, last: int, marker: str = "") -> Spoil:
    return lambda t: t[~(t["frame"].between(first, last) & t["marker"].str.startswith(marker))]


# spoiled tracks, exit status of `ovines run`, and a word: of the refusal, or of the note that names the gap ("" for
# none)
TRACKS: dict[str, tuple[Spoil, int, str]] = {
    "two markers of the NES": (only("H1", "H2", "H3", "H4", "N2", "N3"), 0, "no rotation.parquet: no more than 2"),
    "one marker of the NES": (only("H1", "H2", "H3", "H4", "N1"), 2, "no frame shows two markers of the NES"),
    "two markers of the Host": (only("H1", "H2", "N1", "N2", "N3"), 0, ""),
    "two markers in all": (only("H1", "N1"), 2, "no frame shows two markers of the NES"),
    "no marker of the NES": (only("H1", "H2", "H3", "H4"), 2, "no frame shows two markers of the NES"),
    "no marker of the Host": (only("N1", "N2", "N3", "N4", "N5"), 2, "no frame shows two markers of the Host"),
    "one camera": (lambda t: t[t["camera"] == "VW1"], 2, "camera"),
    "one camera for half of the run": (
        lambda t: t[(t["camera"] == "VW1") | (t["frame"] < 100)],
        0,
        "no point in 100 of 200 tracked frames",
    ),
    "negative times, all lost for 100 ms": (
        lambda t: lost(60, 139)(t).assign(time_s=lambda kept: kept["time_s"] - 5.0),
        0,
        "NES not seen in 80 of 200 frames, longest from -4.925 s to -4.826 s",
    ),
    "NES lost for 100 ms": (lost(60, 139, "N"), 0, "NES not seen in 80 of 200 frames"),
    "Host lost for 100 ms": (lost(60, 139, "H"), 0, "Host not seen in 80 of 200 frames"),
    "every second frame lost": (
        lambda t: t[t["frame"] % 2 == 0],
        0,
        "NES not seen in 99 of 199 frames, never more than 1 in a row",
    ),
    "one frame": (lambda t: t[t["frame"] == 0], 0, "does not move"),
    "three frames": (lambda t: t[t["frame"] < 3], 0, ""),
    "unknown markers too": (
        lambda t: pd.concat([t, t[t["marker"] == "N1"].assign(marker="Q7")]),
        0,
        "tracks of Q7 are not used",
    ),
    "only unknown markers": (lambda t: t.assign(marker="Q" + t["marker"]), 2, "marker"),
    "nothing moves": (
        lambda t: t.assign(**{c: t.groupby(["camera", "marker"])[c].transform("first") for c in ("u_px", "v_px")}),
        0,
        "does not move",
    ),
    "duplicate frames": (lambda t: t.assign(frame=t["frame"] // 2), 2, "frame"),
    "repeated times": (lambda t: t.assign(time_s=np.floor(t["time_s"] * 400) / 400), 2, "time"),
    "times a million seconds late": (lambda t: t.assign(time_s=t["time_s"] + 1e6), 0, ""),
    "NaN": (lambda t: t.assign(u_px=t["u_px"].where(t["frame"] != 5)), 2, "u_px"),
    "infinite": (lambda t: t.assign(v_px=t["v_px"].where(t["frame"] != 5, np.inf)), 2, "v_px"),
    "markers far off": (lambda t: t.assign(u_px=t["u_px"] * 1e6), 2, "u_px is 2.3"),
    "markers on one spot": (lambda t: t.assign(u_px=500.0, v_px=300.0), 2, "no frame shows two markers"),
    "sd of zero": (lambda t: t.assign(sd_px=0.0), 2, "sd_px"),
    "sd unknown": (lambda t: t.assign(sd_px=np.nan), 0, ""),
}


PLAIN = {"two markers of the NES"}  # no gaps to paint, and no frames to count: less of both does


def write_tracks(path: Path, frame: pd.DataFrame) -> None:
    """As another program might write them: unchecked."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.Table.from_pandas(frame, preserve_index=False), path)


QUICK = {
    "no angle",
    "two markers of the NES",
    "one camera",
    "negative times, all lost for 100 ms",
    "one frame",
    "only unknown markers",
    "duplicate frames",
    "repeated times",
    "NaN",
    "infinite",
    "no impacts, at rest",
    "NES never seen",
    "times backwards",
    "black",
    "the same noise in every frame",
    "wrong size",
    "no marker of the Host",
    "markers far off",
    "markers on one spot",
    "sd of zero",
}
# what each command needs after `ovines run RECORDING --out OUT`, tried whether that came through or not
AFTER = {
    "check": lambda folder, out: [folder, "--out", out],
    "identify": lambda folder, out: [folder, "--out", out],
    "report": lambda folder, out: [out, "--force"],
    "compare": lambda folder, out: [folder, "--out", out, "--runs", "2"],
    "animate": lambda folder, out: [folder, "--results", out, "--slower", "3"],
    "diagnose": lambda folder, out: [folder, "--out", out / "gap"],
}
# these read what the run would have written, or the same input: a run that was refused leaves nothing for them
NEEDS_THE_RUN = ("identify", "report", "compare", "diagnose")


def cases(names: Iterable[str]) -> list:
    """The quick ones with the other tests, all of them with ``-m "long or not long"``."""
    return [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in names]


def ended_well(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """Run a command: status 0, or 2 with three lines; never an exception, a traceback or numpy's warnings on the
    terminal.
    """
    capsys.readouterr()
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        status = main([str(one) for one in arguments])
    output, error = capsys.readouterr()
    assert status in (0, 2), error
    assert "Traceback" not in error and "Warning" not in error, error
    if status == 2:
        said = error or output  # `ovines check` says it as its answer
        assert ("found:" in said or "wrong:" in said) and "expected:" in said and "do:" in said, said
    return status, output + error


def through_every_command(
    folder: Path, out: Path, expected: int, word: str, capsys: pytest.CaptureFixture[str]
) -> dict[str, int]:
    """`ovines run`, then every command that could follow it; the exit status of each."""
    status, said = ended_well(capsys, "run", folder, "--out", out)
    assert status == expected and word in said, said
    assert (status == 0) == (out / "report.html").exists()
    after = {name: arguments(folder, out) for name, arguments in AFTER.items()}
    if status == 0:  # the page that the run has just drawn is drawn no second time
        after["report"].remove("--force")
    ends = {name: ended_well(capsys, name, *arguments)[0] for name, arguments in after.items()}
    if expected == 2:
        assert all(ends[name] == 2 for name in NEEDS_THE_RUN), ends
        assert not list(out.glob("gap/diagnosis.json")), "a refusal leaves no answer"
    else:
        assert ends["check"] == ends["identify"] == ends["report"] == 0, ends
    return ends


@pytest.mark.usefixtures("without_next_test")
@pytest.mark.parametrize("case", cases(TRACKS))
def test_poor_tracks(case, tmp_path, capsys, monkeypatch):
    spoil, expected, word = TRACKS[case]
    folder, out = write_small_recording(tmp_path / "run", frames=100 if case in PLAIN else 200).folder, tmp_path / "out"
    if case in PLAIN:
        monkeypatch.setattr("analysis.report.page.data_uri", lambda figure, image: "")
    write_tracks(folder / "tracks.parquet", spoil(pd.DataFrame(read_table(folder / "tracks.parquet", "tracks"))))
    ends = through_every_command(folder, out, expected, word, capsys)
    if case == "negative times, all lost for 100 ms":
        motion = read_table(out / "motion.parquet", "motion")
        gap = motion[motion["frame"].between(60, 139)]
        assert gap["nes_x_m"].isna().all(), "nobody saw the disk: nothing may stand there"
        assert motion[~motion["frame"].between(60, 139)]["nes_x_m"].notna().all()
    if case in ("one frame", "three frames", "nothing moves"):
        assert ends["diagnose"] == 2, "data that say nothing are no evidence for the nominal model"


def still(motion: pd.DataFrame) -> pd.DataFrame:
    return motion.assign(nes_x_m=0.01, nes_y_m=0.0, nes_angle_rad=0.0)


MOTION: dict[str, tuple[Spoil, int, str]] = {
    "no impacts, at rest": (still, 0, "does not move"),
    "no impacts, one flight": (lambda m: m[m["frame"] < 12], 0, ""),
    "NES never seen": (
        lambda m: m.assign(nes_x_m=np.nan, nes_y_m=np.nan, nes_angle_rad=np.nan),
        2,
        "no place of the NES",
    ),
    "Host never seen": (
        lambda m: m.assign(host_x_m=np.nan, host_y_m=np.nan, host_angle_rad=np.nan),
        0,
        "no place of the Host",
    ),
    "no angle": (lambda m: m.assign(nes_angle_rad=np.nan), 0, ""),
    "NES outside the Host": (lambda m: m.assign(nes_x_m=m["nes_x_m"] + 1.0), 0, "outside the Host's wall in 100 %"),
    "frames 1000 apart": (lambda m: m.assign(frame=m["frame"] * 1000), 0, ""),
    "huge": (lambda m: m.assign(nes_x_m=m["nes_x_m"] * 1e150), 0, "outside the Host's wall"),
    "noise only": (lambda m: m.assign(nes_x_m=np.random.default_rng(1).normal(0, 0.01, len(m))), 0, ""),
    "repeated times": (lambda m: m.assign(time_s=0.0), 2, "time"),
    "times backwards": (lambda m: m.assign(time_s=-m["time_s"]), 2, "time"),
    "infinite": (lambda m: m.assign(nes_y_m=np.inf), 2, "nes_y_m is infinite"),
    "negative frames": (lambda m: m.assign(frame=m["frame"] - 5), 2, "frame is -5"),
    "duplicate frames": (lambda m: pd.concat([m, m]), 2, "stands more than once"),
}
BODIES = "[bodies.host]\ninner_radius_m = 0.05\n[bodies.nes]\nradius_m = 0.01\ninertia_factor = 0.5\nmass_kg = 0.02\n"


def write_motion(folder: Path, motion: pd.DataFrame) -> None:
    folder.mkdir(parents=True)
    write_tracks(folder / "motion.parquet", motion)
    (folder / "recording.toml").write_text(f"format = 1\n[time]\nframe_rate_hz = 800.0\n{BODIES}")


@pytest.mark.usefixtures("without_next_test")
@pytest.mark.parametrize("case", cases(MOTION))
def test_poor_motion(case, tmp_path, capsys):
    spoil, expected, word = MOTION[case]
    write_motion(tmp_path / "run", spoil(bouncing_motion(200, 800.0)))
    ends = through_every_command(tmp_path / "run", tmp_path / "out", expected, word, capsys)
    if case in ("NES outside the Host", "huge", "no impacts, at rest"):
        assert ends["diagnose"] == 2, "data that say nothing are no evidence for the nominal model"


def write_frames(folder: Path, images: list[np.ndarray]) -> None:
    """A recording that enters at frames: the small one, 400 x 300 windows, its images given."""
    cameras = two_cameras()
    write_small_recording(folder, frames=2)
    (folder / "tracks.parquet").unlink()
    text = (folder / "recording.toml").read_text()
    for camera in cameras:
        (folder / camera.name).mkdir()
        text = text.replace(f'name = "{camera.name}"\n', f'name = "{camera.name}"\nframes = "{camera.name}/*.png"\n')
        for i, image in enumerate(images):
            cv2.imwrite(str(folder / camera.name / f"{i:03d}.png"), image)
    text = text.replace("window_size_px = [4096, 688]", "window_size_px = [400, 300]")
    (folder / "recording.toml").write_text(text)


NOISE = np.random.default_rng(2).integers(0, 255, (300, 400)).astype(np.uint8)
IMAGES = {
    "black": [np.zeros((300, 400), np.uint8)] * 6,
    "white": [np.full((300, 400), 255, np.uint8)] * 6,
    "the same noise in every frame": [NOISE] * 3,
    "one frame": [np.zeros((300, 400), np.uint8)],
    "16 bit": [np.full((300, 400), 40000, np.uint16)] * 3,
    "colour": [np.full((300, 400, 3), (10, 200, 30), np.uint8)] * 3,
    "wrong size": [np.zeros((100, 100), np.uint8)] * 3,
}


@pytest.mark.parametrize("case", cases(IMAGES))
def test_images_that_show_nothing(case, tmp_path, capsys):
    write_frames(tmp_path / "run", IMAGES[case])
    word = "a picture of 100 x 100 px" if case == "wrong size" else "no marker was found"
    through_every_command(tmp_path / "run", tmp_path / "out", 2, word, capsys)
    status, said = ended_well(capsys, "track", tmp_path / "run", "--out", tmp_path / "other")
    assert status == 2 and word in said


@pytest.mark.parametrize("case", ["black", "noise"])
def test_calibration_images_without_a_board(case, tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run", frames=20).folder
    text = (folder / "recording.toml").read_text()
    images = 'board = "charuco_5x7_8mm"\nintrinsic = "{camera}_*.png"\nextrinsic = "x_{camera}.png"'
    (folder / "recording.toml").write_text(
        text.replace('file = "../calibration.json"', images)
        .replace("4096, 3072", "400, 300")
        .replace("4096, 688", "400, 300")
        .replace("0, 1192", "0, 0")
        .replace("0, 900", "0, 0")
    )
    for name in ("VW1_1", "VW1_2", "VW2_1", "VW2_2", "x_VW1", "x_VW2"):
        cv2.imwrite(str(folder / f"{name}.png"), IMAGES["black"][0] if case == "black" else NOISE)
    for command in ("calibrate", "run", "diagnose"):
        status, said = ended_well(capsys, command, folder, "--out", tmp_path / f"out-{command}")
        assert status == 2 and "board" in said, said
    assert not list(tmp_path.glob("*/calibration*"))


TRIGGERS = {
    "negative": ("frame,time_s\n" + "".join(f"{i},{i / 800 - 3}\n" for i in range(6)), ""),
    "repeated": ("frame,time_s\n0,0\n1,0.1\n2,0.1\n", "line 4"),
    "backwards": ("frame,time_s\n0,0\n1,0.1\n2,0.05\n", "line 4"),
    "too few": ("frame,time_s\n0,0\n1,0.1\n", ""),
    "NaN": ("frame,time_s\n0,0\n1,nan\n", "line 3"),
    "empty": ("", "header"),
}


@pytest.mark.parametrize("case", TRIGGERS)
def test_trigger_times(case, tmp_path, capsys):
    """Negative times are times (a trigger in mid-recording); what does not go forward is refused by its line, before
    any image is looked at.
    """
    text, word = TRIGGERS[case]
    write_frames(tmp_path / "run", IMAGES["black"])
    toml = (tmp_path / "run" / "recording.toml").read_text()
    (tmp_path / "run" / "recording.toml").write_text(toml.replace("[time]\n", '[time]\ntrigger = "trigger.csv"\n'))
    (tmp_path / "run" / "trigger.csv").write_text(text)
    status, said = ended_well(capsys, "run", tmp_path / "run", "--out", tmp_path / "out")
    assert status == 2 and (word or "no marker was found") in said, said


@pytest.mark.long
def test_tracks_of_half_a_series_do_not_cost_the_other_half(tmp_path, capsys):
    """One run of a series with nothing to see: the page over the series is written and names it."""
    for name in ("a", "b"):
        write_small_recording(tmp_path / "series" / name, frames=200)
    cameras = two_cameras()
    poor = tracks_of(bouncing_motion(3, 800.0), cameras, 0.02, np.random.default_rng(0))
    write_table(poor, "tracks", tmp_path / "series" / "b" / "tracks.parquet", {})
    status, _ = ended_well(capsys, "run", tmp_path / "series", "--out", tmp_path / "out")
    assert status == 0
    assert (tmp_path / "out" / "report.html").exists() and (tmp_path / "out" / "a" / "report.html").exists()


def test_results_that_another_program_spoiled(tmp_path, capsys):
    """Tables in the results folder are input again for `compare`, `report` and `animate`."""
    folder, out = write_small_recording(tmp_path / "run", frames=100).folder, tmp_path / "out"
    assert ended_well(capsys, "identify", folder, "--out", out)[0] == 0
    for name, table in (("impacts", "impacts"), ("motion", "motion"), ("identification", "identification")):
        path = out / f"{name}.parquet"
        good = path.read_bytes()
        frame = pd.DataFrame(read_table(path, table))
        for spoiled in (frame.iloc[:0], frame.iloc[:, 1:], None):
            path.write_bytes(b"PAR1") if spoiled is None else write_tracks(path, spoiled)
            for command in ("compare", "animate", "check"):
                ended_well(capsys, command, *AFTER[command](folder, out))
        path.write_bytes(good)
