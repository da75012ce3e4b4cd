"""Luding's law from measured impacts: restitution with its scatter, wall friction, tangential restitution.

Three residuals per impact.  Normal: ``v_n' - eps v_n``.  Tangential, with the *measured* normal impulse: the tangential
impulse per mass against ``min((1 + beta_0) |v_t| / (1 + 1/q), mu_c j_n)``.  Angular: ``q R d(omega) - j_t``, free of
all parameters. (Thesis eqs 88-107, of a heavy Host, M_H >> M_N; one that gives adds its own mobility to 1 + 1/q.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import QUANTITIES, Impacts
from analysis.contact.tangential.lasting import LastingContact, fit_lasting
from analysis.contact.tangential.search import Impulses, likeliest
from analysis.statistics.outliers import belongs
from analysis.statistics.robust import symmetric_inverse

Array = NDArray[np.float64]
_AT = {name: i for i, name in enumerate(QUANTITIES)}
# Velocity errors that the flights' covariance does not hold (neighbouring lens residual, wall normal), where the
# impacts are too few to show them: m/s.  Blind series showed 0 to 5e-4.
SPEED_FLOOR_M_PER_S = 2e-4
FEWEST_FOR_SPEED_FLOOR = 10
# Outliers, impacts that are none of the law's: how many, how far off in restitution or impulse ratio, and of how many
# it can be estimated.
OUTLIER_SHARE, OUTLIER_SPREAD, FEWEST_FOR_OUTLIERS = 0.01, 0.25, 5
# A scatter below this is none: 1e-5 of 3 m/s is a tenth of the best sd of a speed.
LEAST_SCATTER = 1e-5
# Wall friction and tangential restitution that no impact has shown: sd of what they may be; a slip below this tells no
# tangential restitution.
OPEN_FRICTION, OPEN_TANGENTIAL, LEAST_SLIP_M_PER_S = 0.1, 0.3, 1e-3
# Scatter that the fit of the restitution starts from, and where it ends (share of the variance, fall of -2 log L).
START_SCATTER, RESTS_SHARE, RESTS_GAIN = 0.02, 1e-4, 1e-4
# Starts of the tangential law, over steel on plastic and from smooth to rough; scatter there, and the simplex' steps in
# friction, its further coefficients, tangential restitution and the logarithm of the scatter.
FRICTIONS, TANGENTIAL_RESTITUTIONS, TANGENTIAL_SCATTER = (0.08, 0.15, 0.25), (0.2, 0.5, 0.8), 5e-3
STEP_FRICTION, STEP_COEFFICIENT, STEP_TANGENTIAL, STEP_LOG_SCATTER = 0.03, 0.02, 0.15, 1.0


@dataclass(frozen=True, eq=False)
class Circumstances:
    """What K impacts may go with: the spin before them (rad/s), their run, time (s) and azimuth, the Host's angle, the
    drive's phase then and at the run's start (rad), and which of the measured impacts they are."""

    spin: Array
    run: NDArray[np.int64]
    time_s: Array
    azimuth_rad: Array
    host_angle_rad: Array
    drive_rad: Array
    drive_start_rad: Array
    index: NDArray[np.int64]

    def part(self, chosen: NDArray[np.bool_]) -> Circumstances:
        """Of some of the impacts (K,)."""
        return Circumstances(**{name: values[chosen] for name, values in vars(self).items()})


@dataclass(frozen=True, eq=False)
class LawData:
    """The K usable impacts of a series: approach and leaving speeds, impulses per mass (m/s), sds, and what they may go
    with (``at``).

    ``normal_impulse`` = (v_n + v_n') / (1 + ``host_share``) (>= 0); ``tangential_impulse`` of the centre, sign of -v_t
    for a stick or slide; ``angular`` q R d(omega) - tangential_impulse; ``*_sd`` from the flights' covariance.
    ``outliers``: share of the impacts that need not follow the restitution, at most (of a handful none need, see
    :func:`outlier_share`).  ``levers`` (K, 2): of a body that is no disk, the contact point from the centre of mass
    along the outward normal and the tangent, over the radius of gyration.

    Speeds count against the Host as it moves before and after, impulses are the disk's: ``host_share`` is the disk's
    mass over the Host's, ``host_levers`` (K, 2) the contact point from the Host's centre, over the Host's radius of
    gyration for the disk's mass.
    """

    before: Array
    after: Array
    slip: Array
    normal_impulse: Array
    tangential_impulse: Array
    angular: Array
    normal_sd: Array
    tangential_sd: Array
    angular_sd: Array
    at: Circumstances
    inertia_factor: float
    outliers: float = OUTLIER_SHARE
    levers: Array | None = None
    host_share: float = 0.0
    host_levers: Array | None = None

    def __len__(self) -> int:
        return len(self.before)

    def part(self, chosen: NDArray[np.bool_]) -> LawData:
        """Some of the impacts (K,)."""
        own: dict[str, Any] = {
            name: values[chosen] for name, values in vars(self).items() if isinstance(values, np.ndarray)
        }
        return replace(self, at=self.at.part(chosen), **own)

    def from_starts(self, start_s: Array) -> LawData:
        """With times that count from the starts (R,) of their runs, as laws count them."""
        return replace(self, at=replace(self.at, time_s=self.at.time_s - start_s[self.at.run]))

    @property
    def by_laws(self) -> Array:
        """Normal impulse (K,) by written laws that ``after`` is without: those of a restitution that the runs hold."""
        return np.asarray(self.normal_impulse - (self.before + self.after) / (1 + self.host_share), float)

    def impulse_with(self, after: Array) -> Array:
        """Normal impulse (K,) where the disk leaves with other speeds ``after`` (K,)."""
        return np.asarray(self.by_laws + (self.before + after) / (1 + self.host_share), float)

    @property
    def mobility(self) -> Array:
        """Tangential speed of the contact point that a tangential impulse per mass gives (K,): 1 + 1/q of a disk, and
        what the Host gives."""
        own = np.full(len(self), 1 / self.inertia_factor) if self.levers is None else self.levers[:, 0] ** 2
        host = 0.0 if self.host_levers is None else self.host_levers[:, 0] ** 2
        return np.asarray(1 + self.host_share + own + host, float)

    @property
    def host_mobility(self) -> float:
        """The part of :attr:`mobility` that the Host gives, usually."""
        turns = 0.0 if self.host_levers is None else float(np.mean(self.host_levers[:, 0] ** 2))
        return self.host_share + turns

    @property
    def coupling(self) -> Array:
        """Tangential speed that a normal impulse per mass gives (K,): none to a disk, hit straight below its centre."""
        levers = [one for one in (self.levers, self.host_levers) if one is not None]
        return np.asarray(sum((np.prod(one, 1) for one in levers), np.zeros(len(self))), float)


@dataclass(frozen=True, eq=False)
class Law:
    """Fitted law: values, the log-likelihood pieces, and residuals (K,) of the three statements."""

    restitution: float
    scatter: float
    wall_friction: float
    tangential_restitution: float
    normal_misfit: float
    tangential_misfit: float
    tangential_scatter: float


def law_data(
    impacts: Impacts,
    used: NDArray[np.bool_],
    radius_m: float,
    inertia_factor: float,
    speed_floor_m_per_s: float = SPEED_FLOOR_M_PER_S,
) -> LawData:
    """The contact law's view of measured impacts (``used`` selects them); ``speed_floor_m_per_s`` is added to
    every sd.
    """
    at = np.flatnonzero(used)
    v, c = impacts.value[at], impacts.covariance[at]
    gyration_m = float(np.sqrt(inertia_factor)) * radius_m
    levers = impacts.levers_m(radius_m)[at] / gyration_m
    # The contact point's changes of speed are impulses times the inverse mass [[1 + t^2, -n t], [-n t, 1 + n^2]] with
    # the levers n and t, and the same of the Host: rows (K, 8) of the linear maps from the eight quantities to the
    # impulses; variances follow.
    n, t = levers.T
    gives = impacts.junctions.gives
    host_levers = np.sqrt(gives.turn_per_m2) * impacts.host_levers_m(radius_m)[at]
    there, beside = host_levers.T
    straight, aside, both = (
        1 + gives.share + t**2 + beside**2,
        1 + gives.share + n**2 + there**2,
        n * t + there * beside,
    )
    whole = straight * aside - both**2
    along, across, cross = straight / whole, aside / whole, both / whole
    normal = _rows(len(at), {"normal_before": across, "normal_after": across,
                             "tangential_after": -cross, "tangential_before": cross})  # fmt: skip
    tangential = _rows(len(at), {"normal_before": -cross, "normal_after": -cross,
                                 "tangential_after": along, "tangential_before": -along})  # fmt: skip
    arm = np.hypot(n, t)
    turn = gyration_m / arm
    angular = _rows(len(at), {"spin_after": turn, "spin_before": -turn})
    angular -= (n / arm)[:, None] * tangential + (t / arm)[:, None] * normal

    def sd(rows: Array) -> Array:
        return np.sqrt(np.einsum("ki,kij,kj->k", rows, c, rows) + speed_floor_m_per_s**2)

    met = impacts.junctions
    return LawData(
        before=v[:, 0],
        after=v[:, 1],
        slip=v[:, 2],
        normal_impulse=np.sum(v * normal, 1),
        tangential_impulse=np.sum(v * tangential, 1),
        angular=np.sum(v * angular, 1),
        normal_sd=np.sqrt(c[:, 1, 1] + 0.5 * c[:, 0, 0] + speed_floor_m_per_s**2),
        tangential_sd=sd(tangential),
        angular_sd=sd(angular),
        at=Circumstances(
            spin=v[:, 4],
            run=met.run[at],
            time_s=v[:, 7],
            azimuth_rad=impacts.azimuth_rad[at],
            host_angle_rad=met.host[at, 3],
            drive_rad=met.drive_rad[at],
            drive_start_rad=met.drive_start_rad[at],
            index=at,
        ),
        inertia_factor=inertia_factor,
        levers=levers,
        host_share=gives.share,
        host_levers=host_levers if gives.turn_per_m2 else None,
    )


def joined(parts: Sequence[LawData]) -> LawData:
    """The impacts of all ``parts``, of one body."""
    circumstances = Circumstances(**_one_after_another([part.at for part in parts]))
    return replace(parts[0], at=circumstances, **_one_after_another(parts))


def _one_after_another(records: Sequence[LawData | Circumstances]) -> dict[str, Any]:
    arrays = [name for name, values in vars(records[0]).items() if isinstance(values, np.ndarray)]
    return {name: np.concatenate([getattr(one, name) for one in records]) for name in arrays}


def _rows(count: int, entries: dict[str, Array]) -> Array:
    rows = np.zeros((count, len(QUANTITIES)))
    for name, values in entries.items():
        rows[:, _AT[name]] = values
    return rows


def follows(data: LawData, restitution: Array | float, scatter: float, limit_sd: float) -> NDArray[np.bool_]:
    """Which impacts' normal speeds are within ``limit_sd`` of a ``restitution`` (K,), its scatter included."""
    spread = np.sqrt(data.normal_sd**2 + (scatter * data.before) ** 2)
    return np.asarray(np.abs(data.after - restitution * data.before) < limit_sd * spread, bool)


def predicted_tangential(data: LawData, wall_friction: Array | float, tangential_restitution: Array | float) -> Array:
    """Tangential impulse per mass (K,) of Luding's law with the measured normal impulse."""
    slide = wall_friction * data.normal_impulse
    stick = stick_impulse(data, tangential_restitution)
    return np.asarray(np.sign(stick) * np.minimum(np.abs(stick), slide), float)


def stick_impulse(data: LawData, tangential_restitution: Array | float) -> Array:
    """Tangential impulse per mass (K,) after which the contact point leaves with -beta_0 times its slip speed."""
    wanted = (1 + tangential_restitution) * data.slip + data.coupling * data.normal_impulse
    return np.asarray(-wanted / data.mobility, float)


def sticks(data: LawData, wall_friction: Array | float, tangential_restitution: Array | float) -> NDArray[np.bool_]:
    """Which impacts stick (inform tangential restitution); the others slide (inform wall friction)."""
    return np.asarray(np.abs(stick_impulse(data, tangential_restitution)) <= wall_friction * data.normal_impulse, bool)


def fit_restitution(
    data: LawData, design: Array | None = None, prior: float = 0.0
) -> tuple[Array, Array, float, float]:
    """Restitution as a linear function of ``design`` (K, P; a column of ones by default), its scatter by maximum
    likelihood.

    ``v_n' = (design . c) v_n`` with variance ``normal_sd^2 + (scatter v_n)^2``; one impact in a hundred may be none of
    it (``data.outliers``: a wrong track, a hidden second impact), which bounds what a gross error can do.  Returns
    coefficients, covariance, scatter and -2 log L.
    """
    c, covariance, scatter, value, _ = _fit_restitution(data, design, prior)
    return c, covariance, scatter, value


def outlier_count(data: LawData, design: Array) -> float:
    """Number of impacts that the restitution ``design . c`` leaves out as outliers, as a sum of probabilities."""
    return float(np.sum(1 - _fit_restitution(data, design, 0.0)[4]))


def _fit_restitution(data: LawData, design: Array | None, prior: float) -> tuple[Array, Array, float, float, Array]:
    """As :func:`fit_restitution`, and the probability (K,) that each impact follows it."""
    x = np.ones((len(data), 1)) if design is None else design
    a, b2 = x * data.before[:, None], data.before**2
    share, broad = min(data.outliers, outlier_share(len(data))), OUTLIER_SPREAD**2 * b2
    square, own = START_SCATTER**2, np.ones(len(data))
    value = np.inf
    for _ in range(60):
        variance = data.normal_sd**2 + square * b2
        w = own / variance + (1 - own) / (variance + broad)
        covariance = symmetric_inverse((a * w[:, None]).T @ a + prior * np.eye(x.shape[1]))
        c = covariance @ ((a * w[:, None]).T @ data.after)
        r2 = (data.after - a @ c) ** 2
        own, density = belongs(r2, variance, broad, share)
        last, value = value, float(-2 * np.sum(density))
        # Fisher scoring of the variance component, an order of magnitude down at most.
        size = b2 / variance
        new = square + float(np.sum(own * size * (r2 / variance - 1)) / np.sum(own * size**2))
        new = max(new, 0.1 * square, LEAST_SCATTER**2)
        if abs(new - square) < RESTS_SHARE * square and abs(last - value) < RESTS_GAIN:
            break
        square = new
    return c, covariance, float(np.sqrt(square)), value, own


def outlier_share(count: int) -> float:
    """Share of impacts that need not follow the law; none of a handful, where any one could be called an outlier."""
    return OUTLIER_SHARE if count >= FEWEST_FOR_OUTLIERS else 0.0


# So many impacts or fewer: more starts of the tangential law are followed to their end.
FEW_IMPACTS, MORE_STARTS = 30, 12


def _starts_of_impacts(data: LawData) -> list[tuple[float, float]]:
    """Wall friction and beta_0 as each pair of impacts has them: one slides with the one, the other sticks with the
    other."""
    size = np.abs(data.tangential_impulse)
    friction = size / np.maximum(data.normal_impulse, LEAST_SLIP_M_PER_S)
    tangential = size * data.mobility / np.maximum(np.abs(data.slip), LEAST_SLIP_M_PER_S) - 1
    known = np.abs(data.slip) > LEAST_SLIP_M_PER_S
    return [
        (float(mu), float(np.clip(beta, -1.0, 1.0)))
        for i, mu in enumerate(friction)
        for j, beta in enumerate(tangential)
        if i != j and known[j]
    ]


def impulses_of(data: LawData, friction_design: Array | None = None) -> Impulses:
    """What the impacts say along the wall; wall friction is linear in ``friction_design`` (K, P), a column of ones by
    default."""
    x = np.ones((len(data), 1)) if friction_design is None else np.ascontiguousarray(friction_design)
    return Impulses(
        np.ascontiguousarray(data.slip),
        np.ascontiguousarray(data.normal_impulse),
        np.ascontiguousarray(data.tangential_impulse),
        data.mobility,
        data.coupling,
        data.tangential_sd**2,
        (OUTLIER_SPREAD * data.normal_impulse) ** 2,
        outlier_share(len(data)),
        x,
    )


def fit_tangential(
    data: LawData,
    friction_design: Array | None = None,
    start: tuple[float, float] | None = None,
) -> tuple[Array, float, float, float]:
    """Wall friction (linear in ``friction_design``) and tangential restitution by robust likelihood from several
    starts.

    ``min(beta_0, beta_1)`` has local minima, so a grid of starts is tried: the likeliest three are followed; more, and
    what each impact says, where impacts are so few that one more that slides is another answer.  Returns (friction
    coefficients, beta_0, scatter (relative to the normal impulse), -2 log L)."""
    impulses = impulses_of(data, friction_design)
    p = impulses.design.shape[1]
    pairs = [start] if start else [(mu, beta) for mu in FRICTIONS for beta in TANGENTIAL_RESTITUTIONS]
    few = start is None and len(data) <= FEW_IMPACTS
    if few:
        pairs += _starts_of_impacts(data)
    starts = np.zeros((len(pairs), p + 2))
    starts[:, [0, p]], starts[:, p + 1] = sorted(pairs), np.log(TANGENTIAL_SCATTER)
    steps = np.concatenate([[STEP_FRICTION], np.full(p - 1, STEP_COEFFICIENT), [STEP_TANGENTIAL, STEP_LOG_SCATTER]])
    best = np.empty(p + 2)
    least = likeliest(starts, steps, MORE_STARTS if few else 3, impulses, best)
    return best[:p], float(best[p]), float(np.exp(best[p + 1])), float(least)


def fit_law(data: LawData) -> Law:
    """The nominal law: one restitution with scatter, wall friction, tangential restitution."""
    (restitution,), _, scatter, normal = fit_restitution(data)
    (friction,), beta, tangential_scatter, tangential = fit_tangential(data)
    return Law(float(restitution), scatter, float(friction), beta, normal, tangential, tangential_scatter)


def lasting_law(data: LawData, law: Law) -> LastingContact | None:
    """The tangential law of contacts that last, from the ``law`` of an instant (:func:`fit_law`); None where stick or
    slide in an instant is likelier."""
    if not law.wall_friction > 0.0:
        return None
    found = fit_lasting(impulses_of(data), law.restitution, law.wall_friction, law.tangential_scatter)
    return found if found.misfit < law.tangential_misfit else None


def tangential_sd(data: LawData, law: Law) -> tuple[float, float]:
    """How far wall friction and tangential restitution may lie off ``law`` at one impact: what the impacts that slide,
    or stick, leave open, and their scatter; :data:`OPEN_FRICTION` and :data:`OPEN_TANGENTIAL` where none does.
    """
    stick = sticks(data, law.wall_friction, law.tangential_restitution)
    sliding, sticking = data.normal_impulse[~stick], np.abs(data.slip[stick]) / (1 + 1 / data.inertia_factor)
    friction = np.sum((sliding / np.hypot(data.tangential_sd[~stick], law.tangential_scatter * sliding)) ** 2)
    scatter = law.tangential_scatter * data.normal_impulse[stick]
    tangential = np.sum((sticking / np.hypot(data.tangential_sd[stick], scatter)) ** 2)
    each = float(np.median(scatter / np.maximum(sticking, LEAST_SLIP_M_PER_S))) if len(scatter) else 0.0
    return (
        float(np.hypot(law.tangential_scatter, (friction + OPEN_FRICTION**-2) ** -0.5)),
        float(np.hypot(each, (tangential + OPEN_TANGENTIAL**-2) ** -0.5)),
    )


def restitution_gain(data: LawData, columns: Sequence[Array]) -> tuple[float, Array, Array]:
    """Fall of -2 log L when restitution may follow ``columns`` (K,) besides a constant; coefficients and their sd."""
    base = fit_restitution(data)[3]
    c, covariance, _, value = fit_restitution(data, np.column_stack([np.ones(len(data)), *columns]))
    return base - value, c[1:], np.sqrt(np.diag(covariance))[1:]
