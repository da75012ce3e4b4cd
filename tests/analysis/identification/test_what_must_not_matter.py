"""Where the rig stands, when the clock starts, what is called how: the answers of a series must not know.  Entry at the
table motion.

Each test changes one series in a way that must not matter, identifies it again with ``ovines identify``, maps the
answers back and compares: impacts one to one, parameters within a tenth of their sds, sds within a tenth, what the
checks say.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis.checks.recording import verdict
from analysis.flights.cutting.segments import Segments
from analysis.gap.diagnose import diagnose
from analysis.identify import identify_series
from ovines.__main__ import main
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from ovines.tables import read_table
from tests.plants import Run, Spec, draw_rig, make_run, make_series, write_series

SMALL = 0.1  # sds: what rounding, and an optimum found from another side, may change
ALMOST_NEVER_SD = 3.5  # farthest of some fifty differences that are one sd or less in size
CALM = 0.3  # sds: frames in which nothing happens still tell the noise, and with it the weights, a little better
LATE = 1_000_000  # s and frames
SHIFT_M, TURN_RAD = (1.3, -1.4), 2.0
FRAMES_PER_FLIGHT = 25
TILTED = Spec(
    "tilt",
    noise="white",
    reach_m=0.04,
    frames_per_flight=FRAMES_PER_FLIGHT,
    noise_share=1.5e-4,
    periods=4.0,
    at_origin=True,
)


@dataclass(frozen=True)
class Answer:
    """Joint parameters by name (value, sd, low, high), the impacts of each run, and its table ``checks``."""

    parameters: pd.DataFrame
    impacts: list[pd.DataFrame]
    checks: list[pd.DataFrame]


def identified(runs: Sequence[Run], folder: Path) -> Answer:
    """The series written, and identified with the command."""
    written, out = write_series(list(runs), folder / "series"), folder / "out"
    assert main(["identify", str(written), "--out", str(out)]) == 0
    return answer(out, [f"run-{number:02d}" for number in range(1, len(runs) + 1)])


def answer(out: Path, names: Sequence[str]) -> Answer:
    """What ``ovines identify`` wrote of a series whose runs have these ``names``."""
    parameters = read_table(out / "identification.parquet", "identification").set_index("parameter")
    return Answer(
        parameters[["value", "sd", "low", "high"]],
        [read_table(out / name / "impacts.parquet", "impacts") for name in names],
        [read_table(out / name / "checks.parquet", "checks") for name in names],
    )


def identified_together(runs: Sequence[Run], folder: Path) -> Answer:
    """As :func:`identified`, each run's impacts as the joint fit sees them: the command tells what each says alone."""
    series = read_series(write_series(list(runs), folder))
    joint, each = identify_series([read_table(one.folder / "motion.parquet", "motion") for one in series], series)
    parameters = joint.set_index("parameter")[["value", "sd", "low", "high"]]
    return Answer(parameters, [one.impacts for one in each], [])


@pytest.fixture(scope="module")
def series() -> list[Run]:
    """Three short runs at the origin, the table tilted, so that a parameter has a direction in the world."""
    return make_series(TILTED, np.random.default_rng(8), 3)


@pytest.fixture(scope="module")
def base_folder(tmp_path_factory) -> Path:
    """Where ``series`` and ``out`` of :func:`base` lie."""
    return tmp_path_factory.mktemp("base")


@pytest.fixture(scope="module")
def base(series, base_folder) -> Answer:
    found = identified(series, base_folder)
    assert sum(len(one) for one in found.impacts) > 30
    assert "table_tilt_x_m_per_s2" in found.parameters.index  # else a turn of the world would prove little
    return found


def changed(
    series: Sequence[Run], motion: Callable[[pd.DataFrame], pd.DataFrame], toml: Callable[[str], str] = str
) -> list[Run]:
    return [replace(run, motion=motion(run.motion.copy()), toml=toml(run.toml)) for run in series]


def same_parameters(one: pd.DataFrame, other: pd.DataFrame, within_sd: float = SMALL, sds_too: bool = True) -> None:
    """Both tell the same parameters, within ``within_sd`` of the larger sd; what one leaves open the other leaves
    open.
    """
    assert set(one.index) == set(other.index)
    wrong = []
    for name in one.index:
        a, b = one.loc[name], other.loc[name]
        if not a.isna().equals(b.isna()):
            wrong.append(f"{name}: {a.to_dict()} became {b.to_dict()}")
            continue
        sd = np.nanmax([a["sd"], b["sd"], 1e-12 * abs(a["value"])]) if not np.isnan(a["sd"]) else 0.0
        if abs(a["value"] - b["value"]) > within_sd * sd:
            wrong.append(f"{name}: {a['value']:.6g} became {b['value']:.6g}, sd {sd:.2g}")
        elif sds_too and not math.isnan(a["sd"]) and abs(b["sd"] / a["sd"] - 1) > SMALL:
            wrong.append(f"{name}: sd {a['sd']:.4g} became {b['sd']:.4g}")
    assert wrong == []


