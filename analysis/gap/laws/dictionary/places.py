"""Forces that belong to a place or a line: pulls, tethers that are slack up to a length, drag in a patch, ridges,
steps, glued lines and corrugations of the floor."""

from __future__ import annotations

import math

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.modulated import WIDTHS, wave_along, wave_starts
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, PLACE_STEP, RigScales, lines, spots
from ovines.core.laws.terms import Factor, Term

# Lengths over the contact radius up to which a tether is slack.
SLACK = (0.35, 0.8, 1.3)
RIDGE_DIRECTIONS, RIDGE_PLACES, RIDGE_WIDTH = 8, (-0.6, -0.3, 0.0, 0.3, 0.6), 0.1
SPRING_DIRECTIONS = 8
EDGE_DIRECTIONS, EDGE_PLACES = 8, (-0.4, 0.0, 0.4)
# Lengths over the contact radius in which a force towards a side grows by e.
SIDE_LENGTHS = (0.4, 1.0)
TURN = 2 * math.pi


def place_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate of a place or a line."""
    every = (_pulls, _tethers, _springs, _ridges, _edges, _waves)
    return [candidate for each in every for candidate in each(scales)]


def _pulls(scales: RigScales) -> list[Candidate]:
    out, step = [], PLACE_STEP * scales.radius_m
    for where in ("room", "host"):

        def pull(x: float, y: float, width: float, where: str = where) -> tuple[Term, ...]:
            far = f"distance_in_{where}"
            factors = (Factor(far, x=x, y=y), Factor(far, "gaussian", 1.0, width, x, y))
            return (Term(f"from_place_in_{where}", 1.0, factors, x, y),)

        for x, y in spots(scales):
            for share in WIDTHS:
                numbers, steps = (x, y, share * scales.radius_m), (step, step, 0.2)
                name = f"pull of a place in the {where}"
                out.append(Candidate(name, pull, numbers, steps, (False, False, True)))
    return out


def _tethers(scales: RigScales) -> list[Candidate]:
    """A pull in proportion to the distance beyond a length: a string, a stop that yields."""
    out, step = [], PLACE_STEP * scales.radius_m
    for where in ("room", "host"):

        def tether(x: float, y: float, slack: float, where: str = where) -> tuple[Term, ...]:
            far = Factor(f"distance_in_{where}", "above", 1.0, slack, x, y)
            return (Term(f"from_place_in_{where}", 1.0, (far,), x, y),)

        for x, y in spots(scales):
            for share in SLACK:
                numbers, steps = (x, y, share * scales.radius_m), (step, step, 0.2)
                name = f"tether to a place in the {where}"
                out.append(Candidate(name, tether, numbers, steps, (False, False, True)))
    return out


def _springs(scales: RigScales) -> list[Candidate]:
    """What draws along one line only, evenly more along that: a magnet off to one side, a floor that is bowed one
    way."""
    out = []
    for where in ("room", "host"):

        def spring(angle: float, place: float, where: str = where) -> tuple[Term, ...]:
            return (Term("fixed_direction", 1.0, (Factor(f"along_{where}", x=place, y=angle),), x=angle),)

        steps, name = (ANGLE_STEP, PLACE_STEP * scales.radius_m), f"pull along a line of the {where}"
        out += [
            Candidate(name, spring, (0.5 * TURN * i / SPRING_DIRECTIONS, 0.0), steps, (False, False))
            for i in range(SPRING_DIRECTIONS)
        ]
    return out


def _ridges(scales: RigScales) -> list[Candidate]:
    step = PLACE_STEP * scales.radius_m

    def ridge(angle: float, place: float, width: float) -> tuple[Term, ...]:
        factors = (Factor("along_host", x=place, y=angle), Factor("along_host", "gaussian", 1.0, width, place, angle))
        return (Term("fixed_direction", 1.0, factors, x=angle),)

    def stair(angle: float, place: float, width: float) -> tuple[Term, ...]:
        # Up on one side of a line and never down: a floor of two plates.
        return (Term("fixed_direction", 1.0, (Factor("along_host", "gaussian", 1.0, width, place, angle),), x=angle),)

    def stream(angle: float, place: float, width: float) -> tuple[Term, ...]:
        # A band across the Host in which something blows: as a force, and as a drag beside it.
        across = Factor("along_host", "gaussian", 1.0, width, place, angle)
        return (
            Term("fixed_direction", 1.0, (across,), x=angle + 0.5 * math.pi),
            Term("along_velocity", 1.0, (Factor("speed"), across)),
        )

    def seam(angle: float, place: float, width: float) -> tuple[Term, ...]:
        # Held back against the way across a line, as hard at any speed: every crossing costs the same energy.
        across, near = (
            Factor("sliding_along", "sign", x=angle),
            Factor("along_host", "gaussian", 1.0, width, place, angle),
        )
        return (Term("fixed_direction", 1.0, (across, near), x=angle),)

    steps = (ANGLE_STEP, step, 0.2)
    out = []
    for angle, place in lines(RIDGE_DIRECTIONS, RIDGE_PLACES, scales):
        numbers = (angle, place, RIDGE_WIDTH * scales.radius_m)
        out.append(Candidate("ridge across the floor", ridge, numbers, steps, (False, False, True)))
        out.append(Candidate("step of the floor", stair, numbers, steps, (False, False, True)))
        out.append(Candidate("line that takes energy of what crosses it", seam, numbers, steps, (False, False, True)))
    for angle, place in lines(RIDGE_DIRECTIONS, EDGE_PLACES, scales):
        numbers = (angle, place, WIDTHS[0] * scales.radius_m)
        out.append(Candidate("stream across the floor", stream, numbers, steps, (False, False, True)))
    return out


def _edges(scales: RigScales) -> list[Candidate]:
    """A force of the room that grows from a line on, or ever faster towards one side, where what draws the disk is: the
    room was levelled with the disk in the middle."""
    step = PLACE_STEP * scales.radius_m

    def bank(angle: float, place: float) -> tuple[Term, ...]:
        return (Term("fixed_direction", 1.0, (Factor("along_host", "above", 1.0, place, 0.0, angle),), x=angle),)

    def side(angle: float, length: float) -> tuple[Term, ...]:
        near = Factor("along_host", "exponential", 1.0, length, 0.0, angle)
        return Term("fixed_direction", 1.0, (near,), x=angle), Term("fixed_direction", 1.0, x=angle)

    name, lengths = "force that grows towards a side", [share * scales.radius_m for share in SIDE_LENGTHS]
    return [
        *(
            Candidate("slope that begins at a line", bank, line, (ANGLE_STEP, step), (False, False))
            for line in lines(EDGE_DIRECTIONS, EDGE_PLACES, scales, TURN)
        ),
        *(
            Candidate(name, side, (TURN * i / EDGE_DIRECTIONS, length), (ANGLE_STEP, 0.2), (False, True))
            for i in range(EDGE_DIRECTIONS)
            for length in lengths
        ),
    ]


def _waves(scales: RigScales) -> list[Candidate]:
    """A floor of waves: its slope pushes along their direction."""

    def corrugated(angle: float, length: float) -> tuple[Term, ...]:
        return tuple(
            Term("fixed_direction", 1.0, (wave_along(one, angle, length, scales),), x=angle)
            for one in waves("along_host")
        )

    return [
        Candidate("corrugated floor", corrugated, wave, steps, (False, True)) for wave, steps in wave_starts(scales)
    ]
