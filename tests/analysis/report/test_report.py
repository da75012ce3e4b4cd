"""The report of a recording and of a series, from tables on disk to a page in a browser."""

from __future__ import annotations

import json
import time
import warnings

import numpy as np
import pandas as pd
import pytest

from analysis.report.differences import compare_methods, host_acceleration, in_words
from analysis.report.pages.calibration_report import write_calibration_report
from analysis.report.pages.recording_report import recording_page
from analysis.report.pages.series_report import write_series_report
from analysis.report.results import read_results
from analysis.statistics.trend import weighted_trend
from analysis.thesis.impacts import thesis_impacts
from ovines.io.provenance import provenance
from ovines.recording import read_recording
from ovines.recording_schema import ThesisMethod
from ovines.tables import write_table

NAME = "test <b>5<b> & co"
TOML = f"""format = 1
name = "{NAME}"
[time]
frame_rate_hz = 800.0
[[cameras]]
name = "VW1"
sensor_size_px = [4096, 3072]
window_size_px = [4096, 688]
[bodies.host]
markers = ["H1", "H2", "H3", "H<4>"]
inner_radius_m = 0.05
[bodies.nes]
markers = ["N1", "N2", "N3"]
radius_m = 0.01
inertia_factor = 0.5
[excitation]
frequency_hz = 11.0
acceleration_g = 8.0
axis = "x"
"""
RESTITUTION = 0.75


def recording(folder, text=TOML):
    folder.mkdir(exist_ok=True)
    (folder / "recording.toml").write_text(text, encoding="utf-8")
    return read_recording(folder)


def tables(seed=0, n=600):
    """A small made-up run: a Host shaken along x, an NES that bounces in its frame, every fourth flight
    reversed.
    """
    rng, t = np.random.default_rng(seed), np.arange(n) / 800
    host_x = 0.0164 * np.sin(2 * np.pi * 11 * t)
    times = np.arange(0.05, t[-1] - 0.04, 0.06) + rng.uniform(0, 0.01)
    x = np.interp(t, np.concatenate([[0], times, [t[-1]]]), 0.03 * (-1.0) ** np.arange(len(times) + 2))
    y = 0.02 * np.sin(2 * t)
    angle = 0.3 + 5 * t
    motion = pd.DataFrame(
        {
            "frame": np.arange(n),
            "time_s": t,
            "nes_x_m": x,
            "nes_y_m": y,
            "nes_z_m": 0.0,
            "nes_angle_rad": angle,
            "host_x_m": host_x,
            "host_y_m": 0.0,
            "host_z_m": 0.0,
            "host_angle_rad": 0.0,
            "nes_x_sd_m": 2e-5,
        }
    )
    layout = {
        "H1": (0.05, 0),
        "H2": (0, 0.05),
        "H3": (-0.05, 0),
        "H<4>": (0.03, -0.04),
        "N1": (0, 0),
        "N2": (0.006, 0),
        "N3": (0, 0.006),
    }
    points = []
    for marker, (a, b) in layout.items():
        host = marker.startswith("H")
        turn = np.zeros(n) if host else angle
        points.append(
            pd.DataFrame(
                {
                    "frame": np.arange(n),
                    "time_s": t,
                    "marker": marker,
                    "x_m": (host_x if host else x) + np.cos(turn) * a - np.sin(turn) * b,
                    "y_m": (0 if host else y) + np.sin(turn) * a + np.cos(turn) * b,
                    "z_m": 0.01,
                    "x_sd_m": 2e-5,
                    "y_sd_m": 2e-5,
                    "z_sd_m": 4e-5,
                    "reprojection_px": np.abs(rng.normal(0, 0.1, n)),
                }
            )
        )
    points = pd.concat(points)
    points[["x_m", "y_m", "z_m"]] += rng.normal(0, 2e-5, (len(points), 3))
    k = len(times)
    v_n, v_t = rng.uniform(0.5, 2, k), rng.uniform(-1.5, 1.5, k)
    beta = np.minimum(0.5, -1 + 0.15 * 1.75 * 3 * v_n / np.abs(v_t))
    slide = beta < 0.5
    impacts = pd.DataFrame(
        {
            "impact": np.arange(k),
            "time_s": times,
            "time_sd_s": 1e-5,
            "azimuth_rad": 0.0,
            "normal_speed_before_m_per_s": v_n,
            "normal_speed_after_m_per_s": RESTITUTION * v_n,
            "tangential_speed_before_m_per_s": v_t,
            "tangential_speed_after_m_per_s": -beta * v_t + rng.normal(0, 0.01, k),
            "tangential_speed_after_sd_m_per_s": 0.01,
            "tangential_speed_before_sd_m_per_s": 0.01,
            "spin_before_rad_per_s": 5.0,
            "spin_after_rad_per_s": 5.0,
            "restitution": RESTITUTION,
            "restitution_sd": 0.01,
            "tangential_restitution": np.where(slide, np.nan, beta),
            "wall_friction": np.where(slide, 0.15, np.nan),
            "regime": np.where(slide, "slide", "stick"),
        }
    )
    identification = pd.DataFrame(
        [
            ("restitution", RESTITUTION, 0.004, 0.743, 0.757, k),
            ("wall_friction", 0.15, 0.003, 0.145, 0.155, k),
            ("tangential_restitution", np.nan, np.nan, 0.41, np.nan, k),
            ("floor_friction", 0.22, 0.004, 0.213, 0.227, k),
        ],
        columns=["parameter", "value", "sd", "low", "high", "n_impacts"],
    )
    flights = pd.DataFrame({"flight": [0], "start_s": [0.6], "end_s": [0.65], "kind": ["contact"]})
    tracks = points[points["marker"] != "N3"].assign(
        camera="VW1", u_px=lambda p: 2000 + 6000 * p["x_m"], v_px=lambda p: 340 - 6000 * p["y_m"], sd_px=0.1
    )
    return {
        "motion": motion,
        "points": points,
        "impacts": impacts,
        "identification": identification,
        "flights": flights,
        "tracks": tracks[["camera", "frame", "time_s", "marker", "u_px", "v_px", "sd_px"]],
    }


