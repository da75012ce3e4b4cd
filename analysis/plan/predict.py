"""What settings will determine: simulated days, identified as measured ones are, and the same with one setting changed.

A day's runs differ by their starts alone, and each changed setting is asked about the same starts: what differs is the
setting's doing, but for chaos.  A parameter's predicted sd is the median over the days of what identification states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from analysis.identify import identify_series
from analysis.plan.day import MOST_STARTS, Settings, as_planned, simulated_run
from ovines.recording import Recording
from ovines.tables import checked

AS_STATED = "as stated"
# The four numbers that a rig is tested for: settings are ranked by them.
MAIN = ("restitution", "wall_friction", "tangential_restitution", "floor_friction")
# What an undetermined one of them counts as: the sd of anything between 0 and 1.
UNDETERMINED_SD = 12**-0.5
# Processor seconds: of an identification per run and per frame of it, of the simulator per period of the drive, all
# starts of a run together (measured on the practice rig).
RUN_S, FRAME_S, PERIOD_S = 0.5, 1.5e-3, 1e-4 * MOST_STARTS
Progress = Callable[[], object]


@dataclass(frozen=True)
class Change:
    """One setting changed, in words."""

    words: str
    settings: Settings


@dataclass(frozen=True, eq=False)
class Day:
    """Table ``identification`` indexed by parameter; the share of starts that gave a run; filmed time of a run."""

    found: pd.DataFrame
    usable: float
    filmed_s: float


def changes(stated: Settings) -> tuple[Change, ...]:
    """The day as stated, and what could be done otherwise."""
    level, frequency = stated.level_g, stated.frequency_hz
    return (
        Change(AS_STATED, stated),
        Change("twice the runs", replace(stated, runs=2 * stated.runs)),
        Change("runs twice as long", replace(stated, duration_s=2 * stated.duration_s)),
        Change("twice the frame rate", replace(stated, frame_rate_hz=2 * stated.frame_rate_hz)),
        Change("half the noise", replace(stated, noise=stated.noise.times(0.5))),
        Change("0.7 times the level", replace(stated, level_g=0.7 * level)),
        Change("1.4 times the level", replace(stated, level_g=1.4 * level)),
        Change("0.7 times the frequency", replace(stated, frequency_hz=0.7 * frequency)),
        Change("1.4 times the frequency", replace(stated, frequency_hz=1.4 * frequency)),
    )


def cost_s(asked: tuple[Change, ...], days: int) -> float:
    """Processor seconds that `predict` takes, about."""
    return days * sum(
        one.runs * (RUN_S + one.simulated_s * (one.frame_rate_hz * FRAME_S + one.frequency_hz * PERIOD_S))
        for one in (change.settings for change in asked)
    )


def predict(
    recording: Recording, asked: tuple[Change, ...], days: int, seed: int, progress: Progress | None = None
) -> pd.DataFrame:
    """Table ``plan``: a row per setting and parameter."""
    found: list[list[Day]] = []
    for change in asked:
        found.append([])
        for day in range(days):
            found[-1].append(one_day(recording, change.settings, [seed, day]))
            if progress is not None:
                progress()
    parameters = list(dict.fromkeys([*MAIN, *(name for day in found[0] for name in day.found.index)]))
    today = np.array([sds_of([day.found for day in found[0]], name) for name in parameters])
    rows = []
    for change, its_days in zip(asked, found, strict=True):
        for name, base in zip(parameters, today, strict=True):
            sds = sds_of([day.found for day in its_days], name)
            known = sds[np.isfinite(sds)]
            both = np.isfinite(sds) & np.isfinite(base)
            rows.append(
                {
                    "setting": change.words,
                    "parameter": name,
                    "sd": float(np.median(known)) if len(known) else np.nan,
                    "sd_low": known.min() if len(known) else np.nan,
                    "sd_high": known.max() if len(known) else np.nan,
                    "determined": len(known) / days,
                    "gain": float(np.exp(np.median(np.log(base[both] / sds[both])))) if both.any() else np.nan,
                    "impacts": float(np.median([_impacts(day.found) for day in its_days])),
                    "usable": float(np.mean([day.usable for day in its_days])),
                    "filmed_s": float(np.mean([day.filmed_s for day in its_days])),
                }
            )
    return checked(pd.DataFrame(rows), "plan")


def one_day(recording: Recording, settings: Settings, seed: list[int]) -> Day:
    """One simulated day, identified as a measured one is."""
    planned = as_planned(recording, settings)
    made = [simulated_run(planned, settings, np.random.default_rng([*seed, run])) for run in range(settings.runs)]
    joint, _ = identify_series([motion for motion, _ in made], [planned] * settings.runs)
    return Day(
        joint.set_index("parameter"),
        settings.runs / sum(starts for _, starts in made),
        float(np.mean([len(motion) for motion, _ in made])) / settings.frame_rate_hz,
    )


def sds_of(days: list[pd.DataFrame], name: str) -> np.ndarray:
    """The sd of one parameter on each day; NaN where a day does not determine it."""
    return np.array([_sd(day, name) for day in days])


def _sd(day: pd.DataFrame, name: str) -> float:
    if name not in day.index or not np.isfinite(day.loc[name, "value"]):
        return float("nan")
    sd = float(day.loc[name, "sd"])
    return sd if sd > 0.0 else float("nan")


def _impacts(day: pd.DataFrame) -> float:
    counts = day["n_impacts"].dropna()
    return float(counts.max()) if len(counts) else 0.0


def ranked(plan: pd.DataFrame) -> pd.DataFrame:
    """The changed settings, best first: ``gain``, by how much the sds of the four main parameters shrink (geometric
    mean), and each one's own; a parameter that a setting newly determines counts from `UNDETERMINED_SD`.
    """
    table = plan[plan["parameter"].isin(MAIN)].pivot(index="setting", columns="parameter", values="sd")
    known = table.fillna(UNDETERMINED_SD)
    gains = known.loc[AS_STATED] / known
    gains.insert(0, "gain", np.exp(np.log(gains).mean(axis=1)))
    return gains.drop(index=AS_STATED).sort_values("gain", ascending=False)


def days_differ(plan: pd.DataFrame) -> float:
    """The factor by which the sds of two days with the same settings differ, typically: smaller gains mean nothing."""
    main = plan[(plan["setting"] == AS_STATED) & plan["parameter"].isin(MAIN)]
    ratios = (main["sd_high"] / main["sd_low"]).dropna()
    return float(np.sqrt(ratios.median())) if len(ratios) else float("nan")