MEASURED = (
    ("time_s", "time_sd_s"),
    ("restitution", "restitution_sd"),
    ("wall_friction", "wall_friction_sd"),
    ("tangential_restitution", "tangential_restitution_sd"),
    ("normal_speed_before_m_per_s", "normal_speed_before_sd_m_per_s"),
    ("normal_speed_after_m_per_s", "normal_speed_after_sd_m_per_s"),
    ("tangential_speed_before_m_per_s", "tangential_speed_before_sd_m_per_s"),
)


def apart_sd(one: pd.DataFrame, other: pd.DataFrame) -> dict[str, np.ndarray]:
    """Per measured quantity of impacts taken one to one, the difference over the larger sd."""
    return {
        value: (one[value].to_numpy() - other[value].to_numpy()) / np.fmax(one[sd].to_numpy(), other[sd].to_numpy())
        for value, sd in MEASURED
    }


def same_impacts(one: pd.DataFrame, other: pd.DataFrame, within_sd: float = SMALL) -> None:
    """One to one: what is measured within ``within_sd`` of the larger sd, directions, and what each impact informs."""
    assert len(one) == len(other), f"{len(one)} impacts became {len(other)}"
    for value, off in apart_sd(one, other).items():
        assert np.array_equal(one[value].isna(), other[value].isna()), value
        farthest = np.nanmax(np.abs(off), initial=0.0)
        assert farthest <= within_sd, f"{value}: {farthest:.2g} sd"
    turned = np.angle(np.exp(1j * (one["azimuth_rad"].to_numpy() - other["azimuth_rad"].to_numpy())))
    # Along the wall the disk rolls on while its impact's time is uncertain: the azimuth is known no better than that.
    step = np.abs(np.angle(np.exp(1j * np.diff(one["azimuth_rad"])))) / np.diff(one["time_s"])
    along = within_sd * one["time_sd_s"].to_numpy() * np.fmax(np.append(step, 0.0), np.insert(step, 0, 0.0))
    assert np.all(~(np.abs(turned) > np.fmax(1e-3, along)))
    assert one["regime"].fillna("").tolist() == other["regime"].fillna("").tolist()


def same_verdicts(one: Answer, other: Answer) -> None:
    """The same checks hold, and the same parameters are named as not to be used, of each run."""
    for a, b in zip(one.checks, other.checks, strict=True):
        assert a.set_index("check")["state"].to_dict() == b.set_index("check")["state"].to_dict()
        assert verdict(a)[:2] == verdict(b)[:2]


def same(one: Answer, other: Answer, within_sd: float = SMALL) -> None:
    assert len(one.impacts) == len(other.impacts)
    for a, b in zip(one.impacts, other.impacts, strict=True):
        same_impacts(a, b, within_sd)
    same_parameters(one.parameters, other.parameters, within_sd)
    same_verdicts(one, other)


def without(found: Answer, names: Sequence[str]) -> Answer:
    """``found`` without some of its parameters."""
    return replace(found, parameters=found.parameters.drop(list(names)))


def mapped(
    found: Answer,
    impacts: Callable[[pd.DataFrame], pd.DataFrame] = lambda table: table,
    factors: dict[str, float] | None = None,
    tilt_rad: float = 0.0,
) -> Answer:
    """Answers taken back: ``impacts`` per table, ``factors`` on the parameters' values and sds, the tilt turned by
    ``tilt_rad``.
    """
    parameters = found.parameters.copy()
    for name, factor in (factors or {}).items():
        if name in parameters.index:
            parameters.loc[name, ["value", "low", "high"]] *= factor
            parameters.loc[name, "sd"] *= abs(factor)
    if tilt_rad:
        names = ["table_tilt_x_m_per_s2", "table_tilt_y_m_per_s2"]
        c, s = math.cos(tilt_rad), math.sin(tilt_rad)
        x, y = parameters.loc[names, "value"]
        parameters.loc[names, "value"] = c * x - s * y, s * x + c * y
    return Answer(parameters, [impacts(table.copy()) for table in found.impacts], found.checks)


