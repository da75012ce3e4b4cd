"""What two views tell of clocks, windows and the plane.

Two views leave one residual over (epipolar), and bodies that stand on a plane leave a second (their height).  At a
body's centre with velocity V, seen by a second camera that is late by d and whose window lies w off::

    epipolar = n . (w + d J V)          height = M_z . (w + d J V) + a x + b y + Host's own z(t) + c

n, M and J being the derivative of residual, point and pixel.  Host and NES share the Host's own vertical motion and
differ in place and velocity, which separates a tilted plane, a late clock and real vertical motion; the NES's markers
may all lie higher than the layout says, by ``c``, which is no tilt where it stays on one side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.by_run import ByRun
from analysis.gap.cause import THAN_STATED, Structure, two_sided
from analysis.gap.finding import Finding, judge
from analysis.gap.measurement.body_rows import body_rows
from analysis.gap.measurement.clock_change import PARTS, clock_change
from analysis.gap.series import Series
from analysis.gap.thresholds import EQUIVALENT, NEGLIGIBLE_FRAMES, PLACEMENTS, SIGNIFICANCE
from analysis.statistics.robust import least_squares
from ovines.camera import Camera, baseline
from ovines.recording_schema import PLACEMENT_SD_M
from ovines.robust import MEDIAN_TO_SD

Array = NDArray[np.float64]

# A lens residual that is seen in the epipolar lines has a constant and a slope too, which pass for window and tilted
# plane: in 50 series with 0.2 to 0.3 px of it the window came out 0.10 px wrong (rms of a coordinate) and the plane by
# 0.1 px of height over the lever, whatever the part that is seen (0.01 to 0.08 px); a smaller part means a smaller
# residual.
LENS_PX, LENS_FULL_PX, LENS_SEEN = 0.10, 0.01, 3.0
# Two such slopes add like the sides of a triangle: more than this many times the one is seen once in 50 series.
LENS_TILTS = 2.8
# ... estimated from the means of squares of the room this wide, of so many frames each and so many in all; frames so
# many robust sds off their square's median are none of it, and a correlation beyond this is no longer noise.
SQUARE_M, FEWEST_IN_SQUARE, FEWEST_SEEN = 0.01, 20, 50
GROSS_SD, MOST_LAG = 5.0, 0.9
# Rounds of the robust fit of both bodies' frames, and what keeps it solvable where a body never moves.
ROUNDS, RIDGE = 6, 1e-12
# Velocities at the NES come from local parabolas: a late clock is right to this share.
CLOCK_SHARE = 1.5e-3


@dataclass(frozen=True, eq=False)
class Rows:
    """Both bodies' frames as linear equations: ``design`` (N, 5 + own) of window u, v, delay and the plane's slopes, by
    how much the NES's markers lie higher than the layout says, and the Hosts' own vertical motion, ``value`` (N,) with
    ``sd`` (epipolar px or height m), ``run`` and ``share`` of its run's frames at which each was taken, 0 to 1.
    """

    design: Array
    value: Array
    sd: Array
    run: NDArray[np.int64]
    share: Array

    def part(self, parts: int) -> NDArray[np.int64]:
        """Number (N,) of the part of a run, of ``parts`` equal ones, that each was taken in."""
        return np.asarray(self.run * parts + np.minimum((self.share * parts).astype(np.int64), parts - 1), np.int64)

    @property
    def heights(self) -> NDArray[np.bool_]:
        """Which equations are of heights; the others are of epipolar lines."""
        return np.asarray((self.design[:, 3] != 0) | (self.design[:, 4] != 0), bool)


def rows_of(series: Series) -> Rows | None:
    """The equations of all runs; None where no body was seen in frames enough."""
    n_runs = len(series.runs)
    designs, values, sds, numbers, shares = [], [], [], [], []
    for number, (points, motion, run) in enumerate(zip(series.points or (), series.motions, series.runs, strict=True)):
        for body in ("host", "nes"):
            block = body_rows(series, points, motion, run, body)
            if block is None:
                continue
            late_px, late_m = block.late()
            shared_e = np.column_stack([block.line_per_px, late_px, np.zeros((len(block.x_m), 2))])
            shared_z = np.column_stack([block.height_per_px, late_m, block.x_m, block.y_m])
            own = np.zeros((len(block.x_m), 1 + 2 * n_runs))
            own[:, 0] = body == "nes"
            if run.data.host.omega_rad_per_s:
                own[:, 2 * number + 1], own[:, 2 * number + 2] = np.cos(block.phase_rad), np.sin(block.phase_rad)
            designs += [np.hstack([shared_e, np.zeros_like(own)]), np.hstack([shared_z, own])]
            values += [block.line_px, block.height_m]
            sds += [block.line_sd_px, block.height_sd_m]
            numbers.append(np.full(2 * len(block.x_m), number))
            shares += [block.share, block.share]
    if not designs:
        return None
    rows = Rows(*map(np.concatenate, (designs, values, sds, numbers, shares)))
    ok = np.isfinite(rows.design).all(1) & np.isfinite(rows.value) & np.isfinite(rows.sd)
    return Rows(rows.design[ok], rows.value[ok], rows.sd[ok], rows.run[ok], rows.share[ok])


@dataclass(frozen=True)
class TwoViews:
    """``findings`` of clock, window and plane; whether a lens residual is ``seen`` (or could not be looked for);
    ``change`` of the second camera's delay within the runs; NES markers ``raised`` over their layout.
    """

    findings: tuple[Finding, ...] = ()
    seen: bool = True
    change: Structure | None = None
    raised: Structure | None = None


def two_views(series: Series, notes: list[str]) -> TwoViews:
    """Clock, window and plane from epipolar residual and height of both bodies, by one robust linear fit."""
    if series.points is None or series.cameras is None or "epipolar_px" not in series.points[0]:
        notes.append("no two views at this entry: camera clocks, windows and the plane cannot be tested")
        return TwoViews()
    rows = rows_of(series)
    if rows is None:
        return TwoViews()
    rows, change = _with_own_delays(rows, NEGLIGIBLE_FRAMES["camera_clock_offset"] * series.period_s)
    a, b, heights = rows.design, rows.value, rows.heights
    fit = least_squares(a, b, rows.sd, rounds=ROUNDS, ridge=RIDGE)
    solution, weight = fit.coefficients, fit.weight
    # A lens residual bends epipolar lines and heights alike; what it does to the former tells what to allow in the
    # latter.
    warp_px, seen, inflation = lens_residual(a, b - a @ solution)
    error = np.sqrt(np.diag(fit.covariance) * inflation)
    lens_px = LENS_PX * min(1.0, warp_px / LENS_FULL_PX) if seen else 0.5 * warp_px
    height_per_px = float(np.median(np.abs(a[heights, 0]))) if heights.any() else 0.0
    speed = _speed_px_per_s(a, heights)
    alike = _rivals(a * weight[:, None], b * weight, float(inflation))
    window, window_sd, delay, sd_delay = solution[:2], error[:2], solution[2], error[2]
    window_lens_px = lens_px
    if series.cameras[0].field is not None:  # taught by recordings, it says itself what it leaves open
        window_lens_px = max(lens_px, series.cameras[0].field.open_sd["window_v_px"])
    u, v = ((float(w), float(np.hypot(sd, window_lens_px))) for w, sd in zip(window, window_sd, strict=True))
    # A field that recordings have taught leaves a window open: one that is no larger is none.
    moved_px, learnt = float(np.hypot(*window)), series.cameras[0].field is not None
    by_lens = moved_px / max(window_lens_px, 1e-9) / LENS_TILTS * SIGNIFICANCE if learnt else np.inf
    found = [
        judge("sensor_window_offset", {"u_px": u, "v_px": v}, moved_px, min(moved_px / max(window_sd), float(by_lens))),
        # The lens residual, over the pixels per second that the bodies move: a tenth of it survives the average over
        # places.
        judge(
            "camera_clock_offset",
            {"offset_s": (delay, float(np.linalg.norm([sd_delay, 0.1 * warp_px / speed, CLOCK_SHARE * delay])))},
            abs(delay),
            abs(delay) / sd_delay,
            NEGLIGIBLE_FRAMES["camera_clock_offset"] * series.period_s,
        ),
        _plane_tilt(series.cameras, solution[3:5], error[3:5], lens_px * height_per_px, a[heights, 3:5]),
    ]
    if change is not None:  # no one delay is that of all frames
        found = [replace(f, found=f.found and f.effect != "camera_clock_offset") for f in found]
    by_run = _by_run(a * weight[:, None], b * weight, rows.run == np.arange(len(series.runs))[:, None], inflation)
    found = [replace(f, rivals=alike[f.effect], by_run=by_run[f.effect]) for f in found]
    return TwoViews(tuple(found), seen, change, _raised(series, solution[5], error[5], lens_px * height_per_px))


def _raised(series: Series, height_m: float, sd_m: float, lens_height_m: float) -> Structure | None:
    """NES markers that lie by ``height_m`` higher over the Host's than the layouts say, by more than these may be off
    and a lens residual bends heights; None where a body has no stated layout."""
    bodies = series.recordings[0].bodies
    if any(bodies[name].layout_m is None for name in ("host", "nes")):
        return None
    placed_m = np.array([bodies[name].layout_sd_m or PLACEMENT_SD_M for name in ("host", "nes")])
    least_m = PLACEMENTS * float(np.linalg.norm(placed_m))
    sure = abs(height_m) / max(sd_m, 1e-12)
    if abs(height_m) < max(least_m, LENS_TILTS * lens_height_m) or sure < SIGNIFICANCE:
        return None
    way = "higher" if height_m > 0 else "lower"
    return Structure(
        "measurement",
        "all",
        "z",
        f"the NES: its markers lie {way} over the Host's {THAN_STATED}",
        abs(height_m) / least_m,
        sure**2,
        abs(height_m),
        "m",
        two_sided(sure),
    )


def _speed_px_per_s(design: Array, heights: NDArray[np.bool_]) -> float:
    """How fast bodies cross the second view: what a delay does to heights over what a pixel does."""
    moving, per_px = design[heights, 2], np.abs(design[heights, 0])
    return max(float(np.std(moving)) / max(float(np.median(per_px)), 1e-12), 1.0) if len(moving) else 1.0


def _with_own_delays(rows: Rows, least_s: float) -> tuple[Rows, Structure | None]:
    """Where the second camera's delay changes within the runs, by more than ``least_s``, what says so, and ``rows``
    with a delay of its own for every part: window and plane are then not bent by it.
    """
    fit = least_squares(rows.design, rows.value, rows.sd, rounds=ROUNDS, ridge=RIDGE)
    left = rows.value - rows.design @ fit.coefficients
    lens_px, _, inflation = lens_residual(rows.design, left)
    lens_s = lens_px / _speed_px_per_s(rows.design, rows.heights)
    along, parts = rows.design[:, 2], rows.part(PARTS)
    change = clock_change(along * fit.weight, left * fit.weight, parts, inflation, lens_s, least_s)
    if change is None:
        return rows, None
    own = np.column_stack([along * (parts == k) for k in np.unique(parts)[1:]])
    return replace(rows, design=np.hstack([rows.design, own])), change


def _plane_tilt(
    cameras: tuple[Camera, ...], slope: Array, slope_sd: Array, lens_height_m: float, places_m: Array
) -> Finding:
    """The plane's tilt from its ``slope`` (2,), of which a lens residual that bends heights by ``lens_height_m`` over
    the ``places_m`` (N, 2) may be the cause.
    """
    lever = float(np.std(places_m)) or 1.0
    lens_along = lens_across = max(lens_height_m / (2 * lever), 1e-9)
    learnt = cameras[0].field
    if learnt is not None:
        lens_along, lens_across = (max(lens_along, learnt.open_sd[name]) for name in ("plane_along", "plane_across"))
    c, s = baseline(cameras)
    lens_x, lens_y = np.hypot(c * lens_along, s * lens_across), np.hypot(s * lens_along, c * lens_across)
    (slope_x, slope_y), (sx, sy) = slope, slope_sd
    along, across = c * slope_x + s * slope_y, c * slope_y - s * slope_x
    by_lens = float(np.hypot(along / lens_along, across / lens_across))
    tilt = float(np.hypot(slope_x, slope_y))
    # z = a x + b y is the world turned by b about x and by -a about y.
    return judge(
        "plane_tilt",
        {"x_rad": (slope_y, np.hypot(sy, lens_y)), "y_rad": (-slope_x, np.hypot(sx, lens_x))},
        tilt,
        min(tilt / max(sx, sy), by_lens / LENS_TILTS * SIGNIFICANCE),
    )


#: columns of the joint fit that belong to each effect
COLUMNS = {"sensor_window_offset": (0, 1), "camera_clock_offset": (2,), "plane_tilt": (3, 4)}


def _rivals(a: Array, b: Array, inflation: float) -> dict[str, tuple[str, ...]]:
    """For each effect the others that alone explain the (weighted) residuals as well: where bodies stay in one place or
    hardly move.
    """
    normal, right = a.T @ a, a.T @ b
    own = list(range(5, a.shape[1]))

    def explained(columns: tuple[int, ...]) -> float:
        at = [*columns, *own]
        return float(right[at] @ np.linalg.pinv(normal[np.ix_(at, at)], hermitian=True) @ right[at]) / inflation

    gain = {effect: explained(columns) for effect, columns in COLUMNS.items()}
    return {
        effect: tuple(o for o in COLUMNS if o != effect and gain[effect] - gain[o] < EQUIVALENT) for effect in COLUMNS
    }


def _by_run(a: Array, b: Array, of_run: NDArray[np.bool_], inflation: float) -> dict[str, ByRun]:
    """What the (weighted) equations of each run, those ``of_run`` (R, N), say of each effect, whatever the others
    are."""
    information = np.array([a[here].T @ a[here] for here in of_run]) / inflation
    score = np.array([a[here].T @ b[here] for here in of_run]) / inflation
    return {effect: ByRun.of_forms(information, score, own) for effect, own in COLUMNS.items()}


def lens_residual(a: Array, residual: Array) -> tuple[float, bool, float]:
    """RMS (px) of what the epipolar residual shows in squares of 10 mm of the room beyond its noise, whether it is
    surely there, and by how much the noise's correlation inflates the variance of a mean.

    Mean squares of the squares' means are held against the scatter within them, allowing for its correlation from frame
    to frame.
    """
    rows = np.flatnonzero((a[:, 3] == 0) & (a[:, 4] == 0))
    heights = np.flatnonzero((a[:, 3] != 0) | (a[:, 4] != 0))
    if len(rows) != len(heights) or len(rows) < FEWEST_SEEN:
        return 0.0, False, 1.0
    place = np.floor(a[heights, 3:5] / SQUARE_M).astype(int)
    _, square = np.unique(place, axis=0, return_inverse=True)
    r = residual[rows]
    centre, deviation = _by_square(r, square, np.median), _by_square(np.abs(r), square, np.median)
    use = np.abs(r - centre[square]) < GROSS_SD * MEDIAN_TO_SD * deviation[square] + 1e-12
    r, square = r[use], square[use]
    count, mean = np.bincount(square), _by_square(r, square, np.mean)
    within = r - mean[square]
    full = count >= FEWEST_IN_SQUARE
    if not full.any():
        return 0.0, False, 1.0
    variance = (np.bincount(square, within**2) / np.maximum(count, 1))[full]
    pairs = square[1:] == square[:-1]
    lag = float(np.sum(within[1:][pairs] * within[:-1][pairs]) / max(np.sum(within[1:][pairs] ** 2), 1e-300))
    lag = float(np.clip(lag, 0.0, MOST_LAG))
    inflation = (1 + lag) / (1 - lag)
    excess = np.sum((mean[full] ** 2 - variance / count[full]) * count[full]) / count[full].sum()
    chi = float(np.mean(mean[full] ** 2 * count[full] / variance)) / inflation
    return float(np.sqrt(max(excess, 0.0))), chi > LENS_SEEN, float(inflation)


def _by_square(values: Array, square: NDArray[np.int64], what: Callable[[Array], float]) -> Array:
    order = np.argsort(square, kind="stable")
    cuts = np.flatnonzero(np.diff(square[order])) + 1
    out = np.zeros(int(square.max()) + 1)
    for part in np.split(order, cuts):
        out[square[part[0]]] = what(values[part])
    return out
