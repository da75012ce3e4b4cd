"""The bodies' markers in a row, from recording.toml, with the tolerance within which each is looked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.recording import Recording

# Radii of the rig: what the calibration does to a layout, and sd of markers of whose placing nothing is known.
_CALIBRATED, _PLACED = 0.003, 0.0006
_SDS = 3.0  # of that placing within which a marker lies
_LEAN = 0.006  # of the plane [rad]
_OF_SPACING = 0.08  # of the least distance of two markers: with more a layout fits its own neighbours
_NES_RADII = 5.0  # that the rig has where no Host says, as in the thesis


@dataclass(frozen=True, eq=False)
class Layout:
    """All markers of all bodies in a row: names, positions (n, 3) [m] in the bodies' frames.

    `first` (bodies + 1,): first marker of each body; `tolerance_m` (bodies,): how far a marker may lie from its
    design place; `known` (bodies,): False while a body's positions are still to be found (ground without layout);
    `rig_m`: radius of the rig, the unit of gates.
    """

    bodies: tuple[str, ...]
    markers: tuple[str, ...]
    position_m: np.ndarray
    first: np.ndarray
    tolerance_m: np.ndarray
    known: np.ndarray
    rig_m: float

    def of(self, body: int) -> slice:
        """The rows of the body's markers."""
        return slice(int(self.first[body]), int(self.first[body + 1]))


def layout_tolerance(layout_xy_m: np.ndarray, rig_m: float, sd_m: float | None) -> float:
    """How far a marker of a layout (n, 2) may lie from its place [m]: calibration, a plane that leans, and placing, of
    sd `sd_m` (None: unknown).
    """
    extent_m = float(np.ptp(layout_xy_m, axis=0).max()) if len(layout_xy_m) > 1 else 0.0
    apart = np.hypot(*(layout_xy_m[:, None] - layout_xy_m[None]).T)[np.triu_indices(len(layout_xy_m), 1)]
    unplaced_m = (_CALIBRATED + (_SDS * _PLACED if sd_m is None else 0.0)) * rig_m + _LEAN * extent_m
    return min(unplaced_m, _OF_SPACING * float(min(apart, default=np.inf))) + _SDS * (sd_m or 0.0)


def layout_of(
    recording: Recording,
    names: pd.DataFrame | None = None,
    cameras: Sequence[Camera] = (),
    names_needed: bool = True,
) -> Layout:
    """Markers of all bodies, with the tolerance within which they are looked for; `cameras`: see `rig_radius`.

    A body without layout must be named, unless only those of known layout are asked for (``names_needed`` false).
    The ground's frame is the world's, moved to the middle of its markers: how far the world's origin lies must not
    matter to a turn.
    """
    bodies = [(name, body) for name, body in recording.bodies.items() if body.markers]
    if not bodies:
        raise InputError("no markers in [bodies]", "the markers of ground, host and nes", "name them in recording.toml")
    positions, tolerance, known = [], [], []
    rig_m = rig_radius(recording, cameras)
    for name, body in bodies:
        place = np.array(body.layout_m, float) if body.layout_m else np.zeros((len(body.markers), 3))
        if name == "ground":
            place[:, :2] -= place[:, :2].mean(0)
        positions.append(place)
        # Without a layout: as of two markers on either side of the rig's middle.
        shape = place[:, :2] if body.layout_m else rig_m * np.array([[-0.5, 0.0], [0.5, 0.0]])
        tolerance.append(layout_tolerance(shape, rig_m, body.layout_sd_m))
        known.append(body.layout_m is not None)
        named = names is not None and set(body.markers) <= set(names["marker"])
        if names_needed and body.layout_m is None and name != "ground" and not named:
            raise InputError(
                f"[bodies.{name}] has no layout_m, and its markers are not named",
                "layout_m, or where each marker is in the first frame",
                "add layout_m, or run `ovines track RECORDING --names names.csv` (columns camera,marker,u_px,v_px)",
            )
    return Layout(
        tuple(name for name, _ in bodies),
        tuple(m for _, body in bodies for m in body.markers),
        np.concatenate(positions),
        np.cumsum([0] + [len(p) for p in positions]),
        np.array(tolerance),
        np.array(known),
        rig_m,
    )


def rig_radius(recording: Recording, cameras: Sequence[Camera] = ()) -> float:
    """The length [m] by which gates are measured: the radius of the Host's wall, or what a Host about these bodies
    would have.

    Without Host and NES half of the widest layout; without any that of the first camera's window, NaN where no camera
    is given.
    """
    host_m, nes = host_radius(recording), recording.settings.bodies.nes
    if host_m is not None:
        return host_m
    if nes is not None:
        return _NES_RADII * nes.radius_m
    spans = [
        float(np.ptp(np.array(body.layout_m), axis=0).max()) for body in recording.bodies.values() if body.layout_m
    ]
    if spans and max(spans) > 0:
        return 0.5 * max(spans)
    if not cameras:
        return float("nan")
    away_m = abs(float(cameras[0].centre_m[2]))
    return 0.5 * min(recording.camera(cameras[0].name).window_px) * away_m / float(cameras[0].matrix[0, 0])


def host_radius(recording: Recording) -> float | None:
    """Radius [m] within which the Host's inner wall lies; None without a Host."""
    host = recording.settings.bodies.host
    if host is None:
        return None
    if host.inner_radius_m:
        return host.inner_radius_m
    return float(np.hypot(*np.array(host.polygon_m).T).max())


def symmetric_turn(layout_xy_m: np.ndarray, tolerance_m: float) -> float | None:
    """Smallest turn [rad] under which a layout (n, 2) lies on itself within `tolerance_m`; None: there is none.

    Such a layout of look-alike markers does not say which is which.
    """
    around = layout_xy_m - layout_xy_m.mean(0)
    distance = np.hypot(*around.T)
    far = int(np.argmax(distance))
    if len(around) < 2 or distance[far] < tolerance_m:
        return None
    turns = []
    for k in np.flatnonzero(np.abs(distance - distance[far]) < tolerance_m):
        turn = np.arctan2(around[k, 1], around[k, 0]) - np.arctan2(around[far, 1], around[far, 0])
        c, s = np.cos(turn), np.sin(turn)
        turned = around @ np.array([[c, s], [-s, c]])
        apart = np.hypot(*(turned[:, None] - around[None]).T).T
        if k != far and (apart.min(1) < tolerance_m).all() and len(set(apart.argmin(1))) == len(around):
            turns.append(abs((turn + np.pi) % (2 * np.pi) - np.pi))
    return float(min(turns)) if turns else None


def symmetry_notes(layout: Layout, names: pd.DataFrame | None) -> list[str]:
    """A note for each moving body whose markers look the same after a turn and are not named by hand."""
    named = set() if names is None else set(names["marker"])
    notes = []
    for body, name in enumerate(layout.bodies):
        part = layout.of(body)
        if name == "ground" or not layout.known[body] or named >= set(layout.markers[part]):
            continue
        turn = symmetric_turn(layout.position_m[part, :2], float(layout.tolerance_m[body]))
        if turn is not None:
            notes.append(
                f"the {name} markers lie the same after a turn by {np.degrees(turn):.0f} degrees (within "
                f"{1e3 * layout.tolerance_m[body]:.2f} mm): the pictures do not say which is which, and its angle may "
                f"be off by "
                "whole such turns, from one gap to the next too; name them with --names, or move one marker"
            )
    return notes
