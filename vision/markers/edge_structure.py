"""What a disc's edge keeps after the fit, as displacement of the edge against direction: its noise at the frequency of
a shift.

Pixel noise alone makes a centre uncertain by what the normal equations say.  Paper, print, JPEG blocks, a sharpened
edge and another edge running through leave residuals that neighbours share, and how far those move the centre depends
on how they lie around the disc: a halo of sharpening, equal on all sides, moves it not at all.  A shift of the centre
displaces the edge by cos(angle) and has been fitted away; the displacements by cos(k angle) for k of 3 and more have
not, and their power gives the power at 1.  Even k are equal on opposite sides, as the pixels' lattice, smear and an
octagon are: those of far more power than their odd neighbours are such, and do not count.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, compiled_fast
from vision.markers.window import LIT_X, LIT_Y, NX, NY, RESIDUAL, SLOPE, STEP_X, STEP_Y, WEIGHT

Array = NDArray[np.float64]
Singles = NDArray[np.float32]

FIRST = 3  # lowest frequency that neither position nor an ellipse's shape takes
LAST_SLOW = 4  # last of the slow frequencies, those nearest to a shift's
LAST_SHAPE = 6  # last of those that distinguish a disc from other shapes
LAST = 9  # last one computed: of a disc of 4 px radius finer ones are within its blur
_PER_RADIUS = 2.0  # frequencies per pixel of the radius: finer ones are within the blur of a smaller disc
_ZERO = np.float32(0.0)
_LITTLE = np.float32(1e-12)
# Share of a frequency's mean power that its cap, the sum of its neighbours', leaves where all are alike:
# E[min(chi^2_2, chi^2_4)] / 2.
_CAPPED = 0.75
# Exponent with which slow over fast power goes on growing down to frequency 1: between rendered texture (0) and rough
# print (0.5).
_RED_POWER = 1.0 / 3.0
_RED_SHARE = 4.0  # squared ratio of slow to all power from which the slow ones decide: chance has 2 in one of ten discs
_LEAST_FAST = 0.3  # share of all power: slow ones of a shadow's edge leave 0.3 to 0.5 to the fast ones
_AGREEING = 20.0  # frequencies' worth at which the pixels' own noise counts where it agrees with the frequencies' power
_DISAGREE = 4.0  # rate at which that falls with the squared logarithm of their ratio: to a third for a factor of 1.7


@compiled_fast
def _sums(rows: Singles, n: int, last: int, moved: Array, weight: Array) -> None:
    """Per frequency FIRST..last and phase: residual times displacement, and squared displacement, summed over the
    edge's pixels.
    """
    pull, stiffness, re, im = rows[STEP_X], rows[STEP_Y], rows[LIT_X], rows[LIT_Y]
    nx, ny = rows[NX], rows[NY]
    for j in range(n):
        g = rows[WEIGHT, j] * rows[SLOPE, j]
        pull[j], stiffness[j], re[j], im[j] = g * rows[RESIDUAL, j], g * rows[SLOPE, j], nx[j], ny[j]
    for k in range(2, last + 1):
        a = b = c = d = _ZERO
        for j in range(n):
            x = re[j] * nx[j] - im[j] * ny[j]
            y = re[j] * ny[j] + im[j] * nx[j]
            re[j], im[j] = x, y
            a += pull[j] * x
            b += pull[j] * y
            c += stiffness[j] * x * x
            d += stiffness[j] * y * y
        if k >= FIRST:
            moved[k, 0], moved[k, 1], weight[k, 0], weight[k, 1] = a, b, c + _LITTLE, d + _LITTLE


@compiled
def displacements(rows: Singles, n: int, radius_px: float) -> tuple[Array, Array, int]:
    """Where the edge lies beside the fit, of the n edge pixels that `normal_equations` left in `rows`.

    Per frequency (LAST + 1) and phase (2): residual times displacement [grey levels^2/px], and squared slope
    [grey levels^2/px^2], their ratio being the displacement [px]; the last frequency that a disc of ``radius_px`` has.
    """
    last = min(max(int(_PER_RADIUS * radius_px), LAST_SHAPE), LAST)
    moved, weight = np.zeros((LAST + 1, 2)), np.zeros((LAST + 1, 2))
    _sums(rows, n, last, moved, weight)
    return moved, weight, last


@compiled
def edge_structure(
    moved: Array, weight: Array, last: int, radius_px: float, noise: float
) -> tuple[float, float, float]:
    """What `displacements` say: noise that moves the centre, slow over fast power, shape.

    Parameters
    ----------
    moved, weight, last : of `displacements`; radius_px : of the disc; noise : rms of a pixel by itself [grey levels]

    Returns
    -------
    Rms [grey levels] of independent pixels that would move the centre as much; power of slow displacements of
    the edge over that of fast ones; rms of displacements of frequency 3 to 6, beyond what that noise makes, over the
    radius: the disc's difference from an ellipse.
    """
    total = slow = shape = 0.0
    powers = np.zeros(LAST + 1)
    for k in range(FIRST, last + 1):
        for phase in range(2):
            power = moved[k, phase] ** 2 / weight[k, phase]
            powers[k] += power
            if k <= LAST_SHAPE:
                shape += 0.5 * (power - noise * noise) / weight[k, phase]
    for k in range(FIRST, last + 1):
        power = powers[k]
        if k % 2 == 0:
            power = min(power, powers[k - 1] + powers[k + 1 if k < last else k - 1]) / _CAPPED
        total += power
        if k <= LAST_SLOW:
            slow += power
    n_all, n_slow = 2.0 * (last - FIRST + 1), 2.0 * (LAST_SLOW - FIRST + 1)
    fast, mean, slow = (total - slow) / (n_all - n_slow), total / n_all + 1e-6, slow / n_slow
    ratio = mean / (noise * noise)
    agreeing = _AGREEING * np.exp(-_DISAGREE * np.log(ratio) ** 2)
    pooled = (agreeing * noise * noise + n_all * mean) / (agreeing + n_all)
    fast = max(fast, _LEAST_FAST * pooled)  # of few frequencies chance leaves hardly anything
    red = (slow / pooled) ** 2
    share = red / (red + _RED_SHARE)
    power = (1.0 - share) * pooled + share * slow * max(slow / fast, 1.0) ** _RED_POWER
    return np.sqrt(power), slow / fast, np.sqrt(max(shape, 0.0)) / radius_px
