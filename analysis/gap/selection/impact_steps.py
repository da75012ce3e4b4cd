"""The impacts' step: shape of the wall, restitution's effects by forward selection, probes in every law of the
contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import fit_restitution
from analysis.contact.restitution import RESTITUTION_EFFECTS, restitution_design
from analysis.contact.sliding import USUAL_FRICTION_SCATTER, friction_of_blows
from analysis.contact.wall_fit import CONTACT_MODEL_SHARE, contact_time_s
from analysis.gap.cause import EACH_BLOW, EACH_RUN, HELD_BY_MORE, NONE_TESTED, SMALLEST_P, Cause, Structure
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.impact_laws import rivals_of, select_laws
from analysis.gap.selection.impacts.distance import distance_gains
from analysis.gap.selection.impacts.fit import PLAIN_SHAPE, ImpactFit, Shape, fit_impacts, with_lobes
from analysis.gap.selection.impacts.gain import ImpactGain, negligible_share
from analysis.gap.selection.impacts.own_places import own_places
from analysis.gap.selection.null_distribution import (
    by_chance,
    chance_of_largest,
    chance_of_misfit,
    impact_null_distribution,
)
from analysis.gap.thresholds import (
    CONTACT_NEGLIGIBLE,
    DISTANCE_NEGLIGIBLE,
    ELLIPTICITY_NEGLIGIBLE,
    ELLIPTICITY_SD_UNDER_LENS,
    ELLIPTICITY_UNDER_LENS,
    IMPACT_GAIN,
    LEFT_OVER,
    SIGNIFICANCE,
    USUAL_DISTANCE,
)
from analysis.walls.lobes import LOBE_TERMS
from analysis.walls.outlines import ELLIPSE_TERMS

Array = NDArray[np.float64]
# Restitution scatters by up to 0.03 from impact to impact, contact distances by the lens residual: more has a
# cause.
USUAL_SCATTER = 0.03
# ... and above so many times it something else scatters them, which no covariate shows.
WIDE_SCATTER = 1.35 * USUAL_SCATTER
LEAST_IMPACTS = 8
# An impact's noise counts up to so many times the usual one: its distance is no better than clipped.
GROSS_NOISE = 4.0


@dataclass(frozen=True, eq=False)
class ImpactSteps:
    """Recalibrated and final fit of wall and law, the terms in use, what was accepted, and the probes after;
    ``left`` the named effects' gains on the final fit, ``null_distribution`` the best gain in each of the series
    without effect that were drawn."""

    nominal: ImpactFit | None = None
    fitted: ImpactFit | None = None
    gains: tuple[ImpactGain, ...] = ()
    probes: tuple[ImpactGain, ...] = ()
    restitution_terms: tuple[str, ...] = ()
    shape: Shape = PLAIN_SHAPE
    causes: tuple[Cause, ...] = ()
    structure: tuple[Structure, ...] = ()
    left: tuple[ImpactGain, ...] = ()
    null_distribution: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def left_p(self) -> float:
        """How often chance makes the best probe of the restitution gain what it does; 1 where none explains more than
        is negligible."""
        least = negligible_share("restitution", self.shape.finite)
        gained = [g.gain for g in self.probes if g.residual == "restitution" and g.size > least]
        return by_chance(self.null_distribution, max(gained)) if gained else 1.0


def select_impact_effects(
    flight: FlightFit,
    effects: Sequence[str],
    withheld: frozenset[str],
    lens_residual_found: bool,
    rng: np.random.Generator,
    surely: Sequence[str] = (),
) -> ImpactSteps:
    """Wall and law refitted, then the wall's shape, then restitution's effects; nothing where there are fewer than 8
    impacts.  ``surely``: effects of the restitution that something else has shown already.
    """
    terms: Sequence[str] = [e for e in effects if e in RESTITUTION_EFFECTS]
    shape = Shape("wall_ellipticity" in effects, "finite_contact_time" in effects)
    nominal = fit_impacts(flight.fits, shape)
    if len(nominal.data) < LEAST_IMPACTS:
        return ImpactSteps(restitution_terms=tuple(terms), shape=shape)
    if "wall_lobes" in effects:
        shape = with_lobes(nominal, shape)
        nominal = fit_impacts(flight.fits, shape)
    shape, shapes, fitted, shape_gains, distances = _shape(flight, nominal, shape, withheld, lens_residual_found)
    shape_left, distance_probes = ([g for g in distances if g.named == named] for named in (True, False))
    limit_m = DISTANCE_NEGLIGIBLE * fitted.wall.wall.size_m
    steps = ImpactSteps(
        nominal,
        fitted,
        tuple(shape_gains),
        tuple(distance_probes),
        tuple(terms),
        shape,
        tuple(shapes),
        tuple(_distance_structure(distance_probes, shapes, limit_m)),
        tuple(shape_left),
    )
    return _with_laws(steps, fitted, terms, withheld, rng, surely)


def beside_wall_law(
    steps: ImpactSteps, leaning: ImpactFit, effects: Sequence[str], withheld: frozenset[str], rng: np.random.Generator
) -> ImpactSteps:
    """``steps`` with all that is not the wall's shape asked once more of the impacts at a wall whose normal a law
    turns (``leaning``)."""
    of_shape = [[g for g in gains if g.residual == "distance"] for gains in (steps.gains, steps.probes, steps.left)]
    shapes = replace(
        steps,
        gains=tuple(of_shape[0]),
        probes=tuple(of_shape[1]),
        left=tuple(of_shape[2]),
        causes=tuple(c for c in steps.causes if c.effect not in RESTITUTION_EFFECTS),
        structure=tuple(one for one in steps.structure if one.coordinate == "radius"),
    )
    terms = [e for e in effects if e in RESTITUTION_EFFECTS]
    return _with_laws(shapes, leaning, terms, withheld, rng)


def _with_laws(
    shapes: ImpactSteps,
    fitted: ImpactFit,
    terms: Sequence[str],
    withheld: frozenset[str],
    rng: np.random.Generator,
    surely: Sequence[str] = (),
) -> ImpactSteps:
    """The steps of the wall's shape alone, and behind them those of the contact's laws, asked of the impacts
    ``fitted``, whose restitution holds the ``terms``."""
    null_distribution = impact_null_distribution(fitted.data, terms, rng)
    laws, terms, law_gains, law_left, probes, structure = select_laws(
        fitted, terms, shapes.shape.finite, withheld, null_distribution, surely
    )
    return ImpactSteps(
        shapes.nominal,
        fitted,
        (*shapes.gains, *law_gains),
        (*probes, *shapes.probes),
        tuple(terms),
        shapes.shape,
        (*shapes.causes, *laws),
        (*structure, *shapes.structure),
        (*shapes.left, *law_left),
        null_distribution,
    )


def _shape(
    flight: FlightFit, base: ImpactFit, shape: Shape, withheld: frozenset[str], lens_residual_found: bool
) -> tuple[Shape, list[Cause], ImpactFit, list[ImpactGain], list[ImpactGain]]:
    """Ellipticity, lobes and finite contact, whichever explains most first; then the others on top.  Returns the gains
    of the named ones before, and those of all, probes too, beside what was found."""
    causes: list[Cause] = []
    gains = distance_gains(base, shape, withheld)
    first = found = [g for g in gains if g.named]
    for _ in range(3):
        accepted = [g for g in found if _shape_accepted(g, base, lens_residual_found)]
        if not accepted:
            break
        best = max(accepted, key=lambda g: g.gain)
        shape = Shape(
            shape.ellipse or best.name == "wall_ellipticity",
            shape.finite or best.name == "finite_contact_time",
            best.order or shape.order,
        )
        base = fit_impacts(flight.fits, shape)
        causes.append(replace(_shape_cause(best, base, lens_residual_found), rivals=rivals_of(best, found)))
        gains = distance_gains(base, shape, withheld)
        found = [g for g in gains if g.named]
    return shape, causes, base, first, gains


def contact_negligible_s(base: ImpactFit) -> float:
    """A contact as short as this is an instant: the way at the median approach is a small share of the radius."""
    return CONTACT_NEGLIGIBLE * base.wall.wall.size_m / max(float(np.median(base.data.before)), 1e-9)


def _shape_accepted(gain: ImpactGain, base: ImpactFit, lens_residual_found: bool) -> bool:
    if gain.gain < IMPACT_GAIN or gain.significance < SIGNIFICANCE:
        return False
    if gain.name == "finite_contact_time":
        return contact_time_s(float(gain.estimate[-1]), base.law.restitution) > contact_negligible_s(base)
    e = gain.estimate[:2]
    return float(np.hypot(*e)) > (ELLIPTICITY_UNDER_LENS if lens_residual_found else ELLIPTICITY_NEGLIGIBLE)


def _shape_cause(gain: ImpactGain, base: ImpactFit, lens_residual_found: bool) -> Cause:
    if gain.name == "finite_contact_time":
        factor = contact_time_s(1.0, base.law.restitution)
        duration = base.contact_slope_s * factor
        parameters = {"duration_s": (duration, base.contact_slope_sd_s * factor + CONTACT_MODEL_SHARE * duration)}
        return Cause(
            gain.name, "impact", parameters, duration / contact_negligible_s(base), gain.gain, "normal", "impact"
        )
    terms, order = (LOBE_TERMS, gain.order) if gain.order else (ELLIPSE_TERMS, 2)
    values = base.wall.wall.values()
    c, s = (values[t] for t in terms)
    at = [list(base.wall.terms).index(t) for t in terms]
    lens = ELLIPTICITY_SD_UNDER_LENS if lens_residual_found else 0.0
    sd = float(np.hypot(np.sqrt(np.mean(np.diag(base.wall.covariance)[at])), lens))
    e = float(np.hypot(c, s))
    # Lobes are fitted in the Host; all directions are stated in the room.
    turn = float(np.mean(base.data.at.host_angle_rad)) if gain.order else 0.0
    direction = (float(np.arctan2(s, c)) / order + turn, sd / order / max(e, 1e-9))
    parameters = (
        {"amplitude": (e, sd), "order": (float(order), 0.0), "direction_rad": direction}
        if gain.order
        else {"ellipticity": (e, sd), "direction_rad": direction}
    )
    return Cause(gain.name, "geometry", parameters, e / ELLIPTICITY_NEGLIGIBLE, gain.gain, "radius", "impact")


def _distance_structure(probes: Sequence[ImpactGain], causes: Sequence[Cause], limit_m: float) -> list[Structure]:
    strongest = max((c.strength for c in causes), default=0.0)
    # A contact distance that goes with the azimuth is the wall's shape; with the speed of approach it is the contact's
    # doing.
    return [
        Structure(
            "impact" if p.name == "the approach speed" else "geometry",
            "impact",
            "radius",
            p.name,
            p.size / limit_m,
            p.gain,
            p.size,
            "m",
            chance_of_largest(p.gain, len(p.estimate), len(probes)),
        )
        for p in probes
        if p.gain > 2 * IMPACT_GAIN
        and p.significance > SIGNIFICANCE
        and p.size > limit_m * max(LEFT_OVER * strongest, 1.0)
    ]


def unexplained_scatter(step: ImpactSteps, found: Sequence[Structure]) -> list[Structure]:
    """Scatter of the impacts beyond what is usual, where no covariate explains it, and a wall that lies elsewhere in
    each run, in no order."""
    base = step.fitted
    elsewhere = (s for s in found if not s.is_taken_out)
    if base is None or any(s.stage in ("impact", "geometry", "measurement") for s in elsewhere):
        return []
    out = []
    scatter = float(fit_restitution(base.data, restitution_design(base.data, step.restitution_terms))[2])
    if scatter > WIDE_SCATTER:
        out.append(
            Structure(
                "impact",
                "impact",
                "normal",
                f"{NONE_TESTED} (scatter from impact to impact)",
                scatter / USUAL_SCATTER,
                0.0,
                scatter,
                "1",
                chance_of_misfit(len(base.data) * (scatter / USUAL_SCATTER) ** 2, len(base.data)),
            )
        )
    out += _along_the_wall(base)
    usual_m = USUAL_DISTANCE * base.wall.wall.size_m
    places, size_m, gain, p = own_places(base.wall)
    least_m = DISTANCE_NEGLIGIBLE * base.wall.wall.size_m
    if places and size_m > least_m:
        strength = size_m / least_m
        return [*out, Structure("geometry", "impact", "radius", EACH_RUN, strength, gain, size_m, "m", p, places)]
    # What the frames' own noise makes of the distances (a smeared disk's among them) is no scatter of the wall.
    used = base.wall.used
    sds_m = base.wall.impacts.sd("gap")[used]
    noise_m = float(np.sqrt(np.mean(np.minimum(sds_m, GROSS_NOISE * np.median(sds_m)) ** 2))) if used.any() else 0.0
    scatter_m = float(np.sqrt(max(base.wall.scatter_m**2 - noise_m**2, 0.0)))
    if scatter_m > usual_m:
        out.append(
            Structure(
                "geometry",
                "impact",
                "radius",
                f"{NONE_TESTED} (scatter of the contact distance)",
                scatter_m / usual_m,
                0.0,
                scatter_m,
                "m",
                chance_of_misfit(len(base.data) * (scatter_m / usual_m) ** 2, len(base.data)),
            )
        )
    return out


def _along_the_wall(base: ImpactFit) -> list[Structure]:
    """Friction of the wall that each impact has of its own, or that holds more than it slides with; not of contacts
    that last, which have a law of their own."""
    observed = None if base.lasting is not None else friction_of_blows(base.data, base.law)
    if observed is None:
        return []
    if observed.is_each_blows:
        words = EACH_BLOW
        p = chance_of_misfit(observed.slid * (observed.scatter / USUAL_FRICTION_SCATTER) ** 2, observed.slid)
        size, strength = observed.scatter, observed.scatter / USUAL_FRICTION_SCATTER
    elif observed.holds_by_more:
        words = HELD_BY_MORE
        size, strength, p = observed.held - 1, (observed.held - 1) / USUAL_FRICTION_SCATTER, SMALLEST_P
    else:
        return []
    return [Structure("impact", "impact", "tangential", words, strength, 0.0, size, "1", p)]
