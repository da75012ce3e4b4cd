"""Section part: the wall from markers, image edges and impacts, side by side."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from analysis.contact.wall_sources import WallSource, wall_sources
from analysis.figures.geometry import wall_comparison
from analysis.report.numbers import MISSING, length, value_with_sd, with_unit
from analysis.report.page import Section
from analysis.report.results import Results

# Two sources disagree from this many sd of their difference.
DISAGREE_SD = 3.0


def add_wall_sources(section: Section, results: Results) -> None:
    """Heading, figure, table and a sentence on where the sources disagree; the absent ones are named with the
    reason.
    """
    sources = wall_sources(
        results.recording,
        results.get("motion"),
        results.circles,
        results.get("walls"),
        results.get("identification"),
        _pixel_m(results),
    )
    section.add_heading("The wall by three ways")
    figure = wall_comparison(sources)
    if figure is not None:
        section.add_figure(
            "wall_sources",
            figure,
            "Left: contact radius (wall less disk) from the circle through the Host markers (their scale times the "
            "design radius), from the "
            "edges in the images, and from the impacts; bars are 90 %. Right: where each puts the wall's centre in "
            "the frame of the Host's "
            "layout, with 90 % ellipses.",
            "Contact radius and wall centre from markers, image edges and impacts.",
        )
    section.add_table(
        ("source", "measured", "contact radius ± sd", "centre x", "centre y", "seen"),
        [_row(source) for source in sources if source.measured],
        "sd without the calibration's own, which markers and edges share; 'seen' counts frames, instants or impacts.",
        (0, 1),
    )
    section.add_text(in_words(sources))
    for source in sources:
        if source.missing:
            section.add_missing(f"wall from {source.name}", source.missing)


def in_words(sources: list[WallSource]) -> str:
    """Which pairs of sources differ by more than their sd explain, and by how much."""
    pairs = [
        (a, b)
        for a, b in combinations(sources[1:], 2)
        if np.isfinite(a.contact_radius_sd_m) and np.isfinite(b.contact_radius_sd_m)
    ]
    if not pairs:
        return "Fewer than two ways gave a contact radius: nothing to compare."
    off = []
    for a, b in pairs:
        difference, sd = (
            a.contact_radius_m - b.contact_radius_m,
            float(np.hypot(a.contact_radius_sd_m, b.contact_radius_sd_m)),
        )
        if abs(difference) > DISAGREE_SD * sd:
            more = "larger" if difference > 0 else "smaller"
            off.append(
                f"{a.name} give a contact radius {length(abs(difference))} {more} than {b.name} "
                f"({abs(difference) / sd:.0f} sd)"
            )
    if not off:
        worst = max(abs(a.contact_radius_m - b.contact_radius_m) for a, b in pairs)
        return f"The contact radii agree within their sd (largest difference {length(worst)})."
    words = "; ".join(off)
    return (
        f"{words[0].upper()}{words[1:]}. Markers tell the scale only as well as their layout; edges tell the rim, "
        f"impacts the wall that is hit."
    )


def _pixel_m(results: Results) -> float:
    """What a pixel shows at the rig (m), mean over the cameras; NaN without a calibration."""
    cameras = results.calibration["cameras"] if results.calibration is not None else []
    return (
        float(np.mean([np.linalg.norm(c["translation_m"]) / c["matrix"][0][0] for c in cameras]))
        if cameras
        else float("nan")
    )


def _row(source: WallSource) -> tuple[str, ...]:
    radius = value_with_sd(1e3 * source.contact_radius_m, 1e3 * source.contact_radius_sd_m, "mm")
    known = np.isfinite(source.contact_radius_sd_m)
    return (
        source.name,
        source.measured,
        radius
        if known or not np.isfinite(source.contact_radius_m)
        else with_unit(1e3 * source.contact_radius_m, "mm", 5),
        *(value_with_sd(1e6 * c, 1e6 * sd, "µm") for c, sd in zip(source.centre_m, source.centre_sd_m, strict=True)),
        str(source.count) if source.count else MISSING,
    )
