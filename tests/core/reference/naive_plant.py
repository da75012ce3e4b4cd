"""A second simulator for the tests: Jacobians and a mass matrix, scipy's DOP853, one event function per thing that can
happen.

Shares no code with ovines.core: elliptic integrals by Carlson's forms and an area integral, contact forces from
J M^-1 J^T, everything in the world frame.  Slow (a second of motion takes seconds), accurate (rtol 1e-11), no penalty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import chebyshev
from scipy.integrate import solve_ivp
from scipy.special import elliprd, elliprf

REST_HEIGHT = 1e-14  # m: a bounce lower than this on a wall that presses ends the chatter
TOUCHING = 1e-10  # m


def _torque_by_area(k: float) -> float:
    """T/k at ratio 1/k by integration over the disk (smooth for k < 1)."""
    node, weight = np.polynomial.legendre.leggauss(30)
    r, w = 0.5 * (node + 1), 0.5 * weight
    phi = 2 * np.pi * np.arange(64) / 64
    x, y = r[:, None] * np.cos(phi), r[:, None] * np.sin(phi)
    ux, uy = 1 - k * y, k * x  # slides along x with 1, spins with k
    torque = (x * uy - y * ux) / np.hypot(ux, uy)
    return float((w * r) @ torque.mean(axis=1) * 2 / k)


# even in k: a polynomial in k^2; below k = 0.03 rounding of the area sum would show, there it is extrapolated
_SMALL = chebyshev.Chebyshev.interpolate(
    lambda square: np.vectorize(_torque_by_area)(np.sqrt(square)), 9, domain=[9e-4, 0.09]
)


def force_and_torque(speed: float, rim: float) -> tuple[float, float]:
    """Farkas' F and T at a sliding speed and a rim speed."""
    if rim == 0.0:
        return 1.0, 0.0
    k = min(speed, rim) / max(speed, rim)
    kc = (1 - k) * (1 + k)
    if kc < 1e-14:
        return 8 / (3 * math.pi), 8 / (9 * math.pi)
    big_k, d = elliprf(0.0, kc, 1.0), elliprd(0.0, kc, 1.0) / 3
    e = big_k - k * k * d
    b = big_k - d
    if speed <= rim:
        return 4 * k / (3 * math.pi) * (b + e), 4 / (9 * math.pi) * ((4 - 2 * k * k) * e - kc * big_k)
    torque = k * float(_SMALL(k * k)) if k < 0.3 else 4 * k / (9 * math.pi) * ((d - b) / k**2 + 3 * b - d)
    return 4 / (3 * math.pi) * (e + b), torque


@dataclass
class Rig:
    """Numbers of one run; ``drive`` and ``ground`` hold (axis, amplitude, omega, phase)."""

    radius: float
    mass: float
    inertia: float
    host_radius: float | None = None
    corners: tuple | None = None
    obstacle: float = 0.0
    host_mass: float = math.inf
    host_inertia: float = math.inf
    drive: tuple = ()
    spring: tuple | None = None  # stiffness, damping
    eps: float = 1.0
    mu: float = 0.0
    beta: float = 0.0
    floor: float = 0.0
    farkas: bool = True
    on_ground: bool = False
    smoothing: float = 1e-3
    load: float = 9.81
    gravity: tuple = (0.0, 0.0)
    edges: list = field(default_factory=list)

    def __post_init__(self):
        if self.corners is not None:
            points = np.asarray(self.corners, dtype=float)
            for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
                n = np.array([b[1] - a[1], a[0] - b[0]]) / math.dist(a, b)
                self.edges.append((float(n[0]), float(n[1]), float(n @ a)))
        self.movable = math.isfinite(self.host_mass)

    def shaker(self, t):
        """Position, velocity, acceleration of (x, y, rotation, z)."""
        q, v, a = [0.0] * 4, [0.0] * 4, [0.0] * 4
        for axis, size, omega, phase in self.drive:
            s, c = math.sin(omega * t + phase), math.cos(omega * t + phase)
            q[axis] += size * s
            v[axis] += size * omega * c
            a[axis] -= size * omega * omega * s
        return q, v, a


