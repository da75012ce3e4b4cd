"""Names by clicking: suggested from geometry, driven by mouse and keys, taken by the tracker."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.backend_bases import KeyEvent, MouseEvent
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ovines.__main__ import main
from ovines.camera import read_calibration
from ovines.commands.recording.pick import wanted_markers
from ovines.errors import InputError
from ovines.recording import read_recording
from ovines.tables import read_table
from vision.identity.geometric_names import Pairs, as_rows, pair_discs, suggest_names
from vision.identity.naming_session import Naming
from vision.identity.picker import Frame, PickWindow, centres
from vision.markers.detect import marker_discs

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "rendered"
CAMERAS = ("VW1", "VW2")


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """The rendered sample's first 12 frames without any layout, with its true cameras."""
    folder = tmp_path_factory.mktemp("pick") / "bare"
    folder.mkdir()
    for camera in CAMERAS:
        (folder / camera).mkdir()
        for path in sorted((SAMPLE / camera).glob("*.png"))[:12]:
            shutil.copy(path, folder / camera)
    shutil.copy(SAMPLE / "true_calibration.json", folder / "calibration.json")
    lines = (SAMPLE / "recording.toml").read_text().splitlines()
    kept = [line for line in lines if not line.startswith(("layout_m", "board", "intrinsic", "extrinsic"))]
    text = "\n".join(kept).replace("[calibration]", '[calibration]\nfile = "calibration.json"')
    (folder / "recording.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def first(bare):
    """(recording, cameras, window offsets, discs) of the first frames; truth of them."""
    from vision.frames.sources import read_image
    from vision.markers.detect import find_discs

    recording = read_recording(bare)
    cameras = read_calibration(bare / "calibration.json")
    images = [read_image(recording.frame_files(name)[0], recording.camera(name).window_px) for name in CAMERAS]
    truth = read_table(SAMPLE / "truth.parquet", "truth")
    offsets = [recording.camera(name).window_offset_px for name in CAMERAS]
    return recording, cameras, offsets, images, [find_discs(image) for image in images], truth


def truly(truth: pd.DataFrame, camera: str, u: float, v: float) -> tuple[str, float]:
    """Marker truly nearest to a place in the first frame, and how far it is."""
    own = truth[(truth["camera"] == camera) & (truth["frame"] == 0)]
    away = np.hypot(own["u_px"] - u, own["v_px"] - v)
    return own["marker"].iloc[int(away.argmin())], float(away.min())


def test_the_suggestion_is_right_about_bodies_and_cameras(first):
    """Names within a body are free (no layout says which is which); body, pairing and the centre marker are not."""
    recording, cameras, offsets, _, discs, truth = first
    pairs = pair_discs(cameras, offsets, discs, 0.05)
    rows = as_rows(suggest_names(pairs, recording), pairs, CAMERAS, discs)
    assert len(rows) == 2 * len(recording.markers)
    found = {(camera, marker): truly(truth, camera, u, v) for camera, marker, u, v in rows}
    assert max(off for _, off in found.values()) < 0.3  # px; the ellipse's centre is not the circle's
    for marker in recording.markers:
        assert found["VW1", marker][0] == found["VW2", marker][0]
        assert found["VW1", marker][0][0] == marker[0]
    assert found["VW1", "N1"][0] == "N1"  # the centre marker


def test_the_suggestion_does_without_what_it_cannot_see(first):
    """A Host marker hidden: no Host names rather than wrong ones, the others stay."""
    recording, cameras, offsets, _, discs, truth = first
    pairs = pair_discs(cameras, offsets, discs, 0.05)
    names = [truly(truth, "VW1", *centres(discs[0])[row])[0] for row in pairs.disc[:, 0]]
    for hidden in (("H2",), ("H2", "G1", "G2", "G3")):
        keep = [i for i, name in enumerate(names) if name not in hidden]
        left = suggest_names(pairs[keep], recording)
        assert set(left) == {"N1", "N2", "N3", "N4", "N5"}
    assert suggest_names(pairs[[]], recording) == {}


def test_the_disk_itself_is_no_marker_of_its_own(first):
    """A light disk with dark markers is a disc too, with its middle where the centre marker is."""
    recording, cameras, offsets, _, discs, _ = first
    pairs = pair_discs(cameras, offsets, discs, 0.05)
    usual = suggest_names(pairs, recording)
    centre = usual["N1"]
    whole = Pairs(
        np.r_[pairs.disc, pairs.disc[[centre]]],
        np.r_[pairs.place_m, pairs.place_m[[centre]]],
        np.r_[pairs.radius_m, -0.01],
    )
    assert suggest_names(whole, recording) == usual
    disc = discs[0][pairs.disc[centre, 0]].copy()
    disc[2:5] /= 60.0  # inverse squares of its half axes
    assert len(marker_discs(np.vstack([discs[0], disc]))) == len(discs[0])
    assert pairs.radius_m[centre] == pytest.approx(0.0012, rel=0.5) and pairs.radius_m[usual["H1"]] > 0


def test_no_discs_give_no_pairs(first):
    _, cameras, offsets, _, discs, _ = first
    assert len(pair_discs(cameras, offsets, [discs[0][:0], discs[1]], 0.05).disc) == 0


class Hand:
    """Mouse and keyboard on a window that nobody sees."""

    def __init__(self, window: PickWindow) -> None:
        self.window, self.canvas = window, window.figure.canvas
        self.canvas.draw()

    def click(self, axes, u: float, v: float, button: int = 1) -> None:
        x, y = axes.transData.transform((u, v))
        self.canvas.callbacks.process("button_press_event", MouseEvent("button_press_event", self.canvas, x, y, button))

    def key(self, name: str) -> None:
        self.canvas.callbacks.process("key_press_event", KeyEvent("key_press_event", self.canvas, name))


def window_of(first, markers, suggested=()) -> PickWindow:
    recording, cameras, offsets, images, discs, _ = first
    figure = Figure(figsize=(13, 5.6))
    FigureCanvasAgg(figure)
    bodies = {marker: name for name, body in recording.bodies.items() for marker in body.markers}
    frames = [Frame(*one) for one in zip(cameras, offsets, images, map(centres, discs), strict=True)]
    return PickWindow(figure, frames, Naming(CAMERAS, markers, suggested), bodies)


def test_clicks_name_discs_and_the_tracker_follows_them(first, bare, tmp_path):
    """Every marker clicked some pixels beside its true place, the tracks held against the truth."""
    recording, _, _, _, _, truth = first
    markers = wanted_markers(recording, False)
    assert len(markers) == 12
    window, rng = window_of(first, markers), np.random.default_rng(3)
    hand = Hand(window)
    for marker in markers:
        assert window.naming.current == marker
        for axes, camera in zip(window.pictures, CAMERAS, strict=True):
            own = truth[(truth["camera"] == camera) & (truth["frame"] == 0) & (truth["marker"] == marker)].iloc[0]
            hand.click(axes, *(own[["u_px", "v_px"]].to_numpy(float) + rng.uniform(-3, 3, 2)))
    hand.key("enter")
    assert window.saved and window.done
    text = "camera,marker,u_px,v_px\n" + "".join(f"{c},{m},{u:.2f},{v:.2f}\n" for c, m, u, v in window.naming.rows())
    names = tmp_path / "by_hand.csv"
    names.write_text(text)
    assert main(["track", str(bare), "--names", str(names), "--out", str(tmp_path / "out")]) == 0
    tracks = read_table(tmp_path / "out" / "tracks.parquet", "tracks")
    both = tracks.merge(truth, on=["camera", "frame", "marker"], suffixes=("", "_true"))
    assert len(both) == len(tracks)
    counts = tracks.groupby(["camera", "marker"]).size()
    assert len(counts) == 24
    assert set(counts[counts < 12].index) <= {
        ("VW1", "G1")
    }  # the Host comes to cover it; with a layout it is lost there too
    off = np.hypot(both["u_px"] - both["u_px_true"], both["v_px"] - both["v_px_true"])
    assert off.max() < 0.3  # px: no name swapped (markers are 15 px apart), none lost


def test_keys_and_buttons(first):
    window = window_of(first, ["N1", "N2", "H1"])
    hand, naming = Hand(window), window.naming
    left, right = window.pictures
    places = window.frames[0].discs
    hand.click(left, *places[0])
    assert naming.rows() == [("VW1", "N1", *places[0])]
    line = [one for one in right.lines if len(one.get_xdata()) > 10 and one.get_linestyle() == "-"]
    assert len(line) == 1  # where N1 may be in the other camera ...
    met = np.hypot(*(np.column_stack(line[0].get_data())[:, None] - window.frames[1].discs).T)
    assert met.min() < 2.0  # ... passes through a disc there
    hand.click(left, *places[1])  # the same marker once more moves it
    assert naming.rows() == [("VW1", "N1", *places[1])]
    hand.key("u")
    assert naming.rows() == [("VW1", "N1", *places[0])]
    hand.click(right, *window.frames[1].discs[0])
    assert naming.current == "N2" and naming.is_named("N1")
    hand.click(left, *places[0])  # another name for a named disc takes the old one off
    assert ("VW1", "N1") in naming.missing and naming.places["VW1", "N2"] == tuple(places[0])
    hand.click(left, places[0][0] + 2, places[0][1], button=3)
    assert "N2" not in [row[1] for row in naming.rows()]
    hand.key("enter")
    assert not window.saved  # names are missing
    hand.key("down")
    assert naming.current == "H1"
    hand.click(window.list, 0.5, 0.2)
    assert naming.current == "N1"
    hand.key("c")
    assert naming.rows() == []
    hand.key("u")
    hand.key("escape")
    assert window.done and not window.saved and naming.rows()


def test_leaving_closes_the_window_for_pyplot_too(first):
    """Otherwise pyplot closes it once more at the end of the program, and Tk answers with a traceback."""
    import matplotlib.pyplot as plt

    recording, cameras, offsets, images, discs, _ = first
    figure = plt.figure("to be closed")
    frames = [Frame(*one) for one in zip(cameras, offsets, images, map(centres, discs), strict=True)]
    bodies = {marker: name for name, body in recording.bodies.items() for marker in body.markers}
    window = PickWindow(figure, frames, Naming(CAMERAS, ["N1"], ()), bodies)
    assert plt.fignum_exists("to be closed")
    figure.canvas.callbacks.process("key_press_event", KeyEvent("key_press_event", figure.canvas, "escape"))
    assert window.done and not window.saved and not plt.fignum_exists("to be closed")


def test_a_click_far_from_any_disc_means_the_place_itself(first):
    window = window_of(first, ["N1"])
    Hand(window).click(window.pictures[0], 230.0, 200.0)
    assert window.naming.rows() == [("VW1", "N1", pytest.approx(230, abs=0.5), pytest.approx(200, abs=0.5))]


def test_the_command_without_a_window(bare, tmp_path, monkeypatch, capsys):
    folder = shutil.copytree(bare, tmp_path / "rec")
    picture = tmp_path / "names.png"
    assert main(["pick", str(folder), "--accept", "--picture", str(picture)]) == 0
    rows = list(csv.reader((folder / "names.csv").open()))
    assert rows[0] == ["camera", "marker", "u_px", "v_px"] and len(rows) == 25
    assert picture.stat().st_size > 10_000
    monkeypatch.setenv("MPLBACKEND", "Agg")
    capsys.readouterr()
    assert main(["pick", str(folder)]) == 2
    assert "--accept" in capsys.readouterr().err


def test_nothing_to_name_is_said():
    with pytest.raises(InputError, match="every body has its layout_m"):
        wanted_markers(read_recording(SAMPLE), False)
    assert len(wanted_markers(read_recording(SAMPLE), True)) == 12
