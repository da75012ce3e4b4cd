"""The laws that a plant may follow: for each, what it changes of a rig that follows ours.

A change is a dict of fields of :class:`kernel.Physics`, drawn in the rig's own units: ``speed`` is the Host's top
speed, ``weight`` what the floor's friction decelerates with, ``reach`` the contact radius.  Two more keys are none of
Physics' fields: ``gust_m_per_s2`` (RMS of a random acceleration) with ``gust_s`` (its correlation time), and
``vertical_g`` (out-of-plane acceleration that nobody measures, over g).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Draw = Callable[[np.random.Generator, float, float, float], dict[str, float]]


@dataclass(frozen=True)
class Law:
    """``friction_known``: one number is the floor's friction; else it has no single true value.  ``restitution_known``
    likewise.

    ``frame_rate_hz``: what the law is filmed with whatever the rig; None as the rig asks.
    """

    draw: Draw
    friction_known: bool = True
    restitution_known: bool = True
    frame_rate_hz: float | None = None


def _ours(rng, speed, weight, reach):
    return {}


def _coulomb(rng, speed, weight, reach):
    return {"coupling": 0.0, "spin_decay_per_s": rng.uniform(0.5, 4.0)}


def _stribeck(rng, speed, weight, reach):
    return {"static_share": rng.uniform(0.5, 1.5), "static_m_per_s": speed * rng.uniform(0.1, 0.4)}


def _spin_decay(rng, speed, weight, reach):
    return {"spin_decay_per_s": rng.uniform(1.0, 6.0)}


def _patch(rng, speed, weight, reach):
    far, azimuth = reach * rng.uniform(0.2, 0.6), rng.uniform(0.0, 2 * np.pi)
    return {
        "patch_share": rng.uniform(1.0, 2.5),
        "patch_x_m": far * np.cos(azimuth),
        "patch_y_m": far * np.sin(azimuth),
        "patch_width_m": reach * rng.uniform(0.15, 0.3),
    }


def _gusts(rng, speed, weight, reach):
    return {"gust_m_per_s2": weight * rng.uniform(0.1, 0.4), "gust_s": rng.uniform(0.02, 0.08)}


def _eccentric(rng, speed, weight, reach):
    far, azimuth = 0.2 * reach * rng.uniform(0.03, 0.1), rng.uniform(0.0, 2 * np.pi)
    return {"mass_x_m": far * np.cos(azimuth), "mass_y_m": far * np.sin(azimuth)}


def _wall_pull(rng, speed, weight, reach):
    return {"pull_m_per_s2": weight * rng.uniform(1.0, 3.0), "pull_width_m": reach * rng.uniform(0.06, 0.15)}


def _air_drag(rng, speed, weight, reach):
    return {"air_per_m": weight / speed**2 * rng.uniform(0.3, 1.0)}


def _place(rng, speed, weight, reach):
    size, azimuth = rng.uniform(0.25, 0.6), rng.uniform(0.0, 2 * np.pi)
    return {"gradient_x": size * np.cos(azimuth), "gradient_y": size * np.sin(azimuth)}


def _vertical(rng, speed, weight, reach):
    return {"vertical_g": rng.uniform(0.2, 0.6)}


def _anisotropic(rng, speed, weight, reach):
    return {"anisotropy": rng.uniform(0.15, 0.4), "anisotropy_rad": rng.uniform(0.0, np.pi)}


def _two_levels(rng, speed, weight, reach):
    return {
        "memory_share": rng.uniform(0.4, 1.0),
        "memory_slow_m_per_s": 0.15 * speed,
        "memory_fast_m_per_s": 0.6 * speed,
    }


def _settling(rng, speed, weight, reach):
    return {"settling_share": rng.uniform(0.4, 0.8), "settling_s": reach / speed * rng.uniform(0.2, 0.6)}


def _tilt(rng, speed, weight, reach):
    size, azimuth = 9.81 * rng.uniform(0.01, 0.04), rng.uniform(0.0, 2 * np.pi)
    return {"tilt_x_m_per_s2": size * np.cos(azimuth), "tilt_y_m_per_s2": size * np.sin(azimuth)}


def _tilt_and_air(rng, speed, weight, reach):
    return _tilt(rng, speed, weight, reach) | _air_drag(rng, speed, weight, reach)


def _rough_wall(rng, speed, weight, reach):
    return {"wall_roughness_rad": rng.uniform(0.005, 0.03)}


def _soft_wall(rng, speed, weight, reach):
    return {"restitution_fall_s_per_m": rng.uniform(0.03, 0.12) / speed}


def _whirl(rng, speed, weight, reach):
    return {"lift": rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.8) * weight * reach / (2.0 * speed) ** 2}


# Seeds of tests and benchmarks hold a law's place in the alphabet: a new one goes behind the others there.
LAWS: dict[str, Law] = {
    "ours": Law(_ours),
    "coulomb": Law(_coulomb),  # plain sliding; the spin decays by itself
    "stribeck": Law(_stribeck, friction_known=False),
    "spin_decay": Law(_spin_decay),
    "sticky_patch": Law(_patch, friction_known=False),
    "gusts": Law(_gusts),
    "eccentric_mass": Law(_eccentric),
    "wall_pull": Law(_wall_pull),
    "air_drag": Law(_air_drag, frame_rate_hz=400.0),
    "friction_by_place": Law(_place, friction_known=False),
    "unseen_vertical": Law(_vertical),
    "anisotropic_floor": Law(_anisotropic, friction_known=False),
    "two_levels": Law(_two_levels, friction_known=False),
    "settling": Law(_settling, friction_known=False),
    "tilt": Law(_tilt),
    "tilt_and_air": Law(_tilt_and_air),
    "rough_wall": Law(_rough_wall),
    "soft_wall": Law(_soft_wall, restitution_known=False),
    "whirl": Law(_whirl),
}
