"""First screen of gap.html: what was found, how far the gap shrinks with it, in a card each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from analysis.gap.diagnose import Diagnosis
from analysis.gap.ladder import Ladder
from analysis.gap.page.figures.measured import direct_shrinkage
from analysis.gap.page.tables import chance
from analysis.gap.page.words import STAGES, bare, meaning, parameter_words, plain, shown_interval
from analysis.gap.thresholds import EQUIVALENT
from analysis.report.numbers import MISSING, percent, with_unit
from analysis.report.page import Page, Status

#: effects whose size the recalibrated model fits anyway, as placement of the markers
REFITTED = ("wall_centre_offset", "mass_centre_offset", "centre_marker_offset", "stated_radius")


def lead(summary: dict[str, Any]) -> str:
    """The verdict in a sentence or two."""
    said = [f"{plain(e)}: {meaning(e)}" if meaning(e) else plain(e) for e in summary["effects"]]
    sentences = [f"{'; '.join(said)}."] if said else []
    if summary["left"]:
        left = summary["left"][0]
        sentences.append(
            f"There is structure {STAGES.get(left['stage'], left['stage'])} that no effect of the library explains: it "
            f"goes with {bare(left['goes_with'])}."
        )
    if not sentences:
        return (
            "The nominal model, with its parameters refitted, explains these data; no effect of the library is needed."
        )
    return " ".join(sentences)


def facts(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """What the verdict stands on: runs, flights, time, impacts, nominal model."""
    runs = diagnosis.ladder.series.runs
    time = diagnosis.summary["time"]
    facts = [
        ("Runs", str(len(runs))),
        ("Flights", str(sum(len(r.flights) for r in runs))),
        ("Free flight", with_unit(time["free_flight_s"], "s")),
    ]
    if diagnosis.ladder.impacts.fitted is not None:
        facts.append(("Impacts used", str(len(diagnosis.ladder.impacts.fitted.data))))
    model = diagnosis.ladder.series.recordings[0].model
    if model is not None:
        facts.append(("Nominal model", ", ".join(plain(e).lower() for e in model.effects) or "no effects"))
    return facts


def verdict_card(page: Page, diagnosis: Diagnosis) -> None:
    """What causes the gap, with parameters and their intervals."""
    summary, ladder = diagnosis.summary, diagnosis.ladder
    verdict = summary["verdict"]
    if verdict == "none":
        _nothing_card(page, ladder)
        return
    details = []
    if summary["effects"]:
        details.append(f"It lies {STAGES.get(ladder.causes[0].stage, ladder.causes[0].stage)}.")
    for effect, values in summary["parameters"].items():
        details += [
            f"{_sentence(parameter_words(k))} {shown_interval(k, v['low'], v['high'])} (90 %)."
            if len(summary["effects"]) == 1
            else f"{plain(effect)}, {parameter_words(k)}: {shown_interval(k, v['low'], v['high'])} (90 %)."
            for k, v in values.items()
        ]
    if summary["effects"]:
        others = [plain(e) for e in summary["equivalent"] if e not in summary["effects"]]
        details.append(
            f"These data cannot tell it from: {', '.join(others)}."
            if others
            else "No other effect of the library fits these data as well."
        )
    details += [
        f"{plain(one.effect)}: a formula that is no effect's fits as well, so do not rely on the form outside the "
        f"speeds, places and times recorded: {one.instead.formula}."
        for one in ladder.causes
        if one.instead is not None and one.instead.more > -EQUIVALENT
    ]
    if summary["left"]:
        details.append(
            "Besides, something is left that the library has no name for."
            if summary["effects"]
            else "Something is there that the library has no name for."
        )
    details += [
        f"{left['stage'].capitalize()}, {left['coordinate']}: goes with {bare(left['goes_with'])}; "
        f"{left['times_negligible']:.1f} times what is negligible, by chance {chance(left['p'])}."
        for left in summary["left"][:4]
    ]
    named = [plain(e) for e in summary["effects"]]
    answer = " and ".join([*named, *(["something unknown"] if summary["left"] else [])]) if named else "Unknown"
    page.add_card("What causes the gap?", answer, "bad" if summary["left"] else "caution", details)


def _nothing_card(page: Page, ladder: Ladder) -> None:
    blind = [*ladder.measurement.notes]
    if ladder.impacts.fitted is None:
        blind.append("fewer than eight impacts could be used: wall and contact law were not judged")
    if len(ladder.series.runs) == 1:
        blind.append("one run: nothing could be held out")
    page.add_card(
        "What causes the gap?",
        "No effect found",
        "caution" if blind else "good",
        [
            "Every test and every probe stays below what is negligible or what noise makes.",
            *(f"{b[0].upper()}{b[1:]}." for b in blind),
            "The smallest sizes that would have been seen stand at the end.",
        ],
    )


def _sentence(words: str) -> str:
    """First letter large, but the name of a coordinate stays as it is."""
    return words if len(words) == 1 else words[0].upper() + words[1:]


def gap_card(page: Page, diagnosis: Diagnosis) -> None:
    """How far the gap shrinks."""
    summary = diagnosis.summary
    gap, causes = summary["gap"], diagnosis.ladder.causes
    quantity, scale, unit, words = (
        ("impact_m_per_s", 1e3, "mm/s", "velocity after an impact")
        if causes and causes[0].stage == "impact"
        else ("flight_m", 1e3, "mm", "position along a flight")
    )
    value = {
        k: with_unit(scale * gap[k][quantity], unit) if gap.get(k) and gap[k].get(quantity) is not None else MISSING
        for k in ("as_given", "recalibrated", "with_effect", "noise_floor")
    }
    errors = f"{value['recalibrated']} RMS recalibrated, "
    if summary["effects"]:
        errors += f"{value['with_effect']} with {'it' if len(causes) == 1 else 'all named'}, "
    details = [f"Held-out {words}: {errors}noise floor {value['noise_floor']}."]
    if value["as_given"] != MISSING:
        details.append(f"As given it was {value['as_given']}.")
    if summary["effects"]:
        shrinkage = gap["shrinkage"]
        status: Status = "good" if shrinkage > 0.8 else ("caution" if shrinkage > 0.4 else "bad")
        if summary["left"]:
            status = "bad"
        answer = (
            f"By {percent(shrinkage)} ({percent(gap['shrinkage_low']).removesuffix(' %')} to "
            f"{percent(gap['shrinkage_high'])})"
        )
        shares = [f"{plain(e)} {percent(one['shrinkage'])}" for e, one in gap["by_effect"].items()]
        details = [
            *([f"Each one's part: {', '.join(shares)}."] if len(shares) > 1 else []),
            *(f"{one}." for one in _by_laws(summary["laws"])),
            *_own_residual(diagnosis),
            *details,
            "Share of the squared error above the floor, in units of the noise, over flights, impacts, wall and "
            "cameras; 90 % interval over runs.",
        ]
        page.add_card("How far does the gap shrink with it?", answer, status, details)
        return
    if summary["verdict"] == "unknown":
        laws = summary["laws"]
        if laws:
            parts = [f"{closed}: {one['formula']}." for closed, one in zip(_by_laws(laws), laws, strict=True)]
            answer = f"By {percent(laws[0]['shrinkage'])}, with a law written for it"
            page.add_card("How far does the gap shrink?", answer, "caution", [*parts, *details])
            return
        page.add_card("How far does the gap shrink?", "Not yet: nothing with a name closes it", "bad", details)
    elif _above_floor(gap, quantity):
        page.add_card(
            "How far does the gap shrink?",
            "Above the floor, but nothing accepted",
            "caution",
            [
                *details,
                "What is left has neither a name nor a shape that holds in most runs: look at the figures, and record "
                "more.",
            ],
        )
    else:
        page.add_card("How far does the gap shrink?", "Nothing left to shrink", "good", details)


def _by_laws(laws: Sequence[dict[str, Any]]) -> list[str]:
    """What each written law closes of its stage."""
    return [
        f"The law of the {one['stage']} closes {percent(one['shrinkage'])} "
        f"({percent(one['shrinkage_low']).removesuffix(' %')} to {percent(one['shrinkage_high'])}) of the squared "
        "error above the floor there, on runs held out"
        for one in laws
    ]


def _above_floor(gap: dict[str, Any], quantity: str) -> bool:
    """More than a third above what no model can predict."""
    value, floor = ((gap.get(k) or {}).get(quantity) for k in ("recalibrated", "noise_floor"))
    return value is not None and floor is not None and value > 4 / 3 * floor


def _own_residual(diagnosis: Diagnosis) -> list[str]:
    """Of effects that leave flights and impacts alone (measurement, a centre that is refitted anyway): what their own
    residual was and is.
    """
    said = []
    for cause in diagnosis.ladder.causes:
        own = direct_shrinkage(diagnosis.ladder, cause.effect)
        if own is not None:
            name, before, after, unit = own
            said.append(
                f"{name.capitalize()}: {with_unit(before, unit)} RMS as measured, {with_unit(after, unit)} corrected."
            )
    return said
