"""Resolve a contact: an impact in an instant, a contact of finite duration, or the end of a chatter."""

from __future__ import annotations

import math
from typing import NamedTuple

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, making_arrays
from ovines.core.laws import words as W
from ovines.core.laws.kernel import law_of
from ovines.core.laws.targets import TARGETS
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import contact_bias, free_accelerations, push
from ovines.core.system.impact import effective_restitution, impulses
from ovines.core.system.kinematics import contact_velocity, inverse_mass, normal_here, place, wall_and_centre
from ovines.core.system.known import contact_known
from ovines.core.system.packed import Face, System

RESTITUTION, WALL_FRICTION, TANGENTIAL_RESTITUTION, SPIN_KEPT, SPIN_ADDED, CONTACT_NORMAL = (
    TARGETS[name].code
    for name in (
        "restitution", "wall_friction", "tangential_restitution", "spin_kept", "spin_added", "contact_normal",
    )
)  # fmt: skip

REST_HEIGHT = 1e-13  # of the contact radius: a bounce lower than this ends a chatter


class BlowLaw(NamedTuple):
    """The contact law's numbers at one impact, whatever laws add to them."""

    restitution: float
    friction: float
    tangential_restitution: float


class Spring(NamedTuple):
    """A contact of finite duration: stiffness (N/m) and damping (N s/m) along the normal, stiffness along the wall, and
    the wall's friction coefficient."""

    stiffness: float
    damping: float
    tangential_stiffness: float
    friction: float


@compiled
def onto_wall(y: Floats, at: Floats, wall: int, p: Floats, k: Ints, polygon: Floats) -> None:
    """Shift the NES by rounding so that it stands on the wall, never outside it."""
    face = normal_here(wall, at, p, k, polygon)
    shift = face.gap - 2e-16 * p[P.LENGTH]
    y[S.X] += shift * face.x
    y[S.Y] += shift * face.y


@compiled
def pull_to_wall(t: float, y: Floats, wall: int, system: System, work: Floats) -> float:
    """Acceleration towards the wall that free motion would have here (m/s^2), path curvature included."""
    p, k, polygon = system.p, system.k, system.polygon
    scratch, at, dy = work[P.SCRATCH], work[P.PLACE], work[P.SPARE]
    place(t, y, system, scratch, at)
    free_accelerations(t, y, at, system, scratch, dy)
    face = normal_here(wall, at, p, k, polygon)
    return contact_bias(y, at, face, dy, p, k, scratch)[0]


@making_arrays
def resolve(
    t: float,
    y: Floats,
    wall: int,
    system: System,
    work: Floats,
    record: Floats,
) -> tuple[int, float, bool]:
    """Resolve a contact with ``wall`` at ``t``, in place: (mode after, duration, whether it was an impact).

    Approaches so slow that the bounce would stay below REST_HEIGHT are no impact: the disk then slides or
    rolls on if something pulls it to the wall (chatter completed), or flies on.  ``record`` gets the impact.
    """
    p, k, polygon = system.p, system.k, system.polygon
    scratch, at = work[P.SCRATCH], work[P.PLACE]
    place(t, y, system, scratch, at)
    face = normal_here(wall, at, p, k, polygon)
    onto_wall(y, at, wall, p, k, polygon)
    place(t, y, system, scratch, at)
    k_nn, _k_nt, k_tt = inverse_mass(face, at, p)
    normal, tangential = contact_velocity(face, y[S.SPIN], at, p)
    pull = pull_to_wall(t, y, wall, system, work)
    slow = math.sqrt(2.0 * REST_HEIGHT * p[P.LENGTH] * abs(pull))
    if normal <= slow:
        push(at, face, -normal / k_nn, 0.0, p, k, y)
        return (P.SLIDE if pull > 0.0 else P.FLIGHT), 0.0, False
    azimuth = math.atan2(at[S.Y] - at[S.HOST_Y] + p[P.RADIUS] * face.y, at[S.X] - at[S.HOST_X] + p[P.RADIUS] * face.x)
    law = BlowLaw(effective_restitution(normal, azimuth, t, p), p[P.WALL_FRICTION], p[P.TANGENTIAL_RESTITUTION])
    blow = face
    known = work[P.SPARE]  # replaced where a law asks
    if system.law.shape[0] > 0:
        wall_speed, passing = wall_and_centre(face, at)
        known = contact_known(t, y, at, scratch, (azimuth, normal, tangential, wall_speed, passing), p, k)
        known[W.AT_CYLINDER] = 1.0 if wall == P.OBSTACLE else 0.0
        known[W.NORMAL] = math.atan2(face.y, face.x)
        known[W.WALL_ACCELERATION] = known[W.HOST_AX] * face.x + known[W.HOST_AY] * face.y
        law = with_written(law, system.law, known)
        blow = turned(face, law_of(CONTACT_NORMAL, system.law, known), y[S.SPIN], at, p)
    record[P.TIME], record[P.AZIMUTH], record[P.WALL] = t, azimuth, wall
    record[P.NORMAL] = math.atan2(face.y, face.x)
    record[P.NORMAL_BEFORE], record[P.TANGENTIAL_BEFORE], record[P.SPIN_BEFORE] = normal, tangential, y[S.SPIN]
    duration = 0.0
    lost, along, worked = y[P.LOST_NORMAL], y[P.LOST_TANGENT], y[P.WORK]
    if p[P.CONTACT_DURATION] > 0.0:
        duration, stuck = press(t, y, wall, law, k_nn, k_tt, system, work)
        place(t + duration, y, system, scratch, at)
        face = normal_here(wall, at, p, k, polygon)
        onto_wall(y, at, wall, p, k, polygon)
        after_n, after_t = contact_velocity(face, y[S.SPIN], at, p)
    else:
        after_n, after_t, stuck = strike(y, at, blow, law, p, k)
        if blow.x != face.x or blow.y != face.y:
            place(t, y, system, scratch, at)
            after_n, after_t = off_the_wall(y, at, face, p, k)
    if system.law.shape[0] > 0 and spun_by(system.law, known, y, p, k):
        place(t + duration, y, system, scratch, at)
        after_n, after_t = contact_velocity(face, y[S.SPIN], at, p)
    record[P.NORMAL_AFTER], record[P.TANGENTIAL_AFTER], record[P.SPIN_AFTER] = after_n, after_t, y[S.SPIN]
    record[P.STUCK] = 1.0 if stuck else 0.0
    along = y[P.LOST_TANGENT] - along if k[P.STATE_SIZE] > 6 else math.nan
    record[P.LOST_ALONG], record[P.LOST] = along, along + y[P.LOST_NORMAL] - lost
    record[P.WORKED] = y[P.WORK] - worked
    pull = pull_to_wall(t + duration, y, wall, system, work)
    if pull > 0.0 and after_n * after_n < 2.0 * pull * REST_HEIGHT * p[P.LENGTH]:
        place(t + duration, y, system, scratch, at)
        push(at, face, -after_n / k_nn, 0.0, p, k, y)
        return P.SLIDE, duration, True
    return P.FLIGHT, duration, True


