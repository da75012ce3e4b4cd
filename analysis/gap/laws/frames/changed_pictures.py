"""Laws of the cameras' pictures that hold in all frames alike: what the lens fields have of a form, with the sizes of
their posterior."""

from __future__ import annotations

import numpy as np

from analysis.gap.laws.dictionary.candidate import named_numbers
from analysis.gap.laws.found_law import LawFound
from analysis.gap.measurement.changed_pictures import chance_of, changes_of
from analysis.gap.series import Series
from ovines.camera.boards import BOARD_BOW
from ovines.camera.changes import PictureChange
from ovines.core.laws.terms import Term, WrittenLaw


def changed_picture_laws(series: Series) -> tuple[LawFound, ...]:
    """A law for each change that counts; the series is without it already."""
    return tuple(_law(one, series) for one in changes_of(series))


def _law(one: PictureChange, series: Series) -> LawFound:
    law = WrittenLaw((_term(one, series),))
    sds = [one.sd, *(sd for _, sd in one.own_numbers.values())]
    numbers = zip(named_numbers(law).items(), sds, strict=True)
    return LawFound(
        law,
        series.frame.law(law),
        {name: (value, sd, unit) for (name, (value, unit)), sd in numbers},
        chance_of(one, series),
        one.before,
        one.after,
        np.zeros_like(one.before),
        (),
        size=one.size_px,
    )


def _term(one: PictureChange, series: Series) -> Term:
    if one.camera:
        assert series.cameras is not None
        number = [camera.name for camera in series.cameras].index(one.camera)
        return Term(one.target, one.value, (), float(number), one.direction_rad, one.sd)
    x, y = one.place_m if one.target == BOARD_BOW else (one.direction_rad, 0.0)
    return Term(one.target, one.value, (), x, y, one.sd)
