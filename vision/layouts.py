"""The bodies' markers in a row, from recording.toml, with the tolerance within which each is looked for."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.recording import Recording
from vision.eye import Layout, layout_tolerance


def layout_of(recording: Recording, names: pd.DataFrame | None = None) -> Layout:
    """Markers of all bodies, with the tolerance within which they are looked for."""
    bodies = [(name, body) for name, body in recording.bodies.items() if body.markers]
    if not bodies:
        raise InputError("no markers in [bodies]", "the markers of ground, host and nes", "name them in recording.toml")
    positions, tolerance, known = [], [], []
    for name, body in bodies:
        place = np.array(body.layout_m, float) if body.layout_m else np.zeros((len(body.markers), 3))
        extent = np.ptp(place[:, :2], axis=0).max() if body.layout_m else 0.05
        positions.append(place)
        tolerance.append(layout_tolerance(extent, body.layout_sd_m or 3e-5))
        known.append(body.layout_m is not None)
        named = names is not None and set(body.markers) <= set(names["marker"])
        if body.layout_m is None and name != "ground" and not named:
            raise InputError(f"[bodies.{name}] has no layout_m, and its markers are not named",
                             "layout_m, or where each marker is in the first frame",
                             "add layout_m, or run `ovines track RECORDING --names first_frame.csv` "
                             "(columns camera,marker,u_px,v_px)")
    return Layout(tuple(name for name, _ in bodies), tuple(m for _, body in bodies for m in body.markers),
                  np.concatenate(positions), np.cumsum([0] + [len(p) for p in positions]),
                  np.array(tolerance), np.array(known))


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
            notes.append(f"the {name} markers lie the same after a turn by {np.degrees(turn):.0f} degrees (within "
                         f"{1e3 * layout.tolerance_m[body]:.2f} mm): the pictures do not say which is which, and its angle may be off by "
                         "whole such turns, from one gap to the next too; name them with --names, or move one marker")
    return notes
