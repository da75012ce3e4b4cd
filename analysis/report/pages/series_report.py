"""``report.html`` of a series: the thesis' appendix as a table, the trend over the tests, one paragraph in
words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pandas as pd

from analysis.checks.recording import verdict
from analysis.checks.series import AGREEMENT_P as TREND_P
from analysis.checks.series import series_checks
from analysis.checks.series import trends as trends_of
from analysis.figures.series import parameter_trends
from analysis.report.numbers import MISSING, interval, percent, value_with_digits, value_with_sd, with_unit
from analysis.report.page import Page, Status, pages_beside, source_of
from analysis.report.parameters import PRINCIPAL, paragraph, parameter_rows, quantity, statement
from analysis.report.results import Results, identification_notes, read_results
from analysis.report.verdict import actions_of_notes, checks_table, seen_share
from analysis.statistics.trend import Trend
from ovines.recording import Recording
from ovines.tables import read_table


def write_series_report(
    results_folder: Path, recordings: Sequence[Recording], name: str, save_figures: bool = False
) -> Path:
    """Write ``report.html`` of a series whose recordings' results lie in the folders ``results_folder /
    recording.folder.name``.

    An ``identification.parquet`` in ``results_folder`` itself is the joint identification over all runs.  A
    recording without results is a row that says so.
    """
    folder = Path(results_folder)
    page = series_page(
        [read_results(folder / recording.folder.name, recording) for recording in recordings],
        name,
        _joint(folder / "identification.parquet"),
        identification_notes(folder / "identification.parquet"),
    )
    page.source = source_of(recordings[0].folder.resolve().parent, folder) if recordings else ""
    page.links = pages_beside(folder, ("gap.html",))
    if save_figures:
        page.save_figures(folder / "figures")
    return page.write(folder / "report.html")


def _page_of(result: Results) -> str:
    """The way from the series' page to a recording's; "" where it has none."""
    name = result.folder.name
    return f"{quote(name)}/report.html" if (result.folder / "report.html").is_file() else ""


def _joint(path: Path) -> pd.DataFrame | None:
    return read_table(path, "identification") if path.is_file() else None


def tests_of(results: Sequence[Results]) -> pd.DataFrame:
    """One row per recording: name, drive, impacts, share of frames seen, and each parameter with sd and
    interval (NaN: unknown).
    """
    rows = []
    for result in results:
        excitation, impacts = result.recording.excitation, result.get("impacts")
        row = {
            "test": result.recording.name,
            "frequency_hz": np.nan if excitation is None else excitation.frequency_hz,
            "acceleration_g": np.nan if excitation is None else excitation.acceleration_g,
            "impacts": np.nan if result.get("motion") is None else 0 if impacts is None else len(impacts),
            "seen": seen_share(result),
            "log": ", ".join(text for _, text in log.pairs) if (log := result.recording.settings.log) else "",
        }
        for name in PRINCIPAL:
            row[name], row[f"{name}_sd"], row[f"{name}_low"], row[f"{name}_high"] = result.parameter(name)
        rows.append(row)
    table = pd.DataFrame(rows)
    numeric = [column for column in table.columns if column not in ("test", "log")]
    return table.astype(dict.fromkeys(numeric, float))


def series_page(
    results: Sequence[Results], name: str, joint: pd.DataFrame | None = None, notes: Sequence[str] = ()
) -> Page:
    """The page of a series: parameters over its tests, ``joint`` ones of all together with the ``notes`` on them."""
    tests = tests_of(results)
    identifications = [result.get("identification") for result in results]
    trends = {p: _with_shared_errors(trend, joint, p) for p, trend in trends_of(identifications).items()}
    page = Page(
        name,
        "Series report",
        f"{len(tests)} recordings, {int(np.nansum(tests['impacts']))} impacts.",
        footer="Each recording has a report of its own in its folder.",
    )
    checks = series_checks(_called(tests["test"]), [result.get("checks") for result in results], identifications, notes)
    _add_verdict(page, tests, trends, joint, checks)
    page.actions.extend(actions_of_notes(notes))
    if not page.actions:
        page.actions.append("Nothing has to be done.")
    section = page.add_section("Checks", "checks")
    if len(checks):
        checks_table(section, checks)
    else:
        section.add_missing("checks", "No recording was identified.")
    _add_parameters(page, tests, trends, joint, notes)
    section = page.add_section("Tests", "tests")
    logged = bool((tests["log"] != "").any())
    section.add_table(
        (
            "test",
            "drive",
            "NES seen",
            "impacts",
            *(quantity(p).symbol for p in PRINCIPAL),
            *(("log",) if logged else ()),
        ),
        [
            (*_test_row(row, len(_shared_words(tests["test"]))), *((row["log"],) if logged else ()))
            for _, row in tests.iterrows()
        ],
        "As the thesis' Tables 18 and 20; ε restitution, μ_c wall friction, β₀ tangential restitution, "
        "μ_s floor friction; in parentheses the sd of the last digits.",
        links=[_page_of(result) for result in results],
    )
    return page


def _add_parameters(
    page: Page, tests: pd.DataFrame, trends: dict[str, Trend], joint: pd.DataFrame | None, notes: Sequence[str]
) -> None:
    section = page.add_section("Parameters over all tests", "parameters")
    if joint is not None:
        section.add_text(paragraph(joint))
        for note in notes:
            section.add_note(note, "caution")
        section.add_table(
            ("parameter", "symbol", "value ± sd", "90 % interval", "impacts"),
            [row[:5] for row in parameter_rows(joint, None)],
            "Joint maximum likelihood over all impacts and tests.",
            (0, 1),
        )
    section.add_text(_in_words(trends, len(tests)))
    section.add_table(
        (
            "parameter",
            "symbol",
            "weighted mean ± sd",
            "change per test",
            "p (no trend)",
            "p (one value)",
            "tests",
        ),
        [_trend_row(p, trend) for p, trend in trends.items()],
        "Mean and straight trend of the single tests, weighted by their sd; sd are enlarged where tests "
        "scatter more than they should, and a mean's is no less than that of the joint estimate: errors that "
        "all tests share (a lens residual, a length) do not average out.",
        (0, 1),
    )
    shown = [
        (p, quantity(p).title, 1.0)
        for p in PRINCIPAL
        if np.isfinite(tests[[p, f"{p}_low", f"{p}_high"]].to_numpy()).any()
    ]
    if shown:
        section.add_figure(
            "trends",
            partial(parameter_trends, tests, shown),
            "Each test's parameters with sd, in the order of the tests. A slope would be wear or heating.",
            "Identified parameters over the tests of the series.",
        )
    else:
        section.add_missing("trend over the series", "No test determined a parameter.")


def _add_verdict(
    page: Page, tests: pd.DataFrame, trends: dict[str, Trend], joint: pd.DataFrame | None, checks: pd.DataFrame
) -> None:
    done = int(np.isfinite(tests["impacts"]).sum())
    with_impacts = int((tests["impacts"] > 0).sum())
    lost = [str(name) for name in tests.loc[~np.isfinite(tests["impacts"]), "test"]]
    page.add_card(
        "Did it work?",
        "Yes" if done == len(tests) else f"{done} of {len(tests)} recordings",
        "good" if done == len(tests) else "caution" if done else "bad",
        [f"Motion from {done} of {len(tests)} recordings, impacts in {with_impacts}."],
    )
    details: list[str] = []
    word, spoiled, steps = verdict(checks)
    drifting = {p: trend for p, trend in trends.items() if trend.p_slope < TREND_P}
    for p in PRINCIPAL:
        row = None if joint is None else joint[joint["parameter"] == p]
        if row is not None and len(row):
            details.append(statement(row.iloc[0]) + (", not to be used" if p in spoiled else ""))
        elif p in trends:
            mean = value_with_sd(trends[p].mean, trends[p].mean_sd)
            details.append(
                f"{quantity(p).title} {quantity(p).symbol} = {mean}" + (", not to be used" if p in spoiled else "")
            )
    if spoiled:
        details.insert(0, f"Do not use: {', '.join(quantity(name).title.lower() for name in spoiled)}.")
    details += checks.loc[checks["state"] == "fails", "found"].tolist()
    status: Status = (
        "neutral"
        if not details
        else "good"
        if word == "Good" and not drifting
        else "bad"
        if word == "Do not use"
        else "caution"
    )
    page.add_card(
        "How good is it?",
        "No parameter" if not details else "Parameters drift" if word == "Good" and drifting else word,
        status,
        details,
    )
    page.actions.extend(steps)
    if lost:
        page.actions.append(f"Without motion: {', '.join(lost)}. `ovines check` says why.")
    for p, trend in drifting.items():
        page.actions.append(
            f"{quantity(p).title} changes by {value_with_sd(trend.slope, trend.slope_sd)} per test: look for "
            "wear, heating or a level that changed with the order of tests; repeat an early test at the end."
        )
    page.actions.extend(
        f"{quantity(p).title} {quantity(p).symbol} is determined by fewer than two tests."
        for p in PRINCIPAL
        if details and p not in trends and joint is None
    )


def _with_shared_errors(trend: Trend, joint: pd.DataFrame | None, name: str) -> Trend:
    """``trend`` with a mean no surer than the joint estimate, which holds what all tests have in common."""
    sd = [] if joint is None else joint.loc[joint["parameter"] == name, "sd"].to_numpy(float)
    return replace(trend, mean_sd=float(np.fmax(trend.mean_sd, sd[0]))) if len(sd) else trend


def _in_words(trends: dict[str, Trend], tests: int) -> str:
    """One paragraph: each parameter's mean, whether the tests agree on it, and whether it drifts."""
    sentences = []
    for name, trend in trends.items():
        mean = value_with_sd(trend.mean, trend.mean_sd)
        agree = "agree within their sd" if trend.p_scatter > TREND_P else "scatter more than their sd explain"
        drift = "no trend is seen"
        if trend.p_slope < TREND_P:
            drift = f"it changes by {value_with_sd(trend.slope, trend.slope_sd)} per test"
        elif not np.isfinite(trend.p_slope):
            drift = "two tests show no trend"
        sentences.append(
            f"{quantity(name).title} {quantity(name).symbol} = {mean}: {trend.n} of {tests} tests determine "
            f"it and {agree}; {drift}."
        )
    return " ".join(sentences) or "No parameter was determined by two or more tests."


