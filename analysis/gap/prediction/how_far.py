"""How far the gap shrinks: one definition for every effect, in units of the noise.

A model's error is the sum of its squared residuals over the noise's variance, in four stages: positions one flight
ahead, velocities one impact ahead, distances at which the disk met the wall, and the residuals by which measurement
effects are known (distance of the two views, heights, lengths, frequency).  Everything shared - floor, law, wall -
comes from the other runs.  The floor is what no law can predict, and never above the best model,
written laws among them.  Shrinkage is the
share of the recalibrated model's excess over the floor that goes when effects are added, over all stages together,
unclipped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import measure
from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.contact.wall_fit import fit_wall
from analysis.gap.cause import Cause, Structure
from analysis.gap.ladder import CONTACT, Ladder
from analysis.gap.prediction import predict
from analysis.gap.prediction.held_out_errors import Errors4
from analysis.gap.selection.impacts.fit import ImpactFit, wall_prior
from analysis.gap.selection.impacts.floor import impact_floor, scatter_beside
from analysis.walls.lobes import LOBE_TERMS
from analysis.walls.outlines import ELLIPSE_TERMS
from ovines.core.effects import is_law
from ovines.core.laws.terms import WrittenLaw

Array = NDArray[np.float64]
#: terms of the wall that an effect stands for; a contact that lasts adds a column of its own
WALL_TERMS_OF: dict[str, tuple[str, ...]] = {
    "wall_centre_offset": ("centre_x", "centre_y"),
    "mass_centre_offset": ("disk_x", "disk_y"),
    "wall_ellipticity": ELLIPSE_TERMS,
    "wall_lobes": LOBE_TERMS,
    "stated_radius": ("radius", "cylinder_radius"),
    "finite_contact_time": (),
}
#: ... and those that turn its normals
SHAPES = ("wall_ellipticity", "wall_lobes")
DRAWS = 400
# Squared residuals over the variance count up to this: a wrong track is no gap.
CUT = 1e4


@dataclass(frozen=True, eq=False)
class HowFar:
    """Sums of squares over the noise's variance, per stage and run (R,): of the recalibrated model, with all named
    effects, the floor; ``by_effect``: what the error grows by when that one is left out."""

    recalibrated: Mapping[str, Array]
    with_effects: Mapping[str, Array]
    floor: Mapping[str, Array]
    by_effect: Mapping[str, Array]

    def by_stage(self) -> dict[str, tuple[float, float, float]]:
        """Sums over all runs of the recalibrated model, with all named effects, and the floor: those that the
        shrinkage is made of."""
        return {
            stage: (float(each.sum()), float(self.with_effects[stage].sum()), self._floor(stage, np.ones(len(each))))
            for stage, each in self.recalibrated.items()
        }

    def excess(self) -> dict[str, float]:
        """Excess of the recalibrated model over the floor, by stage."""
        return {stage: before - floor for stage, (before, _, floor) in self.by_stage().items()}

    def _floor(self, stage: str, weight: Array) -> float:
        return float(min(weight @ one[stage] for one in (self.floor, self.with_effects, self.recalibrated)))

    def _share(self, closed: Array, weight: Array) -> float:
        above = sum(float(weight @ e) - self._floor(stage, weight) for stage, e in self.recalibrated.items())
        return float(weight @ closed) / above if above > 0 else 0.0

    def shrinkage(self, closed: Array, rng: np.random.Generator) -> tuple[float, float, float]:
        """Share of the excess that ``closed`` (R,) is, with a 90 % interval by bootstrap over runs."""
        n = len(closed)
        value = self._share(closed, np.ones(n))
        drawn = [
            self._share(closed, np.bincount(rng.integers(0, n, n), minlength=n).astype(float)) for _ in range(DRAWS)
        ]
        low, high = np.quantile(drawn, [0.05, 0.95])
        return value, float(min(low, value)), float(max(high, value))

    def entry(self, rng: np.random.Generator) -> dict[str, Any]:
        """What diagnosis.json says of it."""
        total = np.sum([self.recalibrated[s] - self.with_effects[s] for s in self.recalibrated], 0)
        names = ("shrinkage", "low", "high")
        value, low, high = self.shrinkage(total, rng) if self.by_effect else (0.0, 0.0, 0.0)
        return {
            "shrinkage": value,
            "shrinkage_low": low,
            "shrinkage_high": high,
            "by_effect": {
                effect: dict(zip(names, self.shrinkage(closed, rng), strict=True))
                for effect, closed in self.by_effect.items()
            },
        }


def shows_in(one: Cause | Structure, stage: str) -> bool:
    """Whether a finding shows in the residuals of a stage: a contact that lasts shows in the contact distance."""
    if isinstance(one, Cause) and one.effect == "finite_contact_time":
        return stage in ("impact", "geometry")
    if isinstance(one, Cause) and one.effect == "inertia_error":
        return stage == "impact"
    if isinstance(one, Cause) and one.effect == "centre_marker_offset":
        return stage == "measurement"
    return one.stage == stage


def how_far(ladder: Ladder, errors: Errors4, causes: Sequence[Cause], laws: Sequence[WrittenLaw] = ()) -> HowFar:
    """Errors of the recalibrated model and with ``causes``, by stage and run; ``laws`` that were written for what is
    left, in the rig's frame: what they predict is no noise."""
    n = len(ladder.series.runs)
    steps: dict[str, dict[str, Array]] = {"recalibrated": {}, "with_effect": {}, "noise_floor": {}}
    by_effect: dict[str, Array] = {}
    variance = _flight_variance(ladder)
    for name, stages in steps.items():
        found = errors[name]
        stages["flight"] = np.zeros(n) if found is None else found.flight / variance
    flights = [c for c in causes if c.stage == "flight"]
    closed = steps["recalibrated"]["flight"] - steps["with_effect"]["flight"]
    gains = {g.term.name: g.per_run for g in ladder.flights.kept}
    for cause in flights:
        own = gains.get(cause.effect)
        others = np.sum([gains[c.effect] for c in flights if c is not cause and c.effect in gains] or [np.zeros(n)], 0)
        by_effect[cause.effect] = closed if len(flights) == 1 else (closed - others if own is None else own)
    if ladder.impacts.fitted is not None:
        _impacts(ladder, steps, by_effect, causes, laws)
        _walls(ladder, steps, by_effect, causes)
        _normals(steps, by_effect, causes)
    _measurement(ladder, steps, by_effect, causes)
    _drive(ladder, steps, by_effect, causes)
    everything: list[Cause | Structure] = [*causes, *ladder.structure]
    for stage, recalibrated in steps["recalibrated"].items():
        # Where nothing was found, what a freer law still gains is the floor's own bias, no gap.
        if not any(shows_in(one, stage) for one in everything):
            steps["noise_floor"][stage] = recalibrated
    return HowFar(steps["recalibrated"], steps["with_effect"], steps["noise_floor"], by_effect)


