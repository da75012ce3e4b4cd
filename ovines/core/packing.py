"""From a frozen scenario to the arrays of the compiled engine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ovines.core import state as S
from ovines.core.effects import EFFECTS
from ovines.core.effects.effect import unchanged
from ovines.core.effects.written_laws import with_laws
from ovines.core.integration.flight import wall_stands
from ovines.core.laws.terms import WrittenLaw
from ovines.core.laws.words import ROW_SIZE
from ovines.core.refusal import require
from ovines.core.system import parameters as P
from ovines.core.system.kinematics import empty_scratch, placed_in_host
from ovines.core.system.model import Harmonic, MeasuredMotion, Scenario
from ovines.core.system.packed import AXES, Packed
from ovines.core.system.walls import contact_frame

# Longest step of a disk that remembers its way, over the time in which it would fall by half of the contact radius.
STRAIGHT_STEP = 0.01
KINDS = {"fixed": P.FIXED, "free": P.FREE, "driven": P.DRIVEN, "sprung": P.SPRUNG}


def harmonic_rows(harmonics: Sequence[Harmonic]) -> np.ndarray:
    """Axis, amplitude, angular frequency, phase; shape (n, 4).  A constant (frequency 0) has its sine in the
    amplitude.
    """
    rows = [
        [AXES[h.axis], h.amplitude, 2.0 * math.pi * h.frequency_hz, h.phase_rad]
        if h.frequency_hz > 0.0
        else [AXES[h.axis], h.amplitude * math.sin(h.phase_rad), 0.0, 0.5 * math.pi]
        for h in harmonics
    ]
    return np.array(rows, dtype=float).reshape(-1, 4)


def polygon_edges(corners: Sequence[tuple[float, float]], radius: float) -> np.ndarray:
    """Outward normal and distance that the disk's centre may reach, per edge; shape (n, 3)."""
    points = np.asarray(corners, dtype=float)
    along = np.roll(points, -1, axis=0) - points
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    return np.column_stack([normals, np.sum(normals * points, axis=1) - radius])


def table_pieces(table: MeasuredMotion | None) -> np.ndarray:
    """Cubic-spline pieces of a measured Host motion: knot, then four coefficients of x, y, angle, z."""
    if table is None:
        return np.zeros((0, 17))
    from scipy.interpolate import CubicSpline  # slow to load, and most Hosts move by a formula

    columns = [np.asarray(table.time_s, dtype=float)[:-1, None]]
    for values in (table.x_m, table.y_m, table.angle_rad, table.z_m):
        columns.append(CubicSpline(table.time_s, values).c.T)
    return np.ascontiguousarray(np.hstack(columns))


def pack(scenario: Scenario, with_energy: bool = True) -> Packed:
    """Arrays of ``scenario`` with its effects; refuses a start outside the wall or a NES that does not fit."""
    nes, host = scenario.nes, scenario.host
    p, k = np.zeros(P.N_FLOATS), np.zeros(P.N_INTS, dtype=np.int64)
    p[P.RADIUS], p[P.MASS] = nes.radius_m, nes.mass_kg
    p[P.INERTIA] = nes.inertia_factor * nes.mass_kg * nes.radius_m**2
    p[P.GRAVITY_X], p[P.GRAVITY_Y] = scenario.gravity_m_per_s2
    p[P.RESTITUTION], p[P.WALL_FRICTION] = scenario.impact.restitution, scenario.impact.wall_friction
    p[P.TANGENTIAL_RESTITUTION] = scenario.impact.tangential_restitution
    p[P.DURATION], p[P.TOLERANCE], p[P.REGULARISATION] = scenario.duration_s, scenario.tolerance, 1e-3
    if scenario.friction is not None:
        friction = scenario.friction
        p[P.FLOOR_FRICTION], p[P.FLOOR_LOAD] = friction.coefficient, friction.load_m_per_s2
        p[P.REGULARISATION] = friction.regularisation_m_per_s
        p[P.COUPLING] = 1.0 if friction.law == "farkas" else 0.0
        k[P.ON_GROUND] = friction.support == "ground"
    k[P.HOST_KIND], k[P.MAX_IMPACTS] = KINDS[host.motion], scenario.max_impacts
    polygon = pack_walls(scenario, p, k)
    drive, table = np.zeros((0, 4)), np.zeros((0, 17))
    if host.motion == "driven":
        drive, table = harmonic_rows(host.drive), table_pieces(host.table)
    elif host.suspension is not None and host.motion == "sprung":
        drive = harmonic_rows(host.suspension.ground)
        p[P.STIFFNESS_X : P.STIFFNESS_R + 1] = host.suspension.stiffness
        p[P.DAMPING_X : P.DAMPING_R + 1] = host.suspension.damping
    if host.mass_kg is not None and host.motion in ("free", "sprung"):
        reach = host.radius_m or float(np.max(np.hypot(*np.asarray(host.polygon_m, dtype=float).T)))
        p[P.INVERSE_HOST_MASS] = 1.0 / host.mass_kg
        p[P.INVERSE_HOST_INERTIA] = 1.0 / (host.inertia_factor * host.mass_kg * reach**2)
    y = np.zeros(P.N_STATE)
    y[:6] = scenario.initial_nes
    if host.motion in ("free", "sprung"):
        y[P.HOST :] = scenario.initial_host
    k[P.HAS_TABLE] = len(table) > 0
    p[P.RUN_NUMBER] = scenario.run_number
    p[P.BEGINS_WITH] = -1.0 if scenario.begins_with_m_per_s is None else scenario.begins_with_m_per_s
    packed = Packed(p, k, drive, table, polygon, y, np.zeros((0, ROW_SIZE)))
    for name, values in scenario.effects.items():
        require(name in EFFECTS, f"effect {name!r}", "one of " + ", ".join(EFFECTS), "correct the effect's name")
        packed = EFFECTS[name].apply(packed, EFFECTS[name].complete(values), scenario)
    return finish(with_laws(packed, [*_effects_as_laws(scenario), *scenario.laws]), with_energy)