def write(folder, chosen, seed=0):
    folder.mkdir(parents=True, exist_ok=True)
    made = tables(seed)
    if "thesis_impacts" in chosen:
        made["thesis_impacts"] = thesis_impacts(made["motion"], recording(folder.parent / "rec"))
    for name, table in made.items():
        if name in chosen:
            write_table(table, name, folder / f"{name}.parquet", provenance("test", {}, {}))
    return folder


ALL = ("motion", "thesis_impacts", "points", "impacts", "identification", "flights", "tracks")


def write_report(folder, rig, frames=None):
    """``report.html`` of the tables in ``folder``; its path."""
    return recording_page(read_results(folder, rig, frames)).write(folder / "report.html")


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    """The results folder of one full report, and the seconds of processor time it took."""
    base = tmp_path_factory.mktemp("full")
    folder, rig = write(base / "results", ALL), recording(base / "rec")
    frames = {"VW1": np.random.default_rng(1).integers(0, 255, (688, 4096), np.uint8)}
    recording_page(
        read_results(write(base / "warm", ("motion",)), rig)
    )  # imports and fonts are loaded once per process
    start = time.process_time()
    write_report(folder, rig, frames)
    return folder, time.process_time() - start


def test_figures_are_saved_too(tmp_path, unpainted):
    folder = write(tmp_path / "results", ("motion", "thesis_impacts", "impacts", "identification"))
    recording_page(read_results(folder, recording(tmp_path / "rec"))).save_figures(folder / "figures")
    saved = {p.name for p in (folder / "figures").iterdir()}
    assert {"error_map.pdf", "error_map.svg", "relative_trajectory.svg", "wall_sources.svg"} <= saved
    assert len(saved) == 2 * 8