def _flight_variance(ladder: Ladder) -> Array:
    """Variance (m^2) of both coordinates of a frame of each run, as the flights' noise is known."""
    scale = ladder.flights.fitted.noise.scale
    return np.array([2 * (scale * float(np.median(run.data.xy_sd_m))) ** 2 for run in ladder.series.runs])


def _impacts(
    ladder: Ladder,
    steps: dict[str, dict[str, Array]],
    by_effect: dict[str, Array],
    causes: Sequence[Cause],
    laws: Sequence[WrittenLaw],
) -> None:
    """Velocities and spin after an impact, one impact ahead."""
    before, after = ladder.both_impacts()
    terms = list(ladder.impacts.restitution_terms)
    held = [t for t in terms if t not in {c.effect for c in causes}]

    fits = ladder.flights.fitted.fits
    # What a law predicts of the restitution is no scatter.
    scatter = min(after.law.scatter, scatter_beside(after, terms, fits, laws)) if laws else after.law.scatter

    def squares(impacts: ImpactFit, error: tuple[Array, Array]) -> Array:
        """Of the normal and the tangential velocity and the spin (3, K)."""
        data = impacts.data
        turn = impacts.junctions.radius_m * data.inertia_factor
        z2 = np.stack(
            [
                error[0][:, 0] ** 2 / (data.normal_sd**2 + (scatter * data.before) ** 2),
                error[0][:, 1] ** 2
                / (data.tangential_sd**2 + (after.law.tangential_scatter * data.normal_impulse) ** 2),
                (turn * error[1]) ** 2 / data.angular_sd**2,
            ]
        )
        return np.where(np.isfinite(z2), z2, 0.0)

    def by_run(z2: Array, impacts: ImpactFit) -> Array:
        whole = np.minimum(z2.sum(0), CUT)
        return np.asarray(np.bincount(impacts.data.at.run, whole, len(ladder.series.runs)), float)

    def sums(impacts: ImpactFit, error: tuple[Array, Array]) -> Array:
        return by_run(squares(impacts, error), impacts)

    ahead = sums(after, predict.predicted_impacts(after, terms))
    steps["with_effect"]["impact"] = ahead
    as_law = [c.effect for c in causes if c.stage in CONTACT and is_law(c.effect)]
    plain = after if any(c.effect in RESTITUTION_EFFECTS for c in causes) and not as_law else before
    lasts = any(c.effect == "finite_contact_time" for c in causes)
    # A contact that lasts has a law of its own along the wall.
    instant = replace(plain, lasting=None) if lasts else plain
    steps["recalibrated"]["impact"] = sums(instant, predict.predicted_impacts(instant, held))
    floor = squares(after, impact_floor(after, terms, fits, laws))
    if laws:  # what a law of one of the three predicts is none of the others' noise
        model = squares(after, predict.predicted_impacts(after, terms))
        worse = np.minimum(floor, CUT).sum(1) > np.minimum(model, CUT).sum(1)
        floor = np.where(worse[:, None], model, floor)
    steps["noise_floor"]["impact"] = by_run(floor, after)
    for cause in causes:
        if cause.effect in RESTITUTION_EFFECTS:
            rest = [t for t in terms if t != cause.effect]
            by_effect[cause.effect] = sums(after, predict.predicted_impacts(after, rest)) - ahead
        elif cause.effect == "finite_contact_time":
            alike = replace(after, lasting=None)
            by_effect[cause.effect] = sums(after, predict.predicted_impacts(alike, terms)) - ahead
        elif cause.effect == "inertia_error" and ladder.inertia.held_out is not None:
            by_effect[cause.effect] = ladder.inertia.held_out
            steps["recalibrated"]["impact"] = steps["recalibrated"]["impact"] + ladder.inertia.held_out
    others = [by_effect[c.effect] for c in causes if c.effect in by_effect and shows_in(c, "impact")]
    rest = steps["recalibrated"]["impact"] - ahead - np.sum(others or [np.zeros(len(ahead))], 0)
    # Laws by name are taken out of the impacts together.
    by_effect |= {effect: rest / len(as_law) for effect in as_law}


