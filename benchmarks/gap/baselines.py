"""What else may predict the rows in which laws are searched: three baselines, each by itself.

- library: candidates added by squared error of all runs, at the price of a Bayesian information criterion; no run is
  held out and no number inside is searched.
- sparse: all candidates together, small ones thrown out again and again (sequentially thresholded ridge regression, as
  SINDy does; Brunton, Proctor and Kutz 2016).
- Gaussian process: smooth functions of what is known (random Fourier features; Rahimi and Recht 2007), inputs, length
  and size by the likelihood.  It predicts, and names nothing.

All three get the candidates, the rows and the priors that the search of laws gets, and are judged like it: their sizes
are fitted to the other runs, what they choose is chosen with all runs in view.  A library that has chosen many terms of
few blows looks better for that: it is also asked anew without each run that it is judged on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from analysis.gap.laws.choice.listed import Listed
from analysis.gap.laws.regression.forms import kin_of
from analysis.gap.laws.regression.problem import Profile, Regression, held_out_squares, part_of
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.terms import Factor, Term, rows_of
from ovines.pipeline.blind.law_oracle import held_out

MOST_PARTS = 10
SMALL, RIDGE, ROUNDS = (0.05, 0.1, 0.2, 0.4, 0.7), 0.05, 20
FEATURES, LENGTHS, SIZES = 120, (0.5, 1.0, 2.0, 4.0), (0.025, 0.1, 0.4, 1.6)
ACCELERATIONS = np.array([0.5, 0.5, 50.0])  # usual in flights: m/s^2, rad/s^2
MOTION = (W.HX, W.HY, W.VX, W.VY, W.SPIN)
MEMORY = (W.UX, W.UY, W.HOST_AX, W.HOST_AY, W.TIME, W.SINCE, W.LAST_APPROACH, W.LAST_LEFT, W.RUN)
ANGLES = (W.ANGLE, W.PHASE)
AT_BLOWS = (W.HX, W.HY, W.APPROACH, W.SLIP, W.SPIN)
OF_BLOWS = (W.TIME, W.SINCE, W.LAST_APPROACH, W.LAST_SLIP, W.BLOWS, W.RUN, W.HOST_AX, W.HOST_AY)
RIM = ("rim_angle", "rim_turn")  # where the rim is struck, in the disk and from the last place
USUAL = {  # of laws of the impacts and the wall (m)
    "restitution": 0.1, "wall_friction": 0.1, "tangential_restitution": 0.3, "spin_kept": 0.1, "contact_radius": 1e-4
}  # fmt: skip


def library(problem: Regression, listed: Listed) -> list[Term]:
    """Terms chosen by the squared error of all runs of ``problem``."""
    return [term for k in chosen_of(problem, listed) for term in listed.candidates[k].terms]


def chosen_of(problem: Regression, listed: Listed) -> list[int]:
    """Numbers of the candidates that a library takes, in their order."""
    price, asked = np.log(len(problem.residual)) * problem.excess, listed.asked(problem)
    chosen: list[int] = []
    parts: list[int] = []
    for _ in range(MOST_PARTS):
        profile = Profile.of(asked.with_columns(listed.table[:, chosen]))
        turn, score = _beside(profile, listed)
        gains = np.full(len(listed.groups), -np.inf)
        for kin in listed.kin:
            taken = turn.T[kin.at]  # (G, S, P)
            left = kin.information.sum(0) - taken @ taken.mT
            determined = np.diagonal(left, axis1=1, axis2=2).min(1) > 1e-6
            left[~determined] = np.eye(left.shape[1])
            own = score[kin.at]
            gain = np.einsum("gs,gs->g", own, (np.linalg.pinv(left, hermitian=True) @ own[..., None])[..., 0])
            gains[kin.number] = np.where(determined, gain - price * left.shape[1], -np.inf)
        gains[parts] = -np.inf
        best = int(np.argmax(gains))
        if gains[best] <= 0:
            break
        parts.append(best)
        chosen += listed.groups[best]
    return parts


def sparse(problem: Regression, listed: Listed) -> list[Term]:
    """Terms that sequentially thresholded ridge regression keeps, at the threshold whose choice a Bayesian information
    criterion likes best."""
    asked, price = listed.asked(problem), np.log(len(problem.residual)) * problem.excess
    profile = Profile.of(asked)
    turn, score = _beside(profile, listed)
    information = (listed.table.T @ listed.table).astype(float) - turn.T @ turn
    information[np.diag_indices(len(information))] += RIDGE
    every = np.arange(len(score))
    first = np.abs(np.linalg.solve(information, score))
    best = 0.0, np.zeros(0, np.int64)
    for small in SMALL:
        keep, size = every, first
        for _ in range(ROUNDS):
            large = size >= small * size.max()
            if large.all():
                break
            keep = keep[large]
            size = np.abs(np.linalg.solve(information[np.ix_(keep, keep)], score[keep]))
        gain = profile.gain(listed.table[:, keep].astype(float))[0] - price * len(keep)
        if gain > best[0]:
            best = gain, keep
    terms = [term for one in listed.candidates for term in one.terms]
    return [terms[k] for k in best[1]]


def library_by_fold(problem: Regression, listed: Listed) -> float:
    """Mean square of a row on runs held out of the choice, too: the library is asked anew without each."""
    asked = listed.asked(problem)
    total = held_out(problem, problem.nuisances[:, :0]) * len(problem.residual)
    before, folds = held_out_squares(asked, asked.nuisances[:, :0]), asked.folds
    for fold in np.unique(folds):
        own = folds != fold
        part, table = part_of(asked, own), listed.table[own]
        fewer = replace(listed, table=table, kin=kin_of(part, table, listed.groups), asked=lambda one: one)
        chosen = [k for number in chosen_of(part, fewer) for k in listed.groups[number]]
        total += float((held_out_squares(asked, listed.table[:, chosen].astype(float)) - before)[fold])
    return total / len(problem.residual)


def _beside(profile: Profile, listed: Listed) -> tuple[np.ndarray, np.ndarray]:
    """What the profile's basis takes of each column (P, C), and the columns' products with the residual (C,)."""
    count = len(listed.table)
    basis, residual = (one[:count].astype(listed.table.dtype) for one in (profile.basis, profile.residual))
    return (basis.T @ listed.table).astype(float), (listed.table.T @ residual).astype(float)


def gaussian_process(problem: Regression, every: Iterable[np.ndarray]) -> Regression:
    """The regression with the features of a Gaussian process among what is fitted, columns (M, C) of one of ``every``
    set, at the size that is most likely."""
    best: tuple[float, Regression] | None = None
    for columns in every:
        rows = np.column_stack([problem.nuisances, columns])
        products, score = rows.T @ rows, rows.T @ problem.residual
        for size in SIZES:
            prior = np.concatenate([problem.prior, np.full(columns.shape[1], 1 / size**2)])
            # Log evidence of a linear model with Gaussian priors, noise as stated, up to a constant.
            information = products / problem.excess + np.diag(np.maximum(prior, 1e-12))
            fitted = np.linalg.solve(information, score / problem.excess)
            evidence = float(score @ fitted) / problem.excess - np.linalg.slogdet(information)[1]
            evidence -= 2 * columns.shape[1] * np.log(size)
            if best is None or evidence > best[0]:
                tried = Regression(problem.residual, rows, problem.excess * prior, problem.block, problem.run)
                best = evidence, tried
    assert best is not None, "no features"
    return best[1]


def fourier(inputs: np.ndarray, rng: np.random.Generator, alone: bool = False) -> Iterator[np.ndarray]:
    """Random features (N, F) of inputs (N, D), length by length, of all together or each of one ``alone``; inputs that
    never change are left out."""
    scale = inputs.std(0)
    z = (inputs - inputs.mean(0))[:, scale > 0] / scale[scale > 0]
    waves, phases = rng.standard_normal((z.shape[1], FEATURES)), rng.uniform(0, 2 * np.pi, FEATURES)
    if alone:  # a sum of functions of one input each
        waves[np.arange(z.shape[1])[:, None] != np.arange(FEATURES) % z.shape[1]] = 0.0
    for length in LENGTHS:
        yield np.sqrt(2 / FEATURES) * np.cos(z @ waves / length + phases)


def flight_features(regression, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Columns (M, C) of acceleration and torque as smooth functions of the motion, and of it and what went before."""
    known = np.vstack([one.know for one in regression.flights])
    ends = np.cumsum([len(one.know) for one in regression.flights])[:-1]
    known[:, W.SINCE] = np.minimum(known[:, W.SINCE], 3 * np.median(known[:, W.SINCE]))
    motion = known[:, MOTION]
    whole = np.column_stack([motion, known[:, MEMORY], np.cos(known[:, ANGLES]), np.sin(known[:, ANGLES])])
    for inputs, alone in ((motion, False), (whole, False), (whole, True)):
        for feature in fourier(inputs, rng, alone):
            given = np.zeros((len(feature), 3, 3 * FEATURES))
            for way in range(3):
                given[:, way, way * FEATURES : (way + 1) * FEATURES] = ACCELERATIONS[way] * feature
            yield regression.pushed_columns(np.split(given, ends))