def test_full_report_in_a_browser(full, browse):
    page = (full[0] / "report.html").read_text(encoding="utf-8")
    for width_px in (1200, 400):
        seen = browse(page, width_px)
        assert seen.console == []
        assert seen.fetched == []
        assert seen.too_wide == 0
        assert len(seen.pictures) == 13
        assert all(alt and width > 100 for alt, width, _ in seen.pictures)
    assert "<b>5<b>" not in page
    assert "H<4>" not in page
    assert len(page) < 6e6


def test_the_page_says_what_was_found(full):
    page = (full[0] / "report.html").read_text(encoding="utf-8")
    assert "Restitution ε = 0.750 ± 0.004 is determined to better than 1 %" in page
    assert "Tangential restitution β₀ is only bounded, ≥ 0.410" in page
    assert "Yes, with gaps" in page  # one parameter is only a bound
    assert "both sides of the critical angle" in page
    assert "The Host accelerates" in page.replace("the Host accelerates", "The Host accelerates")


@pytest.mark.parametrize(
    ("chosen", "answer"),
    [
        (("motion", "points", "impacts", "tracks"), "Motion and impacts, no parameters"),
        (("motion", "points"), "Motion only"),
        (("motion",), "Motion only"),
        (("points", "tracks"), "No motion"),
        ((), "No motion"),
    ],
)
def test_missing_tables_are_named_gaps(tmp_path, chosen, answer, unpainted):
    page = write_report(write(tmp_path / "results", chosen), recording(tmp_path / "rec")).read_text(encoding="utf-8")
    assert answer in page
    assert "Not here:" in page


def test_what_the_identification_noted_is_something_to_do(tmp_path, unpainted):
    """A tilt that had to be fitted along is no reason to say that nothing has to be done."""
    folder = write(tmp_path / "results", ALL)
    notes = [
        "The flights need table_tilt, which [model] effects does not name; it was fitted along.",
        "The flights miss their frames by 2.2.",
    ]
    write_table(tables()["identification"], "identification", folder / "identification.parquet", {"notes": notes})
    page = write_report(folder, recording(tmp_path / "rec")).read_text(encoding="utf-8")
    actions = page.split("What should I do?")[1].split("</ol>")[0]
    assert "it was fitted along. Run <code>ovines diagnose</code> on the series" in actions
    assert "Before the parameters are used: The flights miss their frames" in actions
    assert "Nothing has to be done" not in page


def test_no_impact_is_a_value(tmp_path, unpainted):
    folder = write(tmp_path / "results", ALL)
    empty = tables()["impacts"].iloc[:0]
    write_table(empty, "impacts", folder / "impacts.parquet", provenance("test", {}, {}))
    page = write_report(folder, recording(tmp_path / "rec")).read_text(encoding="utf-8")
    assert "Motion, no impacts" in page
    assert "record longer or drive harder" in page


def test_impacts_whose_speeds_nobody_knows(tmp_path):
    folder = write(tmp_path / "results", ALL)
    nameless = tables()["impacts"]
    speeds = [c for c in nameless.columns if "speed" in c and nameless[c].dtype.kind == "f"]
    nameless[speeds] = np.nan
    write_table(nameless, "impacts", folder / "impacts.parquet", provenance("test", {}, {}))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        page = write_report(folder, recording(tmp_path / "rec")).read_text(encoding="utf-8")
    assert "median normal speed –" in page


def test_a_bare_motion_is_a_recording_too(tmp_path):
    """An air-hockey puck: no cameras, no markers, no angle, no sd; and all of it null."""
    plain = recording(
        tmp_path / "rec",
        "format = 1\n[time]\nframe_rate_hz = 120.0\n[bodies.host]\ninner_radius_m = "
        "0.05\n[bodies.nes]\nradius_m = 0.01\n",
    )
    folder = tmp_path / "results"
    folder.mkdir()
    for blank in (False, True):
        motion = tables()["motion"][
            ["frame", "time_s", "nes_x_m", "nes_y_m", "nes_z_m", "host_x_m", "host_y_m", "host_z_m"]
        ].copy()
        if blank:
            motion.loc[:, "nes_x_m":] = np.nan
        write_table(motion, "motion", folder / "motion.parquet", provenance("test", {}, {}))
        assert "angle was not measured" in write_report(folder, plain).read_text(encoding="utf-8")


