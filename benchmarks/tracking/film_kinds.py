"""The kinds of films that ``films.py`` renders: light, blur, spin, rigs, cameras and clocks that make
markers hard to follow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from vision.rendering.images import Band, Glare, Look, Markers
from vision.rendering.motion import bouncing
from vision.rendering.recording import Files, Motion, Setup, look_at, render_recording, thesis_setup
from vision.rendering.scene import Greys, Pose, Rig

WINDOW_PX = (1400, 688)
# Light in window pixels: the ring lies in the middle half of the picture, ground markers left and right of it.
BANDS = (Band(450, 120, 0.6, softness_px=6), Band(720, 60, 0.5, 0.3, 3), Band(1000, 200, 0.7, softness_px=20))
GLARES = (Glare(560, 300, 60, 90), Glare(860, 400, 30, 120), Glare(700, 200, 15, 100))
Looks = Callable[[str, int], Look]


@dataclass(frozen=True)
class Kind:
    """What differs from the thesis' rig in even light.

    ``spin_rad_per_s`` is added to the NES' own; ``looks(camera, frame)``: light that changes; ``setup``: changes
    cameras or rig;
    ``clock_s``: the second camera sees the world so much later.
    """

    look: Look = Look()
    exposure_s: float = 5e-5
    spin_rad_per_s: float = 0.0
    looks: Looks | None = None
    setup: Callable[[Setup], Setup] = lambda setup: setup
    clock_s: float = 0.0


def filmed(folder: Path, kind: Kind, frames: int, seed: int) -> pd.DataFrame:
    """Render a recording into the folder; its truth."""
    rng = np.random.default_rng(seed)
    setup = kind.setup(replace(thesis_setup(rng, WINDOW_PX), look=kind.look, exposure_s=kind.exposure_s))
    motion = spun(bouncing(frames / setup.frame_rate_hz), kind.spin_rad_per_s)
    truth = render_recording(
        folder, setup, motion, frames, rng, Files(views=0, suffix=".bmp"), looks=kind.looks, clock_s=kind.clock_s
    )
    text = (folder / "recording.toml").read_text(encoding="utf-8")
    head, tail = text.split("[calibration]", 1)
    (folder / "recording.toml").write_text(
        head + '[calibration]\nfile = "true_calibration.json"\n\n' + tail[tail.index("[bodies") :], encoding="utf-8"
    )
    return truth


def spun(motion: Motion, spin_rad_per_s: float) -> Motion:
    """The motion with a spin added to the NES'."""

    def at(t: float) -> Mapping[str, Pose]:
        poses = motion(t)
        return {**poses, "nes": replace(poses["nes"], angle_rad=poses["nes"].angle_rad + spin_rad_per_s * t)}

    return at


def moving_glare(camera: str, frame: int) -> Look:
    """Two highlights that run over the ring at 6 and 9 px per frame."""
    return Look(
        glares=(
            Glare(450 + 6 * frame + 40 * (camera == "VW2"), 250 + 3 * frame, 40, 110),
            Glare(950 - 9 * frame, 420, 20, 130),
        )
    )


def hidden(camera: str, frame: int) -> Look:
    """An arm over the whole ring from frame 5 to 15 in both cameras."""
    return Look(bands=(Band(700, 900, 1.0, softness_px=0.5),)) if 5 <= frame < 15 else Look()


def high_wall(setup: Setup) -> Setup:
    """A wall of 20 mm, whose ring carries the Host's markers: it covers the NES' where they come near."""
    host = setup.rig.markers["host"]
    raised = replace(host, layout_m=host.layout_m + [0.0, 0.0, 0.008])
    return replace(setup, rig=replace(setup.rig, wall_height_m=0.02, markers={**setup.rig.markers, "host": raised}))


def nes_markers(
    *angles_deg: float, radius_m: float = 0.0062, disc_m: float = 0.0013, grey: float = 20.0, centre: bool = False
) -> Markers:
    turn = np.radians(angles_deg)
    layout = np.stack([radius_m * np.cos(turn), radius_m * np.sin(turn), 0 * turn + 0.01], -1)
    layout = np.concatenate([[[0.0, 0.0, 0.01]], layout]) if centre else layout
    return Markers(tuple(f"N{i + 1}" for i in range(len(layout))), np.round(layout, 6), disc_m, grey)


def nes(markers: Markers) -> Callable[[Setup], Setup]:
    return lambda setup: replace(setup, rig=replace(setup.rig, markers={**setup.rig.markers, "nes": markers}))


