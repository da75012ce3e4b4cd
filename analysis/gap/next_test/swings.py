"""What simulated recordings say of a swing of the Host after blows and of the other kind.

Both answer the normal impulse.  Only a Host that gives takes its wall along, and answers what acts along the wall and
the floor, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.drive.measured_path import MeasuredPath, at_rest, path_beside, sine
from analysis.gap.drive.pushes import RunPushes, pushes_of
from analysis.gap.drive.swinging_wall import Contacts
from analysis.gap.drive.swings import Swing, swing_rows
from analysis.gap.laws.impact_rows import usual_distance_scatter
from analysis.gap.next_test.recording import Recorded, Rig, fitted
from analysis.gap.next_test.separation import Information

Array = NDArray[np.float64]
RECOIL = "host_recoil"


def swing_information(rig: Rig, recorded: Sequence[Recorded], effect: str, rival: str) -> Information | None:
    """Where size, frequency and damping of the rival are unknown, how each recording began, and where the wall is; None
    where the Host's path has no such swing."""
    swing = next((one for one in rig.ladder.drive.swings if one.effect == effect), None)
    if swing is None:
        return None
    fits, rest = [fitted(rig, one) for one in recorded], np.zeros((2, 2))
    pushes, contacts = pushes_of(fits), Contacts.of(fits)
    swing = replace(swing, start=np.zeros((len(fits), 2, 2)), start_s=np.array([one.start_s for one in recorded]))
    moved, unknown, run = list[Array](), list[Array](), list[NDArray[np.int64]]()
    for number, (one, pushed) in enumerate(zip(recorded, pushes, strict=True)):
        path = _path(rig, one, number)
        own = swing.share * swing_rows(swing, path, pushed, rest)[1][:, 0]
        others = swing_rows(replace(swing, effect=rival), path, pushed, rest)[1]
        moved.append(own)
        unknown.append(np.hstack([others, np.zeros((len(own), contacts.columns.shape[1]))]))
        run.append(np.full(len(own), number))
    wall, columns = _contact_rows(rig, replace(swing, effect=RECOIL), pushes, contacts)
    # Against a wall that stays, which is the rival's or the effect's own.
    moved.append(wall)
    unknown.append(np.hstack([np.zeros((len(wall), 3)), columns]))
    run.append(contacts.run)
    rows = np.vstack(unknown)
    return Information.of_rows(np.concatenate(moved), rows, np.zeros(rows.shape[1]), np.concatenate(run))


def _contact_rows(rig: Rig, swing: Swing, pushes: Sequence[RunPushes], contacts: Contacts) -> tuple[Array, Array]:
    """What a wall that swings does to the contact distances (K,), and the columns (K, P) of what it may be off by, over
    the scatter that measured ones have."""
    measured = rig.ladder.impacts.fitted
    scatter_m = 0.0 if measured is None else usual_distance_scatter(measured)
    sd_m = np.hypot(contacts.sd_m, scatter_m)
    out_m = np.zeros(len(contacts.run))
    for number in range(len(pushes)):
        own = contacts.run == number
        out_m[own] = np.sum(swing.places(pushes, number, contacts.time_s[own]) * contacts.normal[own], 1)
    return out_m / sd_m, contacts.columns / sd_m[:, None]


def _path(rig: Rig, recorded: Recorded, number: int) -> MeasuredPath:
    """The Host's path of a simulated recording, with the noise of measured ones."""
    paths = rig.ladder.drive.paths
    sd = np.median([path.sd for path in paths], 0)
    correlation = float(np.median([path.correlation for path in paths]))
    time_s = recorded.result.time_s + recorded.start_s
    omega = recorded.host.omega_rad_per_s
    drive = sine(time_s, omega) if omega else at_rest(time_s)
    return path_beside(drive, number, time_s, np.zeros((len(time_s), 2)), sd, correlation)
