"""Tracking mistakes put into good tracks: two names exchanged, a marker that slipped, for some frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

SLIP_PX = 3.0
Mistake = tuple[int, int, str]


def with_mistakes(
    tracks: pd.DataFrame, markers: Sequence[str], count: int, rng: np.random.Generator
) -> tuple[pd.DataFrame, list[Mistake]]:
    """Tracks with ``count`` mistakes of one to four frames each, slips and swaps in turn, of ``markers``; and each
    mistake's first frame, number of frames and kind.  Swaps are of both cameras or of the second alone.
    """
    tracks, put = tracks.copy(), []
    cameras = sorted(tracks["camera"].unique())
    first, last = int(tracks["frame"].min()), int(tracks["frame"].max())
    apart = (last - first - 8) // count
    starts = first + 4 + apart * np.arange(count) + rng.integers(0, max(apart - 5, 1), count)
    for number, start in enumerate(starts):
        length = int(rng.integers(1, 5))
        at = tracks["frame"].between(start, start + length - 1)
        one, two = rng.choice(list(markers), 2, replace=False)
        if number % 2:
            at &= tracks["camera"].isin(cameras if rng.random() < 0.5 else cameras[1:])
            tracks.loc[at, "marker"] = tracks.loc[at, "marker"].replace({one: two, two: one})
        else:
            at &= (tracks["camera"] == rng.choice(cameras)) & (tracks["marker"] == one)
            turn = rng.uniform(0, 2 * np.pi)
            tracks.loc[at, ["u_px", "v_px"]] += SLIP_PX * np.array([np.cos(turn), np.sin(turn)])
        if at.any():  # the marker may be hidden there
            put.append((int(start), length, "swap" if number % 2 else "slip"))
    return tracks, put