def _effects_as_laws(scenario: Scenario) -> list[WrittenLaw]:
    """Its effects that are laws, without those that the engine knows besides."""
    named = [(EFFECTS[name], values) for name, values in scenario.effects.items()]
    return [effect.law(values) for effect, values in named if effect.by_law and effect.apply is unchanged]


def pack_walls(scenario: Scenario, p: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Walls into the vectors; returns the polygon's edges.  Refuses a NES that has no room."""
    nes, host = scenario.nes, scenario.host
    polygon = np.zeros((0, 3))
    k[P.N_WALLS] = 2
    if host.polygon_m is None:
        assert host.radius_m is not None  # a Host has one of the two
        room = host.radius_m - nes.radius_m
        p[P.CONTACT_RADIUS] = room
        found = f"nes.radius_m = {nes.radius_m} in host.radius_m = {host.radius_m}"
    else:
        polygon = polygon_edges(host.polygon_m, nes.radius_m)
        k[P.N_WALLS] = P.EDGES + len(polygon)
        room = inscribed_radius(polygon)
        found = f"nes.radius_m = {nes.radius_m} in that polygon"
    require(room > 0.0, found, "a NES smaller than the Host", "make the NES smaller or the Host larger")
    p[P.LENGTH] = room if host.radius_m is not None else float(np.max(np.hypot(*np.asarray(host.polygon_m).T)))
    if host.obstacle_radius_m is not None:
        p[P.OBSTACLE_RADIUS] = host.obstacle_radius_m + nes.radius_m
        found = f"an obstacle of {host.obstacle_radius_m} m with that NES and Host"
        fits = p[P.OBSTACLE_RADIUS] < p[P.LENGTH]
        require(fits, found, "room for the NES between obstacle and wall", "make the obstacle smaller")
    return polygon


def contact_radius(scenario: Scenario) -> float:
    """Length that the engine measures by: R_H - R_N, or the farthest corner of a polygon (m)."""
    return float(pack(scenario).p[P.LENGTH])


def inscribed_radius(edges: np.ndarray) -> float:
    """Radius of the largest disk whose centre keeps to the edges' half planes (negative: no room)."""
    from scipy.optimize import linprog

    rows = np.column_stack([edges[:, :2], np.ones(len(edges))])
    bounds = [(None, None)] * 3
    return float(linprog([0, 0, -1], A_ub=rows, b_ub=edges[:, 2], bounds=bounds).x[2])


def finish(packed: Packed, with_energy: bool = True) -> Packed:
    """Derived numbers: bounds, scales, which flights are closed, state size; and the start must be inside."""
    p, k, drive, table, y = packed.p, packed.k.copy(), packed.drive, packed.table, packed.y.copy()
    p = p.copy()
    sprung, driven = k[P.HOST_KIND] == P.SPRUNG, k[P.HOST_KIND] == P.DRIVEN
    k[P.STATE_SIZE] = P.N_STATE if k[P.HOST_KIND] in (P.FREE, P.SPRUNG) else (P.HOST if with_energy else 6)
    k[P.OFF_CENTRE] = p[P.MASS_X] != 0.0 or p[P.MASS_Y] != 0.0
    k[P.HAS_TABLE] = len(table) > 0
    plain = p[P.FLOOR_FRICTION] == 0.0 and p[P.VISCOUS_DRAG] == 0.0 and p[P.AIR_DRAG] == 0.0 and not len(packed.law)
    k[P.CLOSED_FORM] = plain and not k[P.OFF_CENTRE] and not undamped_resonance(p, k, drive)
    gain = response_gains(p, k, drive)
    omega, plane = drive[:, P.OMEGA], drive[:, P.AXIS] < 2
    turning = drive[:, P.AXIS] == AXES["rotation"]
    p[P.HOST_ACCELERATION] = np.sum(np.abs(drive[plane, P.AMPLITUDE]) * gain[plane] * omega[plane] ** 2)
    p[P.HOST_SPIN] = np.sum(np.abs(drive[turning, P.AMPLITUDE]) * gain[turning] * omega[turning])
    p[P.HOST_SPIN_RATE] = np.sum(np.abs(drive[turning, P.AMPLITUDE]) * gain[turning] * omega[turning] ** 2)
    speed = np.sum(np.abs(drive[plane, P.AMPLITUDE]) * gain[plane] * omega[plane])
    rates = [*omega[omega > 0.0]]
    if k[P.HAS_TABLE]:
        speed += add_table_bounds(p, table)
        rates.append(2.0 * math.pi / (8.0 * float(np.median(np.diff(table[:, 0])))) if len(table) > 1 else 1.0)
    if sprung:
        rates += [math.sqrt(p[P.STIFFNESS_X + i] * p[P.INVERSE_HOST_MASS]) for i in range(2)]
        rates.append(math.sqrt(p[P.STIFFNESS_R] * p[P.INVERSE_HOST_INERTIA]))
    fastest = max([rate for rate in rates if rate > 0.0], default=0.0)
    p[P.MAX_STEP] = 0.5 * math.pi / fastest if fastest > 0.0 else p[P.DURATION]
    if p[P.MEMORY_M] > 0.0:  # a step's way counts as straight
        p[P.MAX_STEP] = min(p[P.MAX_STEP], STRAIGHT_STEP * p[P.MEMORY_S])
    lobes = p[P.LOBE_TABLE :].reshape(-1, 3)
    # lobes of order n bend the wall (n/2)^2 times as much as an ellipse of their size
    p[P.WALL_SHAPE] = abs(p[P.ELLIPTICITY]) + 0.25 * float(np.sum(lobes[:, 1] ** 2 * np.abs(lobes[:, 0])))
    p[P.WALL_DEPTH] = abs(p[P.ELLIPTICITY]) + float(np.sum(np.abs(lobes[:, 0])))
    shaped = p[P.WALL_SHAPE] != 0.0 or p[P.WALL_X] != 0.0 or p[P.WALL_Y] != 0.0 or k[P.N_WALLS] > 2
    turns = (driven and (turning.any() or k[P.HAS_TABLE])) or k[P.HOST_KIND] in (P.FREE, P.SPRUNG)
    k[P.WALL_TURNS] = shaped and turns
    k[P.EXTENDED] = with_energy and can_extend(p, k, drive)
    k[P.PLAIN] = k[P.HOST_KIND] in (P.FIXED, P.DRIVEN) and not k[P.OFF_CENTRE] and p[P.ROCKING] == 0.0
    k[P.PLAIN] = k[P.PLAIN] and not len(packed.law)
    k[P.FLOOR_TURNS] = driven and (turning.any() or k[P.HAS_TABLE])
    if k[P.OFF_CENTRE]:
        cosine, sine = math.cos(y[S.ANGLE]), math.sin(y[S.ANGLE])
        dx, dy = cosine * p[P.MASS_X] - sine * p[P.MASS_Y], sine * p[P.MASS_X] + cosine * p[P.MASS_Y]
        y[S.X], y[S.Y] = y[S.X] + dx, y[S.Y] + dy
        y[S.VX], y[S.VY] = y[S.VX] - y[S.SPIN] * dy, y[S.VY] + y[S.SPIN] * dx
    rubbing = p[P.FLOOR_FRICTION] * p[P.FLOOR_LOAD] * (1.0 + abs(p[P.ROCKING]))
    pull = math.hypot(p[P.GRAVITY_X], p[P.GRAVITY_Y]) + rubbing
    own = math.hypot(y[S.VX], y[S.VY]) + math.hypot(y[P.HOST + S.VX], y[P.HOST + S.VY]) + p[P.RADIUS] * abs(y[S.SPIN])
    scale = own + speed + math.sqrt(pull * p[P.LENGTH])
    p[P.SPEED] = scale if scale > 0.0 else 1.0
    done = replace(packed, p=p, k=k, y=y)
    require_inside(done)
    return done


def response_gains(p: np.ndarray, k: np.ndarray, drive: np.ndarray) -> np.ndarray:
    """Amplitude of a sprung Host's steady response over the ground's; 1 for a driven Host."""
    gains = np.ones(len(drive))
    if k[P.HOST_KIND] == P.SPRUNG:
        for row, (axis, _amplitude, omega, _phase) in enumerate(drive):
            if axis < 3:
                inverse = p[P.INVERSE_HOST_INERTIA] if axis == 2 else p[P.INVERSE_HOST_MASS]
                stiffness = p[P.STIFFNESS_X + int(axis)] * inverse
                damping = 1j * p[P.DAMPING_X + int(axis)] * inverse * omega
                below = stiffness - omega**2 + damping
                gains[row] = abs((stiffness + damping) / below) if below != 0 else 1.0
    return gains


def undamped_resonance(p: np.ndarray, k: np.ndarray, drive: np.ndarray) -> bool:
    """Whether a steady response does not exist (or nearly so): the flight must then be integrated."""
    return (k[P.HOST_KIND] == P.SPRUNG and bool(np.any(response_gains(p, k, drive) > 1e6))) or bool(
        k[P.HOST_KIND] == P.SPRUNG
        and any(
            p[P.STIFFNESS_X + int(axis)] * p[P.INVERSE_HOST_INERTIA if axis == 2 else P.INVERSE_HOST_MASS] == omega**2
            and p[P.DAMPING_X + int(axis)] == 0.0
            for axis, _amplitude, omega, _phase in drive
            if axis < 3
        )
    )


def can_extend(p: np.ndarray, k: np.ndarray, drive: np.ndarray) -> bool:
    """Whether contacts can be sharpened to 30 digits: closed flights, one round wall, instant impacts, weak dampers."""
    round_only = k[P.N_WALLS] == 2 and p[P.OBSTACLE_RADIUS] == 0.0 and p[P.WALL_SHAPE] == 0.0
    plain = bool(k[P.CLOSED_FORM]) and p[P.WALL_X] == 0.0 and p[P.WALL_Y] == 0.0 and p[P.CONTACT_DURATION] == 0.0
    if not (round_only and plain) or k[P.HAS_TABLE]:
        return False
    if k[P.HOST_KIND] != P.SPRUNG:
        return True
    inverse = p[[P.INVERSE_HOST_MASS, P.INVERSE_HOST_MASS, P.INVERSE_HOST_INERTIA]]
    stiffness, damping = p[P.STIFFNESS_X : P.STIFFNESS_R + 1] * inverse, p[P.DAMPING_X : P.DAMPING_R + 1] * inverse
    return bool(np.all(stiffness > (0.5 * damping) ** 2 * (1.0 + 1e-9)))


def add_table_bounds(p: np.ndarray, table: np.ndarray) -> float:
    """Add bounds of a measured motion's accelerations to the vector; returns its largest plane speed."""
    pieces = np.diff(table[:, 0], append=table[-1, 0] + (table[-1, 0] - table[-2, 0] if len(table) > 1 else 1.0))
    second, first = [], []
    for axis in range(3):
        c3, c2, c1 = table[:, 1 + 4 * axis], table[:, 2 + 4 * axis], table[:, 3 + 4 * axis]
        second.append(float(np.max(np.maximum(abs(2 * c2), abs(2 * c2 + 6 * c3 * pieces)))))
        first.append(float(np.max(abs(c1) + abs(2 * c2 * pieces) + abs(3 * c3 * pieces**2))))
    p[P.HOST_ACCELERATION] += math.hypot(second[0], second[1])
    p[P.HOST_SPIN] += first[2]
    p[P.HOST_SPIN_RATE] += second[2]
    return math.hypot(first[0], first[1])


def require_inside(packed: Packed) -> None:
    """Refuse a start outside a wall (beyond rounding)."""
    scratch, at = empty_scratch()
    x, y, _vx, _vy = placed_in_host(0.0, packed.y, packed.system, scratch, at)
    for wall in range(packed.k[P.N_WALLS]):
        if wall_stands(wall, packed.p, packed.k):
            gap = contact_frame(wall, x, y, packed.p, packed.polygon)[2]
            fine = gap >= -1e-12 * packed.p[P.LENGTH]
            found = f"a start {-gap:.3g} m outside a wall (NES at {x:.6g}, {y:.6g} m from the Host's centre)"
            require(
                fine, found, "a NES inside the Host at the start", "move initial.nes (a driven Host may not start at 0)"
            )