def placed(motion: pd.DataFrame, shift_m: tuple[float, float], turn_rad: float) -> pd.DataFrame:
    """``motion`` in a world whose origin and axes lie elsewhere."""
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    for body in ("nes", "host"):
        x, y = motion[f"{body}_x_m"], motion[f"{body}_y_m"]
        motion[f"{body}_x_m"], motion[f"{body}_y_m"] = c * x - s * y + shift_m[0], s * x + c * y + shift_m[1]
        motion[f"{body}_angle_rad"] += turn_rad
    return motion


def turned_back(table: pd.DataFrame, turn_rad: float) -> pd.DataFrame:
    return table.assign(azimuth_rad=table["azimuth_rad"] - turn_rad)


def mirrored(motion: pd.DataFrame) -> pd.DataFrame:
    """``motion`` seen in a mirror: y and angles change their signs."""
    return motion.assign(**{name: -motion[name] for name in ("nes_y_m", "host_y_m", "nes_angle_rad", "host_angle_rad")})


def mirrored_back(table: pd.DataFrame) -> pd.DataFrame:
    """Impacts seen in a mirror taken back: azimuths, spins and tangential speeds change their signs."""
    names = [
        "azimuth_rad",
        "tangential_speed_before_m_per_s",
        "tangential_speed_after_m_per_s",
        "spin_before_rad_per_s",
        "spin_after_rad_per_s",
    ]
    return table.assign(**{name: -table[name] for name in names})


#: what a mirror does to the parameters
MIRRORED = dict.fromkeys(("table_tilt_y_m_per_s2", "wall_centre_y_m", "disk_centre_y_m", "wall_ellipticity_sin"), -1.0)


def grown(series: Sequence[Run], scale: float) -> list[Run]:
    """Froude's scaling: under the same gravity lengths by ``scale``, times and speeds by its root."""
    root = math.sqrt(scale)

    def motion(table: pd.DataFrame) -> pd.DataFrame:
        lengths = [name for name in table if name.endswith("_m")]
        return table.assign(**{name: table[name] * scale for name in lengths}, time_s=table["time_s"] * root)

    powers = {"frame_rate_hz": -0.5, "inner_radius_m": 1.0, "radius_m": 1.0, "mass_kg": 3.0, "frequency_hz": -0.5}

    def toml(text: str) -> str:
        return re.sub(
            rf"(?m)^({'|'.join(powers)}) = (.*)$",
            lambda found: f"{found[1]} = {float(found[2]) * scale ** powers[found[1]]!r}",
            text,
        )

    return changed(series, motion, toml)


@pytest.fixture(scope="module")
def diagnosed_here(base, base_folder, without_next_test) -> tuple[list[Segments], dict[str, Any]]:
    """Where the flights of ``base`` end, and its diagnosis; laws are searched for in the changed series, not here."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.gap.diagnose.write_laws", lambda ladder, *_: ((), ladder))
        return diagnosed(base_folder)


def diagnosed(folder: Path) -> tuple[list[Segments], dict[str, Any]]:
    """As ``ovines diagnose`` segments the runs of the folder's ``series``, and what it answers."""
    loaded, _ = load_series(read_series(folder / "series"), folder / "out")
    return [run.segments for run in loaded.runs], diagnose(loaded, np.random.default_rng(0)).summary


