"""Each stage's function: files in, tables out, by way of `vision` and `analysis`.

A stage function takes a `StageContext` and returns its results by file name; the chain writes them.  Imports stand
inside the functions, so that a stage loads only what it needs.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from ovines.camera import with_fields
from ovines.errors import InputError
from ovines.lens_field import lens_fields
from ovines.pipeline.context import StageContext
from ovines.pipeline.stages import CALIBRATION_PAGE, MOTION_OR_IMPACTS
from ovines.plausibility.calibration import calibrated, refuse_camera_count
from ovines.plausibility.frame_files import file_notes, refuse_strange_files
from ovines.plausibility.motion import gaps, host_at_rest, refuse_unseen, track_notes
from ovines.plausibility.names import read_names
from ovines.plausibility.recording import drive_warnings, plausibility_warnings, refuse_contradictions, sd_warnings
from ovines.recording import Recording, read_trigger
from ovines.tables import checked, read_table


def calibrate(context: StageContext) -> dict[str, Any]:
    """Board images to cameras with their uncertainty."""
    from vision.calibrate import calibrate_recording
    from vision.calibration.uncertainty import covariance_table

    (context.out / CALIBRATION_PAGE).unlink(missing_ok=True)  # it would speak of the calibration before
    result = calibrate_recording(context.recording, progress=context.progress)
    context.notes.extend(result.advice)
    return {
        "calibration.json": result.cameras,
        "calibration_views.parquet": result.views,
        "calibration_parameters.parquet": result.parameters,
        "calibration_covariance.parquet": covariance_table(result.covariance, result.labels),
        **{f"{name}.parquet": table for name, table in result.tables.items()},
    }


def track(context: StageContext) -> dict[str, Any]:
    """Images to markers in pixels and walls, after what the calibration says against this recording."""
    from vision.calibration_check import refuse_mistaken
    from vision.track import track as track_markers

    refuse_camera_count(context.recording)
    refuse_strange_files(context.recording)
    context.notes.extend(file_notes(context.recording))
    if "trigger.csv" in context.inputs:
        read_trigger(context.path("trigger.csv"))  # a wrong one is refused before the images cost an hour
    cameras = calibrated(context.path("calibration.json"), context.recording)
    names = read_names(context.path("names.csv"), context.recording) if "names.csv" in context.inputs else None
    refuse_mistaken(context.recording, cameras, names)
    found = track_markers(context.recording, cameras, names, context.progress)
    context.notes.extend(found.notes)
    results = {"tracks.parquet": found.tracks}
    if len(found.walls):
        results["walls.parquet"] = found.walls
    return results


def lens(context: StageContext) -> dict[str, Any]:
    """What the lens models leave over: as all runs of a series tell it, or this recording alone."""
    from vision.lens.estimate import learn_lens_field

    tracks = read_table(context.path("tracks.parquet"), "tracks")
    refuse_contradictions(context.recording, tracks)
    cameras = calibrated(context.path("calibration.json"), context.recording)
    if "lens of the series" in context.inputs:
        return {path.name: read_table(path, path.stem) for path in context.inputs["lens of the series"]}
    covariance = (
        read_table(context.path("calibration_covariance.parquet"), "calibration_covariance")
        if "calibration_covariance.parquet" in context.inputs
        else None
    )
    found = learn_lens_field([tracks], [context.recording], cameras, covariance)
    if found.field is not None or found.loose:  # that there is none stands in the table
        context.notes.append(found.note)
    return {"lens_terms.parquet": found.terms} | ({} if found.field is None else {"lens_field.parquet": found.field})


def triangulate(context: StageContext) -> dict[str, Any]:
    """Markers of the cameras to points in metres, with the calibration's part of their uncertainty."""
    from ovines.plausibility.exchanged import exchange_notes, exchanged_labels
    from vision.calibration.uncertainty import with_calibration_sd
    from vision.calibration_check import length_notes, misfit_notes, refuse_foreign_tracks
    from vision.one_view import one_view_heights, one_view_notes
    from vision.triangulate import triangulate as triangulate_tracks

    refuse_camera_count(context.recording)
    tracks = read_table(context.path("tracks.parquet"), "tracks")
    refuse_contradictions(context.recording, tracks)
    if context.recording.entry() == "tracks":
        context.notes.extend(sd_warnings(tracks, context.recording))
    cameras = calibrated(context.path("calibration.json"), context.recording)
    if "lens_field.parquet" in context.inputs:
        tables = [read_table(context.path(f"{name}.parquet"), name) for name in ("lens_field", "lens_terms")]
        cameras = with_fields(cameras, lens_fields(*tables))
    heights = one_view_heights(context.recording)
    points = triangulate_tracks(tracks, cameras, context.recording.window_offset_px, heights)
    context.notes.extend(one_view_notes(context.recording, tracks, points, cameras))
    refuse_foreign_tracks(tracks, points, cameras, context.recording.window_offset_px)
    context.notes.extend(track_notes(tracks, points, context.recording))
    own = {camera.name for camera in context.recording.cameras}
    seen_by = [camera for camera in cameras if camera.name in own]
    markers = {name: body.markers for name, body in context.recording.bodies.items()}

    def again(some: pd.DataFrame) -> pd.DataFrame:
        return triangulate_tracks(some, seen_by, context.recording.window_offset_px)

    context.notes.extend(exchange_notes(exchanged_labels(points, tracks, seen_by, markers, again)))
    context.notes.extend(misfit_notes(points))
    context.notes.extend(length_notes(points, context.recording))
    if "calibration_covariance.parquet" in context.inputs:
        covariance = read_table(context.path("calibration_covariance.parquet"), "calibration_covariance")
        levels = None if heights is None else {marker: height.place_m[2] for marker, height in heights.items()}
        points = with_calibration_sd(points, seen_by, covariance, levels)
    return {"points.parquet": points}


