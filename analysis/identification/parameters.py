"""Table ``identification``: the parameters with their intervals, what all measurements of a series share included."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.law import fit_restitution, restitution_gain, sticks
from analysis.contact.restitution import SPEED
from analysis.contact.wall_fit import CONTACT_MODEL_SHARE, contact_time_s
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.identification.contact_law.interval import Interval, normal_interval, widened
from analysis.identification.contact_law.intervals import restitution_interval, scatter_interval, tangential_intervals
from analysis.identification.contact_law.restitution_rows import effect_sizes, few, reported_restitution, rows_of
from analysis.identification.fit import HOST_ACCELERATION_M_PER_S2, RigFit
from analysis.identification.lens_residual import restitution_sd
from analysis.motion.rig_frame import RigFrame
from analysis.statistics.correlation import slow_mean
from analysis.statistics.student import NORMAL_90
from analysis.walls.lobes import LOBE_TERMS, LobedWall
from analysis.walls.outlines import CYLINDER_TERMS, ELLIPSE_TERMS, ROUND_TERMS, TURN, wall_parameter

Array = NDArray[np.float64]
Row = tuple[str, Interval, int | None]
UNKNOWN = Interval(np.nan, np.nan, np.nan, np.nan)
# Errors of the parameters over the lens residual's relative size (LensResidual.relative): rms over 28 blind series with
# one. The wall friction compares speeds along the wall with speeds towards it, the tangential restitution speeds with
# the spin's.
LENS_SHARE = {
    "wall_friction": 3.5,
    "tangential_restitution": 2.5,
    "floor_friction": 0.6,
    "contact_radius": 1.6,
    "ellipse": 1.3,
    "scatter": 1.0,
    "slope": 0.3,
    "wall_centre": 0.95,
}
# What adapting the disk's radius to lengths that are off leaves of that error in the law.
ADAPTED_SHARE = 0.03
# Relative error of fast impacts' speeds that no covariance holds: blind series without any scatter showed 1e-4 to 7e-4
# of it.
SPEED_SHARE = 3.5e-4
UNDETERMINED_FRICTION = 0.3
# A force that no law describes of this share of the friction's own is no small correction of its law: whatever slides
# so, it is not this friction (plain Coulomb sliding read as Farkas': up to 5 sd off).
FORCE_SHARE = 0.5
# What integrating the law of friction otherwise changes: flights of 800 frames determine friction to 4e-5 of itself and
# were 1e-4 off.
FRICTION_MODEL_SHARE = 7.5e-5
# What the Host's motion and the wall's curvature change of a contact's stiffness along the wall (share of it): eight
# series of the blind plant, of round and square walls, were 0.4 to 3 % low.
STIFFNESS_MODEL_SHARE = 0.02
FEWEST_FOR_SLOPE = 5
# Contact distances show a residual beyond their noise: five unknowns of the wall and one more.
FEWEST_FOR_RESIDUAL = 6
FLOOR_NAMES = {
    "friction": "floor_friction",
    "viscous": "viscous_drag_per_s",
    "air": "air_drag_per_m",
    "tilt_x": "table_tilt_x_m_per_s2",
    "tilt_y": "table_tilt_y_m_per_s2",
    "drift": "friction_drift_per_s",
    "load": "vertical_motion_share",
    "centre_host": "centre_force_per_s2",
    "magnus": "spin_lift",
    "gyro": "crosswise_force_per_s",
    "host_drag": "host_drag_per_s",
    "spin_decay": "spin_decay_per_s",
    "spin_drive": "spin_drive_rad_per_s2",
}


def law_intervals(rig: RigFit) -> dict[str, Interval]:
    """Intervals of the contact law's parameters and of the restitution's scatter and slope; all NaN without an impact.

    The profile likelihoods' intervals, widened by what all impacts share: errors of length (:func:`length_residual`, a
    lens residual), and a force that grows towards the wall."""
    result = dict.fromkeys(("restitution", "wall_friction", "tangential_restitution"), UNKNOWN)
    if rig.law is None:
        return result
    if rig.restitution is None:
        (value,), covariance, _, _ = fit_restitution(rig.data)
        result["restitution"] = restitution_interval(rig.data, float(value), float(np.sqrt(covariance[0, 0])))
    else:
        value = rig.restitution.value
        result["restitution"] = reported_restitution(rig.restitution, len(rig.data))
    if rig.lasting_intervals is not None:
        for name in ("wall_friction", "tangential_restitution"):
            result[name] = getattr(rig.lasting_intervals, name)
    elif rig.angle:
        result["wall_friction"], result["tangential_restitution"] = tangential_intervals(
            rig.data, rig.law.wall_friction, rig.law.tangential_restitution
        )
    shared = np.hypot(length_residual(rig), ADAPTED_SHARE * rig.length_doubt)
    if rig.wall.delay_s > 0:
        shared = np.hypot(shared, rig.wall.delay_s * HOST_ACCELERATION_M_PER_S2 / float(np.median(rig.data.before)))
    lens = {name: LENS_SHARE[name] * rig.lens.relative for name in result if name in LENS_SHARE}
    lens["restitution"] = restitution_sd(rig.lens, rig.wall.impacts, rig.data, rig.law, rig.wall.wall.size_m) / abs(
        value
    )
    pulled = _pulled(rig)
    # (1 + beta_0) goes with the ratio of two speeds, the others with one.
    return {
        name: widened(
            i,
            float(np.linalg.norm([shared, lens[name], pulled.get(name, 0.0)]))
            * (abs(i.value) + (name == "tangential_restitution")),
        )
        for name, i in result.items()
    }


def _pulled(rig: RigFit) -> dict[str, float]:
    """Relative errors by a force that grows towards the wall: all impacts share them, for it acts alike at each.

    Along the wall it does nothing, so that the tangential restitution has none."""
    force = rig.wall_force
    if force is None or rig.law is None:
        return {}
    data = rig.data
    before, after = force.before_m_per_s[data.at.index], force.after_m_per_s[data.at.index]
    weight = data.normal_impulse**2
    own = {"restitution": abs(np.average(after / data.after - before / data.before, weights=weight))}
    slide = ~sticks(data, rig.law.wall_friction, rig.law.tangential_restitution)
    if slide.any():
        own["wall_friction"] = abs(np.average(((before + after) / data.normal_impulse)[slide], weights=weight[slide]))
    return {name: float(share) for name, share in own.items()}


def length_residual(rig: RigFit) -> float:
    """Relative error of lengths that the contact distances show beyond their noise: a lens residual, a wall not quite
    round.

    Speeds share it within a region of the image, so that it does not average out over the impacts."""
    used, impacts = rig.wall.used, rig.wall.impacts
    if np.count_nonzero(used) < FEWEST_FOR_RESIDUAL:
        return 0.0
    excess = rig.wall.scatter_m**2 - float(np.median(impacts.sd("gap")[used] ** 2))
    return float(np.sqrt(max(excess, 0.0))) / rig.wall.wall.size_m


def identification_table(rig: RigFit, law: dict[str, Interval], frame: RigFrame) -> pd.DataFrame:
    """Table ``identification``: one row per parameter; a bound has no value, what is open on both sides has nothing.

    Fitted in the rig's ``frame``, given in the world's."""
    n = len(rig.data)
    rows: list[Row] = [(name, law[name], n) for name in ("restitution", "wall_friction", "tangential_restitution")]
    if rig.law is not None and n > 2:
        rows.append(("restitution_scatter", _scatter(rig), n))
    if rig.law is not None and n >= FEWEST_FOR_SLOPE and SPEED not in rig.named:
        _, (slope,), (sd,) = restitution_gain(rig.data, [rig.data.before - rig.data.before.mean()])
        rows.append(
            (
                "restitution_speed_slope_s_per_m",
                normal_interval(slope, np.hypot(few(n, 2) * sd, LENS_SHARE["slope"] * rig.lens.relative)),
                n,
            )
        )
    rows += [(name, interval, n) for name, interval in _effect_rows(rig, law, frame)]
    rows += [(name, interval, None) for name, interval in _floor_rows(rig, frame)]
    rows += [(name, interval, int(rig.wall.used.sum())) for name, interval in _wall_rows(rig, frame)]
    rows += [(name, interval, None) for name, interval in _drive_rows(rig)]
    table = pd.DataFrame(
        [(name, i.value, i.sd, i.low, i.high) for name, i, _ in rows],
        columns=["parameter", "value", "sd", "low", "high"],
    )
    columns = ["value", "sd", "low", "high"]
    table[columns] = table[columns].mul([frame.factor(name) for name in table["parameter"]], axis=0)
    table["n_impacts"] = pd.array([count for _, _, count in rows], dtype="Int64")
    return table


def _effect_rows(rig: RigFit, law: dict[str, Interval], frame: RigFrame) -> list[tuple[str, Interval]]:
    """Sizes of the effects on the restitution that were fitted, and how long a contact lasts."""
    reported: dict[str, dict[str, tuple[float, float]]] = {}
    n = len(rig.data)
    if rig.restitution is not None:
        own = reported_restitution(rig.restitution, n).sd
        shared = float(np.sqrt(max(law["restitution"].sd ** 2 - own**2, 0.0)))
        reported = effect_sizes(rig.restitution, n, shared, frame.turn_rad)
    if rig.wall.delay_s > 0 and rig.law is not None:
        factor = contact_time_s(1.0, rig.law.restitution)
        duration = factor * rig.wall.delay_s
        sd = factor * rig.wall.delay_sd_s + CONTACT_MODEL_SHARE * duration
        reported["finite_contact_time"] = {"duration_s": (duration, sd)}
    if rig.inertia is not None:
        reported["inertia_error"] = {"ratio": rig.inertia}
    rows = rows_of(reported)
    if rig.lasting_intervals is not None:
        stiffness = rig.lasting_intervals.stiffness
        rows.append(("contact_stiffness_ratio", widened(stiffness, STIFFNESS_MODEL_SHARE * stiffness.value)))
    return rows


def _lobe_rows(rig: RigFit, frame: RigFrame) -> list[tuple[str, Interval]]:
    """Lobes of the wall, their direction in the room where the Host stands on the mean."""
    wall = rig.wall
    if not isinstance(wall.wall, LobedWall) or not set(LOBE_TERMS) <= set(wall.terms):
        return []
    at = [wall.terms.index(term) for term in LOBE_TERMS]
    order, size = wall.wall.order, max(float(np.hypot(*wall.estimate[at])), 1e-9)
    own = np.sqrt(np.mean((np.diag(wall.covariance) + rig.lens.wall_sd(wall) ** 2)[at]))
    sd = float(np.hypot(own, LENS_SHARE["ellipse"] * rig.lens.relative))
    host = wall.impacts.junctions.host[wall.used, 3]
    direction = np.arctan2(wall.estimate[at[1]], wall.estimate[at[0]]) / order + float(np.mean(host)) + frame.turn_rad
    return [
        ("wall_lobe_amplitude", normal_interval(size, sd)),
        ("wall_lobe_order", normal_interval(order, 0.0)),
        ("wall_lobe_direction_rad", normal_interval(float(np.angle(np.exp(1j * direction))), sd / order / size)),
    ]


def _scatter(rig: RigFit) -> Interval:
    """The restitution's scatter; what the measurement scatters from place to place is no lower bound of it."""
    assert rig.law is not None
    value = rig.law.restitution if rig.restitution is None else rig.restitution.value
    found = scatter_interval(rig.plain_data, value)
    lens = np.hypot(LENS_SHARE["scatter"] * rig.lens.relative, SPEED_SHARE)
    low = float(np.sqrt(max(found.low**2 - (NORMAL_90 * lens) ** 2, 0.0)))
    return Interval(found.value, max(found.sd, lens if low == 0.0 else 0.0), low, found.high)


