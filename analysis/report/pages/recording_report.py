"""``report.html`` of one recording."""

from __future__ import annotations

from analysis.report.impacts import add_impacts, add_parameters
from analysis.report.measurement import add_calibration, add_coordinates, add_host_geometry, add_tracks
from analysis.report.motion import add_accelerometers, add_motion
from analysis.report.numbers import with_unit
from analysis.report.page import Page
from analysis.report.results import Results
from analysis.report.verdict import add_checks, add_verdict, headline
from ovines.recording import Recording


def recording_page(results: Results) -> Page:
    """The page, not yet written: what it says and shows comes from ``results`` alone."""
    page = Page(
        results.recording.name,
        "Trajectory and identification report",
        headline(results),
        facts(results.recording),
        footer="Tables beside this page hold every number of it, in SI units.",
    )
    add_verdict(page, results)
    for add in (
        add_checks,
        add_parameters,
        add_impacts,
        add_motion,
        add_accelerometers,
        add_host_geometry,
        add_coordinates,
        add_tracks,
        add_calibration,
    ):
        add(page, results)
    return page


def facts(recording: Recording) -> list[tuple[str, str]]:
    """What was asked of the rig, for the line under the title."""
    pairs = []
    excitation = recording.excitation
    if excitation is not None:
        if excitation.frequency_hz is not None:
            pairs.append(("Drive", with_unit(excitation.frequency_hz, "Hz")))
        if excitation.acceleration_g is not None:
            pairs.append(("Level", with_unit(excitation.acceleration_g, "g")))
    pairs.append(("Frame rate", with_unit(recording.frame_rate_hz, "Hz", 4)))
    if recording.cameras:
        pairs.append(("Cameras", ", ".join(camera.name for camera in recording.cameras)))
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    if host is not None and host.inner_radius_m is not None:
        pairs.append(("Wall radius", with_unit(1e3 * host.inner_radius_m, "mm")))
    if host is not None and host.polygon_m is not None:
        pairs.append(("Wall", f"{len(host.polygon_m)} flat sides"))
    if host is not None and host.obstacle_radius_m is not None:
        pairs.append(("Cylinder radius", with_unit(1e3 * host.obstacle_radius_m, "mm")))
    if nes is not None and nes.radius_m is not None:
        pairs.append(("NES radius", with_unit(1e3 * nes.radius_m, "mm")))
    return pairs + (recording.settings.log.pairs if recording.settings.log is not None else [])
