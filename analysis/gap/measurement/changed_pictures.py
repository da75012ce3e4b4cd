"""Cameras whose pictures have changed since their calibration in a way that has a form, or that were calibrated on
boards that were not true.

What the lens fields, learnt from the recordings, have of one is reported as left of the measurement; the series is
without it, from its points on."""

from __future__ import annotations

import math

from analysis.gap.cause import BENT, BY_BOARDS, IN_PICTURE, SMALLEST_P, Structure, two_sided
from analysis.gap.measurement.fixed_markers import still_px
from analysis.gap.series import Series
from ovines.camera.changes import PictureChange, number_tried

# RMS over a picture of the smooth residual that is tolerated of a calibration (0.2 to 0.25 px), half as much again.  Of
# 24 series with such residuals fields had 0.11 to 0.23 px, of pictures that were skewed and boards that were
# not true, as long as these had no form, 0.5 to 0.8 px.
MOST_LENS_PX = 0.35


def changed_pictures(series: Series) -> list[Structure]:
    """What is left of the measurement: a structure for each change that counts."""
    return [
        Structure(
            "measurement", "all", "x", _goes_with(one),
            one.size_px / still_px(series), 2 * one.log_odds, one.size_px, "px", chance_of(one, series),
        )
        for one in changes_of(series)
    ]  # fmt: skip


def bent_picture(series: Series) -> list[Structure]:
    """The picture that is bent most beside what has a form, where it is by more than any calibration leaves: reported,
    with nothing else asked because of it, as the field that was learnt has taken it out."""
    worst = max(series.picture_bends_px, key=lambda name: series.picture_bends_px[name], default=None)
    bend_px = 0.0 if worst is None else series.picture_bends_px[worst]
    if bend_px <= MOST_LENS_PX:
        return []
    words, sure = f"{IN_PICTURE} {worst}: {BENT}", series.lens_sds
    strength = bend_px / MOST_LENS_PX
    return [Structure("measurement", "all", "x", words, strength, sure**2, bend_px, "px", two_sided(sure))]


def changes_of(series: Series) -> list[PictureChange]:
    """The changes that move markers by more than a still one may move."""
    if series.cameras is None:
        return []
    return [one for one in series.picture_changes if one.size_px > still_px(series)]


def chance_of(one: PictureChange, series: Series) -> float:
    """How often chance makes recordings so much likelier by one of the forms of one of the cameras: of each at most the
    inverse of that (Markov's inequality)."""
    return min(max(number_tried(len(series.cameras or ())) * math.exp(-one.log_odds), SMALLEST_P), 1.0)


def _goes_with(one: PictureChange) -> str:
    return f"{IN_PICTURE} {one.camera}: {one.words}" if one.camera else f"{BY_BOARDS}: {one.words}"