def _walls(
    ladder: Ladder, steps: dict[str, dict[str, Array]], by_effect: dict[str, Array], causes: Sequence[Cause]
) -> None:
    """Distances at which the disk met the wall, the wall learnt on the other runs."""
    impacts = ladder.impacts.fitted
    assert impacts is not None
    named = [c.effect for c in causes if c.effect in WALL_TERMS_OF]
    as_law = [c.effect for c in causes if c.stage == "geometry" and is_law(c.effect)]
    everything = _distances(ladder, impacts, ())
    steps["with_effect"]["geometry"] = everything
    plain = ladder.both_impacts()[0] if as_law else impacts
    steps["recalibrated"]["geometry"] = _distances(ladder, plain, named) if named or as_law else everything
    steps["noise_floor"]["geometry"] = np.bincount(
        impacts.junctions.run[impacts.wall.used], minlength=len(ladder.series.runs)
    ).astype(float)
    for effect in named:
        distances = _distances(ladder, impacts, [effect]) - everything
        by_effect[effect] = by_effect.get(effect, np.zeros(len(everything))) + distances
    for effect in as_law:  # taken together, like those of the impacts
        distances = (_distances(ladder, plain, ()) - everything) / len(as_law)
        by_effect[effect] = by_effect.get(effect, np.zeros(len(everything))) + distances


