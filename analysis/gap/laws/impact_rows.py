"""Impacts as a regression: restitution, tangential impulse, spin and contact distance, each over its own error.

Rows come in four parts, one per impact each, and a term has entries in the part of what it acts on.  How far each part
answers its target follows from the contact law: restitution moves the normal speed after the impact, wall friction the
impulse of impacts that slide, tangential restitution of those that stick."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import along_normals, known_at_impacts
from analysis.contact.law import LawData, fit_restitution, stick_impulse, sticks
from analysis.contact.restitution import restitution_design
from analysis.contact.wall_fit import DISTANCE_FLOOR_M
from analysis.flights.fit import FlightFits
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.statistics.robust import least_squares
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.terms import Term, WrittenLaw, rows_of
from ovines.robust import MEDIAN_TO_SD, residual_sd

Array = NDArray[np.float64]
# Gross errors count as so many sds; and so many rows of one kind say by themselves what is usual among them.
GROSS_SD, FEWEST_OF_A_KIND = 5.0, 8
# Rounds in which what is gross beside a law settles, and what sticks.
SETTLED = 3
# Where none is to count for many, rows count as no more than so many usual ones.
EVEN_SD = 1.5
# Model error of an impulse beside its own (share of it): rounding of sharp series, not physics.
LEAST_SHARE = 0.01
# What says where along the wall a contact is.
ALONG_WALL = ("azimuth", "turning_azimuth", "contact_turn", "swing", "ovalling", "blows_here")
TANGENTIAL = ("wall_friction", "tangential_restitution")
#: what rows answer beside targets: an impulse along the wall per mass (m/s), what the spin does beyond it
IMPULSE, TURN = "impulse along the wall", "turn beside the impulse"


@dataclass(frozen=True, eq=False)
class ImpactRegression:
    """The impacts of a series: the ``problem`` without a law, what laws ``known`` (K, KNOWN_SIZE) at each of them, and
    how the rows of all parts answer a unit of each target (``answers``: target -> (M,)), of :data:`IMPULSE` and
    :data:`TURN`.

    ``on_cylinder`` (K,): those at a cylinder in the middle, which has no part in the wall's shape.  ``along`` (2, K):
    wall friction and tangential restitution by which each of them sticks or slides."""

    problem: Regression
    known: Array
    answers: dict[str, Array]
    on_cylinder: NDArray[np.bool_] | None = None
    along: Array | None = None

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        size = np.empty((len(self.known), len(terms)))
        sizes(rows_of(terms), self.known, size)
        if self.on_cylinder is not None:
            size[np.outer(self.on_cylinder, [of_wall_shape(term) for term in terms])] = 0.0
        out = np.zeros((len(self.problem.residual), len(terms)))
        for j, term in enumerate(terms):
            if term.target in self.answers:
                out[:, j] = self.answers[term.target] * np.tile(size[:, j], len(out) // len(size))
        return out

    def impulse_column(self, along_m_per_s: Array, turned_m_per_s: Array | float = 0.0) -> Array:
        """Rows (M,) that impulses along the wall (K,) add, and what spins do beyond them."""
        once = np.ones(len(self.known))
        moved = ((IMPULSE, along_m_per_s), (TURN, turned_m_per_s))
        return np.asarray(sum(self.answers[name] * np.tile(once * size, 3) for name, size in moved), float)

    def law_columns(self, law: WrittenLaw) -> Array:
        """What a law adds to the rows (M,), nothing where it has no number."""
        return np.asarray(np.nan_to_num(self.columns(law.terms)).sum(1), float)

    def misfit_along(self, law: WrittenLaw) -> float:
        """-2 log L of the impulses along the wall beside a law, its sds and weights from what a spin that is added
        would change; less a constant."""
        rows, count = self.problem, len(self.known)
        left = rows.residual - self.law_columns(law)
        left = left - rows.nuisances @ np.linalg.lstsq(rows.nuisances, left, rcond=None)[0]
        return float(np.sum(left[count:] ** 2) - 2 * np.sum(np.log(self.answers["spin_added"][count : 2 * count])))

    def weighed(self, weight: Array) -> ImpactRegression:
        """The same with rows that count by ``weight`` (M,)."""
        rows = self.problem
        problem = replace(rows, residual=weight * rows.residual, nuisances=weight[:, None] * rows.nuisances)
        return replace(self, problem=problem, answers={k: weight * answer for k, answer in self.answers.items()})

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (K, B) that ``cut`` gives what is known."""
        weight = cut(self.known)
        return self.columns([term]) * np.tile(weight, (len(self.problem.residual) // len(weight), 1))


def weighed_evenly(rows: ImpactRegression) -> ImpactRegression:
    """The same with rows that leave much weighed down, so that none counts for more than :data:`EVEN_SD` usual ones of
    all that leave something."""
    problem = rows.problem
    left = problem.residual - problem.nuisances @ problem.fitted(problem.nuisances, problem.prior)
    size = np.abs(left)
    usual = MEDIAN_TO_SD * float(np.median(size[size > 0])) if np.any(size > 0) else 0.0
    if not usual > 0:
        return rows
    weight = np.minimum(1.0, EVEN_SD * usual / np.maximum(size, 1e-300))
    return rows.weighed(weight)


def of_wall_shape(term: Term) -> bool:
    """Whether a term says where along the wall its radius is another."""
    return term.target == "contact_radius" and any(one.quantity in ALONG_WALL for one in term.factors)


def law_regression(
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    restitution_terms: Sequence[str],
    law: WrittenLaw | None = None,
    scatter: float | None = None,
    sides_of_law: bool = False,
) -> ImpactRegression:
    """Normal, tangential and angular residuals of the law, restitution's terms, wall friction and beta_0 as nuisances.

    ``law``: one that is known to act, whose part of restitution's scatter is none; or that ``scatter`` itself.
    ``sides_of_law``: whether impacts stick or slide as the law has it, not as the nominal one does."""
    data = impacts.data
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    if scatter is None:
        scatter = usual_scatter(along_blows(data, law, known), restitution_terms, of_target("restitution", law, known))
    normal = _normal(data, restitution_terms, scatter)
    nominal = np.tile([[impacts.law.wall_friction], [impacts.law.tangential_restitution]], len(data))
    rows, kind = _rows(impacts, known, normal, nominal, sticks(data, *nominal))
    weight = _weights(rows.problem.residual, kind)
    if law is not None:
        added = np.zeros((len(TANGENTIAL), len(data)))
        of_law = [of_target(target, law, known) for target in TANGENTIAL]
        for i, one in enumerate(of_law):
            added[i] = 0.0 if one is None else np.nan_to_num(one)
        # What a law explains of a few impacts is no gross error, wherever its mean lies; and what it makes of friction
        # and beta_0 says which impacts stick.
        for _ in range(SETTLED):
            beside, nuisances = rows.problem.residual - rows.law_columns(law), rows.problem.nuisances
            means = np.linalg.lstsq(weight[:, None] * nuisances, weight * beside, rcond=None)[0]
            if sides_of_law:
                along = nominal + means[-2:, None] + added
                rows, kind = _rows(impacts, known, normal, along, sticks(data, *along))
                beside = rows.problem.residual - rows.law_columns(law)
            weight = _weights(beside - rows.problem.nuisances @ means, kind)
    return rows.weighed(weight)


def _rows(
    impacts: ImpactFit, known: Array, normal: tuple[Array, Array], along: Array, stick: NDArray[np.bool_]
) -> tuple[ImpactRegression, NDArray[np.int64]]:
    """Rows of all parts, beside the ``normal`` ones with their design, and the kind (3 K,) of each; ``along`` (2, K):
    wall friction and beta_0 at each impact, which ``stick`` or slide."""
    data, count = impacts.data, len(impacts.data)
    left, design = normal
    tangential, tangential_sd, slides, stuck = _tangential(data, impacts, along, stick)
    angular_sd = np.hypot(data.angular_sd, LEAST_SHARE * np.abs(data.tangential_impulse))
    residual = np.concatenate([left, tangential / tangential_sd, data.angular / angular_sd])
    nuisances = np.zeros((3 * count, design.shape[1] + 2))
    nuisances[:count, : design.shape[1]] = design
    none = np.zeros(count)
    # Of the spin that the impulse has left a share is lost; the impulse is measured by the contact point's speed, in
    # which that spin is, too.
    q = data.inertia_factor
    spun = impacts.junctions.radius_m * data.at.spin + data.tangential_impulse / q
    lost, turned = spun * q / (1 + q), np.full(count, impacts.junctions.radius_m * q / (1 + q))
    # A blow along a turned normal takes of the centre's speed along the wall, and moves it along the wall without a
    # torque; its slip is another.
    impulse, passing = data.normal_impulse, known[:, W.PASSING]
    met = (impulse / data.before * passing + data.tangential_impulse) * design[:, 0] / data.before
    pushed, slipped = impulse / data.mobility, np.where(stuck != 0.0, (1 + along[1]) * data.before / data.mobility, 0.0)
    answers = {
        "restitution": np.concatenate([design[:, 0], none, none]),
        "wall_friction": np.concatenate([none, slides / tangential_sd, none]),
        "tangential_restitution": np.concatenate([none, stuck / tangential_sd, none]),
        "spin_kept": np.concatenate([none, lost / tangential_sd, lost * q / angular_sd]),
        "spin_added": np.concatenate([none, turned / tangential_sd, turned * q / angular_sd]),
        "contact_normal": np.concatenate([met, (slipped - pushed) / tangential_sd, pushed / angular_sd]),
        IMPULSE: np.concatenate([none, 1.0 / tangential_sd, none]),
        TURN: np.concatenate([none, none, 1.0 / angular_sd]),
    }
    nuisances[:, -2], nuisances[:, -1] = answers["wall_friction"], answers["tangential_restitution"]
    residual, nuisances = np.nan_to_num(residual), np.nan_to_num(nuisances)
    kind = np.repeat([0, 1, 3], count)
    kind[count : 2 * count] += slides == 0.0
    problem = Regression(
        residual, nuisances, np.zeros(nuisances.shape[1]), np.tile(np.arange(count), 3),
        np.tile(data.at.run, 3).astype(np.int64),
    )  # fmt: skip
    return ImpactRegression(problem, known, answers, along=along), kind


def distance_regression(
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    law: WrittenLaw | None = None,
    scatter_m: float | None = None,
) -> ImpactRegression:
    """Contact distances; what the fitted wall and the disk's own centre are free in are nuisances.

    ``law``: one that is known to act, whose part of the distances' scatter is none; ``scatter_m``: that scatter, where
    it is known from elsewhere."""
    wall, at = impacts.wall, impacts.data.at.index
    residual_m, noise_m = wall.residual_m[at], wall.impacts.sd("gap")[at]
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    shapes = wall.impacts.design(wall.terms)[at]
    shapes /= np.maximum(np.sqrt(np.mean(shapes**2, 0)), 1e-300)
    on_cylinder = wall.wall.on_cylinder(wall.impacts.surface[at])
    held = of_target("contact_radius", law, known, on_cylinder)
    explained_m = np.zeros(len(at))
    if held is not None:
        every = np.column_stack([shapes, held])
        explained_m = every @ least_squares(every, residual_m, noise_m).coefficients
    left_m = residual_m - explained_m
    sd = np.hypot(noise_m, _distance_scatter(left_m, noise_m) if scatter_m is None else scatter_m)
    # Gross is what a law that is known to act leaves, not what it explains: that is cut then.
    if held is None:
        weight = np.minimum(1.0, GROSS_SD / np.maximum(np.abs(residual_m / sd), 1e-300))
        residual = weight * residual_m / sd
    else:
        weight = np.ones(len(at))
        residual = explained_m / sd + np.clip(left_m / sd, -GROSS_SD, GROSS_SD)
    nuisances = shapes * (weight / sd)[:, None]
    problem = Regression(
        residual, nuisances, np.zeros(nuisances.shape[1]), np.arange(len(at)), impacts.data.at.run.astype(np.int64)
    )
    return ImpactRegression(problem, known, {"contact_radius": weight / sd}, on_cylinder)


def usual_distance_scatter(impacts: ImpactFit) -> float:
    """How far contact distances scatter from impact to impact (m) about the wall that was fitted, beyond the cameras'
    noise."""
    at = impacts.data.at.index
    return _distance_scatter(impacts.wall.residual_m[at], impacts.wall.impacts.sd("gap")[at])


def _distance_scatter(left_m: Array, noise_m: Array) -> float:
    return float(np.sqrt(max(residual_sd(left_m) ** 2 - float(np.median(noise_m)) ** 2, DISTANCE_FLOOR_M**2)))


def of_target(
    target: str, law: WrittenLaw | None, known: Array, on_cylinder: NDArray[np.bool_] | None = None
) -> Array | None:
    """What a law adds to a target, (K,); a wall's shape nothing to what is met ``on_cylinder``."""
    terms = [] if law is None else [term for term in law.terms if term.target == target]
    if not terms:
        return None
    out = np.empty((len(known), len(terms)))
    sizes(rows_of(terms), known, out)
    if on_cylinder is not None:
        out[np.outer(on_cylinder, [of_wall_shape(term) for term in terms])] = 0.0
    return np.asarray(out.sum(1), float)


def along_blows(data: LawData, law: WrittenLaw | None, known: Array) -> LawData:
    """``data`` as seen along the normals that a ``law`` turns the blows to."""
    turn_rad = of_target("contact_normal", law, known)
    return data if turn_rad is None else along_normals(data, known[:, W.PASSING], np.nan_to_num(turn_rad))


def usual_scatter(data: LawData, restitution_terms: Sequence[str], law: Array | None) -> float:
    """How far restitution scatters from impact to impact about its terms and what a ``law`` (K,) adds to it."""
    design = restitution_design(data, restitution_terms)
    return float(fit_restitution(data, design if law is None else np.column_stack([design, law]))[2])


def _normal(data: LawData, restitution_terms: Sequence[str], scatter: float) -> tuple[Array, Array]:
    design = restitution_design(data, restitution_terms)
    coefficients = fit_restitution(data, design)[0]
    sd = np.hypot(data.normal_sd, scatter * data.before)
    return (data.after - design @ coefficients * data.before) / sd, design * (data.before / sd)[:, None]


def _tangential(
    data: LawData, impacts: ImpactFit, along: Array, stick: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array]:
    """Residual of the nominal law's impulse, its sd, and its change with wall friction and beta_0, for impacts that
    ``stick`` or slide where these are ``along`` (2, K)."""
    law, (friction, beta) = impacts.law, along
    wanted = stick_impulse(data, beta)
    predicted = np.where(stick, wanted, np.sign(wanted) * friction * data.normal_impulse)
    missed = data.tangential_impulse - predicted
    scatter = law.tangential_scatter if np.isfinite(law.tangential_scatter) else 0.0
    share = np.full(len(data), scatter)
    for kind in (stick, ~stick):
        if np.count_nonzero(kind) >= FEWEST_OF_A_KIND:
            share[kind] = min(scatter, _usual_share(missed, data, kind))
    sd = np.hypot(np.hypot(data.tangential_sd, share * data.normal_impulse), LEAST_SHARE * np.abs(predicted))
    slides = np.where(stick, 0.0, np.sign(wanted) * data.normal_impulse)
    stuck = np.where(stick, -data.slip / data.mobility, 0.0)
    off = slides * (friction - law.wall_friction) + stuck * (beta - law.tangential_restitution)
    return missed + off, sd, slides, stuck


def _usual_share(missed: Array, data: LawData, kind: NDArray[np.bool_]) -> float:
    """How much impacts of a ``kind`` (K,) usually miss beyond their noise, as a share of the normal impulse: what a law
    does in a few of them is no scatter of all."""
    usual, noise = (
        float(np.median(np.abs(one[kind]) / data.normal_impulse[kind])) for one in (missed, data.tangential_sd)
    )
    return float(np.sqrt(max((MEDIAN_TO_SD * usual) ** 2 - noise**2, 0.0)))


def _weights(left: Array, kind: NDArray[np.int64]) -> Array:
    """Weights (M,) by which rows count no more than :data:`GROSS_SD` times what is usual among those of their ``kind``,
    an index (M,).  Whole rows: a residual that is cut alone makes the coefficients of what explains it too small.

    Gross against what impacts of a kind usually leave, not against noise alone: a missing law is no gross error, nor is
    one of the wall's friction where few impacts slide."""
    usual = [np.abs(left[kind == k]) for k in range(4)]
    together = [usual[0], *[np.concatenate(usual[1:3])] * 2, usual[3]]
    usual = [one if len(one) >= FEWEST_OF_A_KIND else all_ for one, all_ in zip(usual, together, strict=True)]
    limits = [GROSS_SD * max(1.0, MEDIAN_TO_SD * float(np.median(one))) if len(one) else GROSS_SD for one in usual]
    return np.asarray(np.minimum(1.0, np.array(limits)[kind] / np.maximum(np.abs(left), 1e-300)), float)