def _floor_rows(rig: RigFit, frame: RigFrame) -> list[tuple[str, Interval]]:
    rows = []
    estimate, covariance = frame.turned(
        rig.floor.names, rig.floor.estimate, rig.floor.covariance, [("tilt_x", "tilt_y", 1)]
    )
    for k, name in enumerate(rig.floor.names):
        interval = normal_interval(estimate[k], np.sqrt(covariance[k, k]))
        if name == "friction":
            force = _force_on_friction(rig) > FORCE_SHARE * abs(estimate[k]) * GRAVITY_M_PER_S2
            if force or interval.sd > UNDETERMINED_FRICTION or not sum(e.flights for e in rig.floor.evidence):
                interval = UNKNOWN
            shared = np.hypot(
                np.hypot(LENS_SHARE["floor_friction"] * rig.lens.relative, rig.length_doubt), FRICTION_MODEL_SHARE
            )
            interval = widened(interval, shared * abs(interval.value))
            interval = Interval(*(max(v, 0.0) if k != 1 else v for k, v in enumerate(astuple(interval))))
        rows.append((FLOOR_NAMES[name], interval))
    if rig.floor.per_run is not None:
        rows.append(("friction_drift_per_run", normal_interval(*rig.floor.per_run)))
    if "friction" not in rig.floor.names:
        rows.append(("floor_friction", UNKNOWN))
    return rows


