"""Which wall the impacts show, and the contact law on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from analysis.contact.effect_rows import CONTACT_TIME
from analysis.contact.impacts import intersect, measure
from analysis.contact.law import Law, LawData, fit_restitution, fit_tangential
from analysis.contact.wall_fit import WallFit, fit_wall, lobe_order, usable
from analysis.flights.fit import FlightFits
from analysis.identification.contact_law.deviance import best_tangential
from analysis.walls.lobes import LOBE_TERMS, LobedWall
from analysis.walls.outlines import DISK_TERMS, ELLIPSE_TERMS, Ring

# An ellipse is taken where it makes the scatter of the contact distances this much smaller, on enough impacts, and
# chance would not (F test of its two terms: of a dozen impacts seven parameters always explain much).
FEWEST_FOR_ELLIPSE = 12
ELLIPSE_SHARE = 2.0
ELLIPSE_CHANCE = 1e-4
ELLIPSE_WORDS = "The impacts show a wall that is no circle, which [model] effects does not name; an ellipse was fitted."
# A contact lasts where the contact distances grow with the approach speed by this much (s), ten sd beyond doubt: an
# instant one gives 0 to 3e-6, one of half a millisecond 1.6e-4.
LASTING_S = 2e-5
LASTING_SD = 10.0
LASTING_WORDS = (
    "The disk goes on for {:.3f} ms past the wall at impacts: the contact lasts (finite_contact_time), which an "
    "instant law does not describe. "
    "Times are those of the first touch; restitution and the tangential values are those of the whole contact taken "
    "as an instant, the "
    "Host's motion meanwhile included; chatter is followed with such a contact."
)


def wall_and_words(fits: Sequence[FlightFits], effects: Sequence[str], angle: bool) -> tuple[WallFit, list[str]]:
    """The wall as it is meant to be, with the shapes and the lasting contact that ``[model]`` names; a circle as an
    ellipse, and a contact as a lasting one, also where the impacts leave no doubt.
    """
    junctions, start = intersect(fits), fits[0].run.wall
    terms = [term for term in start.nominal_terms if angle or term not in DISK_TERMS]
    prior = {term: start.prior_sd(term) for term in terms}
    seen = measure(junctions, start)
    near = usable(seen, start.size_m) & (seen.surface < len(start.outline.names))
    if near.any():
        # The impacts' own distance, not the design: a scale that is off by 4 % would leave every impact a millimetre
        # from the wall.
        start = start.grown(float(np.median(seen.of("gap")[near])))
    if "wall_ellipticity" in effects:
        terms += start.ellipse_terms
    plain = fit_wall(junctions, start, terms, prior)
    if "wall_lobes" in effects and plain.wall.ellipse_terms:
        order = lobe_order(plain)
        if order:
            start, terms = LobedWall.of(start, order), [*terms, *LOBE_TERMS]
            plain = fit_wall(junctions, start, terms, prior)
    count = int(plain.used.sum())
    lasts = CONTACT_TIME in effects
    if count >= FEWEST_FOR_ELLIPSE:
        lasting = fit_wall(junctions, start, terms, prior, plain.impacts.of("normal_before")[:, None])
        delay, sd = float(lasting.estimate[-1]), float(np.sqrt(lasting.covariance[-1, -1]))
        sure = delay > max(LASTING_S, LASTING_SD * sd) and lasting.scatter_m < plain.scatter_m
        if sure or (lasts and delay > 0):
            fitted = replace(
                lasting,
                delay_s=delay,
                delay_sd_s=sd,
                estimate=lasting.estimate[:-1],
                covariance=lasting.covariance[:-1, :-1],
            )
            return fitted, [] if lasts else [LASTING_WORDS.format(1e3 * delay)]
    if not isinstance(start.outline, Ring) or set(ELLIPSE_TERMS) <= set(terms) or count < FEWEST_FOR_ELLIPSE:
        return plain, []
    ellipse = fit_wall(junctions, start, [*terms, *ELLIPSE_TERMS], prior)
    if plain.scatter_m < ELLIPSE_SHARE * ellipse.scatter_m or not _surely_better(plain, ellipse):
        return plain, []
    return ellipse, [ELLIPSE_WORDS]


def _surely_better(circle: WallFit, ellipse: WallFit) -> bool:
    """Whether the ellipse's two terms explain more of the contact distances than chance would."""
    free = int(ellipse.used.sum()) - len(ellipse.terms)
    if free < 1:
        return False
    per_freedom = max(ellipse.chi_square / free, 1.0)
    ratio = max(circle.chi_square - ellipse.chi_square, 0.0) / 2 / per_freedom
    return bool(fdtrc(2, free, ratio) < ELLIPSE_CHANCE)


def fit_contact_law(data: LawData, angle: bool) -> Law | None:
    """Restitution, and where the angle is known wall friction and tangential restitution; None without an impact."""
    if len(data) == 0:
        return None
    (restitution,), _, scatter, normal = fit_restitution(data)
    if not angle:
        return Law(float(restitution), scatter, np.nan, np.nan, normal, np.nan, np.nan)
    (friction,), beta, tangential_scatter, _ = fit_tangential(data)
    friction, beta, tangential = best_tangential(data, float(friction), beta)
    return Law(
        float(restitution),
        scatter,
        float(friction),
        float(np.clip(beta, -1, 1)),
        normal,
        tangential,
        tangential_scatter,
    )