def all_markers(scale: float = 1.0, grey: float = 20.0) -> Callable[[Setup], Setup]:
    return lambda setup: replace(
        setup,
        rig=replace(
            setup.rig,
            markers={
                body: replace(own, radius_m=scale * own.radius_m, grey=grey) for body, own in setup.rig.markers.items()
            },
        ),
    )


def light_on_dark(setup: Setup) -> Setup:
    dark = Rig(
        setup.rig.markers,
        greys=Greys(background=40.0, ring=60.0, outer_wall=30.0, inner_wall=110.0, floor=90.0, nes=45.0, nes_side=25.0),
    )
    return all_markers(grey=225.0)(replace(setup, rig=dark))


def seen_from(tilt_rad: float, distance_m: float, focal_px: float) -> Callable[[Setup], Setup]:
    """Cameras elsewhere, each leaning by `tilt_rad`."""

    def moved(setup: Setup) -> Setup:
        middle = np.array([0.02, -0.028, 0.0])
        cameras, offsets = [], []
        for camera, side in zip(setup.cameras, (-1, 1), strict=True):
            eye = middle + distance_m * np.array([side * np.sin(tilt_rad), 0.1, np.cos(tilt_rad)])
            cameras.append(
                look_at(
                    camera.name,
                    eye,
                    middle,
                    focal_px,
                    camera.sensor_size_px,
                    camera.distortion,
                    (2030.0, 1550.0),
                    0.02 * side,
                )
            )
            u, v = cameras[-1].project(middle)
            offsets.append((int(u - WINDOW_PX[0] / 2), int(v - WINDOW_PX[1] / 2)))
        return replace(setup, cameras=tuple(cameras), window_offset_px=tuple(offsets))

    return moved


def window(size_px: tuple[int, int], shift_px: tuple[int, int]) -> Callable[[Setup], Setup]:
    """A smaller window, moved."""
    return lambda setup: replace(
        setup,
        window_size_px=size_px,
        window_offset_px=tuple(
            (u + (WINDOW_PX[0] - size_px[0]) // 2 + shift_px[0], v + (WINDOW_PX[1] - size_px[1]) // 2 + shift_px[1])
            for u, v in setup.window_offset_px
        ),
    )


FAINT = Look(gain=0.25, noise_grey=2.0)
HARD = Look(noise_grey=4.0, bands=BANDS)
KINDS: dict[str, Kind] = {
    "plain": Kind(),
    "noise of 6 greys": Kind(Look(noise_grey=6.0)),
    "light from one side": Kind(Look(gradient=(0.8, -0.5))),
    "half the light": Kind(Look(gain=0.5, noise_grey=2.0)),
    "a quarter of the light": Kind(FAINT),
    "shadow bands": Kind(Look(bands=BANDS)),
    "glare": Kind(Look(glares=GLARES)),
    "glare that moves": Kind(looks=moving_glare),
    "500 rad/s": Kind(spin_rad_per_s=500.0),
    "blurred by 0.4 ms": Kind(exposure_s=4e-4),
    "500 rad/s smeared 4 px": Kind(exposure_s=2.4e-4, spin_rad_per_s=500.0),
    "500 rad/s, 4 px, bands, noise 4": Kind(HARD, 2.4e-4, 500.0),
    "blur 2 px, noise 4": Kind(Look(blur_px=2.0, noise_grey=4.0)),
    "hidden for 10 frames": Kind(looks=hidden),
    "window cuts the NES": Kind(setup=window((1400, 400), (0, 100))),
    "wall of 20 mm covers markers": Kind(setup=high_wall),
    "NES with 3 markers": Kind(setup=nes(nes_markers(0, 100, 215))),
    "NES with 4 markers": Kind(setup=nes(nes_markers(0, 80, 170, 275))),
    "NES with 6 markers": Kind(setup=nes(nes_markers(0, 62, 130, 205, 280, centre=True))),
    "NES symmetric, 5 in a ring": Kind(setup=nes(nes_markers(0, 72, 144, 216, 288))),
    "discs of 4 px": Kind(setup=all_markers(0.6)),
    "light on dark": Kind(setup=light_on_dark),
    "60 degrees between the cameras": Kind(setup=seen_from(0.52, 1.2, 6300.0)),
    "leaning 50 degrees each": Kind(setup=seen_from(0.87, 1.2, 6300.0)),
    "longer lens, discs of 10-20 px": Kind(setup=lambda s: all_markers(1.25)(seen_from(0.36, 1.0, 7600.0)(s))),
    "second camera 0.3 ms late": Kind(clock_s=3e-4),
}
