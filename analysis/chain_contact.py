"""What happens at the wall in a chain: gap and speeds of the contact point, an instant impulse, a contact that lasts, and staying there.

A contact that lasts is a spring with a dashpot that never pulls.  With damping ratio z and undamped frequency w it ends after
(pi - 2 asin z) / (w sqrt(1 - z^2)) with a restitution exp(-z (pi - 2 asin z) / sqrt(1 - z^2)) (Schwager and Poeschel, Granular Matter 9, 465
(2007)).  The Host's acceleration and the wall's curvature act meanwhile: slow impacts come out slower than they went in by more than the
restitution, and the slowest not at all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flight_model import host_at

Array = NDArray[np.float64]
#: columns of an impact's record
RECORD = ("time", "normal_before", "normal_after", "tangential_before", "tangential_after", "spin_before", "spin_after", "azimuth")
#: entries of ``rig``, after which the flight model's parameters follow as an array of their own; the restitution at approach speed v is
#: restitution + restitution_rise exp(-v / restitution_speed); wall_frequency (1/s): undamped, of a contact that lasts, 0 for an instant one
RIG = ("radius", "centre_x", "centre_y", "disk_x", "disk_y", "ellipse_c", "ellipse_s", "wall_friction", "tangential_restitution",
       "disk_radius", "inertia", "omega", "phase", "stop_speed", "wall_frequency", "restitution", "restitution_rise", "restitution_speed")
LEAST_RESTITUTION, MOST_RESTITUTION = 0.02, 1.0


@compiled
def damping_ratio(restitution: float) -> float:
    """z at which a spring with a dashpot that never pulls has this restitution, by bisection."""
    low, high = 0.0, 0.999
    for _ in range(30):
        z = 0.5 * (low + high)
        if np.exp(-z * (np.pi - 2 * np.arcsin(z)) / np.sqrt(1 - z * z)) > restitution:
            low = z
        else:
            high = z
    return 0.5 * (low + high)


def wall_frequency(restitution: float, delay_s: float) -> float:
    """Undamped frequency (1/s) at which straight paths before and after a contact meet ``delay_s`` after its beginning; 0 for none.

    At its end the disk is still 2 z e v / w past the wall, with e v away from it."""
    if not delay_s > 0:
        return 0.0
    z = damping_ratio(min(max(restitution, LEAST_RESTITUTION), MOST_RESTITUTION))
    ends = (np.pi - 2 * np.arcsin(z)) / np.sqrt(1 - z * z)
    return float(restitution * (2 * z + ends) / ((1 + restitution) * delay_s))


@compiled
def contact_view(y: Array, t: float, harmonics: Array, rig: Array, shift: float, host: Array, view: Array) -> None:
    """view = gap beyond the wall (m, > 0: outside), normal and tangential speed of the contact point, azimuth, normal's direction."""
    host_at(t, harmonics, rig[11], host)
    c, s = np.cos(host[3]), np.sin(host[3])
    cd, sd = np.cos(y[2]), np.sin(y[2])
    cx = y[0] + cd * rig[3] - sd * rig[4]
    cy = y[1] + sd * rig[3] + cd * rig[4]
    rx = cx - host[0] - (c * rig[1] - s * rig[2])
    ry = cy - host[1] - (s * rig[1] + c * rig[2])
    azimuth = np.arctan2(ry, rx)
    radius = rig[0] * (1 + rig[5] * np.cos(2 * azimuth) + rig[6] * np.sin(2 * azimuth)) + shift
    normal = azimuth + 2 * (rig[5] * np.sin(2 * azimuth) - rig[6] * np.cos(2 * azimuth))
    ex, ey = np.cos(normal), np.sin(normal)
    px, py = cx + rig[9] * ex, cy + rig[9] * ey
    vx = y[3] - y[5] * (py - y[1]) - host[4] + host[7] * (py - host[1])
    vy = y[4] + y[5] * (px - y[0]) - host[5] - host[7] * (px - host[0])
    view[1] = vx * ex + vy * ey
    view[0] = np.sqrt(rx * rx + ry * ry) - radius
    view[2] = -vx * ey + vy * ex
    view[3] = azimuth
    view[4] = normal


