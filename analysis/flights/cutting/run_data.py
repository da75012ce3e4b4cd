"""What the flight fit needs of one run."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.flight_rig import NO_LAW, NO_WAY, FlightRig
from analysis.flights.cutting.way_slid import way_slid
from analysis.motion.host_path import HostMotion
from analysis.motion.rig_frame import own_units
from analysis.walls.wall import Wall
from ovines.core.laws.terms import asks_for_contacts, asks_for_way

Array = NDArray[np.float64]

# Degree of the lens residual's polynomials: what remains of one beyond it changes its sign within a fifth of the
# contact radius (analysis.bounces.noise).
LENS_DEGREE = 4
#: powers (i, j) of the lens-residual polynomials x^i y^j in units of the contact radius
LENS_POWERS = [(d - j, j) for d in range(1, LENS_DEGREE + 1) for j in range(d + 1)]
# Where the motion gives no angle, the flight fit sees one of no weight.
NO_ANGLE_SD_RAD = 1e6
#: the lens residual's coefficients (m), first all along x
LENS_TERMS = [f"lens_{axis}_{i}{j}" for axis in "xy" for i, j in LENS_POWERS]


class Contact(NamedTuple):
    """Where the disk touched the wall, from the Host's centre (m), its normal speed before that (m/s), its angle then
    (rad), the tangential speed of the contact point before (m/s), the speed against the Host that it left the disk
    (m/s), the direction in which it pushed the Host (rad), and the spin that it gave the disk (rad/s).
    """

    x_m: float
    y_m: float
    approach_m_per_s: float
    angle_rad: float
    slip_m_per_s: float
    left_m_per_s: float
    push_rad: float
    spun_rad_per_s: float = 0.0


NO_CONTACT = Contact(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class RunData:
    """What the fit needs of one run: N frames; NaN where the NES was not seen; ``stated``: the wall as designed (None:
    round); ``law``: packed terms of a written law; ``number`` of the run in its series, from 0; ``friction_share``: its
    floor friction over the one that the series shares; ``later_s``: from its start to its middle, less the runs'
    mean of that, for a friction that drifts from the start on; ``middle_m``: the disk's geometric centre, where the
    floor's friction acts, from its centre of mass, in the disk's frame.
    """

    name: str
    time_s: Array
    xy_m: Array
    angle_rad: Array
    xy_sd_m: Array
    angle_sd_rad: Array
    host: HostMotion
    contact_radius_m: float
    radius_m: float
    inertia_factor: float
    stated: Wall | None = None
    law: Array = field(default_factory=NO_LAW.copy)
    number: int = 0
    friction_share: float = 1.0
    later_s: float = 0.0
    middle_m: tuple[float, float] = (0.0, 0.0)

    @property
    def wall(self) -> Wall:
        """The wall as it was designed."""
        return self.stated or Wall.ring(self.contact_radius_m)

    @cached_property
    def period_s(self) -> float:
        """From frame to frame (median)."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 1.0

    @property
    def own_units(self) -> tuple[float, float]:
        """Metres and seconds of these data in one of the rig's own."""
        return own_units(self.contact_radius_m)

    @cached_property
    def host_at_frames(self) -> tuple[Array, Array]:
        """The Host's place and angle (N, 4) at all frames, and their rates."""
        return self.host.at(self.time_s), self.host.at(self.time_s, 1)

    @cached_property
    def lens_terms(self) -> Array:
        """:func:`lens_basis` at the places of all frames (N, len(LENS_POWERS))."""
        return lens_basis(self.xy_m, self.contact_radius_m)

    @property
    def start_s(self) -> float:
        """Time of the first frame; 0 without any."""
        return float(self.time_s[0]) if len(self.time_s) else 0.0

    @cached_property
    def start_rad(self) -> float:
        """Angle of the disk in the first frame that shows it; 0 without any."""
        seen = np.flatnonzero(self.angle_sd_rad < NO_ANGLE_SD_RAD)
        return float(self.angle_rad[seen[0]]) if len(seen) else 0.0

    @cached_property
    def remembers(self) -> bool:
        """Whether the law that the run holds asks for contacts before a flight."""
        return asks_for_contacts(self.law) or asks_for_way(self.law)

    @cached_property
    def way(self) -> Array:
        """Time (s) of each frame and what the disk remembers then of its way over the floor (N, 1 + MEMORY_SIZE)."""
        return way_slid(self.time_s, self.xy_m, self.host_at_frames, self.contact_radius_m)

    @cached_property
    def contacts(self) -> dict[tuple[int, ...], Contact]:
        """`contact_before` (:mod:`analysis.flights.cutting.impact_before`) by the frames of both flights: it is asked
        for at each step of each fit.
        """
        return {}

    @cached_property
    def flight_rig(self) -> FlightRig:
        """What a flight knows of this run beside its parameters."""
        return FlightRig(
            self.host.table(self.time_s[0], self.time_s[-1]) if len(self.time_s) else self.host.table(0.0, 1.0),
            float(self.host.omega_rad_per_s),
            float(self.radius_m),
            float(self.inertia_factor),
            float(self.contact_radius_m),
            float(self.host.phase_rad),
            self.law,
            self.start_s,
            float(self.number),
            *self.middle_m,
            self.start_rad,
            self.way if asks_for_way(self.law) else NO_WAY,
        )


def lens_basis(xy_m: Array, contact_radius_m: float) -> Array:
    """Polynomials (N, len(LENS_POWERS)) of the places ``xy_m`` (N, 2) in the room."""
    x, y = xy_m[:, 0] / contact_radius_m, xy_m[:, 1] / contact_radius_m
    return np.stack([x**i * y**j for i, j in LENS_POWERS], -1)