def analyse(context: StageContext) -> dict[str, Any]:
    """Points to motion, the Host's circle, the angle from triplets, the thesis' impacts, and accelerometers beside the
    Host.
    """
    from analysis.accelerometers.record import read_record
    from analysis.motion.bodies import motion_from_points
    from analysis.motion.host_circle import host_circle
    from analysis.motion.rotation import rotation
    from analysis.thesis.impacts import thesis_impacts

    for body in ("host", "nes"):
        if body not in context.recording.bodies:
            raise InputError(
                f"{context.recording.folder}/recording.toml: no [bodies.{body}]",
                "the Host's wall (inner_radius_m or polygon_m) and the NES' radius_m",
                "add the section",
            )
    record = read_record(context.recording)
    path = context.path("points.parquet or motion.parquet")
    results: dict[str, Any] = {}
    if path.name == "motion.parquet":
        motion = read_table(path, "motion")
        refuse_contradictions(context.recording, motion)
        context.notes.extend(sd_warnings(motion, context.recording))
    else:
        points = read_table(path, "points")
        refuse_contradictions(context.recording, points)
        if context.recording.entry() == "points":
            context.notes.extend(sd_warnings(points, context.recording))
        motion = checked(motion_from_points(points, context.recording), "motion")
        if len(context.recording.bodies["host"].markers) >= 3:
            results["host_circle.parquet"] = host_circle(points, context.recording)
        if len(context.recording.bodies["nes"].markers) >= 3:
            try:
                results["rotation.parquet"] = rotation(points, motion, context.recording)
            except InputError as error:  # fewer than three were seen: the angle of the rigid fit is there
                context.notes.append(f"no rotation.parquet: {error.found}")
    refuse_unseen(motion, context.recording)
    context.notes.extend(gaps(motion, context.recording))
    context.notes.extend(plausibility_warnings(context.recording, motion) + drive_warnings(motion, context.recording))
    motion = host_at_rest(motion)
    results["motion.parquet"] = motion
    results["thesis_impacts.parquet"] = thesis_impacts(motion, context.recording)
    if record is not None:
        from analysis.accelerometers.compare import compare_accelerometers

        asked = context.recording.excitation
        beside = compare_accelerometers(motion, record, asked.frequency_hz if asked is not None else None)
        context.notes.extend(beside.notes)
        if beside.channels is not None:
            results["accelerometers.parquet"] = beside.channels
            results["accelerations.parquet"] = beside.accelerations
    return results


def identify(context: StageContext) -> dict[str, Any]:
    """Motion to impacts, flights, parameters, and the checks that say whether to use them."""
    from analysis.checks.recording import check_run
    from analysis.identification.given_impacts import identify_impacts
    from analysis.identify import identify as identify_parameters

    path = context.path(MOTION_OR_IMPACTS)
    if context.recording.entry() == "impacts":
        alone = identify_impacts([read_table(path, "given_impacts")], [context.recording])
        context.notes.extend(alone.notes)
        return {"identification.parquet": alone.identification, "impacts.parquet": alone.impacts[0]}
    motion = read_table(path, "motion")
    found = identify_parameters(motion, context.recording)
    context.notes.extend(found.notes)
    peaks = (
        read_table(context.path("thesis_impacts.parquet"), "thesis_impacts")
        if "thesis_impacts.parquet" in context.inputs
        else None
    )
    points = read_table(context.path("points.parquet"), "points") if "points.parquet" in context.inputs else None
    checks = check_run(found.rig, 0, motion, context.recording, found.impacts, found.flights, peaks, points)
    return {
        "checks.parquet": checked(checks, "checks"),
        "identification.parquet": found.identification,
        "impacts.parquet": found.impacts,
        "flights.parquet": found.flights,
    }


def report(context: StageContext) -> dict[str, Any]:
    """Everything before on one page."""
    from analysis.report.page import source_of
    from analysis.report.pages.recording_report import recording_page
    from analysis.report.results import read_results

    page = recording_page(read_results(context.out, context.recording, first_frames(context.recording)))
    page.source = source_of(context.recording.folder, context.out)
    if context.in_series:
        page.links.append(("All recordings of the series", "../report.html"))
    if "calibration_views.parquet" in context.inputs:
        page.links.append(("Calibration", CALIBRATION_PAGE))
    return {"report.html": page.render()}


def first_frames(recording: Recording) -> dict[str, Any] | None:
    """One grey image per camera to draw the tracks on, where the recording brings frames."""
    if not any(recording.frame_files(camera.name) for camera in recording.cameras):
        return None
    from vision.frames.sources import open_sources, stream

    sources, notes = open_sources(recording)
    found: dict[str, Any] = {}
    for _, images in stream(sources, notes):
        for source, image in zip(sources, images, strict=True):
            if image is not None:
                found.setdefault(source.camera.name, image)
        if len(found) == len(sources):
            break
    return found
