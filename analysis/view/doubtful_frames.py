"""Frames that a person should look at first: markers exchanged or slipped, bodies half hidden, unexplained approaches.

Nothing here knows of the poses, which a mistaken marker bends: what is held against each frame are distances within a
body, which no motion changes, and the one residual that two views of a marker leave over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.recording import Recording
from ovines.robust import spread

Array = NDArray[np.float64]
DOUBTFUL = 6.0  # robust sds: of 20,000 normal numbers none is so large
SETTLED = 5.0  # robust sds that distances are within where two exchanged names are put right
NEXT_FRAMES = 3  # what is doubtful in frames this near each other is one thing to look at
HIDDEN_SCORE = 4.0  # below every misfit: a hidden marker is a gap, no mistake
APPROACH_SCORE = 5.0
NEAR_SHARE = 0.02  # of the contact radius: how near the wall an approach ends
TURN_SHARE = 0.5  # of the speed of approach that is turned back where something was hit


@dataclass(frozen=True)
class Doubtful:
    """One thing to look at: its worst ``frame``, what ``kind`` it is, in words, and how much it stands out."""

    frame: int
    time_s: float
    kind: str
    text: str
    score: float


def doubtful_frames(
    recording: Recording,
    points: pd.DataFrame | None = None,
    motion: pd.DataFrame | None = None,
    impacts: pd.DataFrame | None = None,
) -> list[Doubtful]:
    """What to look at, worst first, from the tables that there are (``points``, ``motion``, ``impacts``)."""
    found: list[Doubtful] = []
    if points is not None and len(points):
        for name, body in recording.bodies.items():
            found += _misfits(points[points["marker"].isin(body.markers)], name)
    if motion is not None and len(motion):
        found += _hidden(motion)
        found += _approaches(motion, impacts, recording)
    return sorted(_together(found), key=lambda one: -one.score)


def _misfits(points: pd.DataFrame, body: str) -> list[Doubtful]:
    """Frames in which a body's markers do not keep their distances, or two views of one do not meet."""
    if not len(points):
        return []
    times_s = points.groupby("frame")["time_s"].first()
    points = points.assign(z_m=0.0) if points["z_m"].isna().all() else points  # one camera sees from above
    places = {axis: points.pivot(index="frame", columns="marker", values=f"{axis}_m") for axis in "xyz"}
    names, xyz = (
        [str(one) for one in places["x"].columns],
        np.stack([places[axis].to_numpy(float) for axis in "xyz"], -1),
    )
    residual = "epipolar_px" if points["epipolar_px"].notna().any() else "reprojection_px"
    rays = points.pivot(index="frame", columns="marker", values=residual).to_numpy(float)
    pairs = list(combinations(range(len(names)), 2))
    usual_m, scale_m = _usual(xyz, pairs)
    off = np.abs(_distances(xyz, pairs) - usual_m) / scale_m
    apart = np.abs(rays - np.nanmedian(rays, 0)) / np.array(
        [max(spread(one[np.isfinite(one)]), 1e-12) for one in rays.T]
    )
    worst = np.fmax(np.nanmax(_known(off), 1), np.nanmax(_known(apart), 1))
    found = []
    for row in np.flatnonzero(worst > DOUBTFUL):
        exchanged = (
            _exchanged(xyz[row], pairs, usual_m, scale_m) if np.nanmax(_known(off[row : row + 1])) > DOUBTFUL else None
        )
        if exchanged is not None:
            kind, text = "swap", f"{names[exchanged[0]]} and {names[exchanged[1]]} may be exchanged"
        else:
            kind, text = (
                "slip",
                f"{names[_blamed(off[row], apart[row], pairs)]} does not fit the other markers of the {body}",
            )
        frame = int(times_s.index[row])
        found.append(Doubtful(frame, float(times_s.iloc[row]), kind, text, float(worst[row])))
    return found


def _distances(xyz: Array, pairs: Sequence[tuple[int, int]]) -> Array:
    if not pairs:
        return np.empty((*xyz.shape[:-2], 0))
    return np.stack([np.linalg.norm(xyz[..., a, :] - xyz[..., b, :], axis=-1) for a, b in pairs], -1)


