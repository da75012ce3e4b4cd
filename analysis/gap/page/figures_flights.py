"""Flights: the acceleration that a model still lacks, piece by piece of flight, against whatever it may go with."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.evidence import impact_before
from analysis.flights.runs import Run
from analysis.gap.ladder import Ladder
from analysis.gap.page.figures import Panel
from analysis.gap.selection.flight_candidates import FlightFit
from ovines.robust import MEDIAN_TO_SD

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
    "force across the path with the spin (omega x v)": (
        ("across the path", "spin times speed"),
        ("across the path", "spin of the disk"),
    ),
    "force across the path": (("across the path", "speed"), ("across the path", "spin of the disk")),
    "decay of the spin": (("spin", "spin of the disk"), ("spin", "time in the run")),
    "constant torque": (("spin", "time in the run"), ("spin", "spin of the disk")),
    "friction that follows the radius": (("along sliding", "radius"), ("along sliding", "sliding speed")),
    "friction that follows the place in the Host": (
        ("along sliding", "x in the Host"),
        ("along sliding", "y in the Host"),
    ),
    "friction that follows the place in the room": (
        ("along sliding", "x in the room"),
        ("along sliding", "y in the room"),
    ),
    "friction that follows the sliding speed": (
        ("along sliding", "sliding speed"),
        ("along sliding", "time in the run"),
    ),
    "friction that follows the direction of sliding": (
        ("along sliding", "direction of sliding"),
        ("along sliding", "sliding speed"),
    ),
    "friction that follows the drive's phase": (("along sliding", "drive phase"), ("x", "drive phase")),
    "friction that follows the time since the impact before": (
        ("along sliding", "time since the impact before"),
        ("along sliding", "sliding speed"),
    ),
    "pull near the wall": (("outwards", "radius"), ("swirl", "radius")),
    "drag against the Host": (("along sliding", "sliding speed"), ("along the path", "speed")),
    "force with the drive's phase": (("x", "drive phase"), ("y", "drive phase")),
}
OTHERS = (
    ("along sliding", "sliding speed"),
    ("along sliding", "time in the run"),
    ("outwards", "radius"),
    ("x", "drive phase"),
    ("across the path", "spin times speed"),
    ("spin", "spin of the disk"),
    ("x", "x in the room"),
    ("y", "y in the room"),
)
UNITS = {
    "sliding speed": "m/s",
    "speed": "m/s",
    "time in the run": "s",
    "radius": "mm",
    "drive phase": "°",
    "spin of the disk": "rad/s",
    "spin times speed": "m/s²",
    "x in the room": "mm",
    "y in the room": "mm",
    "x in the Host": "mm",
    "y in the Host": "mm",
    "direction of sliding": "°",
    "vertical acceleration of the Host": "m/s²",
    "run": "number",
    "rim over sliding speed": "1",
    "time since the impact before": "ms",
}
CIRCULAR = ("drive phase", "direction of sliding")
QUICK = ("drive phase", "vertical acceleration of the Host", "time since the impact before")


def flight_views(name: str) -> tuple[tuple[str, str], ...]:
    """Components and covariates for a finding's name, then what a sceptic would look at besides; six at most."""
    own = VIEWS.get(name.removeprefix("something like "), ())
    return tuple(dict.fromkeys((*own, *OTHERS)))[:6]


def flight_panels(ladder: Ladder, name: str) -> list[Panel]:
    """Panels for a finding: acceleration that the flights ask for beyond the model, recalibrated and with the
    effect.
    """
    runs = ladder.series.runs
    after = residual_frames(runs, ladder.flights.fitted)
    before = after if ladder.flights.nominal is ladder.flights.fitted else residual_frames(runs, ladder.flights.nominal)
    tables = {
        frames: (missing_acceleration(before, frames), missing_acceleration(after, frames)) for frames in (LONG, SHORT)
    }
    panels = []
    for component, covariate in flight_views(name):
        a, b = tables[SHORT if covariate in QUICK else LONG]
        if min(len(a), len(b)) < 5 or a[component].notna().sum() < 5 or not np.ptp(a[covariate].dropna()) > 1e-9:
            continue
        unit = "rad/s²" if component == "spin" else "m/s²"
        panels.append(
            Panel(
                a[covariate].to_numpy(),
                a[component].to_numpy(),
                b[covariate].to_numpy(),
                b[component].to_numpy(),
                f"{covariate} ({UNITS[covariate]})",
                f"{component} ({unit})",
                covariate in CIRCULAR,
            )
        )
    return panels


