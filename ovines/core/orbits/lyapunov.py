"""Lyapunov exponents by tangents made orthonormal again and again (Benettin; Mueller for impacts)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovines.core.packing import pack
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity.columns import refuse_unfollowed, row_of, tangents_of
from ovines.core.sensitivity.run import follow_packed
from ovines.core.system.model import Scenario

BATCHES = 10


@dataclass(frozen=True)
class Lyapunov:
    """``exponents_per_s`` (m,), largest first, with ``sd_per_s`` of batches; their running means ``history_per_s``
    (n, m) at ``time_s`` (n,); ``impacts_per_s`` after the transient, and the number of ``impacts`` counted.
    """

    exponents_per_s: np.ndarray
    sd_per_s: np.ndarray
    time_s: np.ndarray
    history_per_s: np.ndarray
    impacts_per_s: float
    impacts: int


def lyapunov(
    scenario: Scenario,
    directions: Sequence[str],
    every_s: float,
    transient_s: float = 0.0,
) -> Lyapunov:
    """Lyapunov exponents of a run (1/s) over its duration less ``transient_s``.

    Parameters
    ----------
    scenario
        One run; its ``duration_s`` is the time averaged over, with the transient.
    directions
        States (``nes_x_m`` ...) in which tangents are followed: as many exponents.  All those that move, or where the
        motion keeps to a line, those along it.
    every_s
        Time between two Gram-Schmidt steps; a period of the drive is right.
    transient_s
        Time before averaging begins.

    Returns
    -------
    Lyapunov
        Standard deviations are of the mean, from ten batches.

    Raises
    ------
    ScenarioError
        Grazes and rests in corners; a time that is not inside the run; names that are no states.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.core.orbits.lyapunov import lyapunov
    >>> from ovines.notebook import read_scenario
    >>> found = lyapunov(read_scenario("bouncing-ball"), ["nes_y_m", "nes_vy_m_per_s"], every_s=0.1)
    >>> bool(abs(found.exponents_per_s.sum() - 2 * np.log(0.85) * found.impacts_per_s) < 0.02)  # flow keeps areas
    True
    """
    steps, skipped = (
        (int(scenario.duration_s / every_s), int(np.ceil(transient_s / every_s))) if every_s > 0.0 else (0, 0)
    )
    if not (transient_s >= 0.0 and steps - skipped >= BATCHES):
        raise ScenarioError(
            f"every_s = {every_s:g}, transient_s = {transient_s:g} in a run of {scenario.duration_s:g} s",
            f"at least {BATCHES} times every_s after the transient",
            "lengthen the run",
        )
    packed = pack(replace(scenario, max_impacts=10**9), with_energy=False)
    refuse_unfollowed(packed)
    if any(not name.startswith(("nes_", "host_")) or name in ("nes_radius_m", "nes_mass_kg", "host_radius_m")
           for name in directions):  # fmt: skip
        raise ScenarioError(f"directions {', '.join(directions)}", "names of states, as nes_x_m", "correct the names")
    start, numbers = tangents_of(packed, directions)
    times = every_s * np.arange(1, steps + 1)  # also during the transient: tangents would fall onto each other
    found, count = follow_packed(packed, start, numbers, times, [row_of(name) for name in directions])
    logs = found.logs[skipped:]
    if not np.isfinite(logs).all():
        raise ScenarioError(
            "tangents that vanish", "motion in all the directions asked for", "ask for fewer directions"
        )
    impacts = int(np.sum(found.impacts[:count, 0] > every_s * skipped))
    span = every_s * len(logs)
    history = np.cumsum(logs, axis=0) / (every_s * np.arange(1, len(logs) + 1))[:, None]
    batches = np.array([part.mean(axis=0) for part in np.array_split(logs, BATCHES)]) / every_s
    order = np.argsort(-history[-1])
    return Lyapunov(
        history[-1][order],
        (batches.std(axis=0, ddof=1) / np.sqrt(BATCHES))[order],
        times[-len(logs) :],
        history[:, order],
        impacts / span,
        impacts,
    )
