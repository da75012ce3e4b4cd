"""The residuals that a finding is about, before and after: the evidence of gap.html."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from matplotlib.figure import Figure

from analysis.gap.diagnose import Diagnosis
from analysis.gap.page.figures.drive import drive_figure
from analysis.gap.page.figures.flights import flight_panels
from analysis.gap.page.figures.impacts import impact_panels, law_figure, overview_panels
from analysis.gap.page.figures.measured import ground_figure, layout_figure, measured_figure
from analysis.gap.page.figures.panels import residual_panels
from analysis.gap.page.figures.rigid import rigid_figure
from analysis.gap.page.first_screen import REFITTED
from analysis.gap.page.tables import chance
from analysis.gap.page.words import bare, plain
from analysis.report.page import Page, Section

#: effects that the layout's figure shows
CENTRES = ("centre_marker_offset", "length_scale_error")


def evidence_section(page: Page, diagnosis: Diagnosis) -> None:
    """The residuals behind the verdict: of the named effects, of the structure, or of everything looked at for
    nothing.
    """
    summary, ladder = diagnosis.summary, diagnosis.ladder
    section = page.add_section("The evidence", "evidence")
    if summary["verdict"] == "none":
        section.add_text(
            "Nothing was found, so here is what was looked at: the flights' and the impacts' residuals of the "
            "recalibrated nominal model. "
            "A curve that leaves zero by more than its bars would contradict the verdict."
        )
        flight_evidence(section, diagnosis, "")
        impact_overview(section, diagnosis)
        return
    several = len(ladder.causes) + len(summary["left"]) > 1
    for cause in ladder.causes:
        if several:
            section.add_heading(plain(cause.effect))
        _evidence(section, diagnosis, cause.effect, cause.stage, cause.coordinate)
    if not summary["left"]:
        return
    if ladder.causes:
        section.add_heading("What is left")
    section.add_text(
        "Structure that nothing in the library explains, strongest first. The figures show each residual against "
        "what it goes with."
    )
    section.add_table(
        ("stage", "phase", "coordinate", "goes with", "times negligible", "by chance"),
        [
            (
                left["stage"],
                left["phase"],
                left["coordinate"],
                bare(left["goes_with"]),
                f"{left['times_negligible']:.1f}",
                chance(left["p"]),
            )
            for left in summary["left"]
        ],
        text_columns=(0, 1, 2, 3, 5),
    )
    for left in summary["left"]:
        if "runs" in left:
            _each_run(section, left["runs"])
    shown: set[tuple[str, str]] = set()
    for left in summary["left"]:
        if (left["stage"], left["coordinate"]) not in shown and len(shown) < 3:
            shown.add((left["stage"], left["coordinate"]))
            _evidence(section, diagnosis, left["goes_with"], left["stage"], left["coordinate"])


def _each_run(section: Section, runs: Sequence[dict[str, Any]]) -> None:
    """Where the wall lies in each run."""
    section.add_text(
        "The wall lies elsewhere in each run, in no order of the runs: each has a place of its own, which no formula "
        "tells beforehand. Where it lay, off the mean of all:"
    )
    section.add_table(
        ("run", "x (µm)", "y (µm)", "sd (µm)"),
        [(one["run"], *(f"{1e6 * one[name]:.0f}" for name in ("x_m", "y_m", "sd_m"))) for one in runs],
        text_columns=(0,),
    )


def _evidence(section: Section, diagnosis: Diagnosis, finding: str, stage: str, coordinate: str) -> None:
    """The residual that a finding is about, before and after."""
    if finding in CENTRES:
        layout(section, diagnosis)
    elif stage == "drive":
        drive(section, diagnosis)
    elif stage == "measurement":
        if "ground" in finding:
            _ground(section, diagnosis)
        if "marker" in finding:
            _rigid(section, diagnosis)
        measured(section, diagnosis)
    elif stage == "flight":
        flight_evidence(section, diagnosis, finding)
    else:
        panels = impact_panels(diagnosis.ladder, finding, coordinate)
        if not panels:
            section.add_missing("the impacts' residuals", "there are too few impacts.")
            return
        section.add_figure(
            f"gap-impacts-{_slug(finding)}",
            partial(
                residual_panels,
                panels,
                one_model=_nothing_added(diagnosis),
                before="as the layout says" if finding in REFITTED else "recalibrated",
            ),
            "Residual of each impact (dots) and medians over bins with their standard errors. The first panel is the "
            "one the finding rests on.",
            f"Residuals of the impacts for {finding}",
        )


def flight_evidence(section: Section, diagnosis: Diagnosis, finding: str) -> None:
    """Missing acceleration of the flights against what ``finding`` goes with (empty: against everything)."""
    panels = flight_panels(diagnosis.ladder, finding)
    if not panels:
        section.add_missing("the flights' residuals", "no flight is long enough to measure an acceleration from.")
        return
    section.add_figure(
        f"gap-flights-{_slug(finding)}",
        partial(residual_panels, panels, one_model=diagnosis.ladder.flights.fitted is diagnosis.ladder.flights.nominal),
        "Acceleration that the measured positions ask for beyond the model, in pieces of flights (dots) and as "
        "medians over bins with their "
        "standard errors. Zero everywhere means that the model holds.",
        "Missing acceleration of the flights against their covariates",
    )


def impact_overview(section: Section, diagnosis: Diagnosis) -> None:
    """Every residual of the impacts, and the contact law itself."""
    panels = overview_panels(diagnosis.ladder)
    if not panels:
        section.add_missing("the impacts' residuals", "fewer than eight impacts could be used.")
        return
    section.add_figure(
        "gap-impacts",
        partial(residual_panels, panels, one_model=_nothing_added(diagnosis)),
        "Residuals of the impacts: restitution, contact distance, tangential law (relative to its impulse), angular "
        "law.",
        "Residuals of the impacts",
    )
    section.add_figure(
        "gap-law",
        partial(law_figure, diagnosis.ladder),
        "The contact law itself: restitution against approach speed; tangential impulse, which first sticks and "
        "then slides; and the angular law, which holds for any friction. Grey: measured; red: recalibrated; blue: "
        "with the effect.",
        "Measured impacts and the contact law",
    )


def _nothing_added(diagnosis: Diagnosis) -> bool:
    ladder = diagnosis.ladder
    refitted = ("wall_centre_offset", "mass_centre_offset", "stated_radius", "inertia_error")
    centres = any(c.effect in refitted for c in ladder.causes)
    return ladder.impacts.fitted is ladder.impacts.nominal and not ladder.impacts.restitution_terms and not centres


def _slug(text: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in text.lower()).strip("-") or "all"


def _shown(
    section: Section, name: str, figure: Figure | None, caption: str, alt: str, *, missing: str, because: str
) -> None:
    """A figure, or the sentence why there is none."""
    if figure is None:
        section.add_missing(missing, because)
    else:
        section.add_figure(name, figure, caption, alt)


def _ground(section: Section, diagnosis: Diagnosis) -> None:
    _shown(
        section,
        "gap-ground",
        ground_figure(diagnosis.ladder),
        "What the ground markers do, together in each run and each by itself on the mean of all runs (with sds); they "
        "stand still in the room, so a camera (or its mount) does this.",
        "Motion of the ground markers over time",
        missing="ground markers",
        because="the recording has none, or this entry has no points.",
    )


def _rigid(section: Section, diagnosis: Diagnosis) -> None:
    _shown(
        section,
        "gap-rigid",
        rigid_figure(diagnosis.ladder),
        "Each marker's place on its body over the run, and the Host's markers along its velocity or "
        "acceleration (first run): bodies are rigid, so all "
        "curves should be flat. A step is a marker that came loose, a slope with the velocity one that is read out at "
        "another time, a slope with the acceleration one that bends.",
        "Markers against their bodies",
        missing="markers against their bodies",
        because="this entry has no points.",
    )


def measured(section: Section, diagnosis: Diagnosis) -> None:
    """Epipolar residual, heights, jitter and drive frequency, once."""
    if "gap-measured" in section.figures:
        return
    _shown(
        section,
        "gap-measured",
        measured_figure(diagnosis.ladder),
        "Residual between the two views against the speed across the epipolar line (a slope is a late clock), heights "
        "(a slope is a tilted "
        "plane), variance of the Host's residual against its speed squared (a slope along its way is jitter or blur, "
        "across it blur), drive frequency asked "
        "over seen by run.",
        "Residuals of the measurement",
        missing="residuals of the measurement",
        because="they need two views, or a driven Host.",
    )


def drive(section: Section, diagnosis: Diagnosis) -> None:
    """The Host beside its drive, once."""
    if "gap-drive" in section.figures:
        return
    _shown(
        section,
        "gap-drive",
        drive_figure(diagnosis.ladder.drive),
        "The Host's path without the harmonics of its drive. Left: the run in which it leaves its drive most; red "
        "lines are impacts. Right: the spectrum over all runs, as measured and without what was found.",
        "The Host beside its drive",
        missing="the Host beside its drive",
        because="no Host follows harmonics of a drive.",
    )


def layout(section: Section, diagnosis: Diagnosis) -> None:
    """Markers against their design."""
    _shown(
        section,
        "gap-layout",
        layout_figure(diagnosis.ladder),
        "Markers against their layout, errors magnified; markers glued within the grey circles are placement, not an "
        "effect. "
        "The NES is seen from the centre of mass that its flights show.",
        "Markers against their layout",
        missing="markers against their layout",
        because="this entry has no points, or recording.toml gives no layout_m.",
    )
