"""Effects of shape and place: the wall's form and centre, the disk's centre of mass and marker."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ovines.core.effects.effect import (
    Effect,
    EffectParameter,
    Measurement,
    Values,
    VectorRows,
    Words,
    with_floats,
    with_lobe,
)
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


def _centre_marker(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
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


def _offset(name: str, row: str = "", times: float = 1.0) -> EffectParameter:
    return EffectParameter(name, "m", -INF, INF, 0.0, row, times)


GEOMETRY_EFFECTS = (
    Effect(
        "wall_ellipticity", "geometry",
        (
            EffectParameter("ellipticity", "1", -0.2, 0.2),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0),
        ),
        "Contact radius R_c (1 + e cos 2(azimuth - phi)), fixed in the Host; a ring squeezed by its screws.",
        Words(
            "Oval wall",
            "the wall is not round",
            "Measure the ring's diameter along and across with calipers, and turn the ring by 45 degrees for one run.",
        ),
        _ellipticity,
        rows=VectorRows(("wall_ellipticity_cos", "wall_ellipticity_sin"), turns=2),
        views=(("distance", "azimuth in the room"), ("distance", "approach speed")),
    ),
    Effect(
        "wall_lobes", "geometry",
        (
            EffectParameter("amplitude", "1", -0.1, 0.1, row="wall_lobe_amplitude"),
            EffectParameter("order", "1", 3.0, 24.0, 3.0, row="wall_lobe_order"),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0, row="wall_lobe_direction_rad"),
        ),
        "Contact radius R_c (1 + a cos n(azimuth - phi)), n = 3 or more lobes, fixed in the Host; a ring held by three "
        "screws, or turned in a three-jaw chuck.",
        Words(
            "Lobed wall",
            "the wall bulges at three or more places",
            "Turn the ring in its mount by half a lobe for one run, and measure its diameter with calipers all "
            "round: of an odd number of lobes the diameter shows nothing, a dial gauge on a rotary table does.",
        ),
        _lobes,
        views=(("distance", "azimuth in the Host"), ("distance", "approach speed")),
    ),
    Effect(
        "wall_centre_offset", "geometry", (_offset("x_m", "wall_centre_x_m"), _offset("y_m", "wall_centre_y_m")),
        "The wall's centre in the Host's frame is not the origin that the markers' layout says.",
        Words(
            "Wall centre off the markers' centre",
            "the wall is not where the Host's layout says",
            "Fit the wall's edge in the images (or touch it with a marked disk at four places) and compare with the "
            "markers' circle.",
        ),
        _wall_centre,
        views=(("distance", "azimuth in the Host"), ("distance", "azimuth in the disk")),
    ),
    Effect(
        "mass_centre_offset", "geometry",
        (_offset("x_m", "disk_centre_x_m", -1.0), _offset("y_m", "disk_centre_y_m", -1.0)),
        "Centre of mass off the geometric centre, fixed in the disk; floor friction acts at the geometric centre. "
        "Couples spin and sliding in flight and at impact.",
        Words(
            "Mass centre off the disk's centre",
            "the disk is not balanced",
            "Spin the disk freely on the floor: the marker circle's centre wobbles about the mass centre at the "
            "spin's rate.",
        ),
        _mass_centre,
        views=(("distance", "azimuth in the disk"), ("distance", "azimuth in the Host")),
    ),
    Effect(
        "inertia_error", "geometry", (EffectParameter("ratio", "1", 0.05, 20.0, row="inertia_ratio"),),
        "The disk's moment of inertia is the stated q m R^2 times ratio: a hole, markers, a rim. Impacts that stick "
        "and the floor turn it more or less.",
        Words(
            "Inertia of the disk",
            "impulses turn the disk more or less than its stated inertia says",
            "Hang the disk on three threads and time its swings about its axis: their period gives the inertia; a "
            "caliper its radius, whose error looks alike.",
        ),
        _inertia,
        views=(("angular", "tangential impulse"), ("angular", "spin before")),
    ),
    Effect(
        "centre_marker_offset", "geometry", (_offset("x_m"), _offset("y_m")),
        "The marker taken for the disk's centre is off it, fixed in the disk: the reported centre circles with the "
        "spin.",
        Words(
            "Centre marker off the disk's centre",
            "the marker at the centre is not at the centre",
            "Spin the disk by hand under one camera: the centre marker draws a circle of the offset's radius.",
        ),
        observe=_centre_marker,
    ),
)  # fmt: skip
