"""Shrinkage of effects that the recalibrated model has already absorbed: in the residual by which they are known.

A measurement error is taken out before anything is fitted, and a centre is a free term of the wall: flights and impacts
then agree with and without the effect, and would say that nothing shrank.  The residual that the effect itself leaves
is compared instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.contact.wall_fit import WallFit, fit_wall
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.measurement.tests import measurement_tests
from analysis.gap.prediction.predict import shrinkage
from analysis.gap.selection.impact_candidates import ImpactFit, wall_prior
from analysis.walls.wall import Wall

Array = NDArray[np.float64]


#: terms of the wall that an effect stands for; a contact that lasts adds a column of its own
WALL_TERMS_OF: dict[str, tuple[str, ...]] = {
    "wall_centre_offset": ("centre_x", "centre_y"),
    "mass_centre_offset": ("disk_x", "disk_y"),
    "wall_ellipticity": ("ellipse_c", "ellipse_s"),
    "stated_radius": ("radius", "cylinder_radius"),
    "finite_contact_time": (),
}


@dataclass(frozen=True)
class OwnShrinkage:
    """Shrinkage with its 90 % interval in the effect's own residual; where that is the contact distance, its rms (m)
    without and with.
    """

    value: float
    low: float
    high: float
    without_m: float | None = None
    with_m: float | None = None


def own_shrinkage(ladder: Ladder, cause: Cause, rng: np.random.Generator) -> OwnShrinkage | None:
    """What the effect's own residual says; None where flights or impacts show it."""
    if cause.stage == "measurement":
        return _of_measurement(ladder, cause)
    if cause.effect in WALL_TERMS_OF:
        return _of_wall(ladder, cause, rng)
    if cause.effect == "centre_marker_offset":
        size = float(np.linalg.norm([v for v, _ in cause.parameters.values()]))
        sd = float(max(s for _, s in cause.parameters.values()))
        return _ratio(size, sd, sd)
    return None


def _of_measurement(ladder: Ladder, cause: Cause) -> OwnShrinkage:
    """Size before against size after the correction, measured again; a late clock is not corrected and keeps its sd."""
    finding = next(f for f in ladder.findings if f.effect == cause.effect)
    sd = float(max(s for _, s in finding.parameters.values()))
    after = measurement_tests(ladder.series).findings.get(cause.effect)
    left = sd if after is None or cause.effect == "camera_clock_offset" else after.size
    return _ratio(finding.size, left, sd)


def _ratio(before: float, after: float, sd: float) -> OwnShrinkage:
    """1 - (after/before)^2, and the same at the ends of the 90 % interval of what is left."""

    def share(left: float) -> float:
        return float(np.clip(1 - (left / max(before, 1e-300)) ** 2, 0.0, 1.0))

    return OwnShrinkage(share(after), share(after + 1.645 * sd), share(max(after - 1.645 * sd, 0.0)))


def _of_wall(ladder: Ladder, cause: Cause, rng: np.random.Generator) -> OwnShrinkage:
    """Contact distance with and without the effect's terms, against the cameras' noise, bootstrapped over runs."""
    impacts = ladder.impacts.fitted
    assert impacts is not None, "a cause at the wall comes from impacts"
    fitted = impacts.wall
    without = fit_without(
        impacts,
        WALL_TERMS_OF[cause.effect],
        ladder.series.runs[0].data.wall,
        finite=ladder.impacts.finite and cause.effect != "finite_contact_time",
    )
    used = fitted.used & without.used
    run = impacts.junctions.run[used]
    n = len(ladder.series.runs)

    def sums(residual: Array) -> Array:
        return np.bincount(run, weights=np.minimum(residual[used] ** 2, 1e-6), minlength=n).astype(float)

    before, after = sums(without.residual_m), sums(fitted.residual_m)
    share = shrinkage(before, after, sums(fitted.impacts.sd("gap")), rng)
    count = max(int(used.sum()), 1)
    return OwnShrinkage(*share, float(np.sqrt(before.sum() / count)), float(np.sqrt(after.sum() / count)))


def fit_without(impacts: ImpactFit, names: tuple[str, ...], stated: Wall, *, finite: bool) -> WallFit:
    """The wall refitted with the terms ``names`` as ``stated`` (of flat sides, whose distances are their radius and
    centre, with these); ``finite`` keeps the slope of a contact that lasts."""
    wall, as_stated = impacts.wall.wall, stated.values()
    held = [t for t in wall.terms if t in names or (t.startswith("side") and {"centre_x", "radius"} & set(names))]
    start = wall.moved({name: as_stated[name] - wall.values()[name] for name in held})
    extra = np.maximum(impacts.wall.impacts.of("normal_before"), 0)[:, None] if finite else None
    terms = tuple(t for t in impacts.wall.terms if t not in held)
    return fit_wall(impacts.junctions, start, terms, wall_prior(wall), extra)
