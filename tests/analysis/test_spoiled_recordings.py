"""Recordings spoiled as an experimenter may spoil them, and the verdict each must get; no confidently wrong number
among them.

One plant (a simulator apart from ours) and one run of the sample series, each spoiled in one way, through ``ovines
identify``.  Of every principal parameter that is given and not named as not to be used, the truth lies within three of
its sds.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis.checks.impacts import COUNT
from analysis.checks.recording import summed, verdict
from analysis.checks.row import COLUMNS, PRINCIPAL
from analysis.checks.series import series_checks
from ovines.__main__ import main
from ovines.commands.chain.stage_command import tell
from ovines.pipeline.one_recording import Outcome
from ovines.tables import read_table
from tests.plants import Run, Spec, draw_rig, make_run, make_series, write_series

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "series_tilted"
GOOD, DOUBTFUL, NO, REFUSED = "Good", "Doubtful", "Do not use", "refused"
LAW = ("restitution", "wall_friction", "tangential_restitution")
FARTHEST_SD = 3.0
SHORT = Spec(noise="white", reach_m=0.04, frames_per_flight=25, noise_share=1.5e-4, periods=3.0, most_frames=500)
LONGER: dict[str, Any] = {"periods": 4.0, "most_frames": 800}  # where the shorter run has too few impacts to tell
Spoil = Callable[[Run], Run]
Text = Callable[[str], str]
Table = Callable[[pd.DataFrame], pd.DataFrame]


@cache
def plant(law: str = "ours", seed: int = 1, **chosen: Any) -> Run:
    rng = np.random.default_rng(seed)
    return make_run(draw_rig(replace(SHORT, law=law, **chosen), rng), rng)


def setting(key: str, factor: float) -> Spoil:
    """recording.toml with the number of ``key`` times ``factor``."""

    def spoil(run: Run) -> Run:
        text, count = re.subn(
            rf"^{key} = (.+)$", lambda found: f"{key} = {float(found[1]) * factor!r}", run.toml, flags=re.MULTILINE
        )
        assert count == 1
        return replace(run, toml=text)

    return spoil


def columns(pattern: str, change: Callable[[pd.Series], pd.Series]) -> Spoil:
    def spoil(run: Run) -> Run:
        hit = [name for name in run.motion if re.fullmatch(pattern, name)]
        assert hit
        return replace(run, motion=run.motion.assign(**{name: change(run.motion[name]) for name in hit}))

    return spoil


def both(*spoils: Spoil) -> Spoil:
    def spoil(run: Run) -> Run:
        for one in spoils:
            run = one(run)
        return run

    return spoil


def started(run: Run) -> Run:
    """The first third: motion that makes no sense is slow to fit."""
    return replace(run, motion=run.motion.iloc[: len(run.motion) // 3])


def film_at(factor: float) -> Spoil:
    """Frames taken for ``factor`` times as many a second as they were."""
    return both(started, setting("frame_rate_hz", factor), columns("time_s", lambda t: (t - t.iloc[0]) / factor))


def kept(run: Run, rows: np.ndarray) -> Run:
    return replace(run, motion=run.motion[rows].reset_index(drop=True))


def fifth_missing(run: Run) -> Run:
    return kept(run, np.random.default_rng(3).random(len(run.motion)) > 0.2)


def impacts_hidden(run: Run) -> Run:
    """The frames on both sides of each impact are missing."""
    times, hit = run.motion["time_s"].to_numpy(), run.truth["impacts"]["time_s"].to_numpy()
    return kept(run, np.abs(times[:, None] - hit).min(1) > 1.01 / run.truth["rate_hz"])


def gross_errors(run: Run) -> Run:
    rng = np.random.default_rng(5)
    wrong, motion = rng.random(len(run.motion)) < 0.03, run.motion.copy()
    motion.loc[wrong, ["nes_x_m", "nes_y_m"]] += rng.normal(
        0, 0.1 * run.truth["parameters"]["reach_m"], (wrong.sum(), 2)
    )
    return replace(run, motion=motion)


def with_impacts(count: int) -> Spoil:
    """The longest piece with so many impacts."""

    def spoil(run: Run) -> Run:
        time = run.motion["time_s"].to_numpy()
        edges = np.concatenate([time[:1], run.truth["impacts"]["time_s"], time[-1:]])
        first = int(np.argmax(edges[count + 1 :] - edges[: -count - 1]))
        step = 1.5 / run.truth["rate_hz"]
        return kept(run, (time > edges[first] + step) & (time < edges[first + count + 1] - step))

    return spoil


def halves_glued(run: Run) -> Run:
    """The first half of this run and the second of another of its rig, as if filmed in one."""
    other = make_series(SHORT, np.random.default_rng(1), 2)[1]
    one, two = run.motion.iloc[: len(run.motion) // 2], other.motion.iloc[len(other.motion) // 2 :].copy()
    after = np.arange(1, len(two) + 1)
    two["frame"], two["time_s"] = one["frame"].iloc[-1] + after, one["time_s"].iloc[-1] + after / run.truth["rate_hz"]
    return replace(run, motion=pd.concat([one, two], ignore_index=True))


@dataclass(frozen=True)
class Case:
    """``make``: the recording's run; ``word``: the verdict; ``not_used``: parameters that it must name; ``said``: a
    word of what fails or why it is refused."""

    name: str
    make: Callable[[], Run]
    word: str
    not_used: tuple[str, ...] = ()
    said: str = ""


SDS, PLACES = r"(nes|host)_.*_sd_.*", r"(nes|host)_[xyz](_sd)?_m"
CASES = [
    Case("clean, 40 mm", plant, GOOD),
    Case(
        "clean, 25 mm, lens residual, 15 frames a flight",
        lambda: plant(seed=11, reach_m=0.025, noise="lens", frames_per_flight=15),
        GOOD,
    ),
    Case(
        "clean, 150 mm, correlated noise, 40 frames a flight",
        lambda: plant(seed=12, reach_m=0.15, noise="ar1", frames_per_flight=40),
        GOOD,
    ),
    Case(
        "frame_rate_hz ten times too large",
        lambda: setting("frame_rate_hz", 10)(plant()),
        REFUSED,
        said="frame_rate_hz",
    ),
    Case("frames and times ten times too fast", lambda: film_at(10)(plant()), NO, PRINCIPAL, "[excitation] says"),
    # Not a whole period of the drive is left: its frequency is open, its level is not.
    Case(
        "frames and times half as fast",
        lambda: film_at(0.5)(plant(**LONGER)),
        NO,
        PRINCIPAL,
        "The Host is accelerated by",
    ),
    Case("frames and times 3 % too fast", lambda: film_at(1.03)(plant()), NO, PRINCIPAL, "The Host moves at"),
    Case(
        "inner radius 3 % too large",
        lambda: setting("inner_radius_m", 1.03)(plant()),
        NO,
        PRINCIPAL,
        "Impacts put the ring",
    ),
    Case(
        "disk's radius 3 % too small",
        lambda: setting("radius_m", 0.97)(plant(**LONGER)),
        DOUBTFUL,
        ("tangential_restitution",),
        "Spins",
    ),
    Case(
        "disk's inertia 20 % too large",
        lambda: setting("inertia_factor", 1.2)(plant(**LONGER)),
        DOUBTFUL,
        ("wall_friction",),
        "Spins",
    ),
    Case(
        "calibration 3 % too long",
        lambda: columns(PLACES, lambda c: 1.03 * c)(plant()),
        NO,
        PRINCIPAL,
        "Impacts put the ring",
    ),
    Case("disk's radius in mm", lambda: setting("radius_m", 1e3)(plant()), REFUSED, said="radius_m"),
    Case(
        "both radii in mm",
        lambda: both(started, setting("inner_radius_m", 1e3), setting("radius_m", 1e3))(plant()),
        NO,
        PRINCIPAL,
        "farther out",
    ),
    Case("mass in g", lambda: setting("mass_kg", 1e3)(plant()), GOOD, said="is it in g?"),
    Case("sds three times too small", lambda: columns(SDS, lambda c: c / 3)(plant()), DOUBTFUL, said="stated sds"),
    Case("sds five times too large", lambda: columns(SDS, lambda c: c * 5)(plant()), DOUBTFUL, said="stated sds"),
    Case("tilted table", lambda: plant("tilt"), GOOD, said="table_tilt"),
    Case(
        "air drag at 400 frames a second",
        lambda: plant("air_drag", 3, **LONGER | {"reach_m": None, "frames_per_flight": None}),
        GOOD,
        said="air_drag",
    ),
    Case(
        "plain Coulomb floor", lambda: plant("coulomb"), DOUBTFUL, ("floor_friction",), "a spin that decays by itself"
    ),
    Case("sticky patch", lambda: plant("sticky_patch"), DOUBTFUL, ("floor_friction",), "Flights end"),
    Case("gusts", lambda: plant("gusts"), DOUBTFUL, ("floor_friction",), "Flights end"),
    Case("pull towards the wall", lambda: plant("wall_pull"), DOUBTFUL, ("floor_friction",), "Flights end"),
    Case("a fifth of the frames missing", lambda: fifth_missing(plant()), GOOD),
    Case("gross errors in 3 % of the frames", lambda: gross_errors(plant(**LONGER)), NO, PRINCIPAL, "turns back"),
    Case("every impact between missing frames", lambda: impacts_hidden(plant()), GOOD),
    Case("no angle", lambda: plant(with_angle=False), DOUBTFUL, ("floor_friction",), "angle is not measured"),
    Case("Host still", lambda: plant(still=True), GOOD),
    Case("one impact", lambda: with_impacts(1)(plant()), DOUBTFUL, LAW, "1 impact could be used"),
    Case("no impact", lambda: with_impacts(0)(plant()), DOUBTFUL, LAW, "0 impacts could be used"),
    Case("halves of two recordings glued", lambda: halves_glued(plant()), NO, PRINCIPAL, "The Host jumps"),
]


@dataclass(frozen=True)
class Judged:
    """What the command said: its exit status, all it printed, the verdict, what not to use, the parameters, the checks'
    words.
    """

    status: int
    printed: str
    word: str = REFUSED
    not_used: tuple[str, ...] = ()
    parameters: pd.DataFrame | None = None
    found: str = ""


def judged(recording: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> Judged:
    status = main(["identify", str(recording), "--out", str(out)])
    printed = "".join(capsys.readouterr())
    if status:
        assert status == 2 and not (out / "checks.parquet").exists()
        return Judged(status, printed)
    checks = read_table(out / "checks.parquet", "checks")
    word, not_used, steps = verdict(checks)
    assert all(step in printed for step in steps) and f"{word}." in printed.replace(":", ".")
    found = " ".join(checks.loc[checks["state"] == "fails", "found"])
    return Judged(
        0,
        printed,
        word,
        tuple(not_used),
        read_table(out / "identification.parquet", "identification").set_index("parameter"),
        found,
    )


def errors_sd(parameters: pd.DataFrame, truth: dict[str, float]) -> dict[str, float]:
    """Error over sd of each principal parameter that has a value; of a bound that the truth breaks, infinity."""
    errors = {}
    for name in PRINCIPAL:
        if name not in parameters.index:
            continue
        row = parameters.loc[name, ["value", "sd", "low", "high"]].astype(float)
        if np.isfinite(row["value"]):
            errors[name] = (row["value"] - truth[name]) / row["sd"]
        elif row["low"] > truth[name] or row["high"] < truth[name]:
            errors[name] = np.inf
    return errors


def must_be(case: Any, found: Judged, truth: dict[str, float]) -> None:
    assert found.word == case.word, f"{found.word} ({', '.join(found.not_used)}): {found.found}\n{found.printed}"
    assert set(case.not_used) <= set(found.not_used)
    assert case.said in (found.found if case.word in (DOUBTFUL, NO) else found.printed)
    if found.parameters is not None:
        wrong = {
            name: off
            for name, off in errors_sd(found.parameters, truth).items()
            if abs(off) > FARTHEST_SD and name not in found.not_used
        }
        assert wrong == {}


@pytest.mark.others_further
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_spoiled_motion(case, tmp_path, capsys):
    run = case.make()
    write_series([run], tmp_path)
    truth = run.truth["parameters"]
    must_be(
        case,
        judged(tmp_path / "run-01", tmp_path / "out", capsys),
        {name: truth["friction" if name == "floor_friction" else name] for name in PRINCIPAL},
    )


@dataclass(frozen=True)
class Picture:
    """A spoiled run of the sample series: recording.toml, tracks and calibration changed; the rest as in
    :class:`Case`.
    """

    name: str
    word: str
    not_used: tuple[str, ...] = ()
    said: str = ""
    toml: Text = str
    tracks: Table = lambda table: table
    calibration: Callable[[dict[str, Any]], dict[str, Any]] = lambda solved: solved
    frames: int = 340  # of 960: six impacts and more, a third of the work


def replaced(*pairs: tuple[str, str]) -> Text:
    def change(text: str) -> str:
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        return text

    return change


def longer(solved: dict[str, Any]) -> dict[str, Any]:
    for camera in solved["cameras"]:
        camera["translation_m"] = [1.03 * value for value in camera["translation_m"]]
    return solved


def bodies_swapped(table: pd.DataFrame) -> pd.DataFrame:
    names = {f"{a}{i}": f"{b}{i}" for i in range(1, 5) for a, b in (("H", "N"), ("N", "H"))}
    return table.assign(marker=table["marker"].replace(names))


CAMERAS = {"VW1": "VW2", "VW2": "VW1"}
PICTURES = [
    Picture("as it was", GOOD),
    Picture(
        "exposed for longer than a frame",
        REFUSED,
        said="exposure_s",
        toml=replaced(('name = "VW1"', 'name = "VW1"\nexposure_s = 2e-3')),
    ),
    Picture(
        "window offset of one camera forgotten",
        REFUSED,
        (),
        "rays intersect only with",
        replaced(("window_offset_px = [0, 1182]\n", "")),
    ),
    Picture(
        "window offsets of both cameras forgotten",
        NO,
        PRINCIPAL,
        "miss each other",
        replaced(("window_offset_px = [0, 1182]\n", ""), ("window_offset_px = [0, 1174]\n", "")),
    ),
    Picture(
        "windows exchanged",
        REFUSED,
        said="window_offset_px",
        toml=replaced(("1182", "x"), ("1174", "1182"), ("x]", "1174]")),
    ),
    Picture(
        "cameras exchanged",
        REFUSED,
        said="the other way round",
        tracks=lambda table: table.assign(camera=table["camera"].map(CAMERAS)),
    ),
    Picture("board 3 % too large", NO, PRINCIPAL, "Impacts put the ring", calibration=longer),
    # Motion without sense: its fit takes long, and of 340 frames eight times as long as of 480.
    Picture("Host's and NES' markers exchanged", NO, PRINCIPAL, tracks=bodies_swapped, frames=480),
]


@pytest.mark.further
@pytest.mark.parametrize("case", PICTURES, ids=lambda case: case.name)
def test_spoiled_pictures(case, tmp_path, capsys):
    place = tmp_path / "run-01"
    place.mkdir()
    (tmp_path / "calibration.json").write_text(
        json.dumps(case.calibration(json.loads((SAMPLE / "calibration.json").read_text("utf-8"))))
    )
    text = (
        (SAMPLE / "run-01" / "recording.toml")
        .read_text("utf-8")
        .replace('"spin_coupling"]', '"spin_coupling", "table_tilt"]')
    )
    (place / "recording.toml").write_text(case.toml(text), "utf-8")
    tracks = pd.read_parquet(SAMPLE / "run-01" / "tracks.parquet")
    case.tracks(tracks[tracks["frame"] < tracks["frame"].min() + case.frames]).to_parquet(
        place / "tracks.parquet", index=False
    )
    must_be(
        case, judged(place, tmp_path / "out", capsys), json.loads((SAMPLE / "truth.json").read_text("utf-8"))["plant"]
    )


@pytest.mark.further
def test_one_tilted_run_spoils_the_joint_answer_and_is_said(tmp_path, capsys):
    """The table was tilted in the second of three runs: that run's tilt is fitted along, and the series says that one
    law does not do for all.
    """
    rig, rng = draw_rig(SHORT, np.random.default_rng(1)), np.random.default_rng(2)
    tilted = replace(rig, physics=rig.physics._replace(tilt_x_m_per_s2=0.3))
    write_series([make_run(one, rng, f"run {k}", 800.0) for k, one in enumerate((rig, tilted, rig), 1)], tmp_path)
    assert main(["identify", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    whole = printed[printed.index(f"{tmp_path.name}: ") :]
    assert "Doubtful. Do not use: floor_friction." in whole and "less sure than from run-01 alone" in whole
    assert printed.count("Good: ") == 3 and printed.count("table_tilt") == 1
    assert re.search(r"Floor friction μ_s = .* \(90 %: .*\), not to be used", whole) and re.search(
        r"Restitution ε = [^,]*\n", whole
    )


def table(**states: str) -> pd.DataFrame:
    rows = [
        (
            name,
            4.0,
            6.0,
            state,
            f"{name} seen.",
            "restitution" if state == "fails" else "",
            "Look." if state == "fails" else "",
        )
        for name, state in states.items()
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def test_runs_add_up():
    runs = [table(a="holds", b="open", c="holds"), table(a="fails", b="open", c="open")]
    added = summed(runs, ["x", "y"]).set_index("check")
    assert added["state"].to_dict() == {"a": "fails", "b": "open", "c": "holds"}
    assert added.loc["a", "value"] == 0.5 and added.loc["a", "found"] == "In y (of 2 runs): a seen."
    assert added.loc["c", "found"] == "Holds in 1 of 2 runs."
    counts = summed([table(**{COUNT: "fails"}), table(**{COUNT: "fails"})], ["x", "y"]).iloc[0]
    assert (
        counts["state"] == "holds" and counts["value"] == 8 and counts["parameters"] == ""
    )  # two runs of four impacts are enough together


def test_runs_that_disagree():
    """Two runs whose restitutions lie ten sds apart cannot both be right, however good each is."""
    tables = [pd.DataFrame({"parameter": ["restitution"], "value": [value], "sd": [0.01]}) for value in (0.7, 0.8)]
    checks = series_checks(["x", "y"], [table(a="holds")] * 2, tables)
    assert verdict(checks)[:2] == ("Doubtful", ["restitution"])
    assert "ovines diagnose" in verdict(checks)[2][0]
    assert verdict(series_checks(["x", "y"], [table(a="holds")] * 2, tables[:1] * 2))[0] == "Good"


def test_the_terminal_says_a_series_answer_once(capsys, tmp_path):
    runs = [
        Outcome(
            tmp_path / name,
            tmp_path,
            "done",
            {"report": "run"},
            verdict=["Good: all.", "Restitution ..."],
            page=tmp_path / "page",
        )
        for name in "ab"
    ]
    assert tell(runs[:1]) == 0
    assert capsys.readouterr().out.count("Restitution") == 1
    whole = Outcome(
        tmp_path,
        tmp_path,
        "done",
        {"report": "run"},
        verdict=["Doubtful.", "Restitution ..."],
        page=tmp_path / "report.html",
        whole_series=True,
    )
    assert tell([*runs, whole]) == 0
    printed = capsys.readouterr().out
    assert printed.count("Good: all.") == 2 and printed.count("Restitution") == 1 and printed.count("page: ") == 1
    assert printed.endswith(f"  page: {tmp_path / 'report.html'}\n")
