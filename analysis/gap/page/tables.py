"""Tables of the gap's page: tests, parameters, shifts, detectable sizes, shares, as ready-made texts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from analysis.gap.ladder import Ladder
from analysis.gap.page.words import RATIOS, STAGES, parameter_words, plain, shown, shown_interval, unit_of
from analysis.gap.prediction.how_far import HowFar
from analysis.gap.thresholds import SIGNIFICANCE
from analysis.report.numbers import MISSING, percent, value_with_sd, with_unit

Row = tuple[str, ...]
NOMINAL = {
    "floor_friction": "floor friction μ_s",
    "restitution": "restitution ε",
    "restitution_scatter": "scatter of restitution",
    "wall_friction": "wall friction μ_c",
    "tangential_restitution": "tangential restitution β₀",
}


def measurement_rows(ladder: Ladder) -> list[Row]:
    """Each test: what was measured with sd, how many sd from nothing, negligible size, verdict."""
    rows: list[Row] = []
    for name, finding in ladder.measurement.findings.items():
        parameters = ladder.series.frame.world_parameters(name, finding.parameters)
        values = "; ".join(_with_sd(p, *v) for p, v in parameters.items())
        first = next(iter(finding.parameters))
        found = any(f.effect == name for f in ladder.findings)
        verdict = "found" if finding.found else ("negligible" if finding.significance > SIGNIFICANCE else "nothing")
        if finding.found and not found:
            verdict = "gone after the other corrections"
        elif found and not finding.found:
            verdict = "found after another correction"
        rows.append(
            (
                plain(name),
                values,
                f"{finding.significance:.1f}".replace("-", "−"),
                _size(first, finding.least),
                verdict,
            )
        )
    return rows


def _with_sd(parameter: str, value: float, sd: float) -> str:
    if parameter in RATIOS:
        return f"1 + {value_with_sd(value - 1, sd)}".replace("+ (−", "− (").replace("+ −", "− ")
    factor, unit = unit_of(parameter)
    name = f"{parameter_words(parameter)} " if parameter[:2] in ("u_", "v_", "x_", "y_") else ""
    return f"{name}{value_with_sd(factor * value, factor * sd, unit)}"


def _size(parameter: str, size: float) -> str:
    """A smallest size; that of a ratio is its distance from 1."""
    return f"{size:.2g} of 1" if parameter in RATIOS else shown(parameter, size, 2)


def parameter_rows(parameters: dict[str, Any]) -> list[Row]:
    """Effect, parameter, value with sd, 90 % interval; a row per parameter of every effect found."""
    return [
        (plain(effect), parameter_words(name), shown(name, v["value"], 4), shown_interval(name, v["low"], v["high"]))
        for effect, values in parameters.items()
        for name, v in values.items()
    ]


def nominal_rows(nominal: dict[str, Any], effect: bool) -> list[Row]:
    """How the nominal parameters moved; with an ``effect``, by how much of themselves it moves them again."""
    rows: list[Row] = []
    for name, values in nominal.items():
        a, b = values.get("recalibrated"), values.get("with_effect")
        change = f"{100 * (b / a - 1):+.2f} %".replace("-", "−") if a and b is not None else MISSING
        row = (NOMINAL.get(name, name.replace("_", " ")), _number(values.get("as_given")), _number(a))
        rows.append((*row, _number(b), change) if effect else row)
    return rows


def _number(value: float | None) -> str:
    return MISSING if value is None else f"{value:.4f}"


def detectable_rows(detectable: dict[str, Any], parameters: dict[str, Any]) -> list[Row]:
    """Smallest size of each effect that would have been named, what the noise alone would allow, and what was measured
    of it (the sd being the noise's alone)."""
    rows: list[Row] = []
    for effect, entry in detectable.items():
        found = parameters.get(effect, {}).get(entry["parameter"])
        noise = entry.get("noise_limit")
        rows.append(
            (
                plain(effect),
                parameter_words(entry["parameter"]),
                _size(entry["parameter"], entry["size"]),
                MISSING if noise is None else _size(entry["parameter"], noise),
                _measured(entry, found),
            )
        )
    return rows


def _measured(entry: Any, found: Any) -> str:
    if found:
        return shown(entry["parameter"], found["value"]) + " (named)"
    if entry.get("measured") is None:
        return MISSING
    if entry["parameter"] in RATIOS:
        return f"{value_with_sd(entry['measured'], entry['measured_sd'])} of 1"
    factor, unit = unit_of(entry["parameter"])
    return value_with_sd(factor * entry["measured"], factor * entry["measured_sd"], unit)


def gap_rows(gap: dict[str, Any], leave_out: Sequence[str] = ()) -> list[Row]:
    """Error of each step of the gap with its interval, in units of the noise; ``leave_out``: steps not shown."""
    names = {
        "as_given": "as given",
        "recalibrated": "recalibrated",
        "with_effect": "with the effect",
        "noise_floor": "noise floor",
    }
    rows: list[Row] = []
    for key, name in names.items():
        if key in leave_out:
            continue
        step = gap.get(key) or {}
        rows.append(
            (
                name,
                *(
                    with_unit(scale * step[q], unit) if step.get(q) is not None else MISSING
                    for q, scale, unit in (
                        ("flight_m", 1e3, "mm"),
                        ("impact_m_per_s", 1e3, "mm/s"),
                        ("spin_rad_per_s", 1.0, "rad/s"),
                    )
                ),
            )
        )
    return rows


def stage_rows(far: HowFar, shrinkage: float) -> list[Row]:
    """Squared error over the noise's variance of each stage in which there is one, recalibrated, with all named and at
    the floor, and the part of all that is above the floor which it closes; they add up to the ``shrinkage``."""
    stages = {stage: sums for stage, sums in far.by_stage().items() if max(sums[:2]) > 0}
    above = sum(before - floor for before, _, floor in stages.values())
    rows: list[Row] = []
    for stage, (before, after, floor) in stages.items():
        closed = percent((before - after) / above) if above > 0 else MISSING
        rows.append((STAGES[stage], *(with_unit(one) for one in (before, after, floor)), closed))
    total = (sum(sums) for sums in zip(*stages.values(), strict=True))
    return [*rows, ("in all", *(with_unit(one) for one in total), percent(shrinkage))] if stages else rows


def where_rows(where: Sequence[dict[str, Any]]) -> list[Row]:
    """Stage, phase, coordinate and share of what is missed there."""
    return [(w["stage"], w["phase"], w["coordinate"], percent(w["excess"])) for w in where]


def time_rows(time: dict[str, float]) -> list[Row]:
    """How much of the recorded time was fitted, left out, and why."""
    total = sum(time.values()) or 1.0
    names = {
        "free_flight_s": ("free flight", "fitted"),
        "sustained_contact_s": ("sustained contact with the wall", "left out: no flight, no single impact"),
        "left_out_s": ("unseen, too short or between pieces", "left out"),
    }
    return [(names[k][0], with_unit(v, "s"), percent(v / total), names[k][1]) for k, v in time.items() if k in names]


def drive_rows(ladder: Ladder) -> list[Row]:
    """What of the drive differs from what was asked for: runs, words of the strongest, how rarely by chance; a row per
    kind."""
    found = [f for f in ladder.drive.findings if f.found]
    rows: list[Row] = []
    for kind in dict.fromkeys(f.kind for f in found):
        alike = [f for f in found if f.kind == kind]
        worst = max(alike, key=lambda f: abs(f.size))
        runs = list(dict.fromkeys(ladder.series.names[f.run] for f in alike))
        every = len(runs) == len(ladder.series.runs)
        which = "all" if every and len(runs) > 1 else ", ".join(runs)
        rows.append((which, worst.words, chance(worst.p)))
    return rows


def chance(p: float) -> str:
    """A probability by chance in words: how rarely."""
    return f"once in {1 / p:.0f}" if p > 1e-4 else "less than once in ten thousand"
