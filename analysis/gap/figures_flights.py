"""Flights: the acceleration that a model still lacks, piece by piece of flight, against whatever it may go with."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.gap.figures import Panel
from analysis.gap.flight_stage import FlightFit
from analysis.gap.ladder import Ladder
from analysis.runs import Run

Array = NDArray[np.float64]
#: frames of a piece: long ones measure a steady acceleration well, short ones follow the drive
LONG, SHORT, FEWEST = 40, 16, 10

# (component, covariate): columns of :func:`missing_acceleration`
VIEWS: dict[str, tuple[tuple[str, str], ...]] = {
    "floor_friction": (("along sliding", "sliding speed"), ("along sliding", "time in the run")),
    "spin_coupling": (("along sliding", "rim over sliding speed"), ("along sliding", "sliding speed")),
    "viscous_drag": (("along the path", "speed"), ("along sliding", "sliding speed")),
    "air_drag": (("along the path", "speed"), ("along sliding", "sliding speed")),
    "table_tilt": (("x", "time in the run"), ("y", "time in the run")),
    "vertical_motion": (("along sliding", "vertical acceleration of the Host"), ("along sliding", "drive phase")),
    "friction_drift": (("along sliding", "time in the run"), ("along sliding", "run")),
    "pull towards the Host's centre": (("outwards", "radius"), ("swirl", "radius")),
    "pull towards the room's origin": (("x", "x in the room"), ("y", "y in the room")),
    "pull growing with the cube of the radius": (("outwards", "radius"), ("swirl", "radius")),
    "pull of constant strength towards the centre": (("outwards", "radius"), ("swirl", "radius")),
    "swirl about the Host's centre": (("swirl", "radius"), ("outwards", "radius")),
    "saddle-shaped force in the Host": (("x", "x in the Host"), ("y", "y in the Host")),
    "saddle-shaped force in the room": (("x", "x in the room"), ("y", "y in the room")),
    "force across the path with the spin (omega x v)": (("across the path", "spin times speed"), ("across the path", "spin of the disk")),
    "force across the path": (("across the path", "speed"), ("across the path", "spin of the disk")),
    "decay of the spin": (("spin", "spin of the disk"), ("spin", "time in the run")),
    "constant torque": (("spin", "time in the run"), ("spin", "spin of the disk")),
    "friction that follows the radius": (("along sliding", "radius"), ("along sliding", "sliding speed")),
    "friction that follows the place in the Host": (("along sliding", "x in the Host"), ("along sliding", "y in the Host")),
    "friction that follows the place in the room": (("along sliding", "x in the room"), ("along sliding", "y in the room")),
    "friction that follows the sliding speed": (("along sliding", "sliding speed"), ("along sliding", "time in the run")),
    "friction that follows the direction of sliding": (("along sliding", "direction of sliding"), ("along sliding", "sliding speed")),
    "friction that follows the drive's phase": (("along sliding", "drive phase"), ("x", "drive phase")),
    "drag against the Host": (("along sliding", "sliding speed"), ("along the path", "speed")),
    "force with the drive's phase": (("x", "drive phase"), ("y", "drive phase")),
}
OTHERS = (("along sliding", "sliding speed"), ("along sliding", "time in the run"), ("outwards", "radius"), ("x", "drive phase"),
          ("across the path", "spin times speed"), ("spin", "spin of the disk"), ("x", "x in the room"), ("y", "y in the room"))
UNITS = {"sliding speed": "m/s", "speed": "m/s", "time in the run": "s", "radius": "mm", "drive phase": "°", "spin of the disk": "rad/s",
         "spin times speed": "m/s²", "x in the room": "mm", "y in the room": "mm", "x in the Host": "mm", "y in the Host": "mm",
         "direction of sliding": "°", "vertical acceleration of the Host": "m/s²", "run": "number", "rim over sliding speed": "1"}
CIRCULAR = ("drive phase", "direction of sliding")
QUICK = ("drive phase", "vertical acceleration of the Host")


def flight_views(name: str) -> tuple[tuple[str, str], ...]:
    """Components and covariates for a finding's name, then what a sceptic would look at besides; six at most."""
    own = VIEWS.get(name, ())
    return tuple(dict.fromkeys((*own, *OTHERS)))[:6]


