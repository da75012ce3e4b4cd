"""The NES angle from marker triplets (thesis Sec. 7.3.2), beside the rigid-body fit of ``analysis.motion.bodies``.

A triplet's angle uses two markers only, the ends of its base line; the third says which side is up.  The mean
over all triplets therefore weights markers unevenly and its spread is no standard deviation of the mean:
triplets share markers. The rigid fit uses every marker with its own weight; the difference of the two is what
the report shows.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from analysis.motion.host_circle import marker_positions
from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]
# Height over base below which a triplet is flat: its angle would be ten times as noisy as its base line's.
FLAT_SHARE = 0.1


def rotation(points: pd.DataFrame, motion: pd.DataFrame, recording: Recording) -> pd.DataFrame:
    """Table ``rotation``: mean and spread of the triplets' angles beside the rigid fit's angle, one row per
    frame of ``motion``.

    Each triplet is brought to the rigid fit's zero by the circular mean of its difference from it, and
    unwrapped along it. ``nes_angle_triplet_spread_rad`` is null where a single triplet was seen.
    """
    frames, angles = triplet_angles(points, recording)
    fit = motion.set_index("frame")["nes_angle_rad"] if "nes_angle_rad" in motion else pd.Series(dtype=float)
    sd = motion.set_index("frame").get("nes_angle_sd_rad", pd.Series(np.nan, index=motion["frame"]))
    reference = fit.reindex(frames).to_numpy(float)
    aligned = pd.DataFrame({name: _along(angle, reference) for name, angle in angles.items()}, index=frames)
    aligned = aligned.reindex(motion["frame"])
    seen = aligned.notna().sum(axis=1).to_numpy()
    return pd.DataFrame(
        {
            "frame": motion["frame"].to_numpy(),
            "time_s": motion["time_s"].to_numpy(float),
            "nes_angle_triplet_rad": aligned.mean(axis=1).to_numpy(),
            "nes_angle_triplet_spread_rad": np.where(seen > 1, aligned.std(axis=1).to_numpy(), np.nan),
            "nes_angle_fit_rad": motion["nes_angle_rad"].to_numpy(float) if "nes_angle_rad" in motion else np.nan,
            "nes_angle_fit_sd_rad": sd.to_numpy(float),
        }
    )


def triplet_angles(points: pd.DataFrame, recording: Recording) -> tuple[NDArray[np.int64], dict[str, Array]]:
    """Angle in (-pi, pi] of every NES triplet that is not flat: frames (F,) and ``{"N1-N2-N3": (F,)}``, NaN
    where unseen.

    Within a triplet the base line AC is its longest side (median over the frames): the angle's error is that
    of AC's direction, and falls with its length.  A triplet flatter than a tenth of its base is left out:
    noise could turn its side over, and the angle by pi.  The name puts the apex B second, as the thesis' Fig.
    40.
    """
    nes = recording.settings.bodies.nes
    if nes is None or len(nes.markers) < 3:
        raise InputError(
            f"{0 if nes is None else len(nes.markers)} NES markers in recording.toml",
            "three or more",
            "an angle from triplets needs three markers on the NES",
        )
    frames, _, position_m = marker_positions(points, nes.markers)
    angles = {}
    for triplet in combinations(range(len(nes.markers)), 3):
        a, b, c = _base_and_apex(position_m, triplet)
        if a < 0:
            continue
        name = "-".join(nes.markers[i] for i in (a, b, c))
        angles[name] = triplet_angle(position_m[:, a], position_m[:, b], position_m[:, c])
    if not angles:
        together = int(np.isfinite(position_m).all(-1).sum(1).max(initial=0))
        if together < 3:
            raise InputError(
                f"no more than {together} of the NES' markers {', '.join(nes.markers)} in any frame",
                "three in one frame",
                "check the tracks of the NES' markers",
            )
        raise InputError(
            "every triplet of NES markers lies on one line",
            "three markers that span a triangle",
            "add a marker off the line",
        )
    return frames, angles


def triplet_angle(a_m: ArrayLike, b_m: ArrayLike, c_m: ArrayLike) -> Array:
    """Direction of PB in the plane, P the foot of B on the line AC: thesis eqs (114)-(115) as corrected.

    PB = (BC . AC) AC / |AC|^2 - BC (as printed it has no dimension of a length), and atan2 in place of cos,
    which loses the sign.  Positions (..., 2 or 3) in metres; z is ignored, the NES turns in the plane.
    """
    a, b, c = (np.asarray(p, float)[..., :2] for p in (a_m, b_m, c_m))
    bc, ac = c - b, c - a
    with np.errstate(divide="ignore", invalid="ignore"):
        foot = np.sum(bc * ac, -1, keepdims=True) * ac / np.sum(ac * ac, -1, keepdims=True)
    pb = foot - bc
    return np.arctan2(pb[..., 1], pb[..., 0])


def _base_and_apex(position_m: Array, triplet: tuple[int, ...]) -> tuple[int, int, int]:
    """(A, B, C) with AC the longest side; (-1, -1, -1) for a flat triplet or one never seen together."""
    together = position_m[np.isfinite(position_m[:, triplet]).all((1, 2))][:, triplet, :2]
    if not len(together):
        return -1, -1, -1
    sides = [
        float(np.median(np.linalg.norm(together[:, (k + 1) % 3] - together[:, (k + 2) % 3], axis=-1))) for k in range(3)
    ]
    apex = int(np.argmax(sides))  # side k lies opposite to corner k
    u, v = together[:, 1] - together[:, 0], together[:, 2] - together[:, 0]
    height = float(np.median(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))) / max(sides[apex], 1e-300)
    if not height > FLAT_SHARE * sides[apex]:
        return -1, -1, -1
    return triplet[(apex + 1) % 3], triplet[apex], triplet[(apex + 2) % 3]


def _along(angle: Array, reference: Array) -> Array:
    """``angle`` shifted to the zero of ``reference`` and unwrapped along it; along itself where there is no
    reference.
    """
    both = np.isfinite(angle) & np.isfinite(reference)
    if not both.any():
        return unwrap_over_gaps(angle) - angle[np.isfinite(angle)][0] if np.isfinite(angle).any() else angle
    zero = np.angle(np.mean(np.exp(1j * (angle - reference)[both])))
    difference = angle - zero - reference
    return reference + (difference + np.pi) % (2 * np.pi) - np.pi


def unwrap_over_gaps(angle_rad: ArrayLike) -> Array:
    """``numpy.unwrap`` over the values that are there; NaN stays NaN.  A turn of more than pi inside a gap is
    lost.
    """
    angle = np.array(angle_rad, float)
    seen = np.isfinite(angle)
    angle[seen] = np.unwrap(angle[seen])
    return angle
