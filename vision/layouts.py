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
