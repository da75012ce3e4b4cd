"""Effects of shape and place: the wall's form and centre, the disk's centre of mass and marker."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ovines.core.effects.effect import Effect, EffectParameter, Seen, Values, with_floats, with_lobe
from ovines.core.refusal import require
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed

INF = math.inf


def _ellipticity(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.ELLIPTICITY: values["ellipticity"], P.ELLIPSE_DIRECTION: values["direction_rad"]})


def _wall_centre(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.WALL_X: values["x_m"], P.WALL_Y: values["y_m"]})


def _mass_centre(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.MASS_X: values["x_m"], P.MASS_Y: values["y_m"]})


def _inertia(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.INERTIA: packed.p[P.INERTIA] * values["ratio"]})


def _lobes(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    order, size = values["order"], values["amplitude"]
    require(order == int(order), f"effects.wall_lobes.order = {order:g}", "a whole number of lobes, 3 or more",
            "correct order")  # fmt: skip
    require(scenario.host.polygon_m is None, "effects.wall_lobes on flat walls", "a round wall", "leave it out")
    # The curvature 1 + (n^2 - 1) a cos n(..) must stay positive: the disk touches one place at a time.
    bends = f"effects.wall_lobes.amplitude = {size:g} at order {order:g}, a wall that bends inwards"
    require(abs(size) * (order**2 - 1) < 1, bends, f"less than {1 / (order**2 - 1):.3g}", "make it smaller")
    return with_lobe(packed, size, order, values["direction_rad"])


def _centre_marker(shown: Seen, values: Values, rng: np.random.Generator) -> Seen:
    samples = shown.samples
    seen = samples.copy()
    cosine, sine = np.cos(samples[:, 4]), np.sin(samples[:, 4])
    dx = cosine * values["x_m"] - sine * values["y_m"]
    dy = sine * values["x_m"] + cosine * values["y_m"]
    seen[:, 0] += dx
    seen[:, 1] += dy
    seen[:, 2] -= samples[:, 5] * dy
    seen[:, 3] += samples[:, 5] * dx
    return replace(shown, samples=seen)


def _offset(name: str) -> EffectParameter:
    return EffectParameter(name, "m", -INF, INF, 0.0)


GEOMETRY_EFFECTS = (
    Effect(
        "wall_ellipticity", "geometry",
        (
            EffectParameter("ellipticity", "1", -0.2, 0.2),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0),
        ),
        "Contact radius R_c (1 + e cos 2(azimuth - phi)), fixed in the Host; a ring squeezed by its screws.",
        _ellipticity,
    ),
    Effect(
        "wall_lobes", "geometry",
        (
            EffectParameter("amplitude", "1", -0.1, 0.1),
            EffectParameter("order", "1", 3.0, 24.0, 3.0),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0),
        ),
        "Contact radius R_c (1 + a cos n(azimuth - phi)), n = 3 or more lobes, fixed in the Host; a ring held by three "
        "screws, or turned in a three-jaw chuck.",
        _lobes,
    ),
    Effect(
        "wall_centre_offset", "geometry", (_offset("x_m"), _offset("y_m")),
        "The wall's centre in the Host's frame is not the origin that the markers' layout says.",
        _wall_centre,
    ),
    Effect(
        "mass_centre_offset", "geometry", (_offset("x_m"), _offset("y_m")),
        "Centre of mass off the geometric centre, fixed in the disk; floor friction acts at the geometric centre. "
        "Couples spin and sliding in flight and at impact.",
        _mass_centre,
    ),
    Effect(
        "inertia_error", "geometry", (EffectParameter("ratio", "1", 0.05, 20.0),),
        "The disk's moment of inertia is the stated q m R^2 times ratio: a hole, markers, a rim. Impacts that stick "
        "and the floor turn it more or less.",
        _inertia,
    ),
    Effect(
        "centre_marker_offset", "geometry", (_offset("x_m"), _offset("y_m")),
        "The marker taken for the disk's centre is off it, fixed in the disk: the reported centre circles with the "
        "spin.",
        observe=_centre_marker,
    ),
)  # fmt: skip