# state: x, y, angle, vx, vy, spin, and the Host's X, Y, Angle, Vx, Vy, Spin
class Plant:
    """Runs a rig from a state to an end; ``times``/``states`` dense, ``impacts`` (t, u_n, u_t, spin after),
    ``held``.
    """

    def __init__(self, rig: Rig, nes, host=(0.0,) * 6):
        self.rig = rig
        x, y, vx, vy, angle, spin = nes
        hx, hy, hvx, hvy, hangle, hspin = host
        self.y = np.array([x, y, angle, vx, vy, spin, hx, hy, hangle, hvx, hvy, hspin], dtype=float)
        self.t, self.impacts, self.held, self.pieces = 0.0, [], [], []

    def host(self, t, y):
        """Host position and velocity (x, y, angle each)."""
        if self.rig.movable:
            return y[6:9], y[9:12]
        q, v, _ = self.rig.shaker(t)
        return q[:3], v[:3]

    def free(self, t, y):
        """Generalised accelerations (6) without wall forces."""
        rig = self.rig
        q, v = self.host(t, y)
        ax, ay, turn = rig.gravity[0], rig.gravity[1], 0.0
        hx = hy = hturn = 0.0
        z = rig.shaker(t)[2][3] if not rig.movable else 0.0
        if rig.floor > 0.0:
            load = rig.load if rig.on_ground else max(rig.load + z, 0.0)
            fvx, fvy, fspin = 0.0, 0.0, 0.0
            if not rig.on_ground:
                fvx, fvy, fspin = v[0] - v[2] * (y[1] - q[1]), v[1] + v[2] * (y[0] - q[0]), v[2]
            ux, uy, us = y[3] - fvx, y[4] - fvy, y[5] - fspin
            speed, rim = math.hypot(ux, uy), rig.radius * abs(us)
            f, tq = 0.0, 0.0
            if rig.farkas:
                if speed + rim > 0.0:
                    f, tq = force_and_torque(speed, rim)
                    smooth = math.tanh(math.hypot(speed, rim) / rig.smoothing)
                    f, tq = f * smooth, tq * smooth
            else:
                f = math.tanh(speed / rig.smoothing)
            size = rig.floor * load * rig.mass
            fx, fy = (-size * f * ux / speed, -size * f * uy / speed) if speed > 0 else (0.0, 0.0)
            torque = -size * rig.radius * tq * (1 if us > 0 else -1)
            ax, ay, turn = ax + fx / rig.mass, ay + fy / rig.mass, torque / rig.inertia
            if rig.movable and not rig.on_ground:
                hx, hy = -fx / rig.host_mass, -fy / rig.host_mass
                hturn = -(torque + (y[0] - q[0]) * fy - (y[1] - q[1]) * fx) / rig.host_inertia
        if not rig.movable:
            return [ax, ay, turn, *rig.shaker(t)[2][:3]]
        if rig.spring is not None:
            g, gv, _ = rig.shaker(t)
            pull = [-rig.spring[0][i] * (q[i] - g[i]) - rig.spring[1][i] * (v[i] - gv[i]) for i in range(3)]
            hx, hy = hx + pull[0] / rig.host_mass, hy + pull[1] / rig.host_mass
            hturn += pull[2] / rig.host_inertia
        return [ax, ay, turn, hx, hy, hturn]

    def wall(self, i, t, y):
        """Gap, normal towards wall ``i``, contact arm from the Host's centre, curvature (1/m) of the wall's offset
        curve.
        """
        q, _ = self.host(t, y)
        rx, ry = y[0] - q[0], y[1] - q[1]
        rig = self.rig
        if i == "ring":
            d = math.hypot(rx, ry)
            return rig.host_radius - rig.radius - d, rx / d, ry / d, rig.host_radius, 1 / d
        if i == "obstacle":
            d = math.hypot(rx, ry)
            return d - rig.obstacle - rig.radius, -rx / d, -ry / d, -rig.obstacle, -1 / d
        ex, ey, reach = rig.edges[i]
        c, s = math.cos(q[2]), math.sin(q[2])
        nx, ny = c * ex - s * ey, s * ex + c * ey
        return reach - rig.radius - nx * rx - ny * ry, nx, ny, None, 0.0

    def walls(self):
        names = ["ring"] if self.rig.host_radius is not None else list(range(len(self.rig.edges)))
        return [*names, "obstacle"] if self.rig.obstacle > 0 else names

    def jacobians(self, i, t, y):
        """Rows that turn generalised velocities into approach speed and slip, and their rates along the motion."""
        q, v = self.host(t, y)
        _gap, nx, ny, _arm, bend = self.wall(i, t, y)
        rx, ry = y[0] - q[0], y[1] - q[1]
        cx, cy = rx + self.rig.radius * nx, ry + self.rig.radius * ny
        tx, ty = -ny, nx
        normal = np.array([nx, ny, 0.0, -nx, -ny, -(cx * ny - cy * nx)])
        tangent = np.array([tx, ty, self.rig.radius, -tx, -ty, -(cx * ty - cy * tx)])
        vx, vy = y[3] - v[0], y[4] - v[1]
        if i in ("ring", "obstacle"):  # the normal follows the disk
            along = vx * tx + vy * ty
            return normal, tangent, along * along * bend, 0.0 - along * bend * (vx * nx + vy * ny)
        # the normal turns with the Host: d/dt of n.(v - V) - Omega t.r and of t.(v - V) + R w - Omega reach
        spin = v[2]
        rate_n = 2 * spin * (vx * tx + vy * ty) - spin * spin * (rx * nx + ry * ny)
        rate_t = -spin * (vx * nx + vy * ny)
        return normal, tangent, rate_n, rate_t

    def velocities(self, t, y):
        _, v = self.host(t, y)
        return np.array([y[3], y[4], y[5], *v])

    def inverse_mass(self):
        rig = self.rig
        host = [1 / rig.host_mass, 1 / rig.host_mass, 1 / rig.host_inertia] if rig.movable else [0.0] * 3
        return np.array([1 / rig.mass, 1 / rig.mass, 1 / rig.inertia, *host])

    def contact_forces(self, t, y, contact):
        """Accelerations with the wall's force; push on the disk away from the wall, rub, slip, force rolling needs."""
        i, mode = contact
        a, w = np.array(self.free(t, y)), self.inverse_mass()
        n, s, rate_n, rate_s = self.jacobians(i, t, y)
        slip = float(s @ self.velocities(t, y))
        bias = np.array([n @ a + rate_n, s @ a + rate_s])
        rows = np.array([n, s])
        system = rows * w @ rows.T
        roll = np.linalg.solve(system, -bias)
        if mode == 0:
            force = roll
        else:  # |rub| = mu push, against the slip
            push = bias[0] / (system[0, 0] + mode * self.rig.mu * system[0, 1])
            force = np.array([-push, -mode * self.rig.mu * push])
        return a + w * (rows.T @ force), -force[0], force[1], slip, roll

    def slope(self, t, y, contact):
        if contact is None:
            a = self.free(t, y)
        elif isinstance(contact[0], tuple):
            a = self.corner_forces(t, y, *contact)[0]
        else:
            a = self.contact_forces(t, y, contact)[0]
        if not self.rig.movable:
            return [y[3], y[4], y[5], a[0], a[1], a[2], 0, 0, 0, 0, 0, 0]
        return [y[3], y[4], y[5], a[0], a[1], a[2], y[9], y[10], y[11], a[3], a[4], a[5]]

    def kick(self, impulse):
        change = self.inverse_mass() * impulse
        self.y[3:6] += change[:3]
        if self.rig.movable:
            self.y[9:12] += change[3:]

    def onto(self, i):
        gap, nx, ny, _, _ = self.wall(i, self.t, self.y)
        self.y[0] += gap * nx
        self.y[1] += gap * ny

    def strike(self, i):
        """Impact with wall ``i``; the contact that follows, if it is sustained."""
        rig = self.rig
        self.onto(i)
        n, s, _, _ = self.jacobians(i, self.t, self.y)
        u = self.velocities(self.t, self.y)
        rows, w = np.array([n, s]), self.inverse_mass()
        system = rows * w @ rows.T
        un, us = rows @ u
        force = np.linalg.solve(system, [-(1 + rig.eps) * un, -(1 + rig.beta) * us])
        if abs(force[1]) > rig.mu * abs(force[0]):
            side = math.copysign(1.0, us)
            push = (1 + rig.eps) * un / (system[0, 0] + side * rig.mu * system[0, 1])
            force = np.array([-push, -side * rig.mu * push])
        self.kick(rows.T @ force)
        self.impacts.append((self.t, un, us, self.y[5]))
        return self.settle(i)

    def settle(self, i):
        """After an impact with ``i``: strike what else is touched and approached; the contact that stays, if any."""
        approach, pull = {}, {}
        for j in self.walls():
            if j == i or self.wall(j, self.t, self.y)[0] < TOUCHING:
                n, _, rate, _ = self.jacobians(j, self.t, self.y)
                approach[j] = float(n @ self.velocities(self.t, self.y))
                pull[j] = float(n @ np.array(self.free(self.t, self.y)) + rate)
        slow = {j: math.sqrt(2 * REST_HEIGHT * abs(pull[j])) for j in pull}
        for j, speed in approach.items():
            if j != i and speed > slow[j]:
                return self.strike(j)
        resting = [j for j in approach if abs(approach[j]) < slow[j] and pull[j] > 0]
        if len(resting) == 2:
            return self.enter_corner(*resting)
        return self.enter(i) if i in resting else None

    def enter_corner(self, i, j):
        """Rest on two walls: the Host carries the disk; only its spin is its own."""
        for _ in range(60):
            for wall in (i, j):
                n = self.jacobians(wall, self.t, self.y)[0]
                self.kick(n * (-(n @ self.velocities(self.t, self.y)) / (n * self.inverse_mass() @ n)))
                self.onto(wall)
        slip = float(self.jacobians(i, self.t, self.y)[1] @ self.velocities(self.t, self.y))
        if min(self.corner_forces(self.t, self.y, (i, j), math.copysign(1.0, slip))[1]) > 0:
            return ((i, j), math.copysign(1.0, slip))
        return self.enter(i)

    def corner_forces(self, t, y, pair, side):
        """Accelerations with the forces of two walls, both pushes, slip."""
        a, w = np.array(self.free(t, y)), self.inverse_mass()
        rows, acting, bias = [], [], []
        for wall in pair:
            n, s, rate, _ = self.jacobians(wall, t, y)
            rows.append(n)
            acting.append(-n - side * self.rig.mu * s)
            bias.append(n @ a + rate)
        push = np.linalg.solve(np.array(rows) * w @ np.array(acting).T, -np.array(bias))
        return a + w * (push @ np.array(acting)), push, float(s @ self.velocities(t, y))

    def sit(self, end, pair, side):
        """Stay in a corner until a push or the slip is used up."""
        watched = [(lambda t, y, k=k: self.corner_forces(t, y, pair, side)[1][k], -1) for k in (0, 1)]
        watched.append((lambda t, y: side * self.corner_forces(t, y, pair, side)[2], -1))
        happened = self.integrate(end, (pair, side), watched)
        if happened in (0, 1):
            return self.choose(pair[1 - happened])
        assert happened < 0, "the spin came to rest in a corner: not part of this comparison"
        return (pair, side)

    def enter(self, i):
        """Rest on wall ``i``: no normal speed; slide or roll."""
        n = self.jacobians(i, self.t, self.y)[0]
        w = self.inverse_mass()
        self.kick(n * (-(n @ self.velocities(self.t, self.y)) / (n * w @ n)))
        self.onto(i)
        return self.choose(i)

    def choose(self, i, slip=None):
        if slip is None:
            slip = self.contact_forces(self.t, self.y, (i, 0))[3]
        if abs(slip) > 1e-8:
            return (i, math.copysign(1.0, slip))
        roll = self.contact_forces(self.t, self.y, (i, 0))[4]
        if abs(roll[1]) <= self.rig.mu * -roll[0]:
            return (i, 0)
        return (i, -math.copysign(1.0, roll[1]))

    def integrate(self, until, contact, watched):
        events = []
        for function, direction in watched:
            event = lambda t, y, f=function: f(t, y)
            event.terminal, event.direction = True, direction
            events.append(event)
        part = solve_ivp(lambda t, y: self.slope(t, y, contact), (self.t, until), self.y, method="DOP853", rtol=1e-11,
                         atol=1e-13, events=events, dense_output=True, max_step=4e-3)  # fmt: skip
        self.pieces.append((self.t, float(part.t[-1]), part.sol))
        self.t, self.y = float(part.t[-1]), part.y[:, -1].copy()
        return next((k for k, hits in enumerate(part.t_events) if len(hits)), -1)

    def run(self, end, most=400):
        contact = None
        since = 0.0
        while self.t < end and len(self.impacts) < most:
            if contact is None:
                contact = self.fly(end)
                since = self.t
                continue
            before, contact = contact, self.stay(end, contact)
            if contact is None or self.t >= end or contact[0] != before[0]:
                self.held.append((since, self.t))
                since = self.t
        return self

    def fly(self, end):
        walls = self.walls()
        # just off a wall: half the way to its return is safe, and keeps the root at the start from being found again
        blind, touching = 2e-4, False
        for i in walls:
            gap = self.wall(i, self.t, self.y)[0]
            n, _, rate, _ = self.jacobians(i, self.t, self.y)
            away = -float(n @ self.velocities(self.t, self.y))
            pull = float(n @ np.array(self.free(self.t, self.y)) + rate)
            if gap < TOUCHING:
                touching = True
                blind = min(blind, 0.5 * away / max(pull, 1e-9) if away > 0 else 2e-6)
            elif away < 0:
                blind = min(blind, -0.5 * gap / away)
        if touching:
            self.integrate(min(end, self.t + blind), None, [])
        if self.t >= end:
            return None
        hit = self.integrate(end, None, [(lambda t, y, i=i: self.wall(i, t, y)[0], -1) for i in walls])
        return self.strike(walls[hit]) if hit >= 0 else None

    def stay(self, end, contact):
        i, mode = contact
        if isinstance(i, tuple):
            return self.sit(end, i, mode)
        others = [j for j in self.walls() if j != i]
        mu = self.rig.mu
        watched = [(lambda t, y: self.contact_forces(t, y, contact)[1], -1)]
        if mode != 0 and mu > 0:
            watched.append((lambda t, y: mode * self.contact_forces(t, y, contact)[3], -1))
        elif mode == 0:
            watched.append((lambda t, y: -mu * self.contact_forces(t, y, contact)[4][0]
                            - abs(self.contact_forces(t, y, contact)[4][1]), -1))  # fmt: skip
        first = len(watched)
        watched += [(lambda t, y, j=j: self.wall(j, t, y)[0], -1) for j in others]
        if self.contact_forces(self.t, self.y, contact)[1] <= 0:
            return None
        happened = self.integrate(end, contact, watched)
        if happened < 0:
            return contact
        if happened == 0:
            return None
        if happened >= first:
            return self.strike(others[happened - first])
        if mode != 0:
            return self.choose(i, 0.0)
        roll = self.contact_forces(self.t, self.y, contact)[4]
        return (i, -math.copysign(1.0, roll[1]))

    def at(self, times):
        """States (n, 12) at times; the later piece wins at a joint."""
        out = np.full((len(times), 12), np.nan)
        for start, stop, solution in self.pieces:
            inside = (times >= start) & (times <= stop)
            if inside.any():
                out[inside] = solution(times[inside]).T
        return out
