"""What happens at the wall in a bounce sequence: gap and speeds of the contact point, an instant impulse, a contact
that lasts, and staying there.

A contact that lasts is a spring with a dashpot that never pulls.  With damping ratio z and undamped frequency w it ends
after (pi - 2 asin z) / (w sqrt(1 - z^2)) with a restitution exp(-z (pi - 2 asin z) / sqrt(1 - z^2)) (Schwager and
Poeschel, Granular Matter 9, 465 (2007)).  The Host's acceleration and the wall's curvature act meanwhile: slow impacts
come out slower than they went in by more than the restitution, and the slowest not at all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.equation.model import ANGLE, SPIN, VX, VY, X, Y
from analysis.motion.host_table import host_at
from analysis.walls.surfaces import nearest_surface, surface_seen

Array = NDArray[np.float64]
#: columns of an impact's record
RECORD = (
    "time",
    "normal_before",
    "normal_after",
    "tangential_before",
    "tangential_after",
    "spin_before",
    "spin_after",
    "azimuth",
    "surface",
)
SURFACE = RECORD.index("surface")
TIME, AZIMUTH = RECORD.index("time"), RECORD.index("azimuth")
NORMAL_BEFORE, NORMAL_AFTER = RECORD.index("normal_before"), RECORD.index("normal_after")
TANGENTIAL_BEFORE, TANGENTIAL_AFTER = RECORD.index("tangential_before"), RECORD.index("tangential_after")
SPIN_BEFORE, SPIN_AFTER = RECORD.index("spin_before"), RECORD.index("spin_after")

# A spring with a dashpot needs some restitution: at 0.02 its damping ratio is 0.9.
LEAST_RESTITUTION, MOST_RESTITUTION = 0.02, 1.0
# Halvings of the damping ratio's bracket: to 1e-9.
BISECTIONS, LARGEST_DAMPING = 30, 0.999


class BounceRig(NamedTuple):
    """What a bounce sequence knows of rig and laws: the flight's part and its ``parameters``
    (:mod:`analysis.flights.equation.parameters`), wall and contact law.

    ``surfaces`` (S, 6) of the wall (:mod:`analysis.walls.surfaces`), ``disk`` the disk's geometric centre seen from its
    centre of mass (m).  The restitution at approach speed v is
    restitution + restitution_rise exp(-v / restitution_speed_m_per_s).  Slower than ``stop_speed_m_per_s`` the disk
    stays at the wall; ``wall_frequency_per_s``: undamped, of a contact that lasts, 0 for an instant one.
    """

    flight: FlightRig
    parameters: Array
    surfaces: Array
    disk_x_m: float
    disk_y_m: float
    wall_friction: float
    tangential_restitution: float
    stop_speed_m_per_s: float
    wall_frequency_per_s: float
    restitution: float
    restitution_rise: float
    restitution_speed_m_per_s: float


class ContactView(NamedTuple):
    """The contact point as the wall sees it: ``gap`` beyond the wall (m, > 0: outside), speeds along its normal and its
    tangent (m/s), azimuth of the contact and direction of the normal (rad), number of the surface."""

    gap: float
    normal_speed: float
    tangential_speed: float
    azimuth: float
    normal: float
    surface: int


class LastingContact(NamedTuple):
    """A contact under way: the dashpot's coefficient (1/s), the tangential impulse per mass left (m/s, signed), when it
    began (s)."""

    dashpot: float
    tangential_left: float
    since: float


@compiled
def damping_ratio(restitution: float) -> float:
    """z at which a spring with a dashpot that never pulls has this restitution, by bisection."""
    low, high = 0.0, LARGEST_DAMPING
    for _ in range(BISECTIONS):
        z = 0.5 * (low + high)
        if np.exp(-z * (np.pi - 2 * np.arcsin(z)) / np.sqrt(1 - z * z)) > restitution:
            low = z
        else:
            high = z
    return 0.5 * (low + high)


def wall_frequency(restitution: float, delay_s: float) -> float:
    """Undamped frequency (1/s) at which straight paths before and after a contact meet ``delay_s`` after its beginning;
    0 for none.

    At its end the disk is still 2 z e v / w past the wall, with e v away from it."""
    if not delay_s > 0:
        return 0.0
    z = damping_ratio(min(max(restitution, LEAST_RESTITUTION), MOST_RESTITUTION))
    ends = (np.pi - 2 * np.arcsin(z)) / np.sqrt(1 - z * z)
    return float(restitution * (2 * z + ends) / ((1 + restitution) * delay_s))


@compiled
def contact_view(y: Array, t: float, rig: BounceRig, shift_m: float) -> ContactView:
    """The contact point of a disk in state ``y`` (6,) at t; the wall stands out by ``shift_m`` here."""
    host = host_at(t, rig.flight.host)
    cd, sd = np.cos(y[ANGLE]), np.sin(y[ANGLE])
    cx = y[X] + cd * rig.disk_x_m - sd * rig.disk_y_m
    cy = y[Y] + sd * rig.disk_x_m + cd * rig.disk_y_m
    which = nearest_surface(rig.surfaces, cx - host.x, cy - host.y, host.angle, rig.flight.radius_m)
    seen = surface_seen(rig.surfaces[which], cx - host.x, cy - host.y, host.angle, rig.flight.radius_m)
    ex, ey = np.cos(seen.normal), np.sin(seen.normal)
    px, py = cx + rig.flight.radius_m * ex, cy + rig.flight.radius_m * ey
    vx = y[VX] - y[SPIN] * (py - y[Y]) - host.vx + host.spin * (py - host.y)
    vy = y[VY] + y[SPIN] * (px - y[X]) - host.vy - host.spin * (px - host.x)
    return ContactView(seen.gap - shift_m, vx * ex + vy * ey, -vx * ey + vy * ex, seen.azimuth, seen.normal, which)


@compiled
def _kick(y: Array, view: ContactView, rig: BounceRig, normal_impulse: float, tangential: float) -> None:
    """``y`` after an impulse per mass against the wall's normal and ``tangential`` along the wall."""
    ex, ey = np.cos(view.normal), np.sin(view.normal)
    y[VX] += -normal_impulse * ex - tangential * ey
    y[VY] += -normal_impulse * ey + tangential * ex
    y[SPIN] += tangential / (rig.flight.inertia_factor * rig.flight.radius_m)


