"""`ovines orbits`: how a run answers to its start and numbers, and where runs end up: sensitivities, Lyapunov
exponents, Poincare sections, bifurcation diagrams, periodic orbits over a parameter, basins of attraction."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.commands.options import whole_number
from ovines.core import Scenario, ScenarioError
from ovines.core.ensemble import Workers
from ovines.core.sensitivity.run import STATES
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.pipeline.ownership import refuse_theirs
from ovines.simulations.results import find
from ovines.tables import write_table
from ovines.workers.budget import add_yes, within_budget

NAME = "orbits"
HELP = "Sensitivities of a scenario, Lyapunov exponents, sections, periodic orbits, basins of attraction."
LINE = ("nes_x_m", "nes_vx_m_per_s")
# Periods that pass before states are kept; of the time that exponents are averaged over, at most this share.
TRANSIENT, LARGEST_SHARE = 200, 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is asked, of which scenario, and where it goes."""
    parser.description = HELP
    parser.add_argument(
        "question",
        choices=sorted(QUESTIONS),
        help="sensitivities: derivatives of states and impact times; lyapunov: exponents; section: one state per "
        "period of the drive; bifurcation: sections over a number; follow: a periodic orbit over a number, with its "
        "multipliers; basins: on which attractor a start ends",
    )
    parser.add_argument("scenario", help="a scenario.toml, or a name of `ovines simulate --list`")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder (default: results/ beside the scenario)")
    parser.add_argument(
        "--states", default=",".join(LINE), metavar="A,B",
        help="states that are followed, shown, or must come back, with commas between them (default: "
        "nes_x_m,nes_vx_m_per_s)",
    )  # fmt: skip
    parser.add_argument("--by", metavar="A,B", help="sensitivities: to what (default: all that mean something)")
    parser.add_argument(
        "--over", action="append", default=[], metavar="NAME=LOW:HIGH:COUNT",
        help="bifurcation, follow: the number that varies; basins: the two axes",
    )  # fmt: skip
    parser.add_argument(
        "--periods", type=whole_number, help="periods of the drive kept (default: 200), or of the orbit (1)"
    )
    parser.add_argument(
        "--transient",
        type=whole_number,
        help=f"periods before them (default: {TRANSIENT}; of exponents at most a fifth of the scenario's duration)",
    )
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Answer, write the table and the figure; wrong input is an `InputError`."""
    scenario, source, out = find(args.scenario, args.out)
    table_name = QUESTIONS[args.question][0]
    pictures = (f"{args.question}.png", f"{args.question}.svg")
    refuse_theirs(out, [f"{table_name}.parquet", *(pictures if args.question != "sensitivities" else ())])
    ask = QUESTIONS[args.question][1]
    try:
        table, figure, lines = within_budget(
            lambda: ask(scenario, args), f"{args.question} of {scenario.name}", args.yes
        )
    except ScenarioError as error:
        raise InputError(f"{scenario.name}: {error.found}", error.expected, error.do) from None
    settings = {key: value for key, value in vars(args).items() if key in ("question", "states", "by", "over")}
    settings |= {"scenario": scenario.name, "periods": args.periods, "transient": args.transient}
    write_table(table, table_name, out / f"{table_name}.parquet", provenance(NAME, settings, source))
    if figure is not None:
        from analysis.figures.style import save_figure

        for name in pictures:
            save_figure(figure, out / name)
    for line in (*lines, out):
        print(line)
    return 0


def states_of(args: argparse.Namespace) -> list[str]:
    """Names of ``--states``; one that is none is refused."""
    names = [name.strip() for name in args.states.split(",")]
    if any(name not in STATES for name in names):
        raise InputError(f"--states {args.states}", "names out of " + ", ".join(STATES), "correct the names")
    return names


def ranges_of(args: argparse.Namespace, count: int, known: tuple[str, ...]) -> list[tuple[str, list[float]]]:
    """The ``--over`` of the command line, as many as the question needs."""
    from ovines.simulations.many import parse_range

    if len(args.over) != count:
        raise InputError(f"{len(args.over)} --over for {args.question}", f"{count}", "give NAME=LOW:HIGH:COUNT")
    return [parse_range(text, known) for text in args.over]


def sensitivities_of(scenario: Scenario, args: argparse.Namespace) -> tuple[pd.DataFrame, Any, list[str]]:
    """Derivatives at the samples, in a table; the largest at the end in words."""
    from ovines.core.sensitivity.run import sensitivities
    from ovines.simulations.orbit_tables import sensitivity_table

    found = sensitivities(scenario, [name.strip() for name in args.by.split(",")] if args.by else None)
    lines = []
    for j, name in enumerate(found.names):
        size = np.abs(found.by[-1, :, j])
        row = int(np.argmax(size))
        delay = f", impact {len(found.impact_time_s) - 1} by {found.impact_time_by[-1, j]:.4g} s" if len(
            found.impact_time_s
        ) else ""  # fmt: skip
        lines.append(f"per unit of {name}: {STATES[row]} {found.by[-1, row, j]:.4g} at {found.time_s[-1]:g} s{delay}")
    return sensitivity_table(found), None, lines


def lyapunov_of(scenario: Scenario, args: argparse.Namespace) -> tuple[pd.DataFrame, Any, list[str]]:
    """Exponents over the scenario's duration after the transient."""
    from analysis.dynamics.orbit_figures import lyapunov_figure
    from ovines.core.orbits.lyapunov import lyapunov
    from ovines.core.orbits.period import drive_period_s
    from ovines.simulations.orbit_tables import lyapunov_table

    period = drive_period_s(scenario)
    fifth = int(LARGEST_SHARE * scenario.duration_s / period)
    transient = min(TRANSIENT, fifth) if args.transient is None else args.transient
    found = lyapunov(scenario, states_of(args), period, transient * period)
    values = ", ".join(f"{a:.4g} +- {b:.1g}" for a, b in zip(found.exponents_per_s, found.sd_per_s, strict=True))
    per_impact = found.exponents_per_s[0] / found.impacts_per_s if found.impacts else np.nan
    return lyapunov_table(found), lyapunov_figure(found), [
        f"exponents {values} 1/s, {found.impacts} impacts ({found.impacts_per_s:.4g} per second); largest per impact "
        f"{per_impact:.4g}"
    ]  # fmt: skip


