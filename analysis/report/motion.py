"""Sections on the motion: relative trajectory, velocities, angle and spin."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from analysis.accelerometers.figure import accelerations_figure
from analysis.figures.style import DEG
from analysis.figures.trajectory import angle_and_spin, column, relative_trajectory, velocities
from analysis.report.numbers import value_with_digits, value_with_sd, with_unit
from analysis.report.page import Page
from analysis.report.results import Results
from analysis.walls.drawn import identified_wall
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
        partial(relative_trajectory, motion, host, nes, wall, results.get("impacts")),
        caption,
        "Trajectory of the NES relative to the Host inside the wall.",
    )
    section.add_figure(
        "velocities",
        partial(velocities, motion),
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
        partial(angle_and_spin, motion, results.rotation),
        text + ".",
        "Angle and spin of the NES over time.",
    )


def add_accelerometers(page: Page, results: Results) -> None:
    """The Host's motion by accelerometers and by cameras, where a record was brought."""
    if results.recording.settings.accelerometers is None:
        return
    section = page.add_section("Accelerometers", "accelerometers")
    table, over_time = results.get("accelerometers"), results.get("accelerations")
    if table is None or over_time is None:
        section.add_missing(
            "comparison", "The record could not be synchronised; the notes of `ovines analyse` say why."
        )
        return
    first = table.iloc[0]
    section.add_text(
        f"The cameras' time is {value_with_sd(first['offset_s'], first['offset_sd_s'], 's')} + "
        f"{value_with_sd(first['time_scale'], first['time_scale_sd'])} times the record's, found from the Host's "
        f"motion; in the middle of the run it is known to {with_unit(1e6 * first['middle_sd_s'], 'μs', 2)}."
    )
    if np.isfinite(first["other_offset_s"]):
        section.add_note(
            f"{with_unit(first['other_offset_s'], 's', 6)} fits as well: the drive repeats itself. `start_s` in "
            f"`[accelerometers]` says which period is meant.",
            "caution",
        )
    section.add_figure(
        "accelerations",
        partial(accelerations_figure, over_time),
        "Acceleration of the Host along each sensor, by the cameras' path and by the record with its stated "
        "sensitivity, each a mean over a frame's interval, and their difference.",
        "Acceleration of the Host by cameras and accelerometers over some periods, and its difference over the run.",
    )
    section.add_table(
        ("channel", "", "frequency (Hz)", "amplitude (m/s²)", "phase", "RMS difference (m/s²)", "gain", "mV/g"),
        [row for _, one in table.iterrows() for row in _rows(one)],
        "Main line of the drive by both, each in its own clock; phase of the record before the cameras. RMS difference "
        "with the stated sensitivity, and with the gain and the sensitivity by which both agree (a wrong scale of the "
        "cameras looks the same).",
        text_columns=(0, 1),
    )


def _rows(one: pd.Series) -> list[tuple[str, ...]]:
    """Two rows of a channel: by the record and by the cameras."""
    sensitivity = value_with_digits(one["sensitivity_mv_per_g"], one["sensitivity_sd_mv_per_g"])
    return [
        (
            str(one["channel"]),
            "record",
            with_unit(one["record_frequency_hz"], digits=6),
            with_unit(one["record_amplitude_m_per_s2"], digits=4),
            with_unit(1e3 * one["phase_rad"], "mrad", 2),
            with_unit(one["error_m_per_s2"], digits=2),
            "1",
            with_unit(one["stated_sensitivity_mv_per_g"], digits=4),
        ),
        (
            "",
            "cameras",
            with_unit(one["cameras_frequency_hz"], digits=6),
            with_unit(one["cameras_amplitude_m_per_s2"], digits=4),
            "",
            with_unit(one["error_with_gain_m_per_s2"], digits=2),
            value_with_digits(one["gain"], one["gain_sd"]),
            sensitivity,
        ),
    ]