@compiled
def push(y: Array, view: ContactView, rig: BounceRig, normal_impulse: float, tangential_restitution: float) -> float:
    """``y`` after an impulse per mass along the wall's normal and what wall friction gives along it, which is
    returned.
    """
    share = 1 + 1 / rig.flight.inertia_factor
    slip = view.tangential_speed
    tangential = -np.sign(slip) * min(
        (1 + tangential_restitution) * abs(slip) / share, rig.wall_friction * normal_impulse
    )
    _kick(y, view, rig, normal_impulse, tangential)
    return tangential


@compiled
def touch(y: Array, view: ContactView, rig: BounceRig, deviation: float, record: Array, t: float) -> LastingContact:
    """A contact that lasts begins: ``record`` filled but for what comes after it."""
    record[TIME], record[AZIMUTH], record[SURFACE] = t, view.azimuth, view.surface
    record[NORMAL_BEFORE], record[NORMAL_AFTER] = view.normal_speed, 0.0
    record[TANGENTIAL_BEFORE], record[TANGENTIAL_AFTER] = view.tangential_speed, view.tangential_speed
    record[SPIN_BEFORE], record[SPIN_AFTER] = y[SPIN], y[SPIN]
    return LastingContact(
        2 * damping_ratio(restitution_at(view.normal_speed, rig, deviation)) * rig.wall_frequency_per_s,
        -(1 + rig.tangential_restitution) * view.tangential_speed / (1 + 1 / rig.flight.inertia_factor),
        t,
    )


@compiled
def squeeze(
    y: Array, view: ContactView, rig: BounceRig, h: float, caught: bool, contact: LastingContact
) -> LastingContact:
    """What the wall does to ``y`` in h: spring and dashpot, and friction until the law's tangential impulse is spent; a
    disk that is ``caught`` is rubbed as long as it slips.
    """
    force = (rig.wall_frequency_per_s**2 * view.gap + contact.dashpot * view.normal_speed) / (
        1 + 0.5 * h * contact.dashpot
    )
    if force <= 0:
        return contact
    if caught:
        push(y, view, rig, force * h, 0.0)
        return contact
    tangential = np.sign(contact.tangential_left) * min(abs(contact.tangential_left), rig.wall_friction * force * h)
    _kick(y, view, rig, force * h, tangential)
    return LastingContact(contact.dashpot, contact.tangential_left - tangential, contact.since)


@compiled
def stay(y: Array, view: ContactView, later: ContactView, rig: BounceRig, h: float) -> None:
    """Put ``y``, after a free step of h from the wall (``view``) to past it (``later``), back on the wall: no gap, no
    normal speed.
    """
    ex, ey = np.cos(later.normal), np.sin(later.normal)
    # The wall pushes along a normal that turns meanwhile, and rubs all along the step.
    turned = 0.5 * np.sin(later.normal - view.normal) * later.normal_speed
    rubbed = push(y, later, rig, max(later.normal_speed, 0.0), 0.0)
    normal = min(later.normal_speed, 0.0)
    y[X] += -later.gap * ex - 0.5 * h * rubbed * ey
    y[Y] += -later.gap * ey + 0.5 * h * rubbed * ex
    y[VX] += -normal * ex - turned * ey
    y[VY] += -normal * ey + turned * ex


@compiled
def restitution_at(speed: float, rig: BounceRig, deviation: float) -> float:
    """Restitution at an approach ``speed`` (m/s), off the law by ``deviation``."""
    law = rig.restitution + rig.restitution_rise * np.exp(-speed / rig.restitution_speed_m_per_s)
    return min(max(law + deviation, LEAST_RESTITUTION), MOST_RESTITUTION)


@compiled
def strike(y: Array, view: ContactView, rig: BounceRig, deviation: float, record: Array, t: float) -> None:
    """Luding's law at the contact, its restitution changed by ``deviation``: ``y`` after it, ``record`` filled."""
    share = 1 + 1 / rig.flight.inertia_factor
    restitution = restitution_at(view.normal_speed, rig, deviation)
    record[TIME], record[AZIMUTH], record[SURFACE] = t, view.azimuth, view.surface
    record[NORMAL_BEFORE], record[NORMAL_AFTER] = view.normal_speed, restitution * view.normal_speed
    record[TANGENTIAL_BEFORE], record[SPIN_BEFORE] = view.tangential_speed, y[SPIN]
    tangential = push(y, view, rig, (1 + restitution) * view.normal_speed, rig.tangential_restitution)
    record[TANGENTIAL_AFTER], record[SPIN_AFTER] = view.tangential_speed + share * tangential, y[SPIN]
