"""Written laws in the simulator: their terms packed, the wall's lobes among them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ovines.core.effects.effect import with_floats, with_lobe
from ovines.core.laws.terms import Term, WrittenLaw, rows_of
from ovines.core.refusal import require
from ovines.core.system import parameters as P
from ovines.core.system.packed import Packed

DRIVE_QUANTITIES = ("phase", "clock")


def with_laws(packed: Packed, laws: Sequence[WrittenLaw]) -> Packed:
    """``packed`` with the terms of ``laws``; refuses a wall's law that is no sum of cosines of the azimuth, a law in
    step with a drive that has no frequency, and one of the measurement."""
    for law in laws:
        found = "a law of the measurement, and a simulation, which has no cameras"
        use = "use it with ovines diagnose --law, or in [model] of recording.toml"
        require(law.stage != "measurement", found, "laws of flights, impacts and the wall", use)
    terms = [term for law in laws for term in law.terms]
    for term in terms:
        if term.target == "contact_radius":
            packed = _with_radius(packed, term)
    if any(factor.quantity in DRIVE_QUANTITIES for term in terms for factor in term.factors):
        packed = _with_drive(packed)
    others = [term for term in terms if term.target != "contact_radius"]
    return replace(packed, law=rows_of(others)) if others else packed


def _with_radius(packed: Packed, term: Term) -> Packed:
    factors = term.factors
    fine = (
        len(factors) == 1
        and factors[0].quantity == "azimuth"
        and factors[0].function == "cosine"
        and factors[0].order == round(factors[0].order) >= 2
    )
    found = "a law of the contact radius that is no cosine of the azimuth"
    require(fine, found, "terms amplitude * cos(n (azimuth - x)) with n from 2 on", "leave it out of the simulation")
    return with_lobe(packed, term.coefficient / packed.p[P.CONTACT_RADIUS], factors[0].order, factors[0].x)


def _with_drive(packed: Packed) -> Packed:
    """Rate and phase of the sine along the axis that moves most."""
    plane = packed.drive[(packed.drive[:, 0] < 2) & (packed.drive[:, 2] > 0.0)]
    found = "a law in step with the drive, and a Host without harmonics"
    require(len(plane) > 0, found, "[host.drive] with a frequency", "give the drive as harmonics")
    main = plane[int(np.argmax(np.abs(plane[:, 1])))]
    phase = main[3] if main[1] >= 0.0 else main[3] + math.pi
    return with_floats(packed, {P.DRIVE_RATE: main[2], P.DRIVE_PHASE: phase})
