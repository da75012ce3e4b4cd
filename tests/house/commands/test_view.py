"""`ovines view`: the file that it writes is read back and held against the tables; refusals without rerun."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.view.outlines import body_lines, placed, poses, seen_by, wall_gap_m
from analysis.view.simulated_motion import simulated_motion
from ovines.__main__ import main
from ovines.camera import read_calibration
from ovines.recording import read_recording
from ovines.tables import read_table, write_table
from tests.conftest import two_cameras, write_small_recording
from vision.frames.dropped import DroppedFrames
from vision.frames.previews import Selection, jpegs

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "rendered"
FRAMES = 90


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """Results of the rendered sample made from its truth: true motion and cameras, tracks as the truth sees them."""
    folder = tmp_path_factory.mktemp("view") / "results"
    folder.mkdir()
    truth = read_table(SAMPLE / "truth.parquet", "truth")
    shutil.copy(SAMPLE / "true_calibration.json", folder / "calibration.json")
    tracks = truth[truth["visible"]][["camera", "frame", "time_s", "marker", "u_px", "v_px"]].assign(sd_px=0.01)
    hidden = (tracks["marker"] == "N3") & tracks["frame"].between(40, 49) & (tracks["camera"] == "VW1")
    write_table(tracks[~hidden], "tracks", folder / "tracks.parquet", {"notes": ["a note of the tracking"]})
    once = truth[truth["camera"] == "VW1"].drop_duplicates("frame")
    names = ["frame", "time_s"] + [f"{body}_{name}" for body in ("nes", "host") for name in ("x_m", "y_m", "angle_rad")]
    motion = once[names].assign(nes_z_m=0.0, host_z_m=0.0).reset_index(drop=True)
    write_table(motion, "motion", folder / "motion.parquet", {})
    points = once_per_marker(truth)
    write_table(points, "points", folder / "points.parquet", {})
    return folder


def once_per_marker(truth: pd.DataFrame) -> pd.DataFrame:
    own = truth[truth["camera"] == "VW1"]
    columns = {f"{axis}_sd_m": 1e-5 for axis in "xyz"} | {"reprojection_px": 0.01}
    return own[["frame", "time_s", "marker", "x_m", "y_m", "z_m"]].assign(**columns).reset_index(drop=True)


def contents(path: Path) -> tuple[dict[str, int], dict[str, pd.DataFrame]]:
    """Rows in time per entity of an .rrd file, and per entity its columns by frame."""
    from rerun.chunk import RrdReader

    rows: Counter[str] = Counter()
    tables: dict[str, list[pd.DataFrame]] = {}
    reader = RrdReader(path)
    assert len(reader.recordings()) == 1 and len(reader.blueprints()) == 1
    for chunk in reader.stream():
        if not chunk.is_static:
            rows[chunk.entity_path.lstrip("/")] += chunk.num_rows
            tables.setdefault(chunk.entity_path.lstrip("/"), []).append(chunk.to_record_batch().to_pandas())
    return dict(rows), {
        name: pd.concat(parts).sort_values("frame").reset_index(drop=True) for name, parts in tables.items()
    }


def test_the_file_holds_every_frame_and_what_was_found(results, tmp_path, capsys):
    pytest.importorskip("rerun")
    out = tmp_path / "sample.rrd"
    assert main(["view", str(SAMPLE), "--results", str(results), "--save", str(out)]) == 0
    assert f"{FRAMES} frames with pictures" in capsys.readouterr().out
    rows, tables = contents(out)
    for camera in ("VW1", "VW2"):
        path = f"world/cameras/{camera}"
        assert rows[f"{path}/image"] == rows[f"{path}/bodies/nes"] == rows[f"{path}/bodies/host"] == FRAMES
        assert rows[f"{path}/tracks/ground"] == rows[f"{path}/tracks/host"] == rows[f"{path}/tracks/nes"] == FRAMES
    assert (
        rows["world/bodies/nes"]
        == rows["world/points/nes"]
        == rows["curves/x/nes"]
        == rows["curves/room_to_the_wall/nes"]
        == FRAMES
    )
    tracks = read_table(results / "tracks.parquet", "tracks")
    shown = tables["world/cameras/VW1/tracks/nes"]
    own = tracks[(tracks["camera"] == "VW1") & (tracks["frame"] == 45) & tracks["marker"].str.startswith("N")]
    row = shown[shown["frame"] == 45].iloc[0]
    assert list(row["Points2D:labels"]) == list(own["marker"]) == ["N1", "N2", "N4", "N5"]  # N3 is hidden there
    found = np.stack(row["Points2D:positions"])
    np.testing.assert_allclose(
        found, own[["u_px", "v_px"]].to_numpy() + 0.5, atol=1e-3
    )  # their pixels begin at the corner
    motion = read_table(results / "motion.parquet", "motion")
    np.testing.assert_allclose(
        np.stack(tables["curves/x/nes"]["Scalars:scalars"])[:, 0], 1e3 * motion["nes_x_m"], atol=1e-6
    )
    jpeg = bytes(tables["world/cameras/VW2/image"]["EncodedImage:blob"].iloc[3][0])
    assert jpeg[:2] == b"\xff\xd8"


def test_fewer_frames_on_request(results, tmp_path):
    pytest.importorskip("rerun")
    out = tmp_path / "few.rrd"
    assert (
        main(
            ["view", str(SAMPLE), "--results", str(results), "--save", str(out), "--frames", "10", "29", "--every", "5"]
        )
        == 0
    )
    rows, tables = contents(out)
    assert list(tables["world/cameras/VW1/image"]["frame"]) == [10, 15, 20, 25]
    assert rows["curves/y/nes"] == FRAMES  # curves are whole


def test_a_recording_without_frames_is_shown_too(tmp_path):
    """Entry at tracks, results incomplete: what there is."""
    pytest.importorskip("rerun")
    folder = write_small_recording(tmp_path / "run-01", frames=30).folder
    assert main(["view", str(folder), "--save", str(tmp_path / "x.rrd")]) == 0
    rows, _ = contents(tmp_path / "x.rrd")
    assert rows["world/cameras/VW1/tracks/host"] == 30 and not any("image" in name or "curves" in name for name in rows)


def test_a_name_with_signs_is_escaped():
    pytest.importorskip("rerun")
    from analysis.view.stream import camera_path

    assert camera_path("left eye/1") == r"world/cameras/left\ eye\/1"


@pytest.mark.parametrize(("arguments", "word"), [(["--save", "film.mp4"], ".rrd"), ([], "ovines run")])
def test_refusals(tmp_path, capsys, arguments, word):
    pytest.importorskip("rerun")
    folder = write_small_recording(tmp_path / "run-01", frames=5).folder
    (folder / "tracks.parquet").unlink()
    (folder / "recording.toml").write_text(
        (folder / "recording.toml").read_text().replace('name = "VW1"', 'name = "VW1"\nframes = "a/*"')
    )
    assert main(["view", str(folder), *arguments]) == 2
    assert word in capsys.readouterr().err


def test_without_the_extra_it_says_how_to_get_it(tmp_path):
    """In a Python in which rerun cannot be imported."""
    hide = "import sys; sys.modules['rerun'] = None; from ovines.__main__ import main; sys.exit(main(['view', '.']))"
    result = subprocess.run(
        [sys.executable, "-c", hide], capture_output=True, text=True, timeout=120, check=False, cwd=tmp_path
    )
    assert result.returncode == 2 and "pip install -e '.[view]'" in result.stderr and "Traceback" not in result.stderr


def test_outlines_meet_the_markers_and_the_walls_touch():
    """The disk's markers under a pose, projected, are where the cameras saw them; the room to the wall is what it
    is.
    """
    recording, truth = read_recording(SAMPLE), read_table(SAMPLE / "truth.parquet", "truth")
    own = truth[truth["camera"] == "VW2"]
    once = own.drop_duplicates("frame")
    camera = {one.name: one for one in read_calibration(SAMPLE / "true_calibration.json")}["VW2"]
    layout = np.array(recording.bodies["nes"].layout_m)
    seen = seen_by(camera, recording.camera("VW2").window_offset_px, placed(poses(once, "nes"), layout))
    marked = own[own["marker"] == "N4"][["u_px", "v_px"]].to_numpy()
    # layout_m is the design: markers are placed with 30 um (0.06 px here) and the truth is the mean over the exposure
    assert np.abs(seen[1:, 3] - marked[1:]).max() < 0.6
    radii = [np.hypot(*line[:, :2].T).max() for line in body_lines(recording)["nes"]]
    assert radii == pytest.approx([0.01] * 3)
    gap = wall_gap_m(once, recording)
    assert (
        -2e-4 < gap.min() < 2e-3 and gap.max() < 0.08
    )  # frames do not fall on the impacts: 2.5 mm in a frame at 2 m/s


def test_room_in_a_square(tmp_path):
    (tmp_path / "recording.toml").write_text(
        "format = 1\n[time]\nframe_rate_hz = 800.0\n[bodies.host]\npolygon_m = [[-0.05, -0.05], [0.05, -0.05], [0.05, "
        "0.05], [-0.05, 0.05]]\n"
        "[bodies.nes]\nradius_m = 0.01\n"
    )
    motion = pd.DataFrame(
        {"nes_x_m": [0.0, 0.03], "nes_y_m": 0.0, "host_x_m": 0.0, "host_y_m": 0.0, "host_angle_rad": [0.0, np.pi / 4]}
    )
    gap = wall_gap_m(motion, read_recording(tmp_path))
    assert gap == pytest.approx([0.04, 0.05 - 0.03 / np.sqrt(2) - 0.01])


def test_simulated_flights_lie_on_the_measured_ones():
    """Free flights without friction: each is foretold from its impact to numerical accuracy; before the first is
    nothing.
    """
    from tests.conftest import bouncing_motion

    motion = bouncing_motion(160, 800.0)
    recording = read_recording(SAMPLE)
    impacts, identification = (
        exact_impacts(),
        pd.DataFrame(
            [("restitution", 0.72), ("wall_friction", 0.0), ("tangential_restitution", -1.0), ("floor_friction", 0.0)],
            columns=["parameter", "value"],
        ).assign(sd=1e-3, low=np.nan, high=np.nan),
    )
    table = simulated_motion(motion, impacts, identification, recording)
    before = motion["time_s"] < impacts["time_s"][0]
    assert table["nes_x_m"][before].isna().all()
    off = np.hypot(table["nes_x_m"] - motion["nes_x_m"], table["nes_y_m"] - motion["nes_y_m"])[~before]
    assert off.notna().mean() > 0.9 and off.max() < 2e-6
    np.testing.assert_allclose(table["nes_angle_rad"][~before], motion["nes_angle_rad"][~before], atol=1e-6)


def exact_impacts() -> pd.DataFrame:
    """The bounces of `bouncing_motion`, from its own straight flights."""
    from tests.conftest import bouncing_motion

    fine = bouncing_motion(160 * 50, 800.0 * 50)
    place, dt = fine[["nes_x_m", "nes_y_m"]].to_numpy(), 1 / 40000
    velocity = np.diff(place, axis=0) / dt
    jumps = np.flatnonzero(np.hypot(*np.diff(velocity, axis=0).T) > 0.1)
    firsts = [k for k in jumps if k - 1 not in jumps]
    rows = []
    for number, k in enumerate(firsts):
        reached = place[k + 1] + velocity[k - 1] * 0.0
        normal = reached / np.hypot(*reached)
        before, after = velocity[k - 2], velocity[k + 3]
        tangent = np.array([-normal[1], normal[0]])
        spin = 3.0
        rows.append(
            {
                "impact": number,
                "time_s": fine["time_s"][k + 1],
                "azimuth_rad": np.arctan2(normal[1], normal[0]),
                "normal_speed_before_m_per_s": before @ normal,
                "normal_speed_after_m_per_s": -after @ normal,
                "tangential_speed_before_m_per_s": before @ tangent + 0.01 * spin,
                "tangential_speed_after_m_per_s": after @ tangent + 0.01 * spin,
                "spin_before_rad_per_s": spin,
                "spin_after_rad_per_s": spin,
            }
        )
    return pd.DataFrame(rows)


def test_pictures_after_a_dropped_frame_get_the_numbers_of_the_tables():
    """The tracking's own words, so that the two cannot drift apart."""
    note = f"{DroppedFrames('VW2', 20, 1, 40.0)}; its later frames are renumbered"
    frames = dict(jpegs(read_recording(SAMPLE), Selection(first=18, last=22), [note]))
    assert {number: set(pictures) for number, pictures in frames.items()} == {
        18: {"VW1", "VW2"}, 19: {"VW1", "VW2"}, 20: {"VW1"}, 21: {"VW1", "VW2"}, 22: {"VW1", "VW2"},
    }  # fmt: skip
    plain = dict(jpegs(read_recording(SAMPLE), Selection(first=18, last=22)))
    assert frames[21]["VW2"] == plain[20]["VW2"] != plain[21]["VW2"]


