"""Tracking from a rig of 20 mm at 4000 frames/s to one of 500 mm at 100, discs of 3 to 60 px, a body thrown across a
quarter of the window.

    python benchmarks/tracking/track_rigs.py [--frames 60] [--seed 1] [--only "500 mm"]

Rendered films of each rig (``RIGS``: the Host's inner radius, frames per second, the discs' radius in pixels), with the
true calibration. The NES flies straight from wall to wall; every second impact throws it a quarter of the window's
width per frame, the others let it creep, and each gives it another spin, up to 0.6 rad per frame either way.  The Host
swings by a tenth of its radius, in 40 frames; "shaken hard": by a quarter, in 10.  ``seen``: of the markers that the
picture shows wholly, those with a track; ``NES``: the same of the NES' alone;
``swaps``: tracks nearer to another marker's true place than to their own; ``wrong``: tracks more than a radius off;
``px``: median, RMS and largest error of the others' centres; ``in``: share of their coordinates within 1.645 sd
(honest: 90 %); ``ms``: clock per frame of both cameras.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ovines.camera import read_calibration
from ovines.errors import InputError
from ovines.recording import read_recording
from vision.calibration.targets.boards import find_board
from vision.rendering.images import Look, Markers, Pose, Rig
from vision.rendering.recording import Files, Motion, Setup, look_at, render_recording
from vision.track import track


@dataclass(frozen=True)
class Film:
    """A rig and its cameras.  ``nes_discs``, ``host_discs``, ``ring_discs``: radius of the NES and of its ring of
    markers, radius of the Host's wall and the width of its ring, in radii of a disc.
    """

    host_m: float
    rate_hz: float
    disc_px: float
    nes_discs: float = 7.4
    marker_discs: float = 4.6
    host_discs: float = 37.0
    ring_discs: float = 7.0
    swing: float = 0.1
    period_frames: float = 40.0

    @property
    def disc_m(self) -> float:
        return self.host_m / self.host_discs

    @property
    def window_px(self) -> tuple[int, int]:
        """The swinging ring with room for a ground marker on each side."""
        half = (
            self.disc_px * np.array([self.aside_discs + 2.0, self.host_discs + self.ring_discs + 1.0]) + 12.0
        )  # a fit looks at 10 px about a disc
        return 2 * int(np.ceil(half[0])), 2 * int(np.ceil(half[1]))

    @property
    def aside_discs(self) -> float:
        """Where the ground markers lie, in x: beside the swinging ring, whose top leans over them by a tenth of its
        radius.
        """
        return self.host_discs * (1.1 + self.swing) + self.ring_discs + 2.0


COMPACT = {"nes_discs": 3.6, "marker_discs": 2.25, "host_discs": 9.5, "ring_discs": 3.0}  # large discs
RIGS = {
    "20 mm, 4000/s, 2 px": Film(0.02, 4000.0, 2.0),
    "20 mm, 4000/s, 3 px": Film(0.02, 4000.0, 3.0),
    "20 mm, 4000/s, 8 px": Film(0.02, 4000.0, 8.0),
    "20 mm, 4000/s, 60 px": Film(0.02, 4000.0, 60.0, **COMPACT),
    "50 mm, 800/s, 7 px": Film(0.05, 800.0, 7.0),
    "50 mm, 800/s, 20 px": Film(0.05, 800.0, 20.0, **COMPACT),
    "500 mm, 100/s, 3 px": Film(0.5, 100.0, 3.0),
    "500 mm, 100/s, 8 px": Film(0.5, 100.0, 8.0),
    "500 mm, 100/s, 8 px, shaken hard": Film(0.5, 100.0, 8.0, swing=0.25, period_frames=10.0),
    "500 mm, 100/s, 60 px": Film(0.5, 100.0, 60.0, **COMPACT),
}
CREEP, THROW = 0.02, 0.25  # of the window's width, per frame
SPIN_RAD = 0.6  # per frame at most


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="rigs whose name holds this")
    args = parser.parse_args()
    print(f"{'rig':34s}    seen     NES swaps wrong | px: med   rms  largest   in |  ms")
    for name, film in ((n, f) for n, f in RIGS.items() if args.only in n):
        with tempfile.TemporaryDirectory() as folder:
            print(f"{name:34s} {row(Path(folder), film, args.frames, args.seed)}", flush=True)


def filmed(folder: Path, film: Film, frames: int, seed: int) -> pd.DataFrame:
    """Render a film into the folder; its truth."""
    rng = np.random.default_rng(seed)
    truth = render_recording(
        folder, setup_of(film, rng), motion_of(film, frames, rng), frames, rng, Files(views=0, suffix=".bmp")
    )
    text = (folder / "recording.toml").read_text(encoding="utf-8")
    head, tail = text.split("[calibration]", 1)
    text = (
        head
        + '[calibration]\nfile = "true_calibration.json"\n\n'
        + tail[tail.index("[bodies") : tail.index("[excitation]")]
    )
    (folder / "recording.toml").write_text(text, encoding="utf-8")
    return truth


def setup_of(film: Film, rng: np.random.Generator) -> Setup:
    """Two cameras 24 Host radii away, 40 degrees apart; discs placed to a hundredth of their radius."""
    disc_m, window = film.disc_m, film.window_px
    size = (window[0] + 64, window[1] + 32)
    away_m = 24.6 * film.host_m
    focal = film.disc_px / disc_m * away_m
    height_m = 0.24 * film.host_m

    def ring(degrees: tuple[float, ...], radius: float, z_m: float) -> np.ndarray:
        a = np.radians(degrees)
        return disc_m * np.stack([radius * np.cos(a), radius * np.sin(a), 0 * a], -1) + [0.0, 0.0, z_m]

    out = film.host_discs + 0.5 * film.ring_discs
    ground = disc_m * np.array(
        [[-film.aside_discs, 0.2 * out, 0.0], [film.aside_discs, 0.15 * out, 0.0], [film.aside_discs, -0.5 * out, 0.0]]
    )
    nes = ring((0, 85, 165, 262), film.marker_discs, 0.2 * film.host_m)
    rig = Rig(
        {
            "ground": Markers(("G1", "G2", "G3"), ground, disc_m),
            "host": Markers(("H1", "H2", "H3", "H4"), ring((22, 118, 205, 309), out, height_m), disc_m),
            "nes": Markers(("N1", "N2", "N3", "N4"), nes, disc_m),
        },
        host_inner_radius_m=film.host_m,
        host_outer_radius_m=film.host_m + film.ring_discs * disc_m,
        wall_height_m=height_m,
        nes_radius_m=film.nes_discs * disc_m,
        nes_height_m=0.2 * film.host_m,
    )
    cameras = tuple(
        look_at(
            name,
            away_m * np.array([side * np.sin(0.36), 0.01, np.cos(0.36)]),
            np.zeros(3),
            focal,
            size,
            np.array([-0.05, 0.1, 2e-4, -1e-4, 0.0]),
            (size[0] / 2 + 5.0, size[1] / 2 - 3.0),
        )
        for name, side in (("left", -1), ("right", 1))
    )
    return Setup(
        cameras, ((32, 16),) * 2, window, rig, find_board("charuco_5x7_8mm"), Look(), film.rate_hz, 1e-3 / film.rate_hz
    )


def motion_of(film: Film, frames: int, rng: np.random.Generator) -> Motion:
    """Straight flights between points of the circle that the NES' centre can reach, in the Host's frame, by turns slow
    and fast.
    """
    per_m = film.disc_px / film.disc_m
    free_m = film.host_m - film.nes_discs * film.disc_m
    times, places, angles = [0.0], [np.array([0.3 * free_m, -0.2 * free_m])], [0.4]
    turn, fast = 0.3, False
    while times[-1] < frames + 2:
        turn += np.pi + rng.uniform(-1.0, 1.0)
        target = free_m * np.array([np.cos(turn), np.sin(turn)])
        step_m = (THROW if fast else CREEP) * film.window_px[0] / per_m
        lasts = float(np.hypot(*(target - places[-1]))) / step_m
        if not fast and lasts > 6.0:  # creeping all the way would be another film
            target, lasts = places[-1] + (target - places[-1]) * 6.0 / lasts, 6.0
        times.append(times[-1] + lasts)
        places.append(target)
        angles.append(angles[-1] + lasts * rng.uniform(-SPIN_RAD, SPIN_RAD))
        fast = not fast
    path = np.array(places)

    def at(t: float) -> Mapping[str, Pose]:
        frame = t * film.rate_hz
        host = film.swing * film.host_m * np.sin(2 * np.pi * frame / film.period_frames)
        x, y, angle = (float(np.interp(frame, times, column)) for column in (path[:, 0], path[:, 1], angles))
        return {"host": Pose(host, 0.1 * host), "nes": Pose(host + x, 0.1 * host + y, 0.0, angle)}

    return at


def row(folder: Path, film: Film, frames: int, seed: int) -> str:
    """Render, follow and judge one film: a row of the table."""
    truth = filmed(folder, film, frames, seed)
    recording, cameras = read_recording(folder), read_calibration(folder / "true_calibration.json")
    began = time.perf_counter()
    try:
        found = track(recording, cameras)
    except InputError as error:
        return f"refused: {error}"
    clock_ms = 1e3 * (time.perf_counter() - began) / frames
    notes = [note for note in found.notes if "from images" not in note]
    return judged(truth, found.tracks, film.disc_px) + f" | {clock_ms:.0f}" + "".join(f"\n    {note}" for note in notes)


def judged(truth: pd.DataFrame, tracks: pd.DataFrame, disc_px: float) -> str:
    """Markers seen, swapped, wrong, and how far off the others are."""
    both = truth.merge(tracks, on=["camera", "frame", "marker"], suffixes=("_true", ""), how="left")
    off = both[["u_px", "v_px"]].to_numpy() - both[["u_px_true", "v_px_true"]].to_numpy()
    error, found, visible = np.hypot(*off.T), both["u_px"].notna().to_numpy(), both["visible"].to_numpy()
    swaps = 0
    for _, own in both[found].groupby(["camera", "frame"]):
        apart = np.hypot(*(own[[f"{k}_px"]].to_numpy() - own[f"{k}_px_true"].to_numpy() for k in "uv"))
        swaps += int((apart.argmin(1) != np.arange(len(own))).sum())
    right = found & (error < disc_px)
    inside = np.mean(np.abs(off[right]) < 1.645 * both.loc[right, ["sd_px"]].to_numpy())
    nes = visible & (both["body"] == "nes").to_numpy()
    return (
        f"{found[visible].mean():7.2%} {found[nes].mean():7.2%} {swaps:5d} {int((found & ~right).sum()):5d} | "
        f"{np.median(error[right]):7.4f} "
        f"{np.sqrt(np.mean(error[right] ** 2)):7.4f} {error[right].max():6.3f} {inside:5.0%}"
    )


if __name__ == "__main__":
    main()