def _distances(ladder: Ladder, impacts: ImpactFit, without: Sequence[str]) -> Array:
    """Sums (R,) of squared gaps at contact over their variance, held out run by run, the terms of some effects being as
    stated (of flat sides, whose distances are their radius and centre, with these)."""
    names = {t for effect in without for t in WALL_TERMS_OF[effect]}
    wall, stated = impacts.wall.wall, ladder.series.runs[0].data.wall.values()
    held = [t for t in wall.terms if t in names or (t.startswith("side") and {"centre_x", "radius"} & names)]
    # Lobes are stated by nobody.
    start = wall.moved({name: stated.get(name, 0.0) - wall.values()[name] for name in held})
    terms = tuple(t for t in impacts.wall.terms if t not in held)
    finite = ladder.impacts.shape.finite and "finite_contact_time" not in without
    junctions = impacts.junctions
    scatter_m = ladder.both_impacts()[1].wall.scatter_m
    speed = np.maximum(impacts.wall.impacts.of("normal_before"), 0)[:, None]
    n = len(ladder.series.runs)
    out = np.zeros(n)
    for run in range(n):
        here = junctions.run == run
        if not here.any():
            continue
        rest = ~here if n > 1 and np.count_nonzero(~here & impacts.wall.used) >= 8 else np.ones(len(here), bool)
        learnt = fit_wall(junctions.at(rest), start, terms, wall_prior(start), speed[rest] if finite else None)
        seen = measure(junctions.at(here), learnt.wall)
        residual = seen.of("gap")
        if finite:
            residual = residual - speed[here, 0] * learnt.estimate[-1]
        z2 = residual**2 / (seen.sd("gap") ** 2 + scatter_m**2)
        out[run] = np.sum(np.minimum(z2[impacts.wall.used[here]], CUT))
    return out


def _normals(steps: dict[str, dict[str, Array]], by_effect: dict[str, Array], causes: Sequence[Cause]) -> None:
    """A wall's shape turns its normals, which the velocities after impacts feel: what no effect of the impact has taken
    there belongs to the named shapes, as they share the distances."""
    shapes = [c.effect for c in causes if c.effect in SHAPES and c.effect in by_effect]
    total = sum(float(by_effect[effect].sum()) for effect in shapes)
    if not total > 0:
        return
    taken = [by_effect[c.effect] for c in causes if c.effect in by_effect and shows_in(c, "impact")]
    left = steps["recalibrated"]["impact"] - steps["with_effect"]["impact"] - np.sum(taken or [np.zeros(1)], 0)
    for effect in shapes:
        by_effect[effect] = by_effect[effect] + float(by_effect[effect].sum()) / total * left


def _drive(
    ladder: Ladder, steps: dict[str, dict[str, Array]], by_effect: dict[str, Array], causes: Sequence[Cause]
) -> None:
    """The Host's path beside its drive; a swing's share is learnt on the other runs."""
    drive = ladder.drive
    named = [c.effect for c in causes if c.stage == "drive"]
    for name, stages in steps.items():
        stages["drive"] = drive.error.get(name, np.zeros(len(ladder.series.runs)))
    by_effect |= {effect: gain for effect, gain in drive.by_effect.items() if effect in named}


def _measurement(
    ladder: Ladder, steps: dict[str, dict[str, Array]], by_effect: dict[str, Array], causes: Sequence[Cause]
) -> None:
    """Residuals by which measurement effects and the centre marker are known: what each run shows of their sizes, held
    against what the other runs say."""
    for stages in steps.values():
        stages["measurement"] = np.zeros(len(ladder.series.runs))
    for cause in causes:
        if cause.by_run is None:
            continue
        before, after, floor = cause.by_run.squares(cause.gain)
        for name, squares in (("recalibrated", before), ("with_effect", after), ("noise_floor", floor)):
            steps[name]["measurement"] = steps[name]["measurement"] + squares
        by_effect[cause.effect] = before - after