def test_a_spoilt_table_is_named(tmp_path, unpainted):
    folder = write(tmp_path / "results", ("motion",))
    (folder / "impacts.parquet").write_bytes(b"PAR1 not really")
    assert "Write impacts.parquet again" in write_report(folder, recording(tmp_path / "rec")).read_text(
        encoding="utf-8"
    )


def test_series_report(tmp_path, browse):
    recordings = []
    for run in range(3):
        recordings.append(recording(tmp_path / f"run-{run}", TOML.replace("test ", f"test {run} ")))
        if run < 2:
            write(tmp_path / "results" / f"run-{run}", ("motion", "impacts", "identification"), run)
    path = write_series_report(tmp_path / "results", recordings, "series <1>")
    page = path.read_text(encoding="utf-8")
    seen = browse(page)
    assert (seen.console, seen.fetched, seen.too_wide) == ([], [], 0)
    assert len(seen.pictures) == 1
    assert "2 of 3 recordings" in page
    assert "Without motion: test 2 &lt;b&gt;5&lt;b&gt; &amp; co" in page
    assert "≥ 0.410" in page


def test_what_the_identification_said_stands_in_the_reports(tmp_path, unpainted):
    said = "The flights need table_tilt, which [model] effects does not name; it was fitted along."
    one = recording(tmp_path / "run")
    folder = write(tmp_path / "results" / "run", ("motion", "impacts", "identification"))
    noted = {**provenance("identify", {}, {}), "notes": [said]}
    for place in (folder, tmp_path / "results"):
        write_table(tables()["identification"], "identification", place / "identification.parquet", noted)
    assert said in write_report(folder, one).read_text(encoding="utf-8")
    assert said in write_series_report(tmp_path / "results", [one], "series").read_text(encoding="utf-8")


def test_a_drift_is_named(tmp_path, unpainted):
    recordings = []
    for run in range(6):
        recordings.append(recording(tmp_path / f"run-{run}"))
        content = tables(run)
        content["identification"].loc[0, "value"] = 0.75 - 0.02 * run
        for name in ("motion", "impacts", "identification"):
            write_table(
                content[name],
                name,
                tmp_path / "results" / f"run-{run}" / f"{name}.parquet",
                provenance("test", {}, {}),
            )
    page = write_series_report(tmp_path / "results", recordings, "s").read_text(encoding="utf-8")
    assert "Restitution changes by −0.0200" in page
    assert "6 of 6 tests determine it and scatter more than their sd explain; it changes by" in page
    assert "6 of 6 tests determine it and agree within their sd; no trend is seen." in page
    assert "Floor friction changes" not in page


def test_trend_is_calibrated():
    """Without a trend p is uniform: 5 % below 0.05 in 2,000 series of eight tests, within four binomial sd;
    also with unknown extra scatter.
    """
    rng = np.random.default_rng(0)
    for scatter in (1.0, 3.0):
        p = [
            weighted_trend(np.arange(8), rng.normal(1, 0.01 * scatter, 8), np.full(8, 0.01)).p_slope
            for _ in range(2000)
        ]
        assert np.mean(np.array(p) < 0.05) < 0.05 + 4 * np.sqrt(0.05 * 0.95 / 2000)
    sloped = weighted_trend(np.arange(8), 1 + 0.01 * np.arange(8) + rng.normal(0, 0.005, 8), np.full(8, 0.005))
    assert abs(sloped.slope - 0.01) < 4 * sloped.slope_sd
    assert sloped.p_slope < 0.01
    assert weighted_trend([1, 2], [1, np.nan], [0.1, 0.1]) is None


