"""First screen of gap.html: what was found, how far the gap shrinks with it, in a card each."""

from __future__ import annotations

from typing import Any

from analysis.gap.diagnose import Diagnosis
from analysis.gap.page.figures_measured import direct_shrinkage
from analysis.gap.page.words import STAGES, bare, meaning, parameter_words, plain, shown_interval
from analysis.report.numbers import MISSING, percent, with_unit
from analysis.report.page import Page, Status

#: effects whose size the recalibrated model fits anyway, as placement of the markers
REFITTED = ("wall_centre_offset", "mass_centre_offset", "centre_marker_offset", "stated_radius")


def lead(summary: dict[str, Any]) -> str:
    """The verdict in a sentence."""
    if summary["verdict"] == "effect":
        said = "; ".join(f"{plain(e)}: {meaning(e)}" if meaning(e) else plain(e) for e in summary["effects"])
        return f"{said}."
    if summary["verdict"] == "unknown":
        g = summary["goes_with"][0]
        return (
            f"There is structure {STAGES.get(g['stage'], g['stage'])} that no effect of the library explains: it "
            f"goes with {bare(g['goes_with'])}."
        )
    return "The nominal model, with its parameters refitted, explains these data; no effect of the library is needed."


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
    if verdict == "effect":
        details = [f"It lies {STAGES.get(summary['stage'], summary['stage'])}."]
        for effect, values in summary["parameters"].items():
            details += [
                f"{_sentence(parameter_words(k))} {shown_interval(k, v['low'], v['high'])} (90 %)."
                if len(summary["effects"]) == 1
                else f"{plain(effect)}, {parameter_words(k)}: {shown_interval(k, v['low'], v['high'])} (90 %)."
                for k, v in values.items()
            ]
        others = [plain(e) for e in summary["equivalent"] if e not in summary["effects"]]
        details.append(
            f"These data cannot tell it from: {', '.join(others)}."
            if others
            else "No other effect of the library fits these data as well."
        )
        page.add_card("What causes the gap?", " and ".join(plain(e) for e in summary["effects"]), "caution", details)
    elif verdict == "unknown":
        details = [
            f"{g['stage'].capitalize()}, {g['coordinate']}: goes with {bare(g['goes_with'])}; "
            f"{g['times_negligible']:.1f} times what is negligible."
            for g in summary["goes_with"][:4]
        ]
        page.add_card(
            "What causes the gap?", "Unknown", "bad", ["Something is there that the library has no name for.", *details]
        )
    else:
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
    gap = summary["gap"]
    quantity, scale, unit, words = (
        ("impact_m_per_s", 1e3, "mm/s", "velocity after an impact")
        if gap.get("shrinkage_of") == "impact_m_per_s"
        else ("flight_m", 1e3, "mm", "position along a flight")
    )
    value = {
        k: with_unit(scale * gap[k][quantity], unit) if gap.get(k) and gap[k].get(quantity) is not None else MISSING
        for k in ("as_given", "recalibrated", "with_effect", "noise_floor")
    }
    contact = gap.get("contact_m")
    details = (
        []
        if contact is None
        else [
            (
                f"Distance from the wall at impacts: {with_unit(1e3 * contact['without_effect'], 'mm')} RMS without "
                f"the effect, "
                f"{with_unit(1e3 * contact['with_effect'], 'mm')} with it; the shrinkage is of this."
            )
        ]
    )
    details += [
        f"Held-out {words}: {value['recalibrated']} RMS recalibrated, {value['with_effect']} with the effect, noise "
        f"floor {value['noise_floor']}."
    ]
    if value["as_given"] != MISSING:
        details.append(f"As given it was {value['as_given']}.")
    if summary["verdict"] == "effect":
        shrinkage = gap["shrinkage"]
        if gap["recalibrated"] == gap["with_effect"] and (
            summary["stage"] == "measurement" or summary["effects"][0] in REFITTED
        ):
            _corrected_card(page, diagnosis, details)
            return
        status: Status = "good" if shrinkage > 0.8 else ("caution" if shrinkage > 0.4 else "bad")
        answer = (
            f"By {percent(shrinkage)} ({percent(gap['shrinkage_low']).removesuffix(' %')} to "
            f"{percent(gap['shrinkage_high'])})"
        ).replace(" %", " %")
        page.add_card(
            "How far does the gap shrink with it?",
            answer,
            status,
            [*details, "Share of the squared gap above the floor; 90 % interval over runs."],
        )
        return
    details[0] = f"Held-out {words}: {value['recalibrated']} RMS recalibrated, noise floor {value['noise_floor']}."
    if summary["verdict"] == "unknown":
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


def _above_floor(gap: dict[str, Any], quantity: str) -> bool:
    """More than a third above what no model can predict."""
    value, floor = ((gap.get(k) or {}).get(quantity) for k in ("recalibrated", "noise_floor"))
    return value is not None and floor is not None and value > 4 / 3 * floor


def _corrected_card(page: Page, diagnosis: Diagnosis, details: list[str]) -> None:
    """An effect that leaves the predictions alone (measurement, a centre that is refitted anyway): what its own
    residual was and is.
    """
    own = direct_shrinkage(diagnosis.ladder, diagnosis.summary["effects"][0])
    said = []
    if own is not None:
        name, before, after, unit = own
        said.append(
            f"{name.capitalize()}: {with_unit(before, unit)} RMS as measured, {with_unit(after, unit)} corrected."
        )
    measured = diagnosis.summary["stage"] == "measurement"
    page.add_card(
        "How far does the gap shrink with it?",
        "Taken out of the data" if measured else "Already in the refitted model",
        "good",
        [
            *said,
            "The predictions below already stand on the corrected data, so they are the same with and without it."
            if measured
            else "The recalibrated model fits this centre already, so the predictions are the same with and without "
            "it.",
            *details,
        ],
    )