def test_sixteen_bits_are_stretched(tmp_path):
    import cv2

    for camera in two_cameras():
        ramp = np.tile(np.linspace(200, 4000, 64).astype(np.uint16), (48, 1))
        (tmp_path / camera.name).mkdir()
        cv2.imwrite(str(tmp_path / camera.name / "0.png"), ramp)
    text = "format = 1\n[time]\nframe_rate_hz = 1.0\n" + "".join(
        f'[[cameras]]\nname = "{name}"\nframes = "{name}/*.png"\nsensor_size_px = [64, 48]\n' for name in ("VW1", "VW2")
    )
    (tmp_path / "recording.toml").write_text(text)
    ((number, pictures),) = jpegs(read_recording(tmp_path), Selection(quality=95))
    seen = cv2.imdecode(np.frombuffer(pictures["VW1"], np.uint8), cv2.IMREAD_GRAYSCALE)
    assert number == 0 and seen[:, 0].max() < 12 and seen[:, -1].min() > 243


FAKE = """#!{python}
import socket, sys, time
port, bound = int(sys.argv[sys.argv.index("--port") + 1]), sys.argv[sys.argv.index("--bind") + 1]
if {fails}:
    sys.exit("winit: no display")
server = socket.create_server((bound, port))
open({address!r}, "w").write(bound)
server.accept()
"""


