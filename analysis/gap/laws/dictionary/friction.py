"""How the floor's friction may differ beside what changes it as a whole: by directions, in its torque, off the mass
centre, in a band of sliding speeds."""

from __future__ import annotations

import math

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate
from analysis.gap.laws.dictionary.parts import RigScales, pair, plain, scaled
from ovines.core.laws.terms import Factor, Term

TARGET = "floor_friction"
# Middles and widths of a band of sliding speeds, over the usual speed, so near to each other that none lies between
# them (a narrow one did under a sweep, whose usual speed is that of its end); speeds at which friction changes at once.
BANDS, STEPS = (0.15, 0.25, 0.35, 0.45, 0.6, 0.75, 0.9, 1.1, 1.3, 1.5), (0.3, 0.6, 1.0)
BAND_WIDTHS = (0.07, 0.15)


def friction_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate for a change of the floor's friction, as a share of it, that :mod:`modulated` does not hold."""
    return [*_directions(), *_bands(scales)]


def _directions() -> list[Candidate]:
    out = [plain("torque of the floor's friction", Term("floor_torque", 1.0))]
    mirrored = pair("mirrored_floor_friction", 0.25 * math.pi)
    out.append(plain("friction that acts off the mass centre", *pair("floor_lever", QUARTER)))
    # Marks around the Host's centre hold what slides across them.
    for word, factors in (("", ()), (" with the radius", (Factor("radius"),))):
        out.append(plain(f"friction along the radius and across it{word}", Term("polar_floor_friction", 1.0, factors)))
    return [*out, plain("friction that differs by direction", *mirrored)]


def _bands(scales: RigScales) -> list[Candidate]:
    """Friction that differs in a band of sliding speeds, as where the disk chatters, or from a speed on, as where it
    floats up."""

    def band(speed: float, width: float) -> tuple[Term, ...]:
        return (Term(TARGET, 1.0, (Factor("sliding_speed", "gaussian", 1.0, width, speed),)),)

    unit, steps = scales.speed_m_per_s, (0.1 * scales.speed_m_per_s, 0.2)
    below, sizes = ("sliding_speed", "below", 1.0), [share * unit for share in STEPS]
    return scaled("friction below a sliding speed", TARGET, below, sizes) + [
        Candidate("friction in a band of sliding speeds", band, (share * unit, width * unit), steps, (False, True))
        for share in BANDS
        for width in BAND_WIDTHS
    ]
