"""A camera whose instant follows what goes on: one that sets its exposure by the light that it sees, a trigger that the
shaker pulls.

Such a delay is nil on average, and alike in all parts of a run: no mean tells it.  What two views miss each other by is
asked for it frame by frame, in every series, of a short list; where that finds something, every form competes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.choice.shortlist import AS_GOOD
from analysis.gap.laws.dictionary.candidate import Candidate, ways
from analysis.gap.laws.dictionary.modulated import RANGES
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, PLACE_STEP, SCALE_STEP, plain, rings
from analysis.gap.laws.frames.evidence.clock import clock_rows
from analysis.gap.laws.frames.evidence.rows import size_of, view_rows
from analysis.gap.series import Series
from analysis.gap.thresholds import NEGLIGIBLE_FRAMES
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
TARGET = "camera_delay"
# Directions of a lamp and places over the contact radius from which on it tells, within which its light saturates;
# places and width of a spot that it lights, the same.
LAMPS, EDGES, BENDS, SPOTS, SPOT = 8, (-0.3, 0.0, 0.3), (0.25, 0.6), ((0.0, 1), (0.6, 6)), 0.3
# What a delay of one of two cameras leaves in their mean.
OF_MEAN = 0.5


def delay_candidates(known: Array, camera: int) -> list[Candidate]:
    """Every candidate for a delay of a ``camera`` that follows where and how fast disk and Host go."""
    radius_m = float(np.median(known[:, W.CONTACT_RADIUS]))
    return [*_ways(camera), *_in_host(radius_m, camera)]


def _terms(camera: int, *factors: Factor) -> tuple[Term, ...]:
    return tuple(Term(TARGET, 1.0, (factor,), x=float(camera)) for factor in factors)


def _ways(camera: int) -> list[Candidate]:
    """What has no numbers inside."""
    place, of_host = ways("along_host"), ways("host_place_along")
    forms = {
        "the disk's place in the Host": place,
        "the Host's place": of_host,
        "the disk's place in the room": (*place, *of_host),
        "the disk's velocity": ways("velocity_along"),
        "the disk's speed": (Factor("speed"),),
        "the disk's speed squared": (Factor("speed", "power", 2.0),),
        "the disk's spin": (Factor("spin"),),
        "the size of its spin": (Factor("spin", "absolute_power"),),
        "the Host's velocity": ways("host_velocity_along"),
        "the Host's speed": (Factor("host_speed"),),
        "the Host's acceleration": ways("host_acceleration_along"),
    }
    # A Host that moves along its drive alone says nothing of another direction.
    for what in ("place", "velocity", "acceleration"):
        forms[f"the Host's {what} along the drive"] = (Factor(f"host_{what}_along"),)
    forms |= {f"the radius to the power {n:g}": (Factor("radius", "power", n),) for n in (1.0, 2.0, 4.0)}
    return [plain(f"delay of a camera, with {name}", *_terms(camera, *factors)) for name, factors in forms.items()]


def _in_host(radius_m: float, camera: int) -> list[Candidate]:
    """With what is bright about a part of the Host: near the wall, on one side of a line, at a place."""

    def near(scale: float) -> tuple[Term, ...]:
        return _terms(camera, Factor("gap", "exponential", 1.0, scale))

    def beyond(angle: float, place: float) -> tuple[Term, ...]:
        return _terms(camera, Factor("along_host", "above", 1.0, place, 0.0, angle))

    def side(angle: float, place: float) -> tuple[Term, ...]:
        return _terms(camera, Factor("along_host", "below", 1.0, place, 0.0, angle))

    def saturating(angle: float, scale: float) -> tuple[Term, ...]:
        return _terms(camera, Factor("along_host", "tanh", 1.0, scale, 0.0, angle))

    def spot(x: float, y: float, width: float) -> tuple[Term, ...]:
        return _terms(camera, Factor("distance_in_host", "gaussian", 1.0, width, x, y))

    step, word = PLACE_STEP * radius_m, "delay of a camera"
    out = [Candidate(f"{word}, near the wall", near, (share * radius_m,), (SCALE_STEP,), (True,)) for share in RANGES]
    edges = [(2 * math.pi * i / LAMPS, share * radius_m) for i in range(LAMPS) for share in EDGES]
    for make, name in ((beyond, "from a line in the Host on"), (side, "on one side of a line in the Host")):
        out += [Candidate(f"{word}, {name}", make, edge, (ANGLE_STEP, step), (False, False)) for edge in edges]
    wide = [(math.pi * i / LAMPS, share * radius_m) for i in range(LAMPS) for share in BENDS]
    name, steps, positive = "saturating along a direction of the Host", (ANGLE_STEP, SCALE_STEP), (False, True)
    out += [Candidate(f"{word}, {name}", saturating, one, steps, positive) for one in wide]
    places = [(x, y, SPOT * radius_m) for x, y in rings(SPOTS, radius_m)]
    name, around = "about a place in the Host", (step, step, 0.2)
    return out + [Candidate(f"{word}, {name}", spot, at, around, (False, False, True)) for at in places]


def delay_follows(series: Series) -> bool:
    """Whether two views say that a camera's delay follows where disk or Host go, more surely than chance, and by more
    than is negligible."""
    rows = view_rows(series, (TARGET,))
    if rows is None:
        return False
    # Draws of its own: what a series without such a delay is asked for later does not change.
    rng = np.random.default_rng(len(series.runs))
    found, _ = find_law(rows.problem, rows.columns, delay_candidates(rows.known, 1), rng, most_parts=1)
    if found is None:
        return False
    return float(np.std(size_of(found.terms, rows.known) @ found.coefficients)) > least_delay_s(series)


def least_delay_s(series: Series) -> float:
    """RMS of a camera's delay that is not worth a law: half of it is in the mean of two views, where it is felt as
    frames at scattered times are."""
    return NEGLIGIBLE_FRAMES["trigger_jitter"] * series.period_s / OF_MEAN


def late_camera(series: Series, terms: Sequence[Term]) -> int:
    """The number of the camera whose delay is that of ``terms``, which say it of the second against the first.

    Two views say how they miss each other only.  But their mean is late by half of it, or early: the Host's path beside
    its drive then goes with the delay times the Host's velocity, one way or the other.  The second where that does not
    tell."""
    rows = clock_rows(series)
    if rows is None:
        return 1
    late = rows.columns([replace(term, target="clock_delay", x=0.0) for term in terms]).sum(1)
    early = -4.0 * OF_MEAN * float(late @ rows.problem.residual)  # by how much the first is likelier, in 2 log L
    # A form that bends where the path does not makes either worse than no delay: then it says nothing of which.
    closer = 0.5 * early > OF_MEAN**2 * float(late @ late)
    return 0 if closer and early > AS_GOOD * rows.problem.excess else 1
