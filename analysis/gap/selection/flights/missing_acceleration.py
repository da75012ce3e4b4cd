"""Flights: the acceleration that a model still lacks, piece by piece of flight, with whatever it may go with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.impact_before import impact_before
from analysis.flights.cutting.run_data import LENS_TERMS, lens_basis
from analysis.flights.cutting.runs import Run
from analysis.gap.selection.flights.fit import FlightFit
from ovines.robust import MEDIAN_TO_SD

Array = NDArray[np.float64]
#: frames of a piece: long ones measure a steady acceleration well, short ones follow the drive
LONG, SHORT, FEWEST = 40, 16, 10
#: components of a missing acceleration (m/s^2; rad/s^2 for the spin)
COMPONENTS = (
    "x",
    "y",
    "outwards",
    "swirl",
    "along the path",
    "across the path",
    "along sliding",
    "spin",
)
#: covariates whose ends meet
CIRCULAR = ("drive phase", "direction of sliding")


def residual_frames(runs: Sequence[Run], fitted: FlightFit, *, without_lens: bool = False) -> pd.DataFrame:
    """Frames of all flights: residual of x, y (m) and angle (rad, NaN where unknown), state and Host; ``run``,
    ``flight``.  ``without_lens``: what the flights take for a smooth lens residual is taken out, which hides a
    part of what else they miss.
    """
    parts = []
    names = [*fitted.columns]
    step = fitted.forms.solved(names).step
    lens_m = np.array([step[names.index(n)] for n in LENS_TERMS]).reshape(2, -1) * without_lens
    for number, (run, fits) in enumerate(zip(runs, fitted.fits, strict=True)):
        data, (ox, oy) = run.data, fits.shared[:2]
        place, velocity = data.host.at(data.time_s), data.host.at(data.time_s, 1)
        lift = data.host.at(data.time_s, 2)[:, 2]
        for k, flight in enumerate(fits.flights):
            i = np.arange(flight.first, flight.last + 1)
            i = i[np.isfinite(data.xy_m[i, 0])]
            if len(i) < FEWEST:
                continue
            states = fits.path(k, data.time_s[i])
            c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
            lens_off_m = lens_basis(data.xy_m[i], data.contact_radius_m) @ lens_m.T
            angle = np.where(data.angle_sd_rad[i] < 1e3, data.angle_rad[i] - states[:, 2], np.nan)
            parts.append(
                np.column_stack(
                    [
                        np.full(len(i), number),
                        np.full(len(i), k),
                        data.time_s[i],
                        data.xy_m[i, 0] - states[:, 0] - c * ox + s * oy - lens_off_m[:, 0],
                        data.xy_m[i, 1] - states[:, 1] - s * ox - c * oy - lens_off_m[:, 1],
                        angle,
                        states[:, [0, 1, 3, 4, 5]],
                        place[i, :2],
                        velocity[i, :2],
                        lift[i],
                        data.host.omega_rad_per_s * data.time_s[i] + data.host.phase_rad,
                        np.full(len(i), data.radius_m),
                        data.time_s[i] - impact_before(data, fits.flights, k),
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
    level and slope, gives the acceleration that the model lacks there.  Columns: :data:`COMPONENTS`, the covariates,
    ``number`` of the flight among all, and ``weight`` (s^4: the variance of a frame over that of x or y).
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
    out = _components(mean, a["rx"], a["ry"], a["ra"])
    out["number"] = flight.ngroup().to_numpy()[np.unique(piece, return_index=True)[1]]
    out["weight"] = np.bincount(piece, q**2) / 4
    return out[n >= FEWEST]


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
