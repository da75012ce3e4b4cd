"""What a residual of an impact may go with beside the law: covariates, probes of them, a value of each run's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from analysis.contact.held_laws import since_before
from analysis.contact.law import LawData

Array = NDArray[np.float64]

#: how long a wall may remember the impact before, for the probe that asks
MEMORY_S = 0.03
#: ... and within how many impacts a run wears in
WORN_IN = 3.0
#: probes as groups of covariates that belong together
PROBES = {
    "the time since the impact before": ("memory of the impact before",),
    "the slip speed": ("slip speed",),
    "the direction of slip": ("slip direction",),
    "the spin": ("spin",),
    "the sense of spin": ("sense of spin",),
    "the time in the run": ("time in the run",),
    "the first impacts of a run": ("first impacts",),
    "the run": ("run",),
    "the drive's phase": ("cos drive phase", "sin drive phase"),
    "the recording's time at the drive's frequency": ("cos clock", "sin clock"),
    "twice the azimuth": ("cos 2 azimuth", "sin 2 azimuth"),
    "three times the azimuth": ("cos 3 azimuth", "sin 3 azimuth"),
}
#: what laws call the quantity that a probe follows
FOLLOWED = {
    "the time since the impact before": "since",
    "the slip speed": "slip",
    "the direction of slip": "slip",
    "the spin": "spin",
    "the sense of spin": "spin",
    "the time in the run": "time",
    "the first impacts of a run": "blows",
    "the run": "run",
    "the drive's phase": "phase",
    "the recording's time at the drive's frequency": "clock",
    "twice the azimuth": "azimuth",
    "three times the azimuth": "azimuth",
}
# A value of each run's own is asked for where so many runs have so many impacts each.
FEWEST_RUNS, FEWEST_IN_RUN = 3, 4
# What chance gains as seldom by the columns of all runs as by those of a pair, it may: this seldom.
SELDOM = 1e-3


def covariates(data: LawData) -> dict[str, Array]:
    """What a residual of an impact may go with, each centred and of unit spread unless it is an angle's cosine or
    sine.
    """
    seen = data.at.azimuth_rad - data.at.host_angle_rad
    plain = {
        "slip speed": np.abs(data.slip),
        "slip direction": np.sign(data.slip),
        "spin": np.abs(data.at.spin) / 100,
        "sense of spin": data.at.spin / 100,
        "time in the run": data.at.time_s,
        "first impacts": np.exp(-_impacts_before(data) / WORN_IN),
        "run": data.at.run.astype(float),
        "memory of the impact before": np.exp(-since_before(data) / MEMORY_S),
    }
    out = {name: standardised(values) for name, values in plain.items()}
    # Seconds of the recording at the drive's frequency: what another machine in step with the drive would follow.
    clock = data.at.drive_rad - data.at.drive_start_rad
    out.update({"cos clock": np.cos(clock), "sin clock": np.sin(clock)})
    out.update(
        {
            "cos drive phase": np.cos(data.at.drive_rad),
            "sin drive phase": np.sin(data.at.drive_rad),
            "cos 2 azimuth": np.cos(2 * seen),
            "sin 2 azimuth": np.sin(2 * seen),
            "cos 3 azimuth": np.cos(3 * seen),
            "sin 3 azimuth": np.sin(3 * seen),
        }
    )
    return out


def _impacts_before(data: LawData) -> Array:
    """How many impacts (K,) of its run were before each."""
    order = np.lexsort((data.at.time_s, data.at.run))
    _, first, number = np.unique(data.at.run[order], return_index=True, return_inverse=True)
    out = np.empty(len(order))
    out[order] = np.arange(len(order)) - first[number]
    return out


def standardised(values: Array) -> Array:
    """Centred, of unit spread; zero where they do not differ."""
    spread = np.std(values)
    return (values - values.mean()) / spread if spread > 1e-12 else np.zeros_like(values)


def run_columns(run: NDArray[np.int64]) -> Array | None:
    """One column for each run but the last (K, R - 1), each of mean zero; short runs stay with the last, None where too
    few are left."""
    numbers, counts = np.unique(run, return_counts=True)
    numbers = numbers[counts >= FEWEST_IN_RUN]
    if len(numbers) < FEWEST_RUNS:
        return None
    columns = (run[:, None] == numbers[:-1]).astype(float)
    return np.asarray(columns - columns.mean(0), float)


def runs_by_chance(columns: Array) -> float:
    """How much more chance gains by ``columns`` (K, C) than by a pair of them."""
    return float(chdtri(columns.shape[1], SELDOM) - chdtri(2, SELDOM))
