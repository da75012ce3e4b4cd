"""A drive whose frequency drifts from run to run against what was asked: the oscillator of the cameras, or that of the
shaker; only what has a time of its own can say which.

What is alike in all runs is the library's ``frame_rate_error``; what goes with the run is a law of the clock that all
cameras share, about the middle run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from analysis.gap.cause import SMALLEST_P, Structure
from analysis.gap.drive.findings import DriveSteps
from analysis.gap.laws.dictionary.candidate import named_numbers
from analysis.gap.laws.evidence import Evidence
from analysis.gap.laws.found_law import LawFound, in_world
from analysis.gap.laws.regression.halves import Halves
from analysis.gap.series import Series
from analysis.gap.thresholds import NEGLIGIBLE
from analysis.motion.drive import BY_CHANCE
from ovines.core.laws.terms import Factor, Term, WrittenLaw

Array = NDArray[np.float64]
FEWEST_RUNS = 4
GOES_WITH = (
    "the run: the drive's frequency drifts against the asked one (the cameras' clock or the shaker's; only what has a "
    "time of its own can say which)"
)


@dataclass(frozen=True, eq=False)
class Drift:
    """Shares (R,) by which drives were seen faster than asked in runs ``number`` (R,); their ``slope`` per run about
    the run ``middle`` with its ``sd``, ``left`` (R,) of them about that line, and ``p`` by chance."""

    number: Array
    share: Array
    slope: float
    sd: float
    middle: float
    left: Array
    p: float


def frequency_drift(series: Series, drive: DriveSteps) -> Drift | None:
    """The drift where it is surely there (Student's t of the slope over the runs) and no frame rate would be negligible
    that is as far off; None else, and where fewer than four runs have a drive of lines whose frequency was asked for.

    A sweep or a random drive has no one frequency to compare."""
    with_lines = [path.run for path in drive.paths if path.tells_lines]
    pairs = [
        (run, series.runs[run].data.host.frequency_hz / excitation.frequency_hz - 1)
        for run in with_lines
        if (excitation := series.recordings[run].excitation) is not None
        and excitation.frequency_hz
        and series.runs[run].data.host.omega_rad_per_s > 0
    ]
    return drift_of(*np.array(pairs, float).T) if len(pairs) >= FEWEST_RUNS else None


def drift_of(number: Array, share: Array) -> Drift | None:
    """That of the shares (R,) in runs ``number`` (R,)."""
    middle = float(number.mean())
    along = number - middle
    square = float(along @ along)
    slope = float(along @ share) / square
    left = share - share.mean() - slope * along
    free = len(number) - 2
    sd = float(np.sqrt(left @ left / free / square))
    p = max(2 * float(stdtr(free, -abs(slope) / max(sd, 1e-300))), SMALLEST_P)
    if not (p < BY_CHANCE and abs(slope) * float(np.std(along)) > NEGLIGIBLE["frame_rate_error"]):
        return None
    return Drift(number, share, slope, sd, middle, left, p)


def drifting_clock_law(series: Series, drive: DriveSteps) -> tuple[LawFound, Structure] | None:
    """The drift as a law of the clock, which makes the drive's frequency the same in all runs, and the structure
    that it stands for."""
    drift = frequency_drift(series, drive)
    if drift is None:
        return None
    term = Term("clock_delay", drift.slope, (Factor("time"), Factor("run", x=drift.middle)), sd=drift.sd)
    law = WrittenLaw((term,))
    world_law = in_world(law, series.frame)
    before, after = (_by_run(squares, drift, series) for squares in _squares(drift))
    sds = {"coefficient": drift.sd}
    numbers = {name: (value, sds.get(name, 0.0), unit) for name, (value, unit) in named_numbers(world_law).items()}
    noise = np.full(len(drift.number), float(drift.left @ drift.left) / (len(drift.number) - 2))
    floor = _by_run(noise, drift, series) * min(1.0, float(after.sum() / noise.sum()))
    size = abs(drift.slope) * float(np.std(drift.number))
    found = LawFound(law=world_law, rig_law=law, numbers=numbers, p=drift.p, before=before, after=after, floor=floor,
                     others=(), evidence=_evidence(drift, series), halves=_halves(drift), size=size)  # fmt: skip
    least = NEGLIGIBLE["frame_rate_error"]
    gain = len(drift.number) * float(np.log(before.sum() / max(after.sum(), 1e-300)))
    return found, Structure("measurement", "all", "x", GOES_WITH, size / least, gain, size, "1", drift.p)


def _evidence(drift: Drift, series: Series) -> Evidence:
    """How late all cameras are at the end of a usual run, by the run."""
    run_s = float(np.median([np.ptp(run.data.time_s) for run in series.runs]))
    line = drift.slope * (drift.number - drift.middle)
    sd = np.full(len(line), float(np.sqrt(drift.left @ drift.left / (len(line) - 2))))
    return Evidence(
        "run", "1", "clock_delay", "s", drift.number,
        run_s * (drift.left + line), run_s * sd, run_s * drift.left, run_s * sd, run_s * line,
    )  # fmt: skip


def _squares(drift: Drift) -> tuple[Array, Array]:
    """Squares (R,) of what runs held out are off the mean of the others, and off their line."""
    count = len(drift.number)
    along = drift.number - drift.middle
    lever = 1 / count + along**2 / float(along @ along)
    return ((drift.share - drift.share.mean()) * count / (count - 1)) ** 2, (drift.left / (1 - lever)) ** 2


def _by_run(values: Array, drift: Drift, series: Series) -> Array:
    out = np.zeros(len(series.runs))
    out[drift.number.astype(int)] = values
    return out


def _halves(drift: Drift) -> Halves:
    """The slope by every second run, over that of all."""
    spread = float(np.sqrt(drift.left @ drift.left / (len(drift.number) - 2)))
    sizes, sds = [], []
    for first in (0, 1):
        along = drift.number[first::2] - drift.number[first::2].mean()
        square = float(along @ along)
        sizes.append(float(along @ drift.share[first::2]) / square / drift.slope)
        sds.append(spread / np.sqrt(square) / abs(drift.slope))
    return Halves((sizes[0], sizes[1]), (sds[0], sds[1]))