@pytest.mark.further
def test_every_second_frame_tells_the_same_less_well(series, base, tmp_path):
    """Half the frames: the differences are what the dropped half knew, so rarely above one sd of the answer from fewer
    frames.

    Counted are impacts above 0.15 m/s with six frames left of either flight.
    """
    rate = series[0].truth["rate_hz"]
    half = changed(
        series,
        lambda m: m.iloc[::2].assign(frame=np.arange((len(m) + 1) // 2)),
        lambda text: re.sub(r"frame_rate_hz = .*", f"frame_rate_hz = {rate / 2!r}", text),
    )
    found, off = identified(half, tmp_path), []
    for fine, coarse in zip(base.impacts, found.impacts, strict=True):
        times, apart = fine["time_s"].to_numpy(), 12 / rate
        clear = np.diff(times, prepend=-np.inf) > apart
        clear &= np.diff(times, append=np.inf) > apart
        clear &= (
            (times > apart)
            & (times < series[0].motion["time_s"].iloc[-1] - apart)
            & (fine["normal_speed_before_m_per_s"] > 0.15).to_numpy()
        )
        for _, impact in fine[clear].iterrows():
            nearest = coarse.iloc[(coarse["time_s"] - impact["time_s"]).abs().argmin()]
            assert abs(nearest["time_s"] - impact["time_s"]) < 0.5 / rate
            off.append((nearest["time_s"] - impact["time_s"]) / max(nearest["time_sd_s"], impact["time_sd_s"]))
    assert len(off) > 15
    names = base.parameters.index.intersection(found.parameters.index)
    both = [(base.parameters.loc[name], found.parameters.loc[name]) for name in names]
    shifts = np.array([(b["value"] - a["value"]) / max(a["sd"], b["sd"]) for a, b in both])
    for z in (np.array(off), shifts[np.isfinite(shifts)]):
        assert np.sqrt(np.mean(z**2)) < 1.2 and np.abs(z).max() < ALMOST_NEVER_SD
    assert {"restitution", "wall_friction", "tangential_restitution", "floor_friction", "contact_radius_m"} <= set(
        names
    )


@pytest.mark.further
def test_a_run_cut_in_two(series, tmp_path):
    """Cut in the middle of its longest flight, the second part with its own clock: what ties the two halves of one
    flight together is lost.
    """
    base, run = identified_together(series, tmp_path / "whole"), series[0]
    times = base.impacts[0]["time_s"].to_numpy()
    longest = int(np.argmax(np.diff(times)))
    at = int(np.searchsorted(run.motion["time_s"], 0.5 * (times[longest] + times[longest + 1])))
    start = float(run.motion["time_s"].iloc[at])
    second = run.motion.iloc[at:].assign(frame=lambda m: m["frame"] - at, time_s=lambda m: m["time_s"] - start)
    parts = [replace(run, motion=run.motion.iloc[:at]), replace(run, motion=second)]
    found = identified_together([*parts, *series[1:]], tmp_path / "cut")
    joined = pd.concat(
        [found.impacts[0], found.impacts[1].assign(time_s=found.impacts[1]["time_s"] + start)], ignore_index=True
    )
    # The cut run's Host is known from half the frames: what its halves say of an impact differs by what the other half
    # would have added.
    assert len(joined) == len(base.impacts[0])
    off = np.concatenate(list(apart_sd(base.impacts[0], joined).values()))
    off = off[np.isfinite(off)]
    assert np.sqrt(np.mean(off**2)) < 1.0 and np.abs(off).max() < ALMOST_NEVER_SD
    # The other runs hear of the cut through what all share alone.
    for a, b in zip(base.impacts[1:], found.impacts[2:], strict=True):
        same_impacts(a, b, ALMOST_NEVER_SD)
        off = np.concatenate(list(apart_sd(a, b).values()))
        assert np.sqrt(np.nanmean(off**2)) < 0.5
    same_parameters(base.parameters, found.parameters, 1.0, sds_too=False)


@pytest.mark.further
def test_a_calm_run_added_to_the_series(series, base, tmp_path):
    """A second in which the Host moves by a hundredth of g, and friction carries the disk along: it tells nothing, and
    must spoil nothing.
    """
    run, rng = series[0], np.random.default_rng(5)
    rig = run.truth["rig"]
    frames = int(run.truth["rate_hz"])
    time = np.arange(frames) / run.truth["rate_hz"]
    place = 0.01 * 9.81 / (2 * np.pi * rig.drive_hz) ** 2 * np.sin(2 * np.pi * rig.drive_hz * time)
    calm = pd.concat([run.motion.iloc[:1]] * frames, ignore_index=True).assign(frame=np.arange(frames), time_s=time)
    offset = {"nes": (0.3 * rig.physics.reach_m, 0.2 * rig.physics.reach_m, 0.7), "host": (0.0, 0.0, 0.0)}
    for body, (x, y, angle) in offset.items():
        for axis, value in (("x_m", x + place), ("y_m", y), ("z_m", 0.0), ("angle_rad", angle)):
            calm[f"{body}_{axis}"] = (
                value
                + rng.normal(size=frames)
                * calm[f"{body}_{axis[0] if axis != 'angle_rad' else 'angle'}_sd_{axis.split('_')[-1]}"]
            )
    text = re.sub(r"acceleration_g = .*", "acceleration_g = 0.01", run.toml)
    found = identified([*series, replace(run, motion=calm, toml=text)], tmp_path)
    assert len(found.impacts[3]) == 0
    of_three = replace(found, impacts=found.impacts[:3], checks=found.checks[:3])
    drive = ["drive_frequency_hz"]  # this the calm second does tell
    same(without(base, drive), without(of_three, drive), CALM)


def test_a_calm_second_at_the_end(tmp_path):
    """A disk that bounces in a Host at rest until friction stops it: a second of rest more."""
    rig = draw_rig(
        replace(TILTED, law="ours", still=True, periods=16.0, frames_per_flight=20), np.random.default_rng(12)
    )
    run = make_run(rig, np.random.default_rng(13), rate_hz=400.0)
    states = run.truth["states"]
    moving = np.hypot(np.gradient(states["nes_x_m"]), np.gradient(states["nes_y_m"])) * 400.0 > 2e-3
    rest = int(np.flatnonzero(moving)[-1]) + 20
    assert len(states) > rest + 400 and len(run.truth["impacts"]) > 3
    short, long = (replace(run, motion=run.motion.iloc[:count]) for count in (rest, rest + 400))
    one, other = identified([short], tmp_path / "short"), identified([long], tmp_path / "long")
    same(one, other, CALM)


@pytest.mark.further
@pytest.mark.parametrize(
    ("scale", "late", "searched"),  # a small rig's frames are near a clock's rounding
    [(5.0, LATE, "with a search for laws"), (0.2, 0, "without_laws")],
)
def test_the_whole_way_to_the_diagnosis(series, base, diagnosed_here, scale, late, searched, request, tmp_path):
    """`ovines identify` and `ovines diagnose` of a rig of another size, elsewhere, turned, in a mirror and later, its
    runs in another order and under other names: impacts, parameters, checks, frames at the wall, kinks, verdict,
    effects, stage.

    All at once, because an answer that knows of one of them knows of all: none takes another one back.  Laws for what
    the effect leaves are searched for in the larger rig: nothing is left there either.
    """
    if searched == "without_laws":
        request.getfixturevalue(searched)

    def elsewhere(motion: pd.DataFrame) -> pd.DataFrame:
        motion = placed(mirrored(motion), SHIFT_M, TURN_RAD)
        return motion.assign(time_s=motion["time_s"] + late, frame=motion["frame"] + late)

    renamed = [
        replace(run, toml=re.sub(r'(?m)^name = ".*"$', f'name = "{word}"', run.toml))
        for run, word in zip(changed(grown(series, scale), elsewhere), ("z", "Ä 2", "a"), strict=True)
    ]
    found, root = identified(renamed[::-1], tmp_path), math.sqrt(scale)

    def back(table: pd.DataFrame) -> pd.DataFrame:
        table = mirrored_back(turned_back(table, TURN_RAD))
        speeds = {name: table[name] / root for name in table if name.endswith("_m_per_s")}
        spins = {name: table[name] * root for name in table if name.endswith("_rad_per_s")}
        times = {"time_s": (table["time_s"] - late) / root, "time_sd_s": table["time_sd_s"] / root}
        return table.assign(**speeds, **spins, **times)

    lengths = {name: 1 / scale for name in found.parameters.index if name.endswith("_m")}
    units = lengths | {"drive_frequency_hz": root, "restitution_speed_slope_s_per_m": root}
    there = mapped(mapped(found, back, units, tilt_rad=-TURN_RAD), factors=MIRRORED)
    there = replace(there, impacts=there.impacts[::-1], checks=there.checks[::-1])
    names = ["table_tilt_x_m_per_s2", "table_tilt_y_m_per_s2"]
    same_parameters(base.parameters.loc[names], there.parameters.loc[names], sds_too=False)
    same(without(base, names), without(there, names))
    (segments, one), (theirs, other) = diagnosed_here, diagnosed(tmp_path)
    seen = root * np.array([-1.0, 1.0])  # in the rig's own frame, turned by half a turn, in a mirror
    for mine, its in zip(segments, theirs[::-1], strict=True):  # a larger rig is no nearer to its wall
        assert np.array_equal(mine.gaps, its.gaps)
        assert np.array_equal(mine.contact, its.contact)
        assert np.allclose(mine.steps_m_per_s * seen, its.steps_m_per_s, rtol=1e-6, atol=0)
    assert (
        (other["verdict"], other["effects"], other["stage"])
        == (one["verdict"], one["effects"], one["stage"])
        == ("effect", ["table_tilt"], "flight")
    )
    tilts = [d["parameters"]["table_tilt"] for d in (one, other)]
    half = 0.5 * (tilts[0]["tilt_rad"]["high"] - tilts[0]["tilt_rad"]["low"])
    assert abs(tilts[1]["tilt_rad"]["value"] - tilts[0]["tilt_rad"]["value"]) < SMALL * half
    turned = TURN_RAD - tilts[1]["direction_rad"]["value"] - tilts[0]["direction_rad"]["value"]
    assert abs(math.remainder(turned, 2 * math.pi)) < SMALL * 0.5 * (
        tilts[0]["direction_rad"]["high"] - tilts[0]["direction_rad"]["low"]
    )
