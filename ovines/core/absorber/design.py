"""The best NES for a Host and its drive: numbers searched for, with confidence, beside a tuned mass damper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ovines.core.absorber.linear import TunedMassDamper, ground_amplitude_m, tuned_mass_damper
from ovines.core.absorber.response import Response, frequency_response
from ovines.core.absorber.sprung import designed, suspension_of
from ovines.core.ensemble import ALL_CORES, Workers
from ovines.core.refusal import ScenarioError
from ovines.core.system.model import Scenario

BOOTSTRAPS = 2000
FINER = 4  # frequencies of the damper's own curve per frequency of the band


@dataclass(frozen=True)
class Candidate:
    """A NES: its ``numbers`` by name, the largest amplitude of the Host over the band (``level_m``, mean of the runs,
    90 % from ``low_m`` to ``high_m``), ``best`` the share of resampled ensembles in which it is the best of those kept
    (NaN: it was only tried), and its ``response``.
    """

    numbers: dict[str, float]
    level_m: float
    low_m: float
    high_m: float
    best: float
    response: Response


@dataclass(frozen=True)
class Design:
    """``kept``, the best first; all ``tried``; the largest amplitude of the ``bare_m`` Host over the band, and with the
    optimal tuned mass ``damper`` of the best one's mass (``damper_m``; along x, y where the ground shakes).
    """

    kept: tuple[Candidate, ...]
    tried: tuple[Candidate, ...]
    bare_m: float
    damper_m: float
    damper: tuple[TunedMassDamper, ...]


@dataclass(frozen=True)
class Search:
    """How thoroughly a design is sought: so many ``candidates`` are tried with a fourth of the ``runs``, the ``keep``
    best again with all; ``transient`` and ``periods`` as :func:`frequency_response` has them.
    """

    candidates: int = 64
    keep: int = 6
    runs: int = 24
    transient: int = 60
    periods: int = 40


USUAL = Search()


def design(
    scenario: Scenario,
    over: Mapping[str, tuple[float, float]],
    factors: Sequence[float] | np.ndarray,
    rng: np.random.Generator,
    search: Search = USUAL,
    workers: Workers = ALL_CORES,
) -> Design:
    """Numbers of the NES that keep the Host's largest amplitude over a band of frequencies smallest.

    Parameters
    ----------
    scenario
        A sprung Host over a shaken ground; its own NES is the first candidate.
    over
        Ranges by name (``clearance_m``, ``mass_ratio``, ``restitution``, ``floor_friction``, ``wall_friction`` ...).
    factors
        The band, in the scenario's own frequency.
    rng
        For candidates (a scrambled Sobol sequence) and starts.
    search
        How many candidates, runs and periods.

    Returns
    -------
    Design

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.core.absorber.design import Search, design
    >>> from ovines.notebook import read_scenario
    >>> host, over, band = read_scenario("sprung-host"), {"mass_ratio": (0.02, 0.2)}, [0.95, 1.0]
    >>> few = Search(candidates=2, keep=1, runs=4, transient=5, periods=5)  # far too few for a real search
    >>> found = design(host, over, band, np.random.default_rng(0), few)
    >>> len(found.tried), found.kept[0].level_m < found.bare_m
    (3, True)
    """
    from scipy.stats import qmc

    suspension_of(scenario)
    candidates, keep, runs = search.candidates, search.keep, search.runs
    if not over or candidates < 1 or keep < 1 or runs < 4:
        raise ScenarioError(f"{len(over)} ranges, {candidates} candidates, {keep} kept, {runs} runs",
                         "a range, candidates, and at least four runs", "give more")  # fmt: skip
    for name, (low, high) in over.items():
        if not (np.isfinite([low, high]).all() and low < high):
            raise ScenarioError(f"{name} from {low:g} to {high:g}", "a range", "correct it")
    low, high = np.array(list(over.values())).T
    points = low + (high - low) * qmc.Sobol(len(over), rng=rng).random(candidates)
    numbers = [{}, *(dict(zip(over, map(float, point), strict=True)) for point in points)]

    def answer(one: dict[str, float], count: int) -> Response:
        made = designed(scenario, one)
        return frequency_response(made, factors, count, rng, search.transient, search.periods, workers)

    tried = [_candidate(one, answer(one, max(runs // 4, 1)), np.nan, rng) for one in numbers]
    best = sorted(tried, key=lambda one: one.level_m)[:keep]
    again = [answer(one.numbers, runs) for one in best]
    drawn = np.array([_resampled(response, rng) for response in again])
    share = np.bincount(np.argmin(drawn, axis=0), minlength=len(best)) / drawn.shape[1]
    kept = [_candidate(one.numbers, r, float(b), rng) for one, r, b in zip(best, again, share, strict=True)]
    kept.sort(key=lambda one: one.level_m)
    size = ground_amplitude_m(scenario)
    frequency = kept[0].response.frequency_hz
    fine = (
        np.linspace(frequency.min(), frequency.max(), FINER * (len(frequency) - 1) + 1)
        if len(frequency) > 1
        else frequency
    )
    heavy = designed(scenario, kept[0].numbers).nes.mass_kg
    dampers = tuple(tuned_mass_damper(scenario, axis, heavy, fine) for axis in range(2) if size[axis] > 0.0)
    gains = np.array([one.gain for one in dampers]) * size[size > 0.0]
    bare = np.linalg.norm(kept[0].response.bare_m, axis=1).max()
    return Design(tuple(kept), tuple(tried), float(bare), float(np.linalg.norm(gains)), dampers)


def _resampled(response: Response, rng: np.random.Generator) -> np.ndarray:
    """Largest mean amplitude over the band in resampled ensembles (BOOTSTRAPS,)."""
    levels = response.level_m()
    n, runs = levels.shape
    chosen = rng.integers(0, runs, size=(BOOTSTRAPS, n, runs))
    means = levels[np.arange(n)[None, :, None], chosen].mean(axis=2)
    return means.max(axis=1)


def _candidate(numbers: dict[str, float], response: Response, best: float, rng: np.random.Generator) -> Candidate:
    low, high = np.percentile(_resampled(response, rng), [5.0, 95.0])
    level = float(response.level_m().mean(axis=1).max())
    return Candidate(numbers, level, float(low), float(high), best, response)
