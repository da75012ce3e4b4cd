"""Written laws in the simulator: their terms packed, the wall's lobes among them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ovines.core.effects.effect import with_floats, with_lobe
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.memory import memory_units
from ovines.core.laws.terms import Term, WrittenLaw, asks_for_way, rows_of
from ovines.core.refusal import require
from ovines.core.system import parameters as P
from ovines.core.system.packed import Packed

DRIVE_QUANTITIES = ("phase", "clock")
# A wall's law as a sum of cosines: orders from an oval on, up to this one (a step is then as steep as 0.1 of a turn's
# radius, 5 degrees), none smaller than this share of the largest; azimuths at which it is asked.
LEAST_ORDER, MOST_ORDER, LEAST_WAVE, SAMPLES = 2, 36, 1e-4, 4096


def with_laws(packed: Packed, laws: Sequence[WrittenLaw]) -> Packed:
    """``packed`` with the terms of ``laws``; refuses a wall's law that follows more than the azimuth, a law in step
    with a drive that has no frequency, one that turns blows of contacts that last, and one of the measurement."""
    for law in laws:
        found = "a law of the measurement, and a simulation, which has no cameras"
        use = "use it with ovines diagnose --law, or in [model] of recording.toml"
        require(law.stage != "measurement", found, "laws of flights, impacts and the wall", use)
    terms = [term for law in laws for term in law.terms]
    turns = any(term.target == "contact_normal" for term in terms) and packed.p[P.CONTACT_DURATION] > 0.0
    found = "a law that turns blows, and contacts that last (effects.finite_contact_time)"
    require(not turns, found, "impacts in an instant where blows are turned", "leave one of them out")
    for term in terms:
        if term.target == "contact_radius":
            packed = _with_radius(packed, term)
    if any(factor.quantity in DRIVE_QUANTITIES for term in terms for factor in term.factors):
        packed = _with_drive(packed)
    others = [term for term in terms if term.target != "contact_radius"]
    if not others:
        return packed
    rows = rows_of(others)
    return replace(_with_way(packed) if asks_for_way(rows) else packed, law=rows)


def _with_way(packed: Packed) -> Packed:
    """The disk remembers its way over the floor, by the contact radius (of a polygon, by its farthest corner)."""
    length_m, time_s = memory_units(packed.p[P.CONTACT_RADIUS] or packed.p[P.LENGTH])
    return with_floats(packed, {P.MEMORY_M: length_m, P.MEMORY_S: time_s})


def _with_radius(packed: Packed, term: Term) -> Packed:
    """The round wall with what ``term`` adds to its contact radius, any function of the azimuth: a cosine as it is,
    others as the sum of their first cosines, a constant as the radius and one turn as the wall's centre."""
    found = "a law of the contact radius that follows more than the azimuth"
    fine = bool(term.factors) and all(one.quantity == "azimuth" for one in term.factors)
    require(fine, found, "a wall that stands still in the Host", "leave it out of the simulation")
    factor, radius_m = term.factors[0], packed.p[P.CONTACT_RADIUS]
    whole = factor.order == round(factor.order) >= LEAST_ORDER
    if len(term.factors) == 1 and factor.function == "cosine" and factor.scale == 1.0 and whole:
        return with_lobe(packed, term.coefficient / radius_m, factor.order, factor.x)
    waves = _series(term)
    packed = with_floats(
        packed,
        {
            P.CONTACT_RADIUS: radius_m + waves[0].real,
            P.WALL_X: packed.p[P.WALL_X] + waves[1].real,
            P.WALL_Y: packed.p[P.WALL_Y] - waves[1].imag,
        },
    )
    free = P.MOST_LOBES - int(packed.p[P.LOBES])
    size = np.abs(waves)
    for order in range(LEAST_ORDER, min(len(waves), LEAST_ORDER + free)):
        if size[order] > LEAST_WAVE * size[LEAST_ORDER:].max():
            direction = float(-np.angle(waves[order])) / order
            packed = with_lobe(packed, float(size[order]) / radius_m, float(order), direction)
    return packed


def _series(term: Term) -> NDArray[np.complex128]:
    """Coefficients c_n (m) of ``term`` = sum of Re(c_n exp(i n azimuth)) up to :data:`MOST_ORDER`, smoothed so that a
    step does not ring (Lanczos' factors)."""
    azimuth = np.arange(SAMPLES) * 2 * math.pi / SAMPLES
    known, value = np.zeros((SAMPLES, W.KNOWN_SIZE)), np.empty((SAMPLES, 1))
    known[:, W.HX], known[:, W.HY] = np.cos(azimuth), np.sin(azimuth)
    sizes(rows_of([term]), known, value)
    waves = np.fft.rfft(value[:, 0])[: MOST_ORDER + 1] * 2 / SAMPLES
    waves[0] *= 0.5
    return np.asarray(waves * np.sinc(np.arange(MOST_ORDER + 1) / (MOST_ORDER + 1)), np.complex128)


def _with_drive(packed: Packed) -> Packed:
    """Rate and phase of the sine along the axis that moves most."""
    plane = packed.drive[(packed.drive[:, P.AXIS] < 2) & (packed.drive[:, P.OMEGA] > 0.0)]
    found = "a law in step with the drive, and a Host without harmonics"
    require(len(plane) > 0, found, "[host.drive] with a frequency", "give the drive as harmonics")
    main = plane[int(np.argmax(np.abs(plane[:, P.AMPLITUDE])))]
    phase = main[P.PHASE] if main[P.AMPLITUDE] >= 0.0 else main[P.PHASE] + math.pi
    return with_floats(packed, {P.DRIVE_RATE: main[P.OMEGA], P.DRIVE_PHASE: phase})