def _usual(xyz: Array, pairs: Sequence[tuple[int, int]]) -> tuple[Array, Array]:
    """Median and robust spread of each distance over all frames."""
    distances = _distances(xyz, pairs)
    seen = [one[np.isfinite(one)] for one in distances.T]
    return (
        np.array([np.median(one) if len(one) else np.nan for one in seen]),
        np.array([max(spread(one), 1e-9) if len(one) else np.nan for one in seen]),
    )


def _known(values: Array) -> Array:
    """``values`` (frames, n) with a column of zeros, so that a frame in which nothing is known is not doubtful."""
    return np.concatenate([values, np.zeros((len(values), 1))], 1)


def _exchanged(xyz: Array, pairs: Sequence[tuple[int, int]], usual_m: Array, scale_m: Array) -> tuple[int, int] | None:
    """The two markers whose exchange would put every distance right; None where no exchange does."""
    for a, b in pairs:
        order = list(range(len(xyz)))
        order[a], order[b] = b, a
        off = np.abs(_distances(xyz[order], pairs) - usual_m) / scale_m
        if np.isfinite(off).any() and np.nanmax(off) < SETTLED:
            return a, b
    return None


def _blamed(off: Array, apart: Array, pairs: Sequence[tuple[int, int]]) -> int:
    """The marker whose distances and rays are worst together."""
    blame = np.nan_to_num(apart.copy())
    for (a, b), one in zip(pairs, np.nan_to_num(off), strict=True):
        blame[a] += one
        blame[b] += one
    return int(np.argmax(blame))


def _hidden(motion: pd.DataFrame) -> list[Doubtful]:
    """Frames in which fewer markers than usual gave a body's pose."""
    found = []
    for body in ("nes", "host"):
        seen = motion[f"{body}_markers"].astype(float).to_numpy() if f"{body}_markers" in motion else np.array([])
        usual = np.nanmedian(seen) if np.isfinite(seen).any() else 0.0
        for row in np.flatnonzero(seen < usual):
            text = f"{seen[row]:.0f} of {usual:.0f} markers of the {body} are seen"
            score = HIDDEN_SCORE * float(usual - seen[row]) / usual
            found.append(
                Doubtful(int(motion["frame"].iloc[row]), float(motion["time_s"].iloc[row]), "occlusion", text, score)
            )
    return found


def _approaches(motion: pd.DataFrame, impacts: pd.DataFrame | None, recording: Recording) -> list[Doubtful]:
    """Frames in which the NES comes to the round wall and turns back without an impact in the table."""
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    if host is None or nes is None or host.inner_radius_m is None or impacts is None:
        return []
    contact_m = host.inner_radius_m - nes.radius_m
    place = motion[["nes_x_m", "nes_y_m"]].to_numpy(float) - np.nan_to_num(
        motion[["host_x_m", "host_y_m"]].to_numpy(float)
    )
    radius_m, times_s = np.hypot(*place.T), motion["time_s"].to_numpy(float)
    speed = np.diff(radius_m) / np.diff(times_s)
    known_s = np.sort(impacts["time_s"].to_numpy(float))
    found = []
    for row in range(2, len(motion) - 2):
        before, after = speed[row - 2], speed[row + 1]
        turned = before > 0 and after < -TURN_SHARE * before
        step_s = float(times_s[row + 1] - times_s[row - 1])
        near = radius_m[row] > (1 - NEAR_SHARE) * contact_m and radius_m[row] == radius_m[row - 2 : row + 3].max()
        if turned and near and not (np.abs(known_s - times_s[row]) <= 2 * step_s).any():
            text = "the NES comes to the wall and turns back, and no impact was found there"
            found.append(
                Doubtful(int(motion["frame"].iloc[row]), float(times_s[row]), "approach", text, APPROACH_SCORE)
            )
    return found


def _together(found: Sequence[Doubtful]) -> list[Doubtful]:
    """Of frames of one kind that follow each other closely the worst alone."""
    kept: list[Doubtful] = []
    last: dict[str, int] = {}
    for one in sorted(found, key=lambda each: each.frame):
        if one.frame - last.get(one.kind, -(2**60)) > NEXT_FRAMES:
            kept.append(one)
        else:
            at = next(i for i in range(len(kept) - 1, -1, -1) if kept[i].kind == one.kind)
            kept[at] = max(kept[at], one, key=lambda each: each.score)
        last[one.kind] = one.frame
    return kept