@pytest.mark.parametrize("fails", [False, True])
def test_the_viewer_listens_to_this_machine_alone(fails, tmp_path, monkeypatch):
    from analysis.view.viewer import start_viewer

    program, address = tmp_path / "rerun", tmp_path / "address"
    program.write_text(FAKE.format(python=sys.executable, fails=fails, address=str(address)))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    if fails:
        with pytest.raises(RuntimeError, match="winit: no display"):
            start_viewer()
    else:
        assert start_viewer().startswith("rerun+http://127.0.0.1:") and address.read_text() == "127.0.0.1"
    program.unlink()
    with pytest.raises(RuntimeError, match="no program rerun"):
        start_viewer()


def test_what_deserves_a_look_is_listed(tmp_path, capsys, monkeypatch):
    """Two markers exchanged for three frames: said on the terminal, and on a timeline of its own in the file."""
    pytest.importorskip("rerun")
    folder = write_small_recording(tmp_path / "run", frames=60).folder
    tracks = read_table(folder / "tracks.parquet", "tracks")
    at = tracks["frame"].between(30, 32)
    tracks.loc[at, "marker"] = tracks.loc[at, "marker"].replace({"N2": "N4", "N4": "N2"})
    write_table(tracks, "tracks", folder / "tracks.parquet", {})
    assert main(["analyse", str(folder), "--out", str(tmp_path / "out")]) == 0
    command = ["view", str(folder), "--results", str(tmp_path / "out"), "--save", str(tmp_path / "a.rrd")]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "N2 and N4 may be exchanged (swap)" in said and "look at frame 3" in said
    content = (tmp_path / "a.rrd").read_bytes()
    assert b"doubt" in content and content.count(b"to look at")
