"""Laws of the cameras' pictures that hold in all frames alike: what the lens fields have of a form, with the sizes of
their posterior."""

from __future__ import annotations

import numpy as np

from analysis.gap.laws.dictionary.candidate import named_numbers
from analysis.gap.laws.found_law import LawFound
from analysis.gap.measurement.changed_pictures import chance_of, changes_of
from analysis.gap.series import Series
from ovines.camera.bends import PERIODS_RAD, PictureChange
from ovines.core.laws.terms import Term, WrittenLaw


def changed_picture_laws(series: Series) -> tuple[LawFound, ...]:
    """A law for each change that counts; the series is without it already."""
    return tuple(_law(one, series) for one in changes_of(series))


def _law(one: PictureChange, series: Series) -> LawFound:
    assert series.cameras is not None
    number = [camera.name for camera in series.cameras].index(one.camera)
    law = WrittenLaw((Term(one.target, one.value, (), float(number), one.direction_rad, one.sd),))
    sds = [one.sd] + [one.direction_sd_rad] * (one.target in PERIODS_RAD)
    numbers = zip(named_numbers(law).items(), sds, strict=True)
    return LawFound(
        law,
        law,
        {name: (value, sd, unit) for (name, (value, unit)), sd in numbers},
        chance_of(one, series),
        one.before,
        one.after,
        np.zeros_like(one.before),
        (),
        size=one.size_px,
    )
