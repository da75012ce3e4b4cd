"""How large a force is that no law describes: its amplitude and memory from what the flights leave beyond the noise.

The amplitude is a variance component.  Every flight's frames are turned so that noise is white and the unknown force's
displacements are independent, too; then all amplitudes are tried by weighing the same numbers (restricted likelihood:
Patterson and Thompson 1971).  The shared unknowns (floor friction, lens residual, ...) are fitted along at each, so
that models are compared with the amplitude that each of them leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.flights.equation.model import STATES
from analysis.flights.evidence import FlightRows, RunRows
from analysis.flights.noise import GROSS_SD, FlightNoise, displacement, white_frames
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# Amplitudes tried (m/s^2; gravity is the unit of what may act on the disk), then about the best.
COARSE_M_PER_S2 = np.array([0.0, 0.02, 0.08, 0.32, 1.3, 5.0, 20.0])
FINE = np.geomspace(0.4, 2.5, 7)
# Spin's amplitudes over those of a force at the rim; then the force's own over what went with the spin's.
SPINS = (0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
PUSHES = (0.0, 0.03, 0.1, 0.3, 1.0)
# Memories tried, as shares of the median flight: a place of the floor that is crossed, a force that turns, one that
# stays.
MEMORIES = (0.1, 0.4, 1.6)
# Fall of -2 log L from which a force is likelier than none: amplitude and memory are two unknowns, chance gives 6 once
# in twenty series.  About it the amplitude sets in smoothly, so that a frame more or less decides nothing; below NONE
# there is none.
THERE, NONE = 6.0, 2.0
# Flights weighed together: as many as fit into a processor's cache.
AT_ONCE = 64
# Larger than any gain of the likelihood.
FAR = 1e200
# A frame is held against the median of so many.
NEIGHBOURS = 5
# A flight counts as gross (an impact or a contact within it) where a force as large as the others' leaves every frame
# this much (-2 log L) worse than a force of its own would, a third of a gross frame.
GROSS_PER_FRAME = GROSS_SD**2 / 3


@dataclass(frozen=True, eq=False)
class ForceEvidence:
    """For every error model tried (A,): -2 log L ``cost`` (A,) without what the shared unknowns explain, and their
    normal equations
    ``information`` (A, P, P), ``score`` (A, P); ``each`` flight's part of the cost (F, A)."""

    noises: tuple[FlightNoise, ...]
    cost: Array
    information: Array
    score: Array
    each: Array

    def costs(self, prior: Prior) -> Array:
        """-2 log L (A,) with the columns of ``prior`` unknown: fitted, those that it has integrated out - terms that it
        allows and the data do not need make the data less likely."""
        return _costs([self], [prior])[0, 0]


@dataclass(frozen=True, eq=False)
class Prior:
    """Gaussian prior of shared unknowns: ``columns`` (P,) among those of the evidence, ``weight`` (P,) 1/variance,
    ``pull`` (P,) added to the score, ``cost`` of standing where the unknowns stand,
    ``integrated`` (P,) which are integrated out."""

    columns: tuple[int, ...]
    weight: Array
    pull: Array
    cost: float
    integrated: NDArray[np.bool_]


def tried_forces(runs: Sequence[RunRows], noise: FlightNoise, radius_m: float) -> list[list[FlightNoise]]:
    """Error models to try, a list per memory: no force, then rising amplitudes of one at the disk's rim, which turns it
    as fast as it moves it.
    """
    lengths = [flight.time_s[-1] - flight.time_s[0] for run in runs for flight in run.flights]
    frame_s = min((flight.period_s for run in runs for flight in run.flights), default=1.0)
    typical = max(float(np.median(lengths)) if lengths else 1.0, frame_s)
    # Whole powers of two of a frame: flights of the same frames then share what is computed for them.
    memories = sorted({frame_s * 2.0 ** max(round(np.log2(share * typical / frame_s)), 0) for share in MEMORIES})
    return [
        [
            replace(noise, acceleration_m_per_s2=float(a), spin_rad_per_s2=float(a) / radius_m, memory_s=memory)
            for a in COARSE_M_PER_S2
        ]
        for memory in memories
    ]


def tried_nearby(noise: FlightNoise) -> list[list[FlightNoise]]:
    """Error models about ``noise``: finer amplitudes of its force."""
    none = noise.without_force()
    return [
        [
            none,
            *(
                replace(
                    noise,
                    acceleration_m_per_s2=noise.acceleration_m_per_s2 * float(f),
                    spin_rad_per_s2=noise.spin_rad_per_s2 * float(f),
                )
                for f in FINE
            ),
        ]
    ]


