"""How strongly each term of the flight model pushes this rig's disk: its acceleration per unit, over the flights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flights.fit import FlightFits, impact_before
from analysis.flights.model import FlightRig, acceleration
from analysis.flights.parameters import INDEX, PARAMETERS, STEPS
from analysis.motion.host_table import host_at

Array = NDArray[np.float64]
# Every so many frames of a flight are enough for a root mean square.
STRIDE = 4


def unit_accelerations(fits: Sequence[FlightFits]) -> tuple[dict[str, float], float]:
    """RMS acceleration (m/s^2) that a unit of each parameter adds along the fitted flights, and the disk's RMS speed
    against the Host (m/s).

    A torque counts as the force at the rim that would make it."""
    total, speed, count = np.zeros(len(PARAMETERS)), 0.0, 0
    for fit in fits:
        p = fit.parameters.copy()
        for k, flight in enumerate(fit.flights):
            p[INDEX["impact_before_s"]] = impact_before(fit.run, fit.flights, k)
            times = fit.run.time_s[flight.first : flight.last + 1 : STRIDE]
            states, _ = fit.flown(k, np.ascontiguousarray(times))
            speed += _add(times, states, p, STEPS, fit.run.flight_rig, total)
            count += len(times)
    root = np.sqrt(total / max(count, 1))
    return {name: float(root[i]) for name, i in INDEX.items()}, float(np.sqrt(speed / max(count, 1)))


@compiled
def _add(times: Array, states: Array, p: Array, steps: Array, rig: FlightRig, total: Array) -> float:
    """Adds to ``total`` (P,) the squares at each of ``times`` (N,) and ``states`` (N, 6); returns those of the speed
    against the Host."""
    rim = rig.radius_m * rig.inertia_factor
    speed = 0.0
    for i in range(len(times)):
        none = acceleration(times[i], states[i], p, rig)
        host = host_at(times[i], rig.host)
        speed += (states[i, 3] - host.vx) ** 2 + (states[i, 4] - host.vy) ** 2
        for j in range(len(steps)):
            kept = p[j]
            p[j] = kept + steps[j]
            one = acceleration(times[i], states[i], p, rig)
            p[j] = kept
            total[j] += ((one.x - none.x) ** 2 + (one.y - none.y) ** 2 + (rim * (one.spin - none.spin)) ** 2) / steps[
                j
            ] ** 2
    return speed
