"""Centres that follow a grid of the picture: the pixels themselves, a colour mosaic, the blocks of a compressed film.

A marker's place is then off by waves of itself, once in so many pixels (of one pixel: peak locking, Christensen,
Exp. Fluids 36, 484 (2004)), which no lens, window or motion is; both views miss each other by it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.gap.cause import Structure, two_sided
from analysis.gap.measurement.body_residuals import over_runs
from analysis.gap.measurement.fixed_markers import still_px
from analysis.gap.series import Series
from analysis.statistics.correlation import slow_mean
from analysis.statistics.robust import least_squares

Array = NDArray[np.float64]
# Grids: pixels, pairs of them (a mosaic, fields), and the usual blocks of a compressed film.
PERIODS_PX = (1.0, 2.0, 4.0, 8.0, 16.0)
# Degree of the polynomials that a lens residual may be where a marker goes, its own place among them; rounds of the
# robust fit, and what keeps it solvable.
LENS_DEGREE, ROUNDS, RIDGE = 3, 6, 1e-12
# Waves that are there stand out by more than this many sds: of series without a grid the largest was 10 (0.03 px, half
# of what counts), of two with blocks of eight pixels 68 and 140.
SURE = 15.0
# A marker that crosses fewer waves tells nothing of them: a part of one is a slope, which a lens may be (of Hosts that
# move by 2 px along a picture's axis the wave of 4 px stood out by 22 sds in one of 20 series with a lens residual).
FEWEST_WAVES = 2.0
# Fewer points of a run tell nothing of so many waves.
FEWEST_POINTS = 400


def picture_grid(series: Series) -> list[Structure]:
    """What says that centres follow a grid of the picture, the strongest; nothing without two views and their
    tracks."""
    if series.points is None or series.tracks is None or series.cameras is None:
        return []
    if "epipolar_px" not in series.points[0]:
        return []
    least_px = still_px(series)
    bodies = series.recordings[0].bodies
    markers = [marker for name in ("host", "nes") if name in bodies for marker in bodies[name].markers]
    names = [camera.name for camera in series.cameras]
    seen = [_waves(p, t, names, markers) for p, t in zip(series.points, series.tracks, strict=True)]
    shown = [one for one in seen if one is not None]
    if not shown:
        return []
    wave, sd = over_runs([one[0] for one in shown], [one[1] for one in shown])
    # By period, then camera and coordinate, cosine and sine.
    pairs = wave.reshape(len(PERIODS_PX), -1, 2)
    size, error = np.hypot(pairs[..., 0], pairs[..., 1]), sd.reshape(pairs.shape).max(-1)
    sure = np.where(size > least_px, size / error, 0.0).max(1)
    best = int(np.argmax(sure))
    if not sure[best] > SURE:
        return []
    period = PERIODS_PX[best]
    words = f"the place in the picture, once in {period:g} pixel{'s' * (period > 1)}"
    amount = float(size[best].max())
    p = two_sided(float(sure[best]))
    return [Structure("measurement", "all", "x", words, amount / least_px, float(sure[best]) ** 2, amount, "px", p)]


def _waves(
    points: pd.DataFrame, tracks: pd.DataFrame, cameras: Sequence[str], markers: Sequence[str]
) -> tuple[Array, Array] | None:
    """Cosines and sines (periods x cameras x coordinates x 2,) of the places in both pictures in what the epipolar
    lines (px) of one run's moving markers are off, and their sds: nan and inf of waves that no marker crosses."""
    rows = points[points["marker"].isin(list(markers))][["frame", "marker", "epipolar_px"]]
    for number, name in enumerate(cameras):
        own = tracks[tracks["camera"] == name][["frame", "marker", "u_px", "v_px"]]
        rows = rows.merge(own.rename(columns={"u_px": f"u{number}", "v_px": f"v{number}"}), on=["frame", "marker"])
    rows = rows.dropna().sort_values(["marker", "frame"], kind="stable")
    if len(rows) < FEWEST_POINTS:
        return None
    places = rows[[f"{axis}{number}" for number in range(len(cameras)) for axis in "uv"]].to_numpy(float)
    periods = np.array(PERIODS_PX)[:, None]
    turn = 2 * np.pi * places[:, None, :] / periods
    waves = np.stack([np.cos(turn), np.sin(turn)], -1).reshape(len(rows), -1)
    columns = np.column_stack([waves, rows["epipolar_px"]])
    _, marker = np.unique(rows["marker"].to_numpy(str), return_inverse=True)
    for number in range(marker.max() + 1):
        at = marker == number
        hardly = np.ptp(places[at], 0) < FEWEST_WAVES * periods
        columns[np.ix_(at, np.repeat(hardly.ravel(), 2).nonzero()[0])] = 0.0
        smooth = np.linalg.qr(_smooth(places[at, -2:]))[0]
        columns[at] -= smooth @ (smooth.T @ columns[at])
    determined = np.any(columns[:, :-1] != 0.0, 0)
    design, value = columns[:, :-1][:, determined], columns[:, -1]
    fit = least_squares(design, value, np.full(len(value), float(np.std(value)) or 1.0), rounds=ROUNDS, ridge=RIDGE)
    left = np.clip(fit.residual, -3.0, 3.0)
    grown = slow_mean(left) * max(float(np.std(left)), 1e-300)
    wave, sd = np.full(len(determined), np.nan), np.full(len(determined), np.inf)
    wave[determined], sd[determined] = fit.coefficients, np.sqrt(np.diag(fit.covariance)) * grown
    return wave, sd


def _smooth(places_px: Array) -> Array:
    """Polynomials (N, P) of the places (N, 2) of one marker: what a lens does there, and how the marker is placed."""
    a, b = ((places_px - places_px.mean(0)) / max(float(places_px.std(0).max()), 1e-12)).T
    return np.column_stack([a**i * b ** (n - i) for n in range(LENS_DEGREE + 1) for i in range(n + 1)])
