"""Whether the wall swings with the Host's markers: what the contact distances say of a swing.

A Host that recoils takes its wall along.  Where only what carries its markers rings, the disk meets a wall that stays
on its drive, however much alike the markers' paths are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from analysis.contact.impacts import intersect, measure
from analysis.contact.wall_fit import CUT_SD, DISTANCE_FLOOR_M, usable
from analysis.flights.fit import FlightFits
from analysis.gap.drive.measured_path import MeasuredPath
from analysis.gap.drive.pushes import RunPushes
from analysis.gap.drive.swings import Swing
from analysis.motion.host_path import HostMotion
from analysis.statistics.robust import at_least_noise, root_weights

Array = NDArray[np.float64]
# Contacts say something from so many beyond the unknowns of the wall.
FEWEST_BEYOND = 4
ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Contacts:
    """K contacts of a series: ``run`` and ``time_s`` (K,), how far past the wall the disk's edge is there (``gap_m``,
    K) with its sd, the wall's outward ``normal`` (K, 2), ``columns`` (K, P) by which wall and disk may be other than
    stated; ``hosts``: the path of each of the series' runs that gaps count against."""

    run: NDArray[np.int64]
    time_s: Array
    gap_m: Array
    sd_m: Array
    normal: Array
    columns: Array
    hosts: tuple[HostMotion, ...]

    @classmethod
    def of(cls, fits: Sequence[FlightFits]) -> Contacts:
        """Where fitted flights meet."""
        junctions, hosts = intersect(fits), tuple(fit.run.host for fit in fits)
        if not len(junctions):
            nil = np.zeros(0)
            return cls(junctions.run, nil, nil, nil, np.zeros((0, 2)), np.zeros((0, 1)), hosts)
        wall = fits[0].run.wall
        impacts = measure(junctions, wall)
        used = np.flatnonzero(usable(impacts, wall.size_m))
        normal = impacts.normal_rad[used]
        # A contact that lasts goes with the speed of approach.
        columns = [impacts.design(wall.nominal_terms), impacts.of("normal_before")[:, None]]
        return cls(
            junctions.run[used],
            junctions.time_s[used],
            impacts.of("gap")[used],
            np.hypot(impacts.sd("gap")[used], DISTANCE_FLOOR_M),
            np.column_stack([np.cos(normal), np.sin(normal)]),
            np.hstack(columns)[used],
            hosts,
        )

    def at(self, chosen: NDArray[np.bool_]) -> Contacts:
        """Those that a mask (K,) selects."""
        return replace(
            self,
            run=self.run[chosen],
            time_s=self.time_s[chosen],
            gap_m=self.gap_m[chosen],
            sd_m=self.sd_m[chosen],
            normal=self.normal[chosen],
            columns=self.columns[chosen],
        )


def borne_out(swing: Swing, paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], contacts: Contacts) -> Array:
    """Fall (P,) of -2 log L of the contact distances of each path's run by what a swing says of the wall, over a wall
    that stays on the drive: nil of markers that ring, and where contacts are too few."""
    if swing.effect != "host_recoil":
        return np.zeros(len(paths))
    return wall_swings(swing, paths, pushes, contacts)[[path.run for path in paths]]


def wall_swings(swing: Swing, paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], contacts: Contacts) -> Array:
    """Fall (runs,) of -2 log L of each run's contact distances by a wall that swings as the markers do, over one that
    stays on the drive; nil where contacts are too few."""
    known = np.isin(contacts.run, [path.run for path in paths])
    contacts, fall = contacts.at(known), np.zeros(len(contacts.hosts))
    beyond = len(contacts.run) - contacts.columns.shape[1]
    if beyond < FEWEST_BEYOND:
        return fall
    stays, swings = np.zeros((len(contacts.run), 2)), np.zeros((len(contacts.run), 2))
    for path in paths:
        own = contacts.run == path.run
        met_s = contacts.time_s[own]
        drive = path.drive_of(path.place - swing.places(pushes, path.run, path.time_s))
        # What the drive is beside the path that gaps count against, which may follow the swing or not.
        beside = CubicSpline(path.time_s, drive - contacts.hosts[path.run].at(path.time_s)[:, :2])
        stays[own] = beside(met_s)
        swings[own] = stays[own] + swing.places(pushes, path.run, met_s)
    left = [_left(contacts, moved) for moved in (stays, swings)]
    # Few contacts leave less than their noise, by as much as the wall has unknowns.
    scatter = min(float(np.sum(np.minimum(one**2, (CUT_SD * at_least_noise(one)) ** 2))) for one in left)
    noise = max(1.0, float(np.sqrt(scatter / beyond)))
    squares = [np.minimum((one / noise) ** 2, CUT_SD**2) for one in left]
    np.add.at(fall, contacts.run, squares[0] - squares[1])
    return fall


def _left(contacts: Contacts, moved: Array) -> Array:
    """What a wall that has ``moved`` (K, 2; m) leaves of the gaps, over their sds (K,)."""
    gap = (contacts.gap_m - np.sum(moved * contacts.normal, 1)) / contacts.sd_m
    columns = contacts.columns / contacts.sd_m[:, None]
    left = gap - columns @ np.linalg.lstsq(columns, gap)[0]
    for _ in range(ROUNDS):
        weight = root_weights(left, at_least_noise(left))
        left = gap - columns @ np.linalg.lstsq(columns * weight[:, None], gap * weight)[0]
    return left
