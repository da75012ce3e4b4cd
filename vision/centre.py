"""The sub-pixel centre of a round marker, to the limit that the noise sets.

A window of the picture is fitted with an ellipse whose edge is a Gaussian step, on a background and a
contrast that may both slope (a lamp from one side brightens a white marker more on one side, and a plain
threshold would shift its centre).  Two facts keep it cheap: only pixels near the edge tell where it is, and
about the centre the unknowns split into those that keep their sign under reflection (levels, shape, blur)
and those that change it (position, slopes), so that the normal equations fall apart into 8 and 6.  The blur is
a symmetric 2 x 2 matrix: motion during the exposure smears along one direction.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from scipy.special import erfc

from ovines.camera import Camera

# Columns of a fit: what `fit_discs` takes (the first 14) and gives.
U, V, M11, M12, M22, S11, S12, S22, LEVEL, LEVEL_U, LEVEL_V, CONTRAST, CONTRAST_U, CONTRAST_V = range(14)
SD, NOISE, MISFIT, COVERAGE, OUTLIERS, OK = range(14, 20)
N_FIT = 20

_MIN_BLUR_PX2 = 0.04  # below this the edge is thinner than a pixel and the model's gradient falls between pixels
_EDGE_SIGMAS = 3.2  # beyond, the Gaussian step is within 0.1 % of its level
_HUBER = 3.0
# A slope of the contrast costs a small disc up to half its precision; it is fitted where it shows (1 % of chi^2, 2 dof).
_SLOPE_CHI2 = 9.2
_STRUCTURE = 1.3  # residual over pixel noise from which the residual is no longer noise
_FAST = {"reassoc", "contract", "arcp", "nsz"}  # not "nnan": comparisons with NaN must stay false
# The Gaussian step and its slope, interpolated linearly (error 4e-6): erfc and exp were two thirds of the time.
_TABLE_END, _TABLE_PER_UNIT = 6.0, 90.0
_TABLE_SIZE = int(2 * _TABLE_END * _TABLE_PER_UNIT) + 1
_TABLE_T = np.linspace(-_TABLE_END, _TABLE_END, _TABLE_SIZE)
_STEP = 0.5 * erfc(_TABLE_T / math.sqrt(2.0))
_BELL = np.exp(-0.5 * _TABLE_T**2) / math.sqrt(2 * math.pi)
_FIT_FREEDOM = 9.0  # unknowns that the edge pixels decide: position 2, shape 3, blur 3, contrast about 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _factor(a, n):
    """Cholesky factor of the lower triangle, in place; False if not positive definite."""
    for i in range(n):
        for j in range(i):
            s = a[i, j]
            for k in range(j):
                s -= a[i, k] * a[j, k]
            a[i, j] = s / a[j, j]
        s = a[i, i]
        for k in range(i):
            s -= a[i, k] * a[i, k]
        if not s > 0.0:
            return False
        a[i, i] = math.sqrt(s)
    return True


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _solve(a, b, first, n):
    """Solve with the factor of `_factor`; the solution replaces b[first:first + n]."""
    for i in range(n):
        s = b[first + i]
        for k in range(i):
            s -= a[i, k] * b[first + k]
        b[first + i] = s / a[i, i]
    for i in range(n - 1, -1, -1):
        s = b[first + i]
        for k in range(i + 1, n):
            s -= a[k, i] * b[first + k]
        b[first + i] = s / a[i, i]


@numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=_FAST)
def _normal_equations(image, p, clip, full, n_even, even, odd, rhs, sums):
    """Accumulate the Gauss-Newton normal equations over the disc's window.

    `full` false leaves the matrices alone and makes the right-hand sides only; `n_even` 2 holds shape and blur.  `sums`: 1 edge
    squares, 2 edge pixels, 3 pixels wanted, 4 pixels inside the picture, 5 clipped edge pixels, 6 inner
    n, 7 inner squares, 8 outer n, 9 outer squares,
    11 neighbouring flat pixels, 12 squares of their differences.
    """
    if full:
        even[:] = 0.0
        odd[:] = 0.0
    rhs[:] = 0.0
    sums[:] = 0.0
    height, width = image.shape
    cu, cv, m11, m12, m22 = p[0], p[1], p[2], p[3], p[4]
    s11, s12, s22 = p[5], p[6], p[7]
    half_trace = 0.5 * (m11 + m22)
    root = math.sqrt(max(half_trace * half_trace - (m11 * m22 - m12 * m12), 0.0))
    r_max = 1.0 / math.sqrt(half_trace - root)
    r_min = 1.0 / math.sqrt(half_trace + root)
    blur = math.sqrt(0.5 * (s11 + s22) + math.sqrt(0.25 * (s11 - s22) ** 2 + s12 * s12))
    band = _EDGE_SIGMAS * blur + 0.5
    ring = band + 2.0
    q_in = max(1.0 - band / r_min, 0.0)
    q_in2 = q_in * q_in
    q_edge2 = (1.0 + band / r_min) ** 2
    q_out2 = (1.0 + ring / r_min) ** 2
    reach = r_max * (1.0 + ring / r_min)
    je = np.empty(8)
    jo = np.empty(6)
    clip2 = clip * clip
    n_wanted = n_seen = 0
    for row in range(math.floor(cv - reach), math.ceil(cv + reach) + 1):
        y = row - cv
        last_col, last_r = -10, 0.0
        for col in range(math.floor(cu - reach), math.ceil(cu + reach) + 1):
            x = col - cu
            mx = m11 * x + m12 * y
            my = m12 * x + m22 * y
            q2 = x * mx + y * my
            if q2 > q_out2:
                continue
            n_wanted += 1
            if row < 0 or row >= height or col < 0 or col >= width:
                continue
            n_seen += 1
            base = p[8] + p[9] * x + p[10] * y
            contrast = p[11] + p[12] * x + p[13] * y
            value = float(image[row, col])
            if q2 < q_in2 or q2 > q_edge2:
                f = 1.0 if q2 < q_in2 else 0.0
                r = value - base - f * contrast
                w = 1.0 if abs(r) < clip else clip / abs(r)
                k = 6 if f > 0.0 else 8
                sums[k] += 1.0
                sums[k + 1] += min(r * r, clip2)
                if col == last_col + 1:
                    sums[11] += 1.0
                    sums[12] += min((r - last_r) ** 2, 2.0 * clip2)
                last_col, last_r = col, r
                wr = w * r
                rhs[0] += wr
                rhs[1] += f * wr
                rhs[10] += wr * x
                rhs[11] += wr * y
                rhs[12] += f * wr * x
                rhs[13] += f * wr * y
                if full:
                    wxx, wxy, wyy = w * x * x, w * x * y, w * y * y
                    even[0, 0] += w
                    even[1, 0] += f * w
                    even[1, 1] += f * w
                    odd[2, 2] += wxx
                    odd[3, 2] += wxy
                    odd[3, 3] += wyy
                    odd[4, 2] += f * wxx
                    odd[5, 2] += f * wxy
                    odd[4, 3] += f * wxy
                    odd[5, 3] += f * wyy
                    odd[4, 4] += f * wxx
                    odd[5, 4] += f * wxy
                    odd[5, 5] += f * wyy
                continue
            norm = math.sqrt(mx * mx + my * my) + 1e-30
            inverse = 1.0 / norm
            nx, ny = mx * inverse, my * inverse
            s2 = s11 * nx * nx + 2.0 * s12 * nx * ny + s22 * ny * ny
            inverse_s = 1.0 / math.sqrt(s2)
            q = math.sqrt(q2)
            t = (q - 1.0) * q * inverse * inverse_s
            place = (t + _TABLE_END) * _TABLE_PER_UNIT
            cell = min(max(int(place), 0), _TABLE_SIZE - 2)
            part = place - cell
            step = _STEP[cell] + part * (_STEP[cell + 1] - _STEP[cell])
            r = value - base - contrast * step
            w = 1.0 if abs(r) < clip else clip / abs(r)
            g = contrast * (_BELL[cell] + part * (_BELL[cell + 1] - _BELL[cell])) * inverse_s
            jo[0] = g * nx
            jo[1] = g * ny
            jo[2] = x
            jo[3] = y
            jo[4] = step * x
            jo[5] = step * y
            wr = w * r
            for i in range(6):
                rhs[8 + i] += wr * jo[i]
            je[0] = 1.0
            je[1] = step
            sums[1] += min(r * r, clip2)
            sums[2] += 1.0
            if w < 1.0:
                sums[5] += 1.0
            if full:
                for i in range(6):
                    a = w * jo[i]
                    for j in range(6):
                        odd[i, j] += a * jo[j]
            if n_even == 2:
                rhs[0] += wr
                rhs[1] += wr * step
                if full:
                    even[0, 0] += w
                    even[1, 0] += w * step
                    even[1, 1] += w * step * step
                continue
            gm = -0.5 * g * inverse
            gs = 0.5 * g * t * inverse_s
            je[2] = gm * x * x
            je[3] = 2.0 * gm * x * y
            je[4] = gm * y * y
            je[5] = gs * nx * nx
            je[6] = 2.0 * gs * nx * ny
            je[7] = gs * ny * ny
            for i in range(8):
                rhs[i] += wr * je[i]
            if full:
                for i in range(8):
                    a = w * je[i]
                    for j in range(8):
                        even[i, j] += a * je[j]
    sums[3] = n_wanted
    sums[4] = n_seen


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _solve_odd(odd, rhs, n_odd):
    """Solve for position and slopes; with `n_odd` 4 the contrast's slope stays out of it.

    Returns what the contrast's slope, let free, would take off the sum of squares: its test costs nothing, since
    the factor is ordered so that it comes last.
    """
    gain = 0.0
    if n_odd == 4:
        forward = np.empty(6)
        for i in range(6):
            s = rhs[8 + i]
            for k in range(i):
                s -= odd[i, k] * forward[k]
            forward[i] = s / odd[i, i]
        gain = forward[4] ** 2 + forward[5] ** 2
        rhs[12] = rhs[13] = 0.0
    _solve(odd, rhs, 8, n_odd)
    return gain


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _apply_step(p, rhs, r0):
    """Add the step `rhs`, held back where it leaves the model's linear range; length of the centre's step [px]."""
    length = math.sqrt(rhs[8] * rhs[8] + rhs[9] * rhs[9])
    scale = 1.0 if length < 0.35 * r0 else 0.35 * r0 / length
    p[0] += scale * rhs[8]
    p[1] += scale * rhs[9]
    p[8] += rhs[0]
    p[9] += rhs[10]
    p[10] += rhs[11]
    p[11] += rhs[1]
    p[12] += rhs[12]
    p[13] += rhs[13]
    size = max(abs(rhs[2]), abs(rhs[3]), abs(rhs[4])) / max(p[2], p[4])
    shrink = 1.0 if size < 0.3 else 0.3 / size
    for i in range(2, 5):
        p[i] += shrink * rhs[i]
    size = max(abs(rhs[5]), abs(rhs[6]), abs(rhs[7])) / max(p[5], p[7])
    shrink = 1.0 if size < 0.7 else 0.7 / size
    for i in range(5, 8):
        p[i] += shrink * rhs[i]
    p[5] = max(p[5], _MIN_BLUR_PX2)
    p[7] = max(p[7], _MIN_BLUR_PX2)
    bound = 0.95 * math.sqrt(p[5] * p[7])
    p[6] = min(max(p[6], -bound), bound)
    return length


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _believable(p, r0, start_u, start_v):
    """False once the fit has left what it was started on."""
    det = p[2] * p[4] - p[3] * p[3]
    if not det > 0.0 or p[2] <= 0.0 or p[4] <= 0.0:
        return False
    r = det**-0.25
    moved = math.hypot(p[0] - start_u, p[1] - start_v)
    return 1.5 < r < 2.0 * r0 + 2.0 and r > 0.5 * r0 and moved < 1.5 * r0 and max(p[5], p[7]) < 0.36 * r * r + 1.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _fit_one(image, p, max_iterations, tolerance_px, n_even, even, odd, rhs, sums):
    """Gauss-Newton from `p` (length 20, changed in place); the matrices are kept while the steps are small."""
    start_u, start_v = p[0], p[1]
    r0 = max(p[2] * p[4] - p[3] * p[3], 1e-12) ** -0.25
    clip = 1e9
    full = True
    p[OK] = 0.0
    n_odd = 6 if p[CONTRAST_U] != 0.0 or p[CONTRAST_V] != 0.0 else 4
    before = 1e9
    settled = 0
    gain = 0.0
    gradient = np.empty(14)
    for iteration in range(max_iterations):
        _normal_equations(image, p, clip, full, n_even, even, odd, rhs, sums)
        if sums[4] < 0.8 * sums[3] or sums[2] < 12:
            return
        # The noise for clipping: the edge's residual counts only once the model has settled.
        plateau = math.sqrt((sums[7] + sums[9] + 1e-3) / (sums[6] + sums[8] + 1e-3))
        edge = math.sqrt(sums[1] / sums[2])
        clip = _HUBER * max(0.3, plateau if iteration > 0 and edge < 2.0 * plateau else max(edge, plateau))
        if full:
            for i in range(n_even):
                even[i, i] *= 1.0 + 1e-6
            for i in range(5, n_even):  # a weak pull keeps the blur's shape defined where a small disc hides it
                even[i, i] += 1e-4 * even[i, i] + 1e-9
            if not _factor(even, n_even) or not _factor(odd, 6):
                return
        gradient[:] = rhs
        _solve(even, rhs, 0, n_even)
        slope_test = _solve_odd(odd, rhs, n_odd)
        gain = 0.0
        for i in range(14):
            if i < n_even or i >= 8:
                gain += gradient[i] * rhs[i]
        length = _apply_step(p, rhs, r0)
        if not _believable(p, r0, start_u, start_v):
            return
        change = max(abs(rhs[2]), abs(rhs[3]), abs(rhs[4])) / max(p[2], p[4])
        blur_change = max(abs(rhs[5]), abs(rhs[6]), abs(rhs[7])) / max(p[5], p[7])
        # Steps shrink about geometrically: stop when all those to come together would not matter.
        ratio = min(length / before, 0.95)
        left = length * ratio / (1.0 - ratio)
        full = length > 0.4 or ratio > 0.4 or change > 0.05 or blur_change > 0.2  # nearer, the old matrices serve
        before = length
        if iteration > settled and left < tolerance_px and change < 0.02 and blur_change < 0.2:
            if n_odd == 6 or slope_test < _SLOPE_CHI2 * (plateau * plateau + 0.1):
                break
            n_odd = 6
            full = True
            settled = iteration + 1
    inverse_trace = 0.0
    for k in range(2):
        rhs[8:] = 0.0
        rhs[8 + k] = 1.0
        _solve(odd, rhs, 8, n_odd)
        inverse_trace += rhs[8 + k]
    # The sums are those before the last step, which took this much off them.
    squares = max(sums[1] - gain, 0.1 * sums[1])
    edge = math.sqrt(squares / max(sums[2] - _FIT_FREEDOM, 0.3 * sums[2]))
    n_plateau = sums[6] + sums[8]
    plateau = math.sqrt((sums[7] + sums[9]) / max(n_plateau - 6.0, 1.0)) if n_plateau > 20 else edge
    noise = math.sqrt((sums[2] * edge**2 + n_plateau * plateau**2) / (sums[2] + n_plateau))
    # Neighbouring pixels differ by noise only; what the model misses (a shadow's edge, glare) they share, and it
    # does not average out.
    white = math.sqrt(0.5 * sums[12] / max(sums[11], 1.0)) if sums[11] > 30 else noise
    structure = max(edge, plateau) / max(white, 0.3)
    if structure > _STRUCTURE:
        noise = max(edge, noise) * structure
    p[SD] = math.sqrt(0.5 * inverse_trace * (noise**2 + 1.0 / 144.0) + 4e-7)
    p[NOISE] = plateau
    p[MISFIT] = edge
    p[COVERAGE] = sums[4] / sums[3]
    p[OUTLIERS] = sums[5] / sums[2]
    p[OK] = 1.0 if abs(p[CONTRAST]) > 4.0 * noise else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fit_discs(image, starts, max_iterations=12, tolerance_px=0.003, hold_shape=False):
    """Fit every disc of `starts` in one picture.

    Parameters
    ----------
    image : (h, w) uint8 or uint16, C-contiguous
    starts : (n, 20) rows as `disc_start` makes them, or the rows of the frame before
    max_iterations, tolerance_px : stop when the centre's step falls below the tolerance
    hold_shape : take shape and blur from the start and fit position and levels only: half the time, and as
        precise, because shape and blur keep their sign under reflection and position does not

    Returns
    -------
    (n, 20): centre U, V [px]; M11..M22: x' M x = 1 on the edge [1/px^2]; S11..S22: squared blur [px^2];
    levels and slopes; SD of the centre per axis [px]; NOISE of plateau and MISFIT (rms at the edge) [grey
    levels]; COVERAGE (share of the window inside the picture), OUTLIERS (share of edge pixels clipped),
    OK (1: converged on something disc-like).
    """
    out = starts.copy()
    even = np.empty((8, 8))
    odd = np.empty((6, 6))
    rhs = np.empty(14)
    sums = np.empty(13)
    for i in range(len(out)):
        _fit_one(image, out[i], max_iterations, tolerance_px, 2 if hold_shape else 8, even, odd, rhs, sums)
    return out


def disc_start(u_px: float, v_px: float, radius_px: float, level: float, contrast: float,
               blur_px: float = 0.9) -> np.ndarray:
    """A starting row for `fit_discs`: a circle of one brightness on one background."""
    row = np.zeros(N_FIT)
    row[[U, V, M11, M22, S11, S22]] = u_px, v_px, radius_px**-2, radius_px**-2, blur_px**2, blur_px**2
    row[LEVEL], row[CONTRAST] = level, contrast
    return row


def radius_px(fits: np.ndarray) -> np.ndarray:
    """Geometric mean radius [px] of fitted ellipses, shape (n, 20) -> (n,)."""
    return (fits[..., M11] * fits[..., M22] - fits[..., M12] ** 2) ** -0.25


def on_plane(camera: Camera, uv_px: np.ndarray, height_m: np.ndarray | float) -> np.ndarray:
    """World points (n, 3) where full-sensor pixels (n, 2) meet the plane(s) z = height_m."""
    direction = camera.rays(uv_px)
    distance = (np.asarray(height_m, float) - camera.centre_m[2]) / direction[:, 2]
    return camera.centre_m + distance[:, None] * direction


def circle_centres(fits: np.ndarray, camera: Camera, height_m: np.ndarray | float,
                   window_offset_px: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Image of each circle's centre, from the centre of its image ellipse.

    The picture of a circle's centre is not the centre of its elliptic picture, by about
    f r^2 sin(a) cos(a) / (Z^2 - r^2 sin^2(a)).  The circle lies in the plane z = height_m facing +z; its
    radius follows from the ellipse's area.  The offset is the exact one of the pinhole (from the dual conic);
    distortion enters through its slope only.

    Returns
    -------
    uv_px : (n, 2) corrected centres in window pixels;  radius_m : (n,) radii of the circles
    """
    centre = on_plane(camera, fits[:, [U, V]] + np.asarray(window_offset_px, float), height_m)
    jacobian = camera.project_with_jacobian(centre)[1][..., :2]
    radius_m = radius_px(fits) / np.sqrt(np.abs(np.linalg.det(jacobian)))
    seen = centre @ camera.rotation.T + camera.translation_m
    h1, h2 = camera.rotation[:, 0], camera.rotation[:, 1]
    lean = (radius_m**2)[:, None] * (h1[2] * h1[:2] + h2[2] * h2[:2]) - seen[:, 2:] * seen[:, :2]
    ellipse = lean / ((radius_m**2) * (h1[2] ** 2 + h2[2] ** 2) - seen[:, 2] ** 2)[:, None]
    offset = ellipse - seen[:, :2] / seen[:, 2:]
    focal = np.diag(camera.matrix)[:2]
    return fits[:, [U, V]] - offset * focal, radius_m
