"""Sections on the motion: relative trajectory, velocities, angle and spin."""

from __future__ import annotations

import numpy as np

from analysis.figures.style import DEG
from analysis.figures.trajectory import angle_and_spin, column, relative_trajectory, velocities
from analysis.report.numbers import with_unit
from analysis.report.page import Page
from analysis.report.results import Results
from analysis.walls.wall import identified_wall
from ovines.robust import residual_sd


def add_motion(page: Page, results: Results) -> None:
    """Motion of Host and NES: coordinates, path, angle and spin."""
    section = page.add_section("Motion", "motion")
    motion = results.get("motion")
    if motion is None:
        section.add_missing("motion", "There is no motion.parquet among the results.")
        return
    host, nes = results.recording.settings.bodies.host, results.recording.settings.bodies.nes
    identification = results.get("identification")
    known = identification is not None and results.get("impacts") is not None
    wall = identified_wall(identification, results.recording) if known else None
    contact = results.parameter("contact_radius_m")[0]
    caption = "Path of the NES centre in the Host's frame, with the wall and the contact edge it cannot pass "
    caption += "(thesis, Figs 57, 61)."
    if np.isfinite(contact):
        caption += f" The impacts themselves put the contact edge at {with_unit(1e3 * contact, 'mm', 4)}."
    section.add_figure(
        "relative_trajectory",
        relative_trajectory(motion, host, nes, wall, results.get("impacts")),
        caption,
        "Trajectory of the NES relative to the Host inside the wall.",
    )
    section.add_figure(
        "velocities",
        velocities(motion),
        "Velocities of NES and Host in the world frame (thesis, Figs 59, 61), smoothed over some frames: an impact, "
        "which takes no time here, looks like a ramp as long as the smoothing.",
        "Velocity components of NES and Host over time.",
    )
    if not np.isfinite(column(motion, "nes_angle_rad")).any():
        section.add_missing("angle and spin", "The NES angle was not measured.")
        return
    text = "Angle and spin of the NES (thesis, Figs 58, 62)"
    if results.rotation is not None:
        difference = column(results.rotation, "nes_angle_triplet_rad") - column(results.rotation, "nes_angle_fit_rad")
        scatter = residual_sd(difference)
        text += (
            ": the rigid fit of all markers, and the mean over marker triplets as in the thesis. They differ "
            "by "
            f"{with_unit(DEG * scatter, '°', 2)} (robust sd); differentiated frame by frame, the "
            "triplets' noise becomes that of the orange spin"
        )
    section.add_figure(
        "angle_and_spin",
        angle_and_spin(motion, results.rotation),
        text + ".",
        "Angle and spin of the NES over time.",
    )
