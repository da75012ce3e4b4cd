"""``plan.html``: how surely the day will determine each parameter, and which setting would help most."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from analysis.figures.style import BLUE, GREY, label, new_figure
from analysis.plan.day import Settings
from analysis.plan.predict import AS_STATED, MAIN, days_differ, ranked
from analysis.report.numbers import MISSING, length, percent, with_unit
from analysis.report.page import Page, source_of
from analysis.report.parameters import quantity

# Where the sd of one of the four is above this share of its value's full range (0 to 1), it is said to be unsure.
UNSURE_SD = 0.02
MOSTLY = 0.9  # share of starts that give a usable run, from which nothing is said
LEAST_DAYS = 0.99  # share of days that must determine a parameter
FARTHEST = 5.0  # gains beyond it, or below one in so many, are arrows at the figure's edge


def settings_in_words(settings: Settings) -> list[tuple[str, str]]:
    """Label and value of each setting."""
    noise = settings.noise
    nes, host = (float(np.sqrt(np.mean(np.square(one)))) for one in (noise.nes_m, noise.host_m))
    return [
        ("Drive", f"{settings.level_g:g} g at {settings.frequency_hz:g} Hz"),
        ("Runs", f"{settings.runs} of {settings.duration_s:g} s"),
        ("Frame rate", f"{settings.frame_rate_hz:g} frames/s"),
        ("Noise of the NES", f"{length(nes)}, {with_unit(1e3 * noise.nes_rad, 'mrad', 2)}"),
        ("Noise of the Host", length(host)),
    ]


def plan_lines(plan: pd.DataFrame) -> list[str]:
    """What the terminal prints: each parameter with its sd, then the settings, best first."""
    stated = plan[plan["setting"] == AS_STATED]
    lines = [
        f"impacts of a day: {stated['impacts'].iloc[0]:.0f}",
        *rolling_in_words(stated),
        "predicted standard deviations (smallest to largest of the days):",
    ]
    width = max(len(quantity(name).title) for name in stated["parameter"])
    lines += [f"  {quantity(row['parameter']).title:<{width}}  {sd_in_words(row)}" for _, row in stated.iterrows()]
    if plan["setting"].nunique() == 1:
        return lines
    table = ranked(plan)
    lines.append("what would help (how many times smaller the sds of the four would be):")
    wide = max(map(len, table.index))
    for words, row in table.iterrows():
        each = ", ".join(f"{quantity(n).title.lower()} {_gain(row[n])}" for n in MAIN if n in row)
        lines.append(f"  {words!s:<{wide}}  {_gain(row['gain'])}  ({each})")
    lines.append(differ_in_words(plan))
    return lines


def rolling_in_words(stated: pd.DataFrame) -> list[str]:
    """Where the disk soon rolls along the wall: that runs have to be repeated, or end early."""
    usable, filmed_s = (float(stated[name].iloc[0]) for name in ("usable", "filmed_s"))
    if usable > MOSTLY:
        return []
    return [
        f"only {percent(usable)} of the starts give a run with ten impacts: in the others the disk soon rolls along "
        f"the wall, and they are repeated; filmed until then, {filmed_s:.2g} s a run"
    ]


def differ_in_words(plan: pd.DataFrame) -> str:
    """How far two days differ by chance."""
    differ = days_differ(plan)
    if not np.isfinite(differ) or differ == 1.0:
        return "one day alone: how far days differ by chance is not known; --days 3 tells"
    return f"two days with the same settings differ by a factor {differ:.2f} themselves: smaller gains mean nothing"


def sd_in_words(row: pd.Series) -> str:
    """``0.0012 (0.0010 to 0.0014)``, or that the days do not determine it."""
    if row["determined"] == 0.0:
        return "not determined"
    sd, low, high = _cells(row["parameter"], row)
    words = f"{sd} ({low} to {high})"
    return words if row["determined"] >= LEAST_DAYS else f"{words}, on {percent(row['determined'])} of the days"


def further_day_in_words(days: int) -> str:
    """How often the range from the smallest day to the largest holds one more day's sd: all orders of days are equally
    likely, and in two of ``days + 1`` places the new one is outside.
    """
    if days < 2:
        return "How far days differ by chance, one day cannot tell."
    return f"A further day's lies from the smallest to the largest with {percent((days - 1) / (days + 1))}."


def plan_page(name: str, settings: Settings, plan: pd.DataFrame, days: int, assumed: Sequence[str]) -> Page:
    """The whole page."""
    page = Page(
        name,
        "Plan of a test day",
        "Days with these settings were simulated, seen with the noise of these markers, and identified as measured "
        "ones are.",
        settings_in_words(settings),
    )
    stated = plan[plan["setting"] == AS_STATED].set_index("parameter")
    _add_cards(page, plan, stated)
    section = page.add_section("How surely each parameter will be known", "parameters")
    section.add_table(
        ("parameter", "standard deviation", "smallest day", "largest day", "days that determine it"),
        [
            (quantity(name).title, *_cells(name, row), percent(row["determined"]))
            for name, row in stated.iterrows()
        ],
        f"Of {days} simulated day{'s'[: days != 1]}; {stated['impacts'].iloc[0]:.0f} impacts each in the median. "
        + further_day_in_words(days),
    )  # fmt: skip
    for words in rolling_in_words(plan[plan["setting"] == AS_STATED]):
        section.add_note(words[0].upper() + words[1:] + ".", "caution")
    if plan["setting"].nunique() > 1:
        _add_settings(page, plan)
    section = page.add_section("What was assumed", "assumed")
    section.add_list(assumed or ["Nothing: all was stated."])
    section.add_text(
        "The rig is taken to follow the nominal law with the effects that `[model]` names. A cause that nobody "
        "knows of, or a lens that is not calibrated well, is not in these numbers."
    )
    return page


def _cells(name: object, row: pd.Series) -> tuple[str, str, str]:
    what = quantity(str(name))
    columns = ("sd", "sd_low", "sd_high")
    if what.unit in ("mm", "µm"):  # finer than the unit of the value itself
        sd, low, high = (length(row[one]) for one in columns)
    else:
        sd, low, high = (with_unit(what.scale * row[one], what.unit, 2) for one in columns)
    return sd, low, high


def _gain(gain: float) -> str:
    return with_unit(gain, digits=2) if not gain < 0.1 else "below 0.1"


def _add_cards(page: Page, plan: pd.DataFrame, stated: pd.DataFrame) -> None:
    main = stated.reindex(list(MAIN))
    open_ones = [name for name in MAIN if not main.loc[name, "determined"] >= LEAST_DAYS]
    unsure = [name for name in MAIN if name not in open_ones and main.loc[name, "sd"] > UNSURE_SD]
    answer = "Not all" if open_ones else "Roughly" if unsure else "Yes"
    details = [
        f"{quantity(name).title}: "
        + (f"± {with_unit(main.loc[name, 'sd'], digits=2)}" if np.isfinite(main.loc[name, "sd"]) else MISSING)
        + (" on some days only" if name in open_ones and np.isfinite(main.loc[name, "sd"]) else "")
        for name in MAIN
    ]
    page.add_card(
        "Will this day determine the rig?", answer, "bad" if open_ones else "caution" if unsure else "good", details
    )
    if plan["setting"].nunique() == 1:
        return
    table, differ = ranked(plan), days_differ(plan)
    best = str(table.index[0])
    gain = float(table["gain"].iloc[0])
    if gain <= (differ if np.isfinite(differ) else 1.0):
        page.add_card("What would help most?", "Nothing tried", "neutral", [differ_in_words(plan).capitalize() + "."])
        return
    page.add_card(
        "What would help most?",
        best.capitalize(),
        "neutral",
        [f"The four standard deviations shrink {with_unit(gain, digits=2)} times (geometric mean)."]
        + [f"Next: {words}, {with_unit(row['gain'], digits=2)} times." for words, row in table.iloc[1:3].iterrows()],
    )


def _add_settings(page: Page, plan: pd.DataFrame) -> None:
    section = page.add_section("What would help", "settings")
    section.add_figure(
        "plan_settings",
        partial(settings_figure, plan),
        "How many times smaller a standard deviation would be than with the settings as stated (line at 1; left of "
        "it: larger; an arrow: off the scale). The grey band is how far two days with the same settings differ.",
        "Gain of each changed setting for each of the four main parameters.",
    )
    table = ranked(plan)
    section.add_table(
        ("setting", "all four", *(quantity(name).title for name in MAIN if name in table)),
        [
            (str(words), *(_gain(row[name]) for name in ("gain", *MAIN) if name in row))
            for words, row in table.iterrows()
        ],
        "The same in numbers. " + differ_in_words(plan).capitalize() + ".",
    )
    section.add_text("A doubled frame rate is taken to cost no light; halved noise means larger or better lit markers.")


def settings_figure(plan: pd.DataFrame) -> Figure:
    """Gain by setting, a panel per main parameter; best setting on top, what is off the scale as an arrow."""
    table, differ = ranked(plan).iloc[::-1], days_differ(plan)
    names = [name for name in MAIN if name in table]
    rows = -(-len(names) // 2)
    figure, axes = new_figure(
        rows, 2, rows * (0.55 + 0.2 * len(table)) + 0.2, margins_in=(1.75, 0.15, 0.46, 0.32), gap_in=(0.2, 0.42),
        sharey=True, sharex=True,
    )  # fmt: skip
    places = np.arange(len(table))
    for ax, name in zip(axes.flat, names, strict=False):
        if np.isfinite(differ):
            ax.axvspan(1 / differ, differ, color=GREY, alpha=0.18, lw=0)
        ax.axvline(1.0, color=GREY, lw=0.8)
        gain = table[name].to_numpy(float)
        for beyond, mark in ((gain < 1 / FARTHEST, "<"), (gain > FARTHEST, ">")):
            ax.plot(np.clip(gain[beyond], 1 / FARTHEST, FARTHEST), places[beyond], mark, color=BLUE, ms=6)
        inside = (gain >= 1 / FARTHEST) & (gain <= FARTHEST)
        ax.plot(gain[inside], places[inside], "o", color=BLUE, ms=5)
        ax.set_xscale("log")
        label(ax, title=quantity(name).title)
    for ax in axes[-1]:
        label(ax, "times smaller", title=ax.get_title(loc="left"))
    for ax in axes.flat:
        ax.set_xlim(0.9 / FARTHEST, 1.1 * FARTHEST)
        ax.xaxis.set_major_locator(FixedLocator([1 / FARTHEST, 0.5, 1.0, 2.0, FARTHEST]))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes[0, 0].set_yticks(places, [str(words) for words in table.index])
    axes[0, 0].set_ylim(-0.6, len(table) - 0.4)
    return figure


def write_plan(page: Page, folder: Path, recording: Path, save_figures: bool = False) -> Path:
    """Write ``plan.html`` into ``folder`` for the recording in the folder ``recording``."""
    page.source = source_of(recording, folder)
    page.footer = "plan.parquet beside this page has all settings and parameters."
    if save_figures:
        page.save_figures(folder / "figures")
    return page.write(folder / "plan.html")