@compiled
def with_written(law: BlowLaw, rows: Floats, known: Floats) -> BlowLaw:
    """``law`` with what written laws of packed ``rows`` add to its numbers, each within its bounds."""
    return BlowLaw(
        min(max(law.restitution + law_of(RESTITUTION, rows, known), 0.0), 1.0),
        max(law.friction + law_of(WALL_FRICTION, rows, known), 0.0),
        min(max(law.tangential_restitution + law_of(TANGENTIAL_RESTITUTION, rows, known), -1.0), 1.0),
    )


@compiled
def turned(face: Face, angle: float, spin: float, at: Floats, p: Floats) -> Face:
    """The wall whose normal is turned by ``angle`` (rad, counterclockwise); itself where the disk of this ``spin``
    (rad/s) would not come into the turned one."""
    c, s = math.cos(angle), math.sin(angle)
    other = Face(c * face.x - s * face.y, s * face.x + c * face.y, face.gap, face.curvature)
    return other if angle != 0.0 and contact_velocity(other, spin, at, p)[0] > 0.0 else face


@compiled
def strike(y: Floats, at: Floats, face: Face, law: BlowLaw, p: Floats, k: Ints) -> tuple[float, float, bool]:
    """An impact in an instant, in place; the contact point's velocity after it along ``face``'s normal and tangent, and
    whether it stuck."""
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    normal, tangential = contact_velocity(face, y[S.SPIN], at, p)
    p_n, p_t, stuck = impulses(
        normal, tangential, k_nn, k_nt, k_tt, law.restitution, law.friction, law.tangential_restitution
    )
    push(at, face, p_n, p_t, p, k, y)
    after_n = normal + k_nn * p_n + k_nt * p_t
    after_t = tangential + k_nt * p_n + k_tt * p_t
    if k[P.STATE_SIZE] > 6:
        y[P.LOST_NORMAL] -= 0.5 * p_n * (normal + after_n)
        y[P.LOST_TANGENT] -= 0.5 * p_t * (tangential + after_t)
    return after_n, after_t, stuck


@compiled
def off_the_wall(y: Floats, at: Floats, face: Face, p: Floats, k: Ints) -> tuple[float, float]:
    """The contact point's velocity along ``face``'s normal and tangent after a blow that was turned; where that was
    into the wall it does not go through it."""
    normal, tangential = contact_velocity(face, y[S.SPIN], at, p)
    if normal <= 0.0:
        return normal, tangential
    k_nn = inverse_mass(face, at, p)[0]
    push(at, face, -normal / k_nn, 0.0, p, k, y)
    if k[P.STATE_SIZE] > 6:
        y[P.LOST_NORMAL] += 0.5 * normal * normal / k_nn
    return 0.0, tangential