def blow_features(regression, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Columns (M, C) of the numbers of the contact law, or of the wall's radius, as smooth functions of the blow, and
    of it and what went before."""
    known = regression.known.copy()
    known[:, W.SINCE] = np.minimum(known[:, W.SINCE], 3 * np.median(known[:, W.SINCE]))
    rim = np.empty((len(known), 2 * len(RIM)))
    shapes = [Factor(name, way) for name in RIM for way in ("cosine", "sine")]
    sizes(rows_of([Term("restitution", 1.0, (one,)) for one in shapes]), regression.known, rim)
    blow, parts = known[:, AT_BLOWS], len(regression.problem.residual) // len(known)
    whole = np.column_stack([blow, known[:, OF_BLOWS], rim])
    for inputs, alone in ((blow, False), (whole, False), (whole, True)):
        for feature in fourier(inputs, rng, alone):
            targets = [name for name in USUAL if name in regression.answers]
            tall = np.tile(feature, (parts, 1))
            yield np.hstack([USUAL[name] * regression.answers[name][:, None] * tall for name in targets])


def squares_of(regression, listed: Listed, features: Iterable[np.ndarray]) -> dict[str, float]:
    """Mean square of a row on runs held out, by method."""
    problem = regression.problem
    out = {}
    for name, choose in (("library", library), ("sparse", sparse)):
        out[name] = held_out(problem, columns_of_terms(regression, choose(problem, listed)))
    out["library, chosen without the run"] = library_by_fold(problem, listed)
    predicted = gaussian_process(problem, features)
    out["Gaussian process"] = held_out(predicted, predicted.nuisances[:, :0])
    return out


def columns_of_terms(regression, terms: Sequence[Term]) -> np.ndarray:
    """Columns (M, T), also of no term."""
    return regression.columns(terms) if terms else np.zeros((len(regression.problem.residual), 0))
