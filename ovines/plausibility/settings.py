"""Settings of recording.toml that contradict each other: masses, lengths, exposures, windows."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ovines.plausibility.warning import PlausibilityWarning
from ovines.recording import Recording
from ovines.recording_schema import Nes

# The densest metal, and a sheet of paper: a solid cylinder as high as it is wide weighs less than the first gives for
# its radius, a disk more than the second.
DENSEST_KG_PER_M3 = 22_600.0
PAPER_KG_PER_M2 = 0.08
# Markers sit on their body: its radius is some times as large as the farthest of them from the body's origin, or some
# times smaller (a ring's wall within its markers, markers on arms).  A factor of 1000 is millimetres read as metres.
RADIUS_FACTOR_DOUBTFUL, RADIUS_FACTOR_MOST = 4.0, 25.0
FEWEST_MARKERS = 3  # of a layout that tells a body's size: one or two may stand near the middle


def exposures(recording: Recording) -> Iterator[PlausibilityWarning]:
    """Exposures longer than the time from one frame to the next."""
    rate_hz = recording.frame_rate_hz
    for i, camera in enumerate(recording.cameras):
        if rate_hz is not None and camera.exposure_s is not None and camera.exposure_s * rate_hz > 1:
            yield PlausibilityWarning(
                f"exposure_s = {camera.exposure_s:g} of {camera.name} at frame_rate_hz = {rate_hz:g}",
                f"an exposure within the {1 / rate_hz:.4g} s from one frame to the next",
                "correct exposure_s or frame_rate_hz",
                ("cameras", i, "exposure_s"),
            )


def masses(recording: Recording) -> Iterator[PlausibilityWarning]:
    """A NES heavier than the densest metal, or lighter than paper, of its radius."""
    nes = recording.bodies.get("nes")
    if not isinstance(nes, Nes) or nes.mass_kg is None:
        return
    most_kg = DENSEST_KG_PER_M3 * 2 * math.pi * nes.radius_m**3
    least_kg = PAPER_KG_PER_M2 * math.pi * nes.radius_m**2
    if least_kg <= nes.mass_kg <= most_kg:
        return
    why = (
        f"a cylinder of the densest metal, as high as wide, weighs {most_kg:.3g} kg at radius_m = {nes.radius_m:g}"
        if nes.mass_kg > most_kg
        else f"a disk of paper weighs {least_kg:.3g} kg at radius_m = {nes.radius_m:g}"
    )
    grams = most_kg >= nes.mass_kg * 1e-3 >= least_kg
    do = f"is it in g? then mass_kg = {nes.mass_kg * 1e-3:g}" if grams else "check mass_kg and radius_m"
    yield PlausibilityWarning(f"nes mass_kg = {nes.mass_kg:g}", why, do, ("bodies", "nes", "mass_kg"))


def radii(recording: Recording) -> Iterator[tuple[PlausibilityWarning, float]]:
    """Each radius beside the markers of its body, and the factor between the two (1 or more)."""
    for body, key in (("host", "inner_radius_m"), ("nes", "radius_m")):
        settings = recording.bodies.get(body)
        radius_m = getattr(settings, key, None)
        if settings is None or radius_m is None or len(settings.layout_m or ()) < FEWEST_MARKERS:
            continue
        far_m = float(np.hypot(*np.array(settings.layout_m, float)[:, :2].T).max())
        if far_m == 0.0:
            continue
        factor = max(radius_m / far_m, far_m / radius_m)
        scaled = 1e3 * far_m / radius_m if radius_m < far_m else radius_m / far_m * 1e-3
        units = "; is one of them in mm?" if 1 / RADIUS_FACTOR_DOUBTFUL < scaled < RADIUS_FACTOR_DOUBTFUL else ""
        yield (
            PlausibilityWarning(
                f"{body} {key} = {radius_m:g}",
                f"a length like that of its layout_m, whose farthest marker is {far_m:.4g} m from the middle{units}",
                f"correct {key} or layout_m (metres)",
                ("bodies", body, key),
            ),
            factor,
        )


def windows(recording: Recording) -> Iterator[PlausibilityWarning]:
    """A window smaller than the sensor whose place nobody said."""
    for i, camera in enumerate(recording.cameras):
        small = camera.window_size_px is not None and camera.window_size_px != camera.sensor_size_px
        if small and "window_offset_px" not in camera.model_fields_set:
            yield PlausibilityWarning(
                f"{camera.name} has no window_offset_px",
                f"its window of {camera.window_px[0]} x {camera.window_px[1]} px is a part of a sensor of "
                f"{camera.sensor_size_px[0]} x {camera.sensor_size_px[1]} px, "
                "and is taken to begin in the corner (0, 0)",
                "give the window's place as the camera's software says it",
                ("cameras", i, "window_size_px"),
            )
