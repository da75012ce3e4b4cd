"""Many runs of one scenario: scattered starts and parameters, sweeps, maps; on threads or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats
from ovines.core.energies import LOSSES
from ovines.core.engine import run
from ovines.core.integration.sampling import N_SAMPLE, take_sample
from ovines.core.packing import pack
from ovines.core.refusal import require, require_an_end
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed, Samples, System

Spread = float | tuple[float, float] | np.ndarray  # normal about the scenario's value, uniform, or a sweep
STATE_PLACES = {
    "nes_x_m": 0, "nes_y_m": 1, "nes_vx_m_per_s": 2, "nes_vy_m_per_s": 3, "nes_angle_rad": 4, "nes_spin_rad_per_s": 5,
    "host_x_m": P.HOST, "host_y_m": P.HOST + S.Y, "host_vx_m_per_s": P.HOST + S.VX, "host_vy_m_per_s": P.HOST + S.VY,
    "host_angle_rad": P.HOST + S.ANGLE, "host_spin_rad_per_s": P.HOST + S.SPIN,
}  # fmt: skip
NUMBER_PLACES = {
    "restitution": P.RESTITUTION, "wall_friction": P.WALL_FRICTION,
    "tangential_restitution": P.TANGENTIAL_RESTITUTION, "floor_friction": P.FLOOR_FRICTION,
}  # fmt: skip
NUMBER_BOUNDS = {
    "restitution": (0.0, 1.0), "wall_friction": (0.0, np.inf), "tangential_restitution": (-1.0, 1.0),
    "floor_friction": (0.0, np.inf),
}  # fmt: skip
DRIVE_COLUMNS = {"drive_amplitude_factor": 1, "drive_frequency_factor": 2, "drive_phase_shift_rad": 3}
CHUNK = 500  # runs that a thread or a worker takes at once
SPREADABLE = (*STATE_PLACES, *NUMBER_PLACES, *DRIVE_COLUMNS)


@dataclass(frozen=True)
class Workers:
    """Who runs an ensemble: ``jobs`` threads (None: all cores), or the workers of a ``client`` (``distributed.Client``;
    a lost worker's chunks run again), ``chunk`` runs at once each.  ``progress`` is called with numbers of runs done.
    """

    jobs: int | None = None
    client: Any = None
    progress: Callable[[int], object] | None = None
    chunk: int = CHUNK


ALL_CORES = Workers()


@dataclass(frozen=True)
class EnsembleResult:
    """What ``n`` runs gave, one row per run.

    ``drawn``: values of each spread quantity (n,); ``final_state`` (n, 12): NES centre x, y, vx, vy, angle, spin,
    then the Host's; ``n_impacts``, ``n_contacts`` (n,); ``contact_s`` (n,) time in sustained contact; ``end_s`` (n,);
    ``samples`` (n, m, 12) at ``sample_times_s`` (m,): stroboscopic maps.  ``energies``: losses by channel and the work
    done (J, each (n,); none unless asked for).
    """

    drawn: dict[str, np.ndarray]
    final_state: np.ndarray
    n_impacts: np.ndarray
    n_contacts: np.ndarray
    contact_s: np.ndarray
    end_s: np.ndarray
    sample_times_s: np.ndarray
    samples: np.ndarray
    energies: dict[str, np.ndarray] = field(default_factory=dict)


def run_chunk(rows: System, y_rows: Floats, times: Floats, with_energies: bool = False) -> tuple[np.ndarray, ...]:
    """Run some rows and give (finals, counts, spans, samples, energies); what a worker is sent.

    ``energies`` (n, 7), or no rows where none are wanted.  Row by row through the engine's one entry: a compiled loop
    around it would hold, and compile, the engine again.
    """
    n = len(y_rows)
    samples = np.full((n, len(times), N_SAMPLE), np.nan)
    finals, counts, spans = np.zeros((n, N_SAMPLE)), np.zeros((n, 2), dtype=np.int64), np.zeros((n, 2))
    energies = np.zeros((n if with_energies else 0, P.HOST - P.ENERGIES))
    impacts, contacts = np.zeros((0, P.N_IMPACT)), np.zeros((0, 2))
    work = np.zeros((P.N_WORK, P.N_STATE))
    for row in range(n):
        y = y_rows[row].copy()
        system = rows._replace(p=rows.p[row], drive=rows.drive[row])
        taken = Samples(times, samples[row], np.zeros(1, np.int64), work[:0])
        end, n_impacts, n_contacts, held = run(system, y, taken, impacts, contacts, with_energies)
        counts[row], spans[row] = (n_impacts, n_contacts), (held, end)
        take_sample(end, y, system, work, finals[row])
        if with_energies:
            energies[row] = y[P.ENERGIES : P.HOST]
    return finals, counts, spans, samples, energies


def simulate_ensemble(
    scenario: Scenario,
    n: int,
    spread: Mapping[str, Spread],
    rng: np.random.Generator,
    sample_times_s: np.ndarray | None = None,
    tolerance: float = 1e-9,
    with_energies: bool = False,
    workers: Workers = ALL_CORES,
) -> EnsembleResult:
    """Run ``scenario`` ``n`` times with quantities of :data:`SPREADABLE` drawn or swept.

    ``spread`` maps a name to a standard deviation (normal, about the scenario's value; about 0 or 1 for a phase shift
    or a factor), a pair (uniform) or an array (n,) (a sweep).  All draws are made here, so the answer does not depend
    on the ``workers``.  ``tolerance`` is the integrator's: an ensemble speaks of statistics, which 1e-9 leaves alone
    (mean impacts of 1,000 runs of Table 15 case 2: 14.556 against 14.555 at 1e-11) at two thirds of the time.  Starts
    that fall outside a wall are drawn again.  ``with_energies`` also follows the energies: hardly more time with floor
    friction, seven times as long for closed flights over springs.  :class:`ScenarioError` where the steps of one of the
    runs come to nothing.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.core import simulate_ensemble
    >>> from ovines.notebook import read_scenario
    >>> scattered = {"nes_x_m": 1e-4, "nes_y_m": 1e-4}  # standard deviations of the start
    >>> found = simulate_ensemble(read_scenario("table-15-case-2"), 20, scattered, np.random.default_rng(0))
    >>> found.n_impacts.shape, bool(10 < found.n_impacts.mean() < 20)
    ((20,), True)
    """
    packed = pack(replace(scenario, tolerance=tolerance), with_energy=with_energies)
    times = np.zeros(0) if sample_times_s is None else np.ascontiguousarray(sample_times_s, dtype=float)
    p_rows, drives, y_rows, drawn = draw(packed, n, spread, rng)
    pieces = [slice(start, min(start + workers.chunk, n)) for start in range(0, n, workers.chunk)]
    tasks = [
        (packed.system._replace(p=p_rows[piece], drive=drives[piece]), y_rows[piece], times, with_energies)
        for piece in pieces
    ]
    results: list[tuple[Floats, ...]] = [()] * len(pieces)
    for index, result in _spread_out(tasks, workers):
        results[index] = result
        if workers.progress is not None:
            workers.progress(len(result[0]))
    if not results:
        results = [run_chunk(packed.system._replace(p=p_rows, drive=drives), y_rows, times, with_energies)]
    finals, counts, spans, samples, moved = (np.concatenate(parts) for parts in zip(*results, strict=True))
    for end, count in zip(spans[:, 1], counts[:, 0], strict=True):
        require_an_end(scenario.name, end, scenario.duration_s, count >= scenario.max_impacts)
    places = LOSSES | {"work_j": P.WORK} if with_energies else {}
    energies = {name: moved[:, place - P.ENERGIES] for name, place in places.items()}
    return EnsembleResult(drawn, finals, counts[:, 0], counts[:, 1], spans[:, 0], spans[:, 1], times, samples, energies)


def _spread_out(tasks: Sequence[tuple[Any, ...]], workers: Workers) -> Iterator[tuple[int, tuple[Floats, ...]]]:
    """Run chunks and yield (index, result) as they finish."""
    if workers.client is not None:
        from distributed import as_completed as as_finished

        futures = {workers.client.submit(run_chunk, *task, pure=False, retries=3): i for i, task in enumerate(tasks)}
        for future in as_finished(list(futures)):
            yield futures[future], future.result()
        return
    pool = ThreadPoolExecutor(max_workers=workers.jobs or os.cpu_count())
    try:
        futures = {pool.submit(run_chunk, *task): i for i, task in enumerate(tasks)}
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)  # all are done, or nobody waits for the rest


def draw(
    packed: Packed, n: int, spread: Mapping[str, Spread], rng: np.random.Generator
) -> tuple[Floats, Floats, Floats, dict[str, Floats]]:
    """Rows of numbers, harmonics and start states for ``n`` runs, and what was drawn."""
    for name in spread:
        require(name in SPREADABLE, f"spread of {name!r}", "one of " + ", ".join(SPREADABLE), "correct the name")
    p_rows, y_rows = np.tile(packed.p, (n, 1)), np.tile(packed.y, (n, 1))
    drives = np.tile(packed.drive, (n, 1, 1))
    drawn = {name: np.zeros(n) for name in spread}
    rows = np.arange(n)
    for _ in range(1000):
        for name, how in spread.items():
            centre = centre_of(packed, name)
            values = draw_values(how, centre, rows, n, rng)
            low, high = NUMBER_BOUNDS.get(name, (-np.inf, np.inf))
            drawn[name][rows] = values = np.clip(values, low, high)
            if name in STATE_PLACES:
                y_rows[rows, STATE_PLACES[name]] = values
            elif name in NUMBER_PLACES:
                p_rows[rows, NUMBER_PLACES[name]] = values
            else:
                column = DRIVE_COLUMNS[name]
                base = packed.drive[:, column]
                shifted = base + values[:, None] if column == 3 else base * values[:, None]
                drives[rows, :, column] = shifted
        rows = np.flatnonzero(~inside(packed, y_rows, drives))
        if len(rows) == 0:
            widen(packed, p_rows, drives)
            return p_rows, drives, y_rows, drawn
    require(False, f"{len(rows)} starts outside the wall after 1000 draws", "starts inside", "narrow the spread")
    raise AssertionError


def draw_values(how: Spread, centre: float, rows: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Values for ``rows``: a normal draw, a uniform draw, or the sweep's own."""
    if isinstance(how, tuple):
        return rng.uniform(how[0], how[1], len(rows))
    values = np.asarray(how, dtype=float)
    if values.ndim == 0:
        return centre + float(values) * rng.standard_normal(len(rows))
    require(values.shape == (n,), f"a sweep of {values.shape}", f"({n},) values", "give one value per run")
    return values[rows]


def centre_of(packed: Packed, name: str) -> float:
    """Value about which a quantity is drawn."""
    if name in STATE_PLACES:
        return float(packed.y[STATE_PLACES[name]])
    if name in NUMBER_PLACES:
        return float(packed.p[NUMBER_PLACES[name]])
    return 0.0 if DRIVE_COLUMNS[name] == 3 else 1.0


def widen(packed: Packed, p_rows: np.ndarray, drives: np.ndarray) -> None:
    """Bounds and steps of the finder must hold for every row's own drive."""
    if len(packed.drive) == 0:
        return
    old = np.maximum(np.abs(packed.drive[:, P.AMPLITUDE]), 1e-300), np.maximum(packed.drive[:, P.OMEGA], 1e-300)
    louder = np.max(np.abs(drives[:, :, 1]) / old[0], axis=1)
    faster = np.maximum(np.max(drives[:, :, 2] / old[1], axis=1), 1.0)
    for place in (P.HOST_ACCELERATION, P.HOST_SPIN, P.HOST_SPIN_RATE):
        p_rows[:, place] *= np.maximum(louder, 1.0) * faster**2
    p_rows[:, P.MAX_STEP] /= faster


def inside(packed: Packed, y_rows: np.ndarray, drives: np.ndarray) -> np.ndarray:
    """Which starts are inside every wall (n,)."""
    from ovines.core.integration.flight import wall_stands
    from ovines.core.system.kinematics import empty_scratch, placed_in_host
    from ovines.core.system.walls import contact_frame

    scratch, at = empty_scratch()
    fine = np.ones(len(y_rows), dtype=bool)
    walls = [wall for wall in range(packed.k[P.N_WALLS]) if wall_stands(wall, packed.p, packed.k)]
    for row, y in enumerate(y_rows):
        x, y_host, _vx, _vy = placed_in_host(0.0, y, packed.system._replace(drive=drives[row]), scratch, at)
        for wall in walls:
            if contact_frame(wall, x, y_host, packed.p, packed.polygon)[2] < -1e-12 * packed.p[P.LENGTH]:
                fine[row] = False
    return fine