def residual_frames(runs: tuple[Run, ...], fitted: FlightFit) -> pd.DataFrame:
    """Frames of all flights: residual of x, y (m) and angle (rad, NaN where unknown), state and Host; ``run``,
    ``flight``.
    """
    parts = []
    for number, (run, fits) in enumerate(zip(runs, fitted.fits, strict=True)):
        data, (ox, oy) = run.data, fits.shared[:2]
        place, velocity = data.host.at(data.time_s), data.host.at(data.time_s, 1)
        lift = data.host.at(data.time_s, 2)[:, 2]
        for k, flight in enumerate(fits.flights):
            i = np.arange(flight.first, flight.last + 1)
            i = i[np.isfinite(data.xy_m[i, 0])]
            if len(i) < FEWEST:
                continue
            states, _ = fits.propagate(k, data.time_s[i])
            c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
            angle = np.where(data.angle_sd_rad[i] < 1e3, data.angle_rad[i] - states[:, 2], np.nan)
            parts.append(
                np.column_stack(
                    [
                        np.full(len(i), number),
                        np.full(len(i), k),
                        data.time_s[i],
                        data.xy_m[i, 0] - states[:, 0] - c * ox + s * oy,
                        data.xy_m[i, 1] - states[:, 1] - s * ox - c * oy,
                        angle,
                        states[:, [0, 1, 3, 4, 5]],
                        place[i, :2],
                        velocity[i, :2],
                        lift[i],
                        data.host.omega_rad_per_s * data.time_s[i] + data.host.phase_rad,
                        np.full(len(i), data.radius_m),
                        data.time_s[i] - impact_before(fits, k),
                    ]
                )
            )
    columns = [
        "run",
        "flight",
        "t",
        "rx",
        "ry",
        "ra",
        "x",
        "y",
        "vx",
        "vy",
        "omega",
        "hx",
        "hy",
        "hvx",
        "hvy",
        "lift",
        "phase",
        "radius",
        "since",
    ]
    return pd.DataFrame(np.vstack(parts) if parts else np.zeros((0, len(columns))), columns=columns)


def missing_acceleration(frames: pd.DataFrame, length: int) -> pd.DataFrame:
    """Acceleration (m/s^2; rad/s^2 for ``spin``) that the measured positions show beyond a fitted model, per piece of
    flight.

    The residuals of :func:`residual_frames` are cut into pieces of about ``length`` frames; a parabola in each, free of
    level and slope, gives the acceleration that the model lacks there.  Columns: the components and covariates of
    :data:`VIEWS`.
    """
    if frames.empty:
        return pd.DataFrame()
    flight = frames.groupby(["run", "flight"], sort=False)
    count, at = flight["t"].transform("size"), flight.cumcount()
    pieces = np.maximum(np.round(count / length), 1)
    piece = frames.groupby(["run", "flight", np.floor(at * pieces / count)], sort=False).ngroup().to_numpy()
    by = frames.groupby(piece)
    mean = by.mean()
    c = frames["t"].to_numpy() - mean["t"].to_numpy()[piece]
    n = np.bincount(piece)
    c2, c3 = np.bincount(piece, c**2), np.bincount(piece, c**3)
    q = c**2 - (c2 / n)[piece] - (c3 / c2)[piece] * c
    a = {
        r: 2 * np.bincount(piece, q * _clipped(frames[r], piece)) / np.bincount(piece, q**2) for r in ("rx", "ry", "ra")
    }
    return _components(mean, a["rx"], a["ry"], a["ra"])[n >= FEWEST]


def _clipped(residual: pd.Series, piece: NDArray[np.int64]) -> Array:
    """Wrong frames drawn in to 5 robust sd about their piece's median, so that one of them does not make an
    acceleration.
    """
    middle = residual.groupby(piece).median().to_numpy()[piece]
    away = (residual - middle).to_numpy()
    limit = 5 * MEDIAN_TO_SD * np.maximum(pd.Series(np.abs(away)).groupby(piece).median().to_numpy()[piece], 1e-9)
    return np.clip(away, -limit, limit)


def _components(mean: pd.DataFrame, ax: Array, ay: Array, spin: Array) -> pd.DataFrame:
    """Components of the missing acceleration and its covariates, from the pieces' mean states."""
    relative = mean[["x", "y"]].to_numpy() - mean[["hx", "hy"]].to_numpy()
    v = mean[["vx", "vy"]].to_numpy()
    sliding = v - mean[["hvx", "hvy"]].to_numpy()
    radius, speed, slip = (np.hypot(*w.T) for w in (relative, v, sliding))
    out, path, slide = (
        w / np.maximum(size, 1e-9)[:, None] for w, size in ((relative, radius), (v, speed), (sliding, slip))
    )
    omega = mean["omega"].to_numpy()

    def along(w: Array) -> Array:
        return ax * w[:, 0] + ay * w[:, 1]

    def across(w: Array) -> Array:
        return ay * w[:, 0] - ax * w[:, 1]

    return pd.DataFrame(
        {
            "x": ax,
            "y": ay,
            "spin": spin,
            "outwards": along(out),
            "swirl": across(out),
            "along the path": along(path),
            "across the path": across(path),
            "along sliding": along(slide),
            "sliding speed": slip,
            "speed": speed,
            "time in the run": mean["t"].to_numpy(),
            "run": mean["run"].to_numpy() + 1,
            "radius": 1e3 * radius,
            "drive phase": np.degrees(np.angle(np.exp(1j * mean["phase"].to_numpy()))),
            "spin of the disk": omega,
            "spin times speed": omega * speed,
            "x in the room": 1e3 * mean["x"].to_numpy(),
            "y in the room": 1e3 * mean["y"].to_numpy(),
            "x in the Host": 1e3 * relative[:, 0],
            "y in the Host": 1e3 * relative[:, 1],
            "direction of sliding": np.degrees(np.arctan2(*sliding.T[::-1])),
            "vertical acceleration of the Host": mean["lift"].to_numpy(),
            "time since the impact before": 1e3 * mean["since"].where(mean["since"] < 1e3).to_numpy(),
            "rim over sliding speed": np.abs(omega) * mean["radius"].to_numpy() / np.maximum(slip, 1e-3),
        }
    )