def _trend_row(name: str, trend: Trend) -> tuple[str, ...]:
    return (
        quantity(name).title,
        quantity(name).symbol,
        value_with_sd(trend.mean, trend.mean_sd),
        value_with_sd(trend.slope, trend.slope_sd),
        with_unit(trend.p_slope, digits=2),
        with_unit(trend.p_scatter, digits=2),
        str(trend.n),
    )


def _called(names: pd.Series) -> list[str]:
    """The tests' names; numbers where two are called alike."""
    every = [str(name) for name in names]
    return every if len(set(every)) == len(every) else [f"test {k}" for k in range(1, len(every) + 1)]


def _shared_words(names: pd.Series) -> str:
    """The words that all tests' names begin with, which need not stand in every row; none of a single test's."""
    if len(names) < 2:
        return ""
    # What the first and the last in order begin with alike, all begin with.
    first, last = (str(name) for name in (names.astype(str).min(), names.astype(str).max()))
    alike = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    return first[: first[:alike].rfind(" ") + 1]


def _test_row(row: pd.Series, shared: int = 0) -> tuple[str, ...]:
    cells = []
    for name in PRINCIPAL:
        if np.isfinite(row[name]):
            cells.append(value_with_digits(row[name], row[f"{name}_sd"]))
        else:
            cells.append(interval(row[f"{name}_low"], row[f"{name}_high"]))
    return (
        str(row["test"])[shared:],
        f"{with_unit(row['frequency_hz'], 'Hz')}, {with_unit(row['acceleration_g'], 'g', 2)}",
        percent(row["seen"]),
        MISSING if not np.isfinite(row["impacts"]) else str(int(row["impacts"])),
        *cells,
    )