@compiled
def spun_by(rows: Floats, known: Floats, y: Floats, p: Floats, k: Ints) -> bool:
    """The spin that written laws of packed ``rows`` leave of that after a contact, in place; whether they change it.

    Taken out of the contact: the speeds after it are those that the disk leaves with."""
    known[W.SPIN_LEFT] = y[S.SPIN]
    spin = (1.0 + law_of(SPIN_KEPT, rows, known)) * y[S.SPIN] + law_of(SPIN_ADDED, rows, known)
    changed: bool = spin != y[S.SPIN]
    if k[P.STATE_SIZE] > 6:
        y[P.LOST_TANGENT] += 0.5 * p[P.INERTIA] * (y[S.SPIN] * y[S.SPIN] - spin * spin)
    y[S.SPIN] = spin
    return changed


@compiled
def press(
    t: float,
    y: Floats,
    wall: int,
    law: BlowLaw,
    k_nn: float,
    k_tt: float,
    system: System,
    work: Floats,
) -> tuple[float, bool]:
    """Kelvin-Voigt contact of finite duration, integrated in place: (time taken, whether it never slid).

    Spring and damper are those of a half period T with the ``law``'s restitution (d = -ln(eps)/T); the tangential
    spring would give beta_0 (cos(w s) = -beta_0) at the time s after which the damper pulls instead of pushing, and
    is cut at the Coulomb limit.  Ends when the disk leaves the wall.
    """
    p, k, polygon = system.p, system.k, system.polygon
    span = p[P.CONTACT_DURATION]
    rate = -math.log(max(law.restitution, 1e-6)) / span
    stiffness = ((math.pi / span) ** 2 + rate * rate) / k_nn
    damping = 2.0 * rate / k_nn
    omega = math.pi / span
    pushing = (math.pi - math.atan2(2.0 * rate * omega, omega * omega - rate * rate)) / omega
    tangential_stiffness = (math.acos(-law.tangential_restitution) / pushing) ** 2 / k_tt
    spring = Spring(stiffness, damping, tangential_stiffness, law.friction)
    n = k[P.STATE_SIZE]
    h = span / 250.0
    stretch, stuck, passed = 0.0, True, 0.0
    end = p[P.DURATION] - t
    trial, slopes = work[P.TRIAL], work
    while passed < end:
        base_stretch = stretch
        for stage in range(4):
            part = (0.0, 0.5, 0.5, 1.0)[stage]
            for j in range(n):
                trial[j] = y[j] + (part * h * slopes[stage - 1, j] if stage > 0 else 0.0)
            if stage > 0:
                stretch = base_stretch + part * h * work[4 + stage - 1, 0]
            work[4 + stage, 0] = press_slopes(
                t + passed + part * h,
                trial,
                wall,
                stretch,
                spring,
                system,
                work,
                slopes[stage],
            )
        for j in range(n):
            y[j] += h / 6.0 * (slopes[0, j] + 2.0 * slopes[1, j] + 2.0 * slopes[2, j] + slopes[3, j])
        stretch = base_stretch + h / 6.0 * (work[4, 0] + 2.0 * work[5, 0] + 2.0 * work[6, 0] + work[7, 0])
        passed += h
        scratch, at = work[P.SCRATCH], work[P.PLACE]
        place(t + passed, y, system, scratch, at)
        face = normal_here(wall, at, p, k, polygon)
        normal = contact_velocity(face, y[S.SPIN], at, p)[0]
        limit = law.friction * max(-stiffness * face.gap + damping * normal, 0.0) / tangential_stiffness
        if abs(stretch) > limit:
            stretch = math.copysign(limit, stretch)
            if face.gap < 0.0:
                stuck = False
        if normal < 0.0 and face.gap - normal * 1e-3 * h >= 0.0:
            return passed, stuck
        if normal < 0.0:  # shorten the last step to leave at the wall
            h = min(span / 250.0, max(-face.gap / -normal, 1e-3 * span / 250.0))
    return passed, stuck


@compiled
def press_slopes(
    t: float, y: Floats, wall: int, stretch: float, spring: Spring, system: System, work: Floats, dy: Floats
) -> float:
    """Derivative of the state while pressed into the wall; returns the rate of the tangential stretch."""
    p, k, polygon = system.p, system.k, system.polygon
    scratch, at = work[P.SCRATCH], work[P.PLACE]
    place(t, y, system, scratch, at)
    free_accelerations(t, y, at, system, scratch, dy)
    face = normal_here(wall, at, p, k, polygon)
    normal, slip = contact_velocity(face, y[S.SPIN], at, p)
    squeeze = -spring.stiffness * face.gap + spring.damping * normal
    limit = spring.friction * max(squeeze, 0.0)
    force_t = -min(max(spring.tangential_stiffness * stretch, -limit), limit)
    push(at, face, -squeeze, force_t, p, k, dy)
    if k[P.STATE_SIZE] > 6:
        dy[P.LOST_NORMAL] += squeeze * normal
        dy[P.LOST_TANGENT] -= force_t * slip
    return slip