def test_methods_are_matched_once_each():
    motion = tables()["motion"]
    impacts = pd.DataFrame(
        {
            "time_s": [0.1, 0.102, 0.3, 0.5],
            "normal_speed_before_m_per_s": [1.0, 0.1, 1.0, 0.2],
            "restitution": [0.7, 0.7, 0.7, 0.7],
        }
    )
    thesis = pd.DataFrame({"time_s": [0.1005, 0.301, 0.7], "restitution": [0.8, 0.6, 0.5]})
    difference = compare_methods(motion, impacts, thesis, ThesisMethod())
    assert difference.pairs.to_numpy().tolist() == [[0, 0], [2, 1]]
    assert difference.missed_median_speed_m_per_s == pytest.approx(0.15, rel=1e-12)
    text = " ".join(in_words(difference, impacts, thesis))
    assert "4 impacts, the acceleration peaks 3; 2 agree" in text
    assert "1 peak of the acceleration norm no two flights support" in text


def test_host_acceleration_of_a_known_drive():
    motion = tables()["motion"]
    assert host_acceleration(motion) == pytest.approx(0.0164 * (2 * np.pi * 11) ** 2, rel=0.01)
    assert host_acceleration(motion.assign(host_x_m=0.0)) == 0.0
    assert np.isnan(host_acceleration(motion.assign(host_x_m=np.nan)))


def test_a_report_takes_seconds(full):
    """Below 4 s on an idle core; 2.5 to 3.4 s seen with other work on the machine, which stretches processor
    time too: twice the goal fails.
    """
    assert full[1] < 8


CALIBRATION = {
    "format": 1,
    "world": "board",
    "cameras": [
        {
            "name": "VW<1>",
            "sensor_size_px": [4096, 3072],
            "matrix": [[6300, 0, 2000], [0, 6300, 1500], [0, 0, 1]],
            "distortion": [0] * 5,
            "rotation": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
            "translation_m": [0, 0, 1.2],
            "rms_px": 0.2,
        }
    ],
}


def test_calibration_report(tmp_path, browse):
    """An RMS of 0.2 px with fx known to 3 % is weak, and the page says so."""
    folder = tmp_path / "results"
    folder.mkdir()
    (folder / "calibration.json").write_text(json.dumps(CALIBRATION), encoding="utf-8")
    views = pd.DataFrame(
        {
            "camera": "VW<1>",
            "view": [f"v{n}.png" for n in range(12)],
            "points": 20,
            "used": [True] * 11 + [False],
            "rms_px": 0.2,
            "reason": [None] * 11 + ["board <blurred>"],
        }
    )
    for sd, answer in ((2.0, "Good"), (189.0, "Fair")):
        parameters = pd.DataFrame({"camera": "VW<1>", "parameter": ["fx", "fy"], "value": 6300.0, "sd": sd})
        write_table(views, "calibration_views", folder / "calibration_views.parquet", provenance("test", {}, {}))
        write_table(
            parameters,
            "calibration_parameters",
            folder / "calibration_parameters.parquet",
            provenance("test", {}, {}),
        )
        page = write_calibration_report(folder, recording(tmp_path / "rec")).read_text(encoding="utf-8")
        assert f"</span>{answer}" in page
        assert "(6300.0 ± 2.0) px" in page if sd == 2.0 else "known to 3.0 % only" in page
    seen = browse(page)
    assert (seen.console, seen.fetched, seen.too_wide, len(seen.pictures)) == ([], [], 0, 1)
    assert "VW<1>" not in page
    assert "board &lt;blurred&gt;" in page
    (folder / "calibration.json").unlink()
    for table in folder.glob("*.parquet"):
        table.unlink()
    assert "No calibration" in write_calibration_report(folder, recording(tmp_path / "rec")).read_text(encoding="utf-8")
