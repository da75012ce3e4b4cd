"""Whether a motion can say anything: bodies never seen are refused, gaps in what was seen are named."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.recording import Recording

BODIES = {"nes": "NES", "host": "Host"}
# A gap that is named: shorter ones are a marker hidden for a moment, and the tables have them.
GAP_S = 0.02
GAP_SHARE = 0.2  # as many frames without a place are named however short each gap is
# A disk that moves less than this against its ring, or is seen in fewer frames, carries nothing to explain.
STILL_M = 1e-4
FEW_FRAMES = 10


def seen_frames(motion: pd.DataFrame, body: str) -> NDArray[np.bool_]:
    """Per row of a ``motion`` table whether ``body`` ("nes" or "host") has a place."""
    return np.asarray(np.isfinite(motion[[f"{body}_x_m", f"{body}_y_m"]].to_numpy(float)).all(axis=1), dtype=bool)


def refuse_unseen(motion: pd.DataFrame, recording: Recording) -> None:
    """`InputError` where the NES has no place in any row, or the Host none although its markers were to be seen.

    A brought ``motion.parquet`` may lack the Host's place: a Host that stands still at the origin.
    """
    brought = recording.entry() == "motion"
    for body, title in BODIES.items():
        if seen_frames(motion, body).any() or (brought and body == "host"):
            continue
        settings = recording.bodies.get(body)
        markers = ", ".join(settings.markers) if settings is not None else ""
        if brought:
            found = f"{recording.folder}: motion.parquet has no place of the {title} in any of {len(motion)} rows"
            raise InputError(found, f"{body}_x_m and {body}_y_m", "check the program that wrote the table")
        raise InputError(
            f"{recording.folder}: no frame shows two markers of the {title} ({markers}) to both cameras",
            "at least two of them in both views",
            "check [bodies] markers in recording.toml, and that both cameras see them in the same frames",
        )


def host_at_rest(motion: pd.DataFrame) -> pd.DataFrame:
    """A motion without any place of the Host with one that stands still at the origin, unturned; others as they are."""
    if seen_frames(motion, "host").any():
        return motion
    return motion.assign(host_x_m=0.0, host_y_m=0.0, host_z_m=0.0, host_angle_rad=0.0)


def gaps(motion: pd.DataFrame, recording: Recording) -> list[str]:
    """What a reader must know of a motion before its numbers: bodies hidden, a disk at rest or outside its ring."""
    notes = []
    for body, title in BODIES.items():
        seen = seen_frames(motion, body)
        if not seen.any() and body == "host":
            notes.append("no place of the Host in motion.parquet: it is taken to stand still at the origin")
        elif not seen.all():
            start, end = longest_gap(seen)
            times_s = motion["time_s"].to_numpy(float)
            count = f"{title} not seen in {int((~seen).sum())} of {len(seen)} frames"
            if times_s[end - 1] - times_s[start] >= GAP_S:
                notes.append(
                    f"{count}, longest from {times_s[start]:.4g} s to {times_s[end - 1]:.4g} s; nothing stands in the "
                    f"tables there"
                )
            elif np.mean(~seen) > GAP_SHARE:
                notes.append(f"{count}, never more than {end - start} in a row; nothing stands in the tables there")
    outside = share_outside(motion, recording)
    if outside > 0.5:
        notes.append(
            f"NES outside the Host's wall in {100 * outside:.0f} % of the frames: check inner_radius_m and the "
            f"calibration"
        )
    if reach_m(motion) < STILL_M:
        notes.append("NES does not move against the Host: no impact, and no parameter of one")
    return notes


def track_notes(tracks: pd.DataFrame, points: pd.DataFrame, recording: Recording) -> list[str]:
    """What of the tracks gives no motion: markers that no body has, and frames in which no marker has a point."""
    notes = []
    known = {marker for body in recording.bodies.values() for marker in body.markers}
    if strangers := sorted(set(tracks["marker"].unique()) - known):
        named = ", ".join(strangers[:5]) + (f" and {len(strangers) - 5} more" if len(strangers) > 5 else "")
        notes.append(f"tracks of {named} are not used: no [bodies] of recording.toml has such a marker")
    times_s = tracks.groupby("frame")["time_s"].first()
    with_point = np.asarray(times_s.index.isin(points["frame"].unique()))
    start, end = longest_gap(with_point)
    if end and times_s.iloc[end - 1] - times_s.iloc[start] >= GAP_S:
        notes.append(
            f"no point in {int((~with_point).sum())} of {len(with_point)} tracked frames, longest from "
            f"{times_s.iloc[start]:.4g} s"
            f" to {times_s.iloc[end - 1]:.4g} s: no marker was seen by two cameras there"
        )
    return notes


def refuse_uninformative(motions: Sequence[pd.DataFrame], recordings: Sequence[Recording]) -> None:
    """`InputError` where no recording of a series has a disk that was seen, moves, and is inside its ring."""
    for motion, recording in zip(motions, recordings, strict=True):
        refuse_unseen(motion, recording)
    reasons = [_nothing_to_explain(one, recording) for one, recording in zip(motions, recordings, strict=True)]
    if reasons and all(reasons):
        raise InputError(
            f"{recordings[0].folder.parent}: {reasons[0]}"
            + (f"; none of {len(reasons)} recordings is better" if len(reasons) > 1 else ""),
            "recordings in which the NES is seen, moves, and stays inside the Host",
            "run `ovines run` on one of them and look at its report",
        )


def _nothing_to_explain(motion: pd.DataFrame, recording: Recording) -> str | None:
    count = int(seen_frames(motion, "nes").sum())
    if count < FEW_FRAMES:
        return f"the NES is seen in {count} frames"
    if reach_m(motion) < STILL_M:
        return f"the NES moves by {1e3 * reach_m(motion):.2g} mm against the Host"
    if share_outside(motion, recording) > 0.5:
        return "the NES is outside the Host's wall most of the time"
    return None


def longest_gap(seen: NDArray[np.bool_]) -> tuple[int, int]:
    """Rows ``start:end`` of the longest run of False; (0, 0) where there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], seen, [True]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return 0, 0
    widest = int(np.argmax(ends - starts))
    return int(starts[widest]), int(ends[widest])


def relative_place_m(motion: pd.DataFrame) -> NDArray[np.float64]:
    """NES from Host (rows seen, 2) in metres; a Host without any place is at the origin."""
    nes = motion[["nes_x_m", "nes_y_m"]].to_numpy(float)
    host = motion[["host_x_m", "host_y_m"]].to_numpy(float)
    place = nes - (host if np.isfinite(host).any() else 0.0)
    return place[np.isfinite(place).all(axis=1)]


def reach_m(motion: pd.DataFrame) -> float:
    """The larger side of the box that holds every place of the NES from the Host."""
    place = relative_place_m(motion)
    return float(np.ptp(place, axis=0).max()) if len(place) else 0.0


def share_outside(motion: pd.DataFrame, recording: Recording) -> float:
    """Share of frames in which the NES' centre is farther from the Host's than any point of its wall."""
    host = recording.bodies.get("host")
    polygon = getattr(host, "polygon_m", None)
    wall_m = getattr(host, "inner_radius_m", None) or (
        np.hypot(*np.asarray(polygon, float).T).max() if polygon else None
    )
    place = relative_place_m(motion)
    if wall_m is None or not len(place):
        return 0.0
    return float(np.mean(np.hypot(place[:, 0], place[:, 1]) > wall_m))