def tried_spins(noise: FlightNoise) -> list[list[FlightNoise]]:
    """Error models with the force of ``noise`` and amplitudes of the spin's own, down to none."""
    none = noise.without_force()
    return [
        [
            none,
            *(replace(noise, spin_rad_per_s2=noise.spin_rad_per_s2 * float(f)) for f in SPINS),
        ]
    ]


def tried_pushes(noise: FlightNoise) -> list[list[FlightNoise]]:
    """Error models with the spin's amplitude of ``noise`` and smaller ones of its force, down to none: what brakes the
    spin alone need not push the disk."""
    none = noise.without_force()
    return [
        [
            none,
            *(replace(noise, acceleration_m_per_s2=noise.acceleration_m_per_s2 * float(f)) for f in PUSHES),
        ]
    ]


def refined(runs: Sequence[RunRows], best: FlightNoise, cost: float, prior: Prior) -> tuple[FlightNoise, float]:
    """``best`` error model of :func:`tried_forces` and its -2 log L ``cost`` with finer amplitudes, the spin's own, and
    the force's own; as it is where there is no force."""
    for finer in (tried_nearby, tried_spins, tried_pushes):
        if best.forced:
            best, _, cost = best_model(force_evidence(runs, finer(best)), [prior])
    return best, cost


def force_evidence(runs: Sequence[RunRows], tried: Sequence[Sequence[FlightNoise]]) -> list[ForceEvidence]:
    """One :class:`ForceEvidence` per list of ``tried`` models, which share noise and memory."""
    flights = [_as_white(flight, tried[0][0]) for run in runs for flight in run.flights]
    some = [flights[first : first + AT_ONCE] for first in range(0, len(flights), AT_ONCE)]
    columns = len(runs[0].columns)
    parts = in_threads(_evidence_of, [(part, tuple(models), columns) for models in tried for part in some])
    each = [parts[k * len(some) : (k + 1) * len(some)] for k in range(len(tried))]
    return [_together(tuple(models), own, columns) for models, own in zip(tried, each, strict=True)]


def _together(models: tuple[FlightNoise, ...], parts: Sequence[ForceEvidence], columns: int) -> ForceEvidence:
    """What all flights say, of some at a time."""
    information, score = np.zeros((len(models), columns, columns)), np.zeros((len(models), columns))
    for one in parts:
        information, score = information + one.information, score + one.score
    each = np.concatenate([np.zeros((0, len(models))), *(one.each for one in parts)])
    return ForceEvidence(models, each.sum(0), information, score, each)


class _WhiteFlight(NamedTuple):
    """A flight's ``frames`` counted from its first, as bytes, its ``rows`` and residual (N, 3, P + 1) over the noise;
    ``unit`` (2,): a usual frame's sd of place and angle; ``log_noise``: what the noise's size costs; ``turned``: rows
    (3 N, P + 1) by the memory (frames) of the force under which they are independent, and what a force adds to the
    variances (N,) of each coordinate."""

    frames: bytes
    period_s: float
    rows: Array
    unit: Array
    log_noise: float
    turned: dict[float, tuple[Array, Array]]


def _as_white(flight: FlightRows, noise: FlightNoise) -> _WhiteFlight:
    """The flight over a noise, kept with its rows: error models of other forces ask for it again."""
    key = noise.scale, noise.angle_scale, noise.correlation
    if key not in flight.kept:
        flight.kept[key] = _made_white(flight, noise)
    white: _WhiteFlight = flight.kept[key]
    return white


def _made_white(flight: FlightRows, noise: FlightNoise) -> _WhiteFlight:
    scales = noise.scale, noise.scale, noise.angle_scale
    residual = flight.residual / (flight.sd * scales)
    # A gross error weighs less in its own frame, before frames are turned into one another.
    weight = np.minimum(1.0, GROSS_SD / np.maximum(beside_neighbours(residual), 1e-12))
    log_noise = 2 * len(residual) * np.sum(np.log(scales)) + 3 * (len(residual) - 1) * np.log(1 - noise.correlation**2)
    weighted = flight.rows * (weight / (flight.sd * scales))[:, :, None]
    return _WhiteFlight(
        (flight.index - flight.index[0]).tobytes(),
        flight.period_s,
        np.concatenate([weighted, (residual * weight)[:, :, None]], 2),
        # In units of the noise of the flight's usual frame: a frame with fewer markers is less exact, hardly elsewhere.
        flight.usual_sd * (scales[0], scales[2]),
        float(log_noise),
        {},
    )


