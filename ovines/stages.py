"""Each stage's function: files in, tables out, by way of `vision` and `analysis`.

A stage function takes a `Work` and returns its results by file name; the chain writes them.  Imports stand inside
the functions, so that a stage loads only what it needs.
"""

from __future__ import annotations

from typing import Any

from ovines.camera import read_calibration
from ovines.chain import CALIBRATION_PAGE
from ovines.errors import InputError
from ovines.first_frame_names import read_names
from ovines.recording import Recording, read_trigger
from ovines.seen import gaps, refuse_unseen, track_notes
from ovines.tables import checked, read_table
from ovines.work import Work


def calibrate(work: Work) -> dict[str, Any]:
    from vision.calibrate import calibrate_recording
    from vision.calibration_uncertainty import covariance_table

    (work.out / CALIBRATION_PAGE).unlink(missing_ok=True)  # it would speak of the calibration before
    result = calibrate_recording(work.recording, progress=work.progress)
    work.notes.extend(result.advice)
    return {
        "calibration.json": result.cameras,
        "calibration_views.parquet": result.views,
        "calibration_parameters.parquet": result.parameters,
        "calibration_covariance.parquet": covariance_table(result.covariance, result.labels),
    }


def track(work: Work) -> dict[str, Any]:
    from vision.calibration_doubt import refuse_mistaken
    from vision.track import track as track_markers

    if "trigger.csv" in work.inputs:
        read_trigger(work.path("trigger.csv"))  # a wrong one is refused before the images cost an hour
    cameras = read_calibration(work.path("calibration.json"))
    names = read_names(work.path("names.csv"), work.recording) if "names.csv" in work.inputs else None
    refuse_mistaken(work.recording, cameras, names)
    found = track_markers(work.recording, cameras, names, work.progress)
    work.notes.extend(found.notes)
    results = {"tracks.parquet": found.tracks}
    if len(found.walls):
        results["walls.parquet"] = found.walls
    return results


def triangulate(work: Work) -> dict[str, Any]:
    from vision.calibration_doubt import length_notes, refuse_foreign_tracks
    from vision.calibration_uncertainty import with_calibration_sd
    from vision.triangulate import triangulate as triangulate_tracks

    tracks = read_table(work.path("tracks.parquet"), "tracks")
    cameras = read_calibration(work.path("calibration.json"))
    points = triangulate_tracks(tracks, cameras, work.recording.window_offset_px)
    refuse_foreign_tracks(tracks, points, cameras, work.recording.window_offset_px)
    work.notes.extend(track_notes(tracks, points, work.recording))
    work.notes.extend(length_notes(points, work.recording))
    if "calibration_covariance.parquet" in work.inputs:
        covariance = read_table(work.path("calibration_covariance.parquet"), "calibration_covariance")
        points = with_calibration_sd(points, cameras, covariance)
    return {"points.parquet": points}


def analyse(work: Work) -> dict[str, Any]:
    from analysis.host_circle import host_circle
    from analysis.motion import motion_from_points
    from analysis.rotation import rotation
    from analysis.thesis_impacts import thesis_impacts

    for body in ("host", "nes"):
        if body not in work.recording.bodies:
            raise InputError(
                f"{work.recording.folder}/recording.toml: no [bodies.{body}]",
                "the Host's wall (inner_radius_m or polygon_m) and the NES' radius_m",
                "add the section",
            )
    path = work.path("points.parquet or motion.parquet")
    results: dict[str, Any] = {}
    if path.name == "motion.parquet":
        motion = read_table(path, "motion")
    else:
        points = read_table(path, "points")
        motion = checked(motion_from_points(points, work.recording), "motion")
        if len(work.recording.bodies["host"].markers) >= 3:
            results["host_circle.parquet"] = host_circle(points, work.recording)
        if len(work.recording.bodies["nes"].markers) >= 3:
            try:
                results["rotation.parquet"] = rotation(points, motion, work.recording)
            except InputError as error:  # fewer than three were seen: the angle of the rigid fit is there
                work.notes.append(f"no rotation.parquet: {error.found}")
    refuse_unseen(motion, work.recording)
    work.notes.extend(gaps(motion, work.recording))
    results["motion.parquet"] = motion
    results["thesis_impacts.parquet"] = thesis_impacts(motion, work.recording)
    return results


def identify(work: Work) -> dict[str, Any]:
    from analysis.identify import identify as identify_parameters

    found = identify_parameters(read_table(work.path("motion.parquet"), "motion"), work.recording)
    work.notes.extend(found.notes)
    return {
        "identification.parquet": found.identification,
        "impacts.parquet": found.impacts,
        "flights.parquet": found.flights,
    }


def report(work: Work) -> dict[str, Any]:
    from analysis.report import recording_page
    from analysis.report.results import read_results

    return {
        "report.html": recording_page(
            read_results(work.out, work.recording, first_frames(work.recording))
        ).render()
    }


def first_frames(recording: Recording) -> dict[str, Any] | None:
    """One grey image per camera to draw the tracks on, where the recording brings frames."""
    if not any(recording.frame_files(camera.name) for camera in recording.cameras):
        return None
    from vision.frames import open_sources, stream

    sources, notes = open_sources(recording)
    found: dict[str, Any] = {}
    for _, images in stream(sources, notes):
        for source, image in zip(sources, images, strict=True):
            if image is not None:
                found.setdefault(source.camera.name, image)
        if len(found) == len(sources):
            break
    return found
