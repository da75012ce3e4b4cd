"""What a NES takes, responses and designs, as tables and in words."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ovines.core.absorber.design import Design
from ovines.core.absorber.response import Response
from ovines.core.absorber.sprung import DESIGNED
from ovines.core.absorber.taken import EnergyTaken
from ovines.core.system.model import Scenario
from ovines.simulations.results import CHANNELS

DECAYED = 0.1


def taken_table(found: EnergyTaken) -> pd.DataFrame:
    """``energy_taken.parquet``: a row per sample."""
    same = {name: getattr(found, name) for name in ("time_s", "host_j", "bare_j", "pumped_j", "nes_j")}
    return pd.DataFrame(same | found.dissipated_j | {"damper_loss_j": found.damper_j, "work_j": found.work_j})


def taken_lines(found: EnergyTaken) -> list[str]:
    """Where the energy of the run went."""
    gone = {name: float(energy[-1]) for name, energy in found.dissipated_j.items()}
    total = sum(gone.values()) + float(found.damper_j[-1])
    parts = [("dampers", float(found.damper_j[-1])), *((CHANNELS[name], value) for name, value in gone.items())]
    shares = ", ".join(
        f"{name} {100 * value / total:.3g} %"
        for name, value in sorted(parts, key=lambda one: -one[1])
        if value > 1e-3 * total
    )
    lines = [f"pumped into the NES {found.pumped_j[-1]:.3g} J, {found.nes_j[-1]:.3g} J of it still there"]
    if total > 0.0:
        lines.append(f"dissipated {total:.3g} J: {shares}")
    with_nes, bare = found.decay_s(DECAYED)
    words = [f"{value:.3g} s" if np.isfinite(value) else "not within the run" for value in (with_nes, bare)]
    lines.append(f"Host's energy below {DECAYED:.0%} for good: {words[0]}, without NES {words[1]}")
    return lines


def response_table(found: Response, scenario: Scenario, design: Design | None) -> pd.DataFrame:
    """``response.parquet``: a row per NES and frequency."""
    rows = []
    for name, one in (("scenario", found), *((("best", design.kept[0].response),) if design else ())):
        level = one.level_m()
        for n, frequency in enumerate(one.frequency_hz):
            low, high = np.percentile(level[n], [5.0, 95.0])
            rows.append(
                {
                    "nes": name, "frequency_hz": frequency, "runs": level.shape[1], "amplitude_m": level[n].mean(),
                    "amplitude_sd_m": level[n].std(), "amplitude_low_m": low, "amplitude_high_m": high,
                    "amplitude_x_m": one.amplitude_m[n, :, 0].mean(), "amplitude_y_m": one.amplitude_m[n, :, 1].mean(),
                    "bare_amplitude_m": float(np.linalg.norm(one.bare_m[n])),
                    "stuck_amplitude_m": float(np.linalg.norm(one.stuck_m[n])),
                    "impacts_per_period": one.impacts_per_period[n],
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def design_table(found: Design) -> pd.DataFrame:
    """``design.parquet``: a row per candidate, those kept first; numbers that were not searched for are null."""
    kept = {id(one.numbers) for one in found.kept}
    rows = []
    for one in (*found.kept, *(one for one in found.tried if id(one.numbers) not in kept)):
        rows.append(
            {name: one.numbers.get(name, np.nan) for name in DESIGNED}
            | {"runs": one.response.amplitude_m.shape[1], "amplitude_m": one.level_m, "amplitude_low_m": one.low_m}
            | {"amplitude_high_m": one.high_m, "best_share": one.best, "bare_amplitude_m": found.bare_m}
            | {"damper_amplitude_m": found.damper_m}
        )
    table = pd.DataFrame(rows)
    table.insert(0, "candidate", np.arange(len(table)))
    return table


def design_lines(response: Response, found: Design | None) -> list[str]:
    """The response's peak, and the best NES."""
    level = response.level_m().mean(axis=1)
    at = int(np.argmax(level))
    bare = np.linalg.norm(response.bare_m, axis=1).max()
    lines = [
        f"largest amplitude {1e3 * level[at]:.4g} mm at {response.frequency_hz[at]:.4g} Hz; bare {1e3 * bare:.4g} mm"
    ]
    if found is None:
        return lines
    best = found.kept[0]
    numbers = ", ".join(f"{name} {value:.4g}" for name, value in best.numbers.items()) or "the scenario's own NES"
    damper = ", ".join(
        f"k {one.stiffness_n_per_m:.4g} N/m, c {one.damping_n_s_per_m:.4g} N s/m" for one in found.damper
    )
    return [
        *lines,
        f"best NES: {numbers}",
        f"  {1e3 * best.level_m:.4g} mm (90 %: {1e3 * best.low_m:.4g} to {1e3 * best.high_m:.4g}), best of the "
        f"{len(found.kept)} kept in {100 * best.best:.0f} % of resampled ensembles",
        f"optimal tuned mass damper of the same mass: {1e3 * found.damper_m:.4g} mm ({damper})",
    ]