def transient_of(args: argparse.Namespace) -> int:
    """Periods of the transient that was asked for, or the usual number."""
    return TRANSIENT if args.transient is None else int(args.transient)


def section_of(scenario: Scenario, args: argparse.Namespace) -> tuple[pd.DataFrame, Any, list[str]]:
    """States once per period."""
    from analysis.dynamics.orbit_figures import section_figure
    from ovines.core.orbits.section import section
    from ovines.simulations.orbit_tables import section_table

    shown = pair(states_of(args))
    states = section(scenario, args.periods or 200, transient_of(args))
    return section_table(states), section_figure(states, shown), [f"{states.shape[1]} states, once per period"]


def bifurcation_of(scenario: Scenario, args: argparse.Namespace) -> tuple[pd.DataFrame, Any, list[str]]:
    """Sections over a number, each run from where the last one ended."""
    from analysis.dynamics.orbit_figures import bifurcation_figure
    from ovines.core.orbits.period import CHANGED
    from ovines.core.orbits.section import bifurcation
    from ovines.simulations.orbit_tables import section_table

    ((over, values),) = ranges_of(args, 1, CHANGED)
    shown = states_of(args)[0]
    found = bifurcation(scenario, over, values, args.periods or 200, transient_of(args))
    words = f"{len(values)} values, {found.impacts.min():.3g} to {found.impacts.max():.3g} impacts per period"
    return section_table(found.states, over, found.values), bifurcation_figure(found, shown), [words]


def follow_of(scenario: Scenario, args: argparse.Namespace) -> tuple[pd.DataFrame, Any, list[str]]:
    """A periodic orbit, both ways from the scenario's own value."""
    from analysis.dynamics.orbit_figures import branch_figure
    from ovines.core.orbits.period import CHANGED
    from ovines.core.orbits.periodic import follow_orbit
    from ovines.simulations.orbit_tables import branch_table

    ((over, values),) = ranges_of(args, 1, CHANGED)
    step = 1.0 / max(len(values) - 1, 1)
    found = follow_orbit(scenario, states_of(args), over, (values[0], values[-1]), args.periods or 1, step)
    stable = sum(orbit.stable for orbit in found.orbits)
    reached = [found.orbits[place].value for place in (0, -1)]
    return branch_table(found), branch_figure(found), [
        f"{len(found.orbits)} orbits, {stable} stable; {over} {reached[0]:.6g} ({found.ends[0]}) to {reached[1]:.6g} "
        f"({found.ends[1]})"
    ]  # fmt: skip


def basins_of(scenario: Scenario, args: argparse.Namespace) -> tuple[pd.DataFrame, Any, list[str]]:
    """A map of starts."""
    from tqdm import tqdm

    from analysis.dynamics.orbit_figures import basins_figure
    from ovines.core.orbits.section import basins
    from ovines.io.run_log import bars_disabled
    from ovines.simulations.orbit_tables import basin_table

    x, y = ranges_of(args, 2, STATES)
    with tqdm(total=len(x[1]) * len(y[1]), disable=bars_disabled(), unit="run") as bar:
        found = basins(
            scenario, x, y, transient_of(args), args.periods or 8, states_of(args), workers=Workers(progress=bar.update)
        )
    lines = [
        f"{'period ' + str(one.period) if one.period else 'no period'}: {100 * one.share:.3g} % of the starts, "
        f"{one.impacts:.3g} impacts per period of the drive"
        for one in found.attractors
    ]
    return basin_table(found), basins_figure(found), lines


def pair(names: list[str]) -> tuple[str, str]:
    """Two names, for the axes of a figure."""
    if len(names) != 2:
        raise InputError(f"--states {','.join(names)}", "two states, for the figure's axes", "give two names")
    return names[0], names[1]


Answer = Callable[[Scenario, argparse.Namespace], tuple[pd.DataFrame, Any, list[str]]]
QUESTIONS: dict[str, tuple[str, Answer]] = {
    "sensitivities": ("sensitivities", sensitivities_of),
    "lyapunov": ("lyapunov", lyapunov_of),
    "section": ("section", section_of),
    "bifurcation": ("section", bifurcation_of),
    "follow": ("orbits", follow_of),
    "basins": ("basins", basins_of),
}