def flight_panels(ladder: Ladder, name: str) -> list[Panel]:
    """Panels for a finding: acceleration that the flights ask for beyond the model, recalibrated and with the effect."""
    tables: dict[tuple[str, int], pd.DataFrame] = {}

    def table(which: str, frames: int) -> pd.DataFrame:
        if (which, frames) not in tables:
            tables[which, frames] = missing_acceleration(ladder.series.runs, ladder.nominal if which == "before" else ladder.flight, frames)
        return tables[which, frames]

    panels = []
    for component, covariate in flight_views(name):
        frames = SHORT if covariate in QUICK else LONG
        before, after = table("before", frames), table("after", frames)
        if before.empty or after.empty or before[component].notna().sum() < 5 or np.ptp(before[covariate].dropna()) < 1e-9:
            continue
        if component == "spin":
            y_name = "spin (rad/s²)"
        else:
            y_name = f"{component} (m/s²)"
        panels.append(Panel(before[covariate].to_numpy(), before[component].to_numpy(), after[covariate].to_numpy(),
                            after[component].to_numpy(), f"{covariate} ({UNITS[covariate]})", y_name, covariate in CIRCULAR))
    return panels


def missing_acceleration(runs: tuple[Run, ...], fitted: FlightFit, frames: int) -> pd.DataFrame:
    """Acceleration (m/s^2; rad/s^2 for ``spin``) that the measured positions show beyond a fitted model, per piece of flight.

    Each flight's residual is cut into pieces of about ``frames`` frames; a parabola in each, free of level and slope, gives
    the acceleration that the model lacks there.  Columns: components, covariates, ``sd`` (m/s^2) of a piece.
    """
    rows = []
    for number, (run, fits) in enumerate(zip(runs, fitted.fits, strict=True)):
        data = run.data
        for k, flight in enumerate(fits.flights):
            index = np.arange(flight.first, flight.last + 1)
            index = index[np.isfinite(data.xy_m[index, 0])]
            if len(index) < FEWEST:
                continue
            states, _ = fits.propagate(k, data.time_s[index])
            c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
            ox, oy = fits.shared[:2]
            residual = np.column_stack([data.xy_m[index] - states[:, :2] - np.column_stack([c * ox - s * oy, s * ox + c * oy]),
                                        np.where(data.angle_sd_rad[index] < 1e3, data.angle_rad[index] - states[:, 2], np.nan)])
            for part in np.array_split(np.arange(len(index)), max(1, round(len(index) / frames))):
                if len(part) >= FEWEST:
                    rows.append(_piece(run, number, index[part], states[part], residual[part]))
    return pd.DataFrame(rows)


def _piece(run: Run, number: int, index: NDArray[np.int64], states: Array, residual: Array) -> dict[str, float]:
    data = run.data
    t = data.time_s[index]
    centred = t - t.mean()
    q = centred**2
    base, _ = np.linalg.qr(np.vander(centred / max(np.ptp(t), 1e-9), 2))
    q = q - base @ (base.T @ q)
    ax, ay, spin = 2 * (q @ _clipped(residual)) / (q @ q)
    host, host_v = data.host.at(t)[:, :2].mean(0), data.host.at(t, 1)[:, :2].mean(0)
    place, v, omega = states[:, :2].mean(0), states[:, 3:5].mean(0), float(states[:, 5].mean())
    relative, sliding = place - host, v - host_v
    out, path, slide = (w / max(np.hypot(*w), 1e-9) for w in (relative, v, sliding))
    a = np.array([ax, ay])
    speed, slip = float(np.hypot(*v)), float(np.hypot(*sliding))
    phase = data.host.omega_rad_per_s * t.mean() + data.host.phase_rad
    return {"x": ax, "y": ay, "spin": spin, "outwards": a @ out, "swirl": a @ np.array([-out[1], out[0]]), "along the path": a @ path,
            "across the path": a @ np.array([-path[1], path[0]]), "along sliding": a @ slide, "sd": 2 * float(np.median(data.xy_sd_m[index])) / np.sqrt(q @ q),
            "sliding speed": slip, "speed": speed, "time in the run": t.mean(), "run": float(number + 1), "radius": 1e3 * float(np.hypot(*relative)),
            "drive phase": float(np.degrees(np.angle(np.exp(1j * phase)))), "spin of the disk": omega, "spin times speed": omega * speed,
            "x in the room": 1e3 * place[0], "y in the room": 1e3 * place[1], "x in the Host": 1e3 * relative[0], "y in the Host": 1e3 * relative[1],
            "direction of sliding": float(np.degrees(np.arctan2(sliding[1], sliding[0]))),
            "vertical acceleration of the Host": float(data.host.at(t, 2)[:, 2].mean()), "rim over sliding speed": abs(omega) * data.radius_m / max(slip, 1e-3)}


def _clipped(residual: Array) -> Array:
    """Wrong frames drawn in to 5 robust sd about the piece's median, so that one of them does not make an acceleration."""
    middle = np.median(residual, axis=0)
    spread = np.maximum(1.4826 * np.median(np.abs(residual - middle), axis=0), 1e-9)
    return np.clip(residual, middle - 5 * spread, middle + 5 * spread)