def _force_on_friction(rig: RigFit) -> float:
    """The unknown force (m/s^2) that may pass for friction: at the rim, too, where friction goes with the spin."""
    noise = rig.floor.noise
    rim = noise.spin_rad_per_s2 * rig.runs[0].data.radius_m if rig.floor.coupling > 0 and rig.angle else 0.0
    return max(noise.acceleration_m_per_s2, rim)


def _wall_rows(rig: RigFit, frame: RigFrame) -> list[tuple[str, Interval]]:
    wall, lens = rig.wall, rig.lens
    if not wall.used.any():
        return []
    distance = float(np.hypot(LENS_SHARE["contact_radius"] * lens.relative, rig.length_doubt) * wall.wall.size_m)
    shared = {
        **dict.fromkeys((t for t in wall.terms if wall.wall.is_length(t)), distance),
        **dict.fromkeys((*ELLIPSE_TERMS, TURN), LENS_SHARE["ellipse"] * lens.relative),
        # The Host's markers and the disk are seen through other regions of the lenses.
        **dict.fromkeys((*ROUND_TERMS[1:], *CYLINDER_TERMS[1:]), LENS_SHARE["wall_centre"] * lens.amplitude_m),
    }
    value, covariance = frame.turned(
        wall.terms, wall.estimate, wall.covariance + np.diag(lens.wall_sd(wall) ** 2), [("ellipse_c", "ellipse_s", 2)]
    )
    sd = np.sqrt(np.diag(covariance))
    return [
        (wall_parameter(term), normal_interval(value[k], np.hypot(sd[k], shared.get(term, 0.0))))
        for k, term in enumerate(wall.terms)
        if term not in LOBE_TERMS
    ] + _lobe_rows(rig, frame)


def _drive_rows(rig: RigFit) -> list[tuple[str, Interval]]:
    """Drive frequency, weighted mean over the runs; nothing for a Host that stands still."""
    found = [
        (
            run.data.host.frequency_hz,
            run.data.host.omega_sd_rad_per_s * slow_mean(run.data.host.residual[:, :2], np.inf) / (2 * np.pi),
        )
        for run in rig.runs
        if run.data.host.omega_rad_per_s > 0 and np.isfinite(run.data.host.omega_sd_rad_per_s)
    ]
    if not found:
        return []
    value, sd = (np.array(c) for c in zip(*found, strict=True))
    weight = np.maximum(sd, 1e-9) ** -2.0
    mean = float(np.average(value, weights=weight))
    # Runs that scatter more than their sds let them widen the mean's (Birge's ratio).
    birge = np.sqrt(np.sum(weight * (value - mean) ** 2) / max(len(value) - 1, 1))
    return [("drive_frequency_hz", normal_interval(mean, max(float(birge), 1.0) * weight.sum() ** -0.5))]