@compiled
def _kick(y: Array, view: Array, rig: Array, normal_impulse: float, tangential: float) -> None:
    """``y`` after an impulse per mass against the wall's normal and ``tangential`` along the wall."""
    ex, ey = np.cos(view[4]), np.sin(view[4])
    y[3] += -normal_impulse * ex - tangential * ey
    y[4] += -normal_impulse * ey + tangential * ex
    y[5] += tangential / (rig[10] * rig[9])


@compiled
def push(y: Array, view: Array, rig: Array, normal_impulse: float, tangential_restitution: float) -> float:
    """``y`` after an impulse per mass along the wall's normal and what wall friction gives along it, which is returned."""
    share = 1 + 1 / rig[10]
    tangential = -np.sign(view[2]) * min((1 + tangential_restitution) * abs(view[2]) / share, rig[7] * normal_impulse)
    _kick(y, view, rig, normal_impulse, tangential)
    return tangential


@compiled
def touch(y: Array, view: Array, rig: Array, deviation: float, record: Array, t: float, press: Array) -> None:
    """A contact that lasts begins: ``record`` filled but for what comes after; ``press`` (3,) takes the dashpot's coefficient (1/s), the
    tangential impulse left (signed) and the time of the touch."""
    record[0], record[1], record[2], record[3], record[4] = t, view[1], 0.0, view[2], view[2]
    record[5], record[6], record[7] = y[5], y[5], view[3]
    press[0] = 2 * damping_ratio(restitution_at(view[1], rig, deviation)) * rig[14]
    press[1] = -(1 + rig[8]) * view[2] / (1 + 1 / rig[10])
    press[2] = t


@compiled
def squeeze(y: Array, view: Array, rig: Array, h: float, caught: bool, press: Array) -> None:
    """What the wall does to ``y`` in h: spring and dashpot, and friction until the law's tangential impulse is spent; a disk that is
    ``caught`` is rubbed as long as it slips."""
    force = (rig[14] ** 2 * view[0] + press[0] * view[1]) / (1 + 0.5 * h * press[0])
    if force <= 0:
        return
    if caught:
        push(y, view, rig, force * h, 0.0)
        return
    tangential = np.sign(press[1]) * min(abs(press[1]), rig[7] * force * h)
    press[1] -= tangential
    _kick(y, view, rig, force * h, tangential)


@compiled
def stay(y: Array, view: Array, later: Array, rig: Array, h: float) -> None:
    """Put ``y``, after a free step of h from the wall (``view``) to past it (``later``), back on the wall: no gap, no normal speed."""
    ex, ey = np.cos(later[4]), np.sin(later[4])
    # The wall pushes along a normal that turns meanwhile, and rubs all along the step.
    turned = 0.5 * np.sin(later[4] - view[4]) * later[1]
    rubbed = push(y, later, rig, max(later[1], 0.0), 0.0)
    normal = min(later[1], 0.0)
    y[0] += -later[0] * ex - 0.5 * h * rubbed * ey
    y[1] += -later[0] * ey + 0.5 * h * rubbed * ex
    y[3] += -normal * ex - turned * ey
    y[4] += -normal * ey + turned * ex


@compiled
def restitution_at(speed: float, rig: Array, deviation: float) -> float:
    """Restitution at an approach ``speed``, off the law by ``deviation``."""
    return min(max(rig[15] + rig[16] * np.exp(-speed / rig[17]) + deviation, LEAST_RESTITUTION), MOST_RESTITUTION)


@compiled
def strike(y: Array, view: Array, rig: Array, deviation: float, record: Array, t: float) -> None:
    """Luding's law at the contact, its restitution changed by ``deviation``: ``y`` after it, ``record`` filled."""
    share = 1 + 1 / rig[10]
    restitution = restitution_at(view[1], rig, deviation)
    record[0], record[1], record[2], record[3] = t, view[1], restitution * view[1], view[2]
    record[5] = y[5]
    record[4] = view[2] + share * push(y, view, rig, (1 + restitution) * view[1], rig[8])
    record[6], record[7] = y[5], view[3]