def _turned(flight: _WhiteFlight, memory: float, correlation: float) -> tuple[Array, Array]:
    if memory not in flight.turned:
        size, turn = _modes(flight.frames, memory, correlation)
        rows = np.tensordot(turn, flight.rows, 1).transpose(1, 0, 2)
        flight.turned[memory] = size, rows.reshape(3 * len(size), -1)
    return flight.turned[memory]


def _evidence_of(flights: Sequence[_WhiteFlight], models: tuple[FlightNoise, ...], columns: int) -> ForceEvidence:
    """What some flights say of ``models``, which share noise and memory, and of the shared ``columns``."""
    sizes = np.array([[m.acceleration_m_per_s2, m.spin_rad_per_s2] for m in models])
    cost = np.empty((len(flights), len(models)))
    products = np.empty((len(flights), len(models), STATES + columns + 1, STATES + columns + 1))
    for number, flight in enumerate(flights):
        memory = models[0].memory_s / max(flight.period_s, 1e-12)
        size, rows = _turned(flight, memory, models[0].correlation)
        amplitudes = sizes * flight.period_s**2 / flight.unit
        variance = (1 + amplitudes[:, [0, 0, 1], None] ** 2 * size).reshape(len(models), -1)
        np.matmul(rows.T * (1 / variance)[:, None, :], rows, out=products[number])
        cost[number] = flight.log_noise + np.sum(np.log(variance), 1)
    left, volume = _without_own(products)
    cost += left[:, :, -1, -1] + volume
    return ForceEvidence(models, cost.sum(0), left[:, :, :-1, :-1].sum(0), left[:, :, :-1, -1].sum(0), cost)


def _without_own(products: Array) -> tuple[Array, Array]:
    """Normal products (F, A, S + P + 1, S + P + 1) of flights' rows and residuals with each flight's own state solved
    for: (F, A, P + 1, P + 1), and the logarithm of its determinant (F, A)."""
    own = products[..., :STATES, :STATES] + 1e-12 * np.eye(STATES)
    scale = np.sqrt(np.diagonal(own, axis1=2, axis2=3))
    unit = own / (scale[..., :, None] * scale[..., None, :]) + 1e-10 * np.eye(STATES)
    both = products[..., :STATES, STATES:] / scale[..., None]
    left = products[..., STATES:, STATES:] - both.swapaxes(2, 3) @ np.linalg.solve(unit, both)
    return left, np.linalg.slogdet(unit)[1] + 2 * np.sum(np.log(scale), 2)


def beside_neighbours(residual: Array) -> Array:
    """How far each of a flight's residuals (N, ...) stands out of its neighbours' median, (N, ...): a smooth error is
    not gross, however large."""
    size = (NEIGHBOURS, *(1 for _ in residual.shape[1:]))
    return np.asarray(np.abs(residual - median_filter(residual, size, mode="nearest")), float)


def gross_flights(evidence: Sequence[ForceEvidence], frames: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which flights (F,) of ``frames`` (F,) each hold something else than a force as large as the others'.

    One with an impact within asks for any force: each counts as no worse than its own best force and
    :data:`GROSS_PER_FRAME` while the amplitude of all is sought."""
    each = np.stack([one.each for one in evidence], 1)
    most = each.min((1, 2)) + GROSS_PER_FRAME * frames
    capped = np.minimum(each, most[:, None, None]).sum(0)
    memory, amplitude = np.unravel_index(int(np.argmin(capped)), capped.shape)
    return np.asarray(each[:, memory, amplitude] > most, bool)


@lru_cache(maxsize=2048)
def _modes(frames: bytes, memory: float, correlation: float) -> tuple[Array, Array]:
    """Variances (N,) that a force of one length per frame squared adds to noise of unit variance, and what turns frames
    into ones in which both are independent (N, N); ``memory`` in frames."""
    index = np.frombuffer(frames, np.int64)
    at, white = index.astype(float), white_frames(index, correlation)
    size, vectors = np.linalg.eigh(white @ displacement(at, memory) @ white.T)
    return np.maximum(size, 0.0), vectors.T @ white


def _costs(evidence: Sequence[ForceEvidence], priors: Sequence[Prior]) -> Array:
    """-2 log L (priors, memories, amplitudes), as :meth:`ForceEvidence.costs`; the priors are of the same columns."""
    first = priors[0]
    kept = np.flatnonzero(~first.integrated)
    order = np.concatenate([kept, np.flatnonzero(first.integrated)])
    chosen = np.array(first.columns, int)[order]
    weight, pull = (np.array([getattr(one, name)[order] for one in priors]) for name in ("weight", "pull"))
    last = len(order)
    beside = np.empty((len(priors), len(evidence), len(evidence[0].cost), last + 1, last + 1))
    beside[..., :last, :last] = np.array([one.information[:, chosen][:, :, chosen] for one in evidence])
    diagonal = np.einsum("...ii->...i", beside)
    diagonal[..., :last] += weight[:, None, None]
    diagonal[..., last] = FAR
    beside[..., last, :last] = np.array([one.score[:, chosen] for one in evidence]) + pull[:, None, None]
    beside[..., :last, last] = beside[..., last, :last]
    size = np.sqrt(diagonal)
    size[..., last] = 1.0
    beside /= size[..., :, None]
    beside /= size[..., None, :]
    volume, explained = _volume_and_gain(beside, len(kept))
    volume += 2 * np.sum(np.log(size[..., len(kept) : last]), -1)
    given = np.array([one.cost for one in priors]) - np.sum(np.log(weight[:, len(kept) :]), 1)
    return np.asarray(np.array([one.cost for one in evidence]) + volume + given[:, None, None] - explained, float)


def _volume_and_gain(beside: Array, kept: int) -> tuple[Array, Array]:
    """Of matrices (..., P, P) with a score as a last row and column of ``beside`` (..., P + 1, P + 1), their last
    element :data:`FAR`: the logarithm of the determinant over that of the first ``kept`` columns, and the score times
    the inverse times the score.  One triangle has both.
    """
    last = beside.shape[-1] - 1
    try:
        root = np.linalg.cholesky(beside)
    except np.linalg.LinAlgError:  # columns that are one to rounding
        unit, score = beside[..., :last, :last], beside[..., last, :last]
        volume = np.linalg.slogdet(unit)[1] - np.linalg.slogdet(unit[..., :kept, :kept])[1]
        return volume, np.sum(np.linalg.solve(unit, score[..., None])[..., 0] * score, -1)
    diagonal = np.diagonal(root, axis1=-2, axis2=-1)[..., kept:last]
    return 2 * np.sum(np.log(diagonal), -1), np.sum(root[..., last, :last] ** 2, -1)


def best_model(evidence: Sequence[ForceEvidence], priors: Sequence[Prior]) -> tuple[FlightNoise, int, float]:
    """The most likely error model, its force weighed by how likely there is one; which of the ``priors``, all of the
    same columns, it goes with (the first unless another is surely better), and -2 log L.

    Examples
    --------
    Is there a force that the law of flight does not describe: as identified, and if the floor friction were forgotten?

    >>> from ovines.notebook import analyse, identify, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> motion = analyse(points, recording)
    >>> motion = motion[motion["time_s"] < 0.6]
    >>> rig = identify(motion, recording).rig
    >>> import numpy as np
    >>> from analysis.flights.evidence import columns_of, linearised
    >>> from analysis.flights.fit import fit_flights
    >>> from analysis.flights.unknown_force import best_model, force_evidence, tried_forces
    >>> from analysis.identification.floor.errors import noise_of
    >>> from analysis.identification.floor.priors import lens_priors
    >>> run, known, columns = rig.runs[0], rig.floor.fits[0], columns_of(rig.floor.names)
    >>> for parameters in known.parameters, np.zeros_like(known.parameters):
    ...     fits = fit_flights(run.data, run.flights, parameters, known.shared)
    ...     rows = [linearised(fits, columns)]
    ...     evidence = force_evidence(rows, tried_forces(rows, noise_of([fits]), run.data.radius_m))
    ...     noise = best_model(evidence, lens_priors(columns, columns, known.shared))[0]
    ...     print(f"{noise.acceleration_m_per_s2:.1f} m/s², probability {noise.sure:.2f}")
    0.0 m/s², probability 0.00
    1.3 m/s², probability 1.00
    """
    costs = _costs(evidence, priors)
    lowest = costs.min((1, 2))
    number = int(np.argmin(lowest)) if lowest[0] - THERE > lowest.min() else 0
    which, best = divmod(int(np.argmin(costs[number])), costs.shape[2])
    none, cost = float(costs[number, 0, 0]), float(costs[number, which, best])
    if best == 0 or none - NONE < cost:
        return evidence[which].noises[0], number, none
    noise, sure = evidence[which].noises[best], float(1 / (1 + np.exp(THERE - (none - cost))))
    weighed = replace(
        noise,
        acceleration_m_per_s2=sure * noise.acceleration_m_per_s2,
        spin_rad_per_s2=sure * noise.spin_rad_per_s2,
        sure=sure,
    )
    return weighed, number, cost
