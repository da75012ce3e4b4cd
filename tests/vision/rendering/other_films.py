"""Recordings as a stranger would bring them, drawn by `other_renderer`: a folder with views of a ChArUco board by both
cameras, frames, recording.toml.

`judge_films` says how true the chain is on them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd

from tests.vision.rendering.other_renderer import PLACES, Bodies, Lens, Window, exposed

BOARDS = {
    "charuco_5x7_8mm": (5, 7, 0.008, 0.006, "DICT_5X5_50"),
    "charuco_7x10_15mm": (7, 10, 0.015, 0.011, "DICT_5X5_50"),
    "charuco_9x13_20mm": (9, 13, 0.02, 0.015, "DICT_5X5_100"),
}
MIDDLE = np.array([0.045, -0.055])  # where the ring rests, seen from the board's corner
STILL = Bodies((0, 0), (0, 0), np.empty((0, 7)))


@dataclass(frozen=True)
class Kind:
    """One stranger's rig, cameras and habits."""

    sensor: tuple[int, int] = (2048, 1536)
    window: tuple[int, int] = (1200, 800)
    px_per_mm: float = 5.3
    leans_deg: tuple[float, float] = (-20.0, 20.0)
    aside_deg: float = 4.0  # leaning along y too
    rolls_deg: tuple[float, float] = (2.0, -3.0)
    distance_m: float = 1.1
    bend: tuple[float, float, float, float, float] = (-0.08, 0.12, 3e-4, -2e-4, -0.05)
    rate_hz: float = 800.0
    exposure_s: float = 2e-5
    spin: float = 60.0
    shaken_m: float = 0.016
    nes_deg: tuple[float, ...] = (0, 83, 150, 262)
    nes_out_m: float = 0.0065
    nes_centre: bool = True
    host_deg: tuple[float, ...] = (22, 118, 205, 309)
    host_centre: bool = False
    ground: tuple[tuple[float, float], ...] = (
        (-0.08, 0.02),
        (0.085, 0.005),
        (0.078, -0.055),
    )  # clockwise from the left, as they are named
    sticker_m: dict[str, float] = field(default_factory=lambda: {"ground": 0.002, "host": 0.002, "nes": 0.0013})
    grey: float = 20.0
    paper: float | None = None  # grey of a thin ring about each sticker: half a radius wide
    bodies: Bodies = STILL
    clutter: tuple[
        tuple[float, float, float, float, float], ...
    ] = ()  # x, y, z, radius, grey: screws and holes on the ring
    blur: float = 0.8
    noise: float = 2.0
    photons: float = 0.0
    vignette: float = 0.0
    glare: tuple[tuple[float, float, float, float], ...] = ()  # u, v, sd, grey
    bits: int = 8
    suffix: str = ".png"
    quality: int = 92
    colour: bool = False
    layout: bool = True
    layout_sd_m: float = 0.0  # how far the stickers lie from their design
    jitter_s: float = 0.0
    board: str = "charuco_7x10_15mm"
    views: int = 10
    print_of: dict[str, bool] = field(default_factory=dict)  # legacy, inverted: unlike what the board's TOML says
    printed: Callable[[np.ndarray], np.ndarray] = lambda picture: (
        picture
    )  # what a mistaken user does to the board's pictures
    toml: Callable[[str], str] = lambda text: text


def lenses(kind: Kind, rng: np.random.Generator) -> list[Lens]:
    focal = 1000 * kind.px_per_mm * kind.distance_m
    found = []
    for name, lean, roll in zip(("left", "right"), np.radians(kind.leans_deg), np.radians(kind.rolls_deg), strict=True):
        aside = np.radians(kind.aside_deg)
        eye = np.append(MIDDLE, 0.0) + kind.distance_m * np.array(
            [np.sin(lean), np.sin(aside) * np.cos(lean), np.cos(aside) * np.cos(lean)]
        )
        forward = np.append(MIDDLE + rng.normal(0, 0.002, 2), 0.0) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        plain = np.stack([right, np.cross(forward, right), forward])
        turn = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]]) @ plain
        centre = (0.5 * kind.sensor[0] + rng.normal(0, 10), 0.5 * kind.sensor[1] + rng.normal(0, 10))
        found.append(Lens(name, kind.sensor, (focal * 1.003, focal), centre, kind.bend, turn, -turn @ eye))
    return found


def plant(kind: Kind, seconds: float, rng: np.random.Generator) -> Callable[[float], np.ndarray]:
    """Own, crude dynamics: ring shaken along x at 11 Hz, washer flying straight, bouncing off its wall, its spin thrown
    about.

    Gives (ring x, y, angle, washer x, y, angle) at a time, relative to MIDDLE.
    """
    step, b = 1e-5, kind.bodies
    t = np.arange(-0.01, seconds + 0.01, step)
    ring = np.stack([kind.shaken_m * np.sin(2 * np.pi * 11 * t + 0.4), 0.0004 * np.sin(2 * np.pi * 11 * t)], -1)
    pull = np.gradient(ring, step, axis=0)
    at, speed, angle, spin = ring[0] + [0.2 * b.inner, -0.1 * b.inner], np.array([0.9, 0.55]), 0.3, kind.spin
    path = np.empty((len(t), 3))
    for i in range(len(t)):
        at, angle = at + step * speed, angle + step * spin
        off = at - ring[i]
        far = np.hypot(*off)
        out = off / far
        closing = (speed - pull[i]) @ out
        if far > b.inner - b.washer and closing > 0:
            speed = speed - (1 + 0.75) * closing * out + 0.15 * closing * np.array([-out[1], out[0]])
            spin = kind.spin * rng.choice([-1, 1]) * rng.uniform(0.6, 1.0)
        path[i] = *at, angle
    columns = np.column_stack([ring, 0.02 * np.sin(2 * np.pi * 11 * t), path])
    return lambda now: np.array([np.interp(now, t, column) for column in columns.T])


def layouts(kind: Kind) -> dict[str, np.ndarray]:
    """Design places (n, 3) of each body's stickers."""
    b = kind.bodies

    def around(degrees, out, z):
        a = np.radians(degrees)
        return np.round(np.stack([out * np.cos(a), out * np.sin(a), 0 * a + z], -1), 5)

    nes = around(kind.nes_deg, kind.nes_out_m, b.washer_height)
    host = around(kind.host_deg, 0.5 * (b.inner + b.outer), b.wall)
    ground = np.array([(*(MIDDLE + place), b.table) for place in kind.ground])
    return {
        "ground": ground,
        "host": np.r_[[[0.0, 0.0, 0.0]], host] if kind.host_centre else host,
        "nes": np.r_[[[0.0, 0.0, b.washer_height]], nes] if kind.nes_centre else nes,
    }


def scene(kind: Kind, placed: dict[str, np.ndarray], pose: np.ndarray) -> Bodies:
    """The bodies at a pose of the plant; ``placed``: where the stickers really sit."""
    ring, washer = MIDDLE + pose[:2], MIDDLE + pose[3:5]
    rows = []
    for body, own in placed.items():
        at, angle = {"ground": (np.zeros(2), 0.0), "host": (ring, pose[2]), "nes": (washer, pose[5])}[body]
        c, s = np.cos(angle), np.sin(angle)
        r = kind.sticker_m[body]
        for x, y, z in own:
            paper = (r * 1.5, kind.paper) if kind.paper is not None else (r, kind.grey)
            rows.append((at[0] + c * x - s * y, at[1] + s * x + c * y, z, r, kind.grey, *paper))
    c, s = np.cos(pose[2]), np.sin(pose[2])
    rows += [
        (ring[0] + c * x - s * y, ring[1] + s * x + c * y, z, r, grey, r, grey) for x, y, z, r, grey in kind.clutter
    ]
    return replace(kind.bodies, ring_at=tuple(ring), washer_at=tuple(washer), stickers=np.array(rows))


def drawn(folder: Path, kind: Kind, frames: int, seed: int) -> pd.DataFrame:
    """Write a recording; the truth: one row per camera, frame and marker."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    cameras, design = lenses(kind, rng), layouts(kind)
    placed = {
        body: own
        + (
            np.column_stack([rng.normal(0, kind.layout_sd_m, (len(own), 2)), np.zeros(len(own))])
            if body != "ground"
            else 0.0
        )
        for body, own in design.items()
    }
    names = [f"{body[0].upper()}{i + 1}" for body, own in placed.items() for i in range(len(own))]
    offsets = []
    for lens in cameras:
        u, v = lens.pixels(np.append(MIDDLE, 0.5 * kind.bodies.wall))
        low = [
            int(np.clip(at - 0.5 * size, 0, whole - size))
            for at, size, whole in zip((u, v), kind.window, kind.sensor, strict=True)
        ]
        offsets.append((low[0] // 4 * 4, low[1] // 2 * 2))
        _boards(folder, kind, lens, np.random.default_rng([seed, len(lens.name)]))
    motion = plant(kind, frames / kind.rate_hz, rng)
    times = (
        np.arange(frames) / kind.rate_hz + rng.normal(0, kind.jitter_s, frames)
        if kind.jitter_s
        else np.arange(frames) / kind.rate_hz
    )
    if kind.jitter_s:
        pd.DataFrame({"frame": np.arange(frames), "time_s": times}).to_csv(folder / "trigger.csv", index=False)
    rows = []
    for lens, offset in zip(cameras, offsets, strict=True):
        window, save = Window(lens, *offset, *kind.window), _saver(folder / lens.name, kind)
        v, u = np.mgrid[: kind.window[1], : kind.window[0]]
        away = np.hypot(u + offset[0] - lens.centre[0], v + offset[1] - lens.centre[1]) / (0.5 * kind.sensor[0])
        extra = sum(
            (grey * np.exp(-0.5 * ((u - a) ** 2 + (v - b) ** 2) / sd**2) for a, b, sd, grey in kind.glare), np.zeros(1)
        )
        for frame, now in enumerate(times):
            middle = scene(kind, placed, motion(now))
            ends = [
                window.lens.pixels(scene(kind, placed, motion(now + half * kind.exposure_s)).stickers[:, :3])
                for half in (-0.5, 0.5)
            ]
            moved = np.abs(ends[1] - ends[0]).max()
            light, n = window.bodies(middle), 1 if moved < 0.15 else 1 + 2 * int(np.ceil(1.2 * moved))
            if n > 1:
                box = _box(window, middle)
                light[box[1] : box[3], box[0] : box[2]] = np.mean(
                    [
                        window.bodies(
                            scene(kind, placed, motion(now + kind.exposure_s * ((k + 0.5) / n - 0.5))),
                            box,
                            PLACES[32 * (k % 3) :][: max(32, 2 * (96 // n))],
                        )
                        for k in range(n)
                    ],
                    axis=0,
                )
            save(
                frame,
                exposed(light, rng, kind.blur, kind.noise, kind.photons, kind.bits, 1 - kind.vignette * away**2, extra),
            )
            pose = motion(now)
            uv = lens.pixels(middle.stickers[: len(names), :3]) - offset
            rows += [
                (
                    lens.name,
                    frame,
                    now,
                    name,
                    *middle.stickers[i, :3],
                    *uv[i],
                    window.share_seen(middle, i),
                    *(MIDDLE + pose[:2]),
                    pose[2],
                    *(MIDDLE + pose[3:5]),
                    pose[5],
                )
                for i, name in enumerate(names)
            ]
        save(-1, None)
    (folder / "recording.toml").write_text(kind.toml(_toml(kind, cameras, offsets, design)), encoding="utf-8")
    return pd.DataFrame(
        rows,
        columns=[
            "camera",
            "frame",
            "time_s",
            "marker",
            "x_m",
            "y_m",
            "z_m",
            "u_px",
            "v_px",
            "share",
            "host_x_m",
            "host_y_m",
            "host_angle_rad",
            "nes_x_m",
            "nes_y_m",
            "nes_angle_rad",
        ],
    )


def _box(window: Window, middle: Bodies) -> tuple[int, int, int, int]:
    """The part of the window in which something may move during an exposure."""
    a = np.linspace(0, 2 * np.pi, 60)
    rim = [
        np.stack(
            [
                middle.ring_at[0] + 1.1 * middle.outer * np.cos(a),
                middle.ring_at[1] + 1.1 * middle.outer * np.sin(a),
                0 * a + z,
            ],
            -1,
        )
        for z in (middle.table, middle.wall)
    ]
    uv = window.lens.pixels(np.concatenate(rim)) - (window.left, window.top)
    low, high = (
        np.clip(np.floor(uv.min(0)).astype(int), 0, window.size),
        np.clip(np.ceil(uv.max(0)).astype(int), 0, window.size),
    )
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _saver(folder: Path, kind: Kind) -> Callable[[int, np.ndarray | None], None]:
    folder.mkdir(parents=True, exist_ok=True)
    if kind.suffix == ".avi":
        film = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter_fourcc(*"FFV1"), 25, kind.window, False)
        if not film.isOpened():
            film = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 25, kind.window, False)
        return lambda frame, picture: film.write(picture) if picture is not None else film.release()

    def save(frame, picture):
        if picture is not None:
            if kind.colour:
                picture = (
                    np.stack([0.8 * picture, picture, np.minimum(1.1 * picture, 255)], -1).round().astype(picture.dtype)
                )
            options = (
                [cv2.IMWRITE_JPEG_QUALITY, kind.quality] if kind.suffix == ".jpg" else [cv2.IMWRITE_PNG_COMPRESSION, 1]
            )
            cv2.imwrite(str(folder / f"{folder.name}-{frame + 1:06d}{kind.suffix}"), picture, options)

    return save


def pattern(board: str, legacy: bool = False, inverted: bool = False) -> tuple[np.ndarray, int]:
    """Which cells of a board are black, and how many cells a square has: a picture that OpenCV makes, one pixel per
    cell of 1 mm or half of one.
    """
    columns, rows, square, marker, dictionary = BOARDS[board]
    aruco = cv2.aruco.CharucoBoard(
        (columns, rows), square, marker, cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    )
    aruco.setLegacyPattern(legacy)
    cells = round(square * 7 / (0.25 * marker)) if dictionary.startswith("DICT_5X5") else 40
    while (marker / square * cells / 7) % 1 > 1e-6 or ((1 - marker / square) / 2 * cells) % 1 > 1e-6:
        cells += 1
    picture = aruco.generateImage((columns * cells, rows * cells), marginSize=0, borderBits=1)
    return (picture < 128) != inverted, cells


_TAKEN: dict[str, list[np.ndarray]] = {}  # kinds of the same cameras share their boards' pictures


def _boards(folder: Path, kind: Kind, lens: Lens, rng: np.random.Generator) -> None:
    key = repr((lens, kind.board, kind.views, kind.blur, kind.noise, kind.print_of))
    if key not in _TAKEN:
        _TAKEN[key] = _views(kind, lens, rng)
    here = folder / "boards" / lens.name
    (here / "lens").mkdir(parents=True, exist_ok=True)
    for k, picture in enumerate(_TAKEN[key]):
        path = here / ("world.png" if k == kind.views else f"lens/board{k:02d}.png")
        cv2.imwrite(str(path), kind.printed(picture), [cv2.IMWRITE_PNG_COMPRESSION, 0])


def _views(kind: Kind, lens: Lens, rng: np.random.Generator) -> list[np.ndarray]:
    """The board held in front of a camera, tilted, near and far; at last lying in the world's place."""
    columns, rows, square, _, _ = BOARDS[kind.board]
    black, cells = pattern(kind.board, **kind.print_of)
    window, pictures = Window(lens, 0, 0, *lens.size), []
    for k in range(kind.views + 1):
        if k == kind.views:
            turn, shift = lens.turn @ np.diag([1.0, -1.0, -1.0]), lens.shift
        else:
            tilt = rng.uniform(0.2, 0.7)
            turn = (
                cv2.Rodrigues(tilt * np.array([np.cos(2.4 * k), np.sin(2.4 * k), 0.0]))[0]
                @ cv2.Rodrigues(np.array([0, 0, rng.uniform(-0.6, 0.6)]))[0]
            )
            at = np.array([((k % 4) + 0.5) / 4 - 0.5, ((k // 4 % 4) + 0.5) / 4 - 0.5]) * 0.7 * np.array(lens.size)
            middle = np.append(0.5 * square * np.array([columns, rows]), 0.0)
            shift = (
                kind.distance_m
                * rng.uniform(0.85, 1.15)
                * np.array([at[0] / lens.focal[0], at[1] / lens.focal[1], 1.0])
                - turn @ middle
            )
        pictures.append(
            exposed(window.board((columns, rows), square, cells, black, turn, shift), rng, kind.blur, kind.noise)
        )
    return pictures


def _toml(kind: Kind, cameras: list[Lens], offsets: list[tuple[int, int]], design: dict[str, np.ndarray]) -> str:
    text = f'format = 1\nname = "another\'s"\n[time]\nframe_rate_hz = {kind.rate_hz}\n' + (
        'trigger = "trigger.csv"\n' if kind.jitter_s else ""
    )
    for lens, offset in zip(cameras, offsets, strict=True):
        text += (
            f'[[cameras]]\nname = "{lens.name}"\nframes = "{lens.name}/*{kind.suffix}"\nsensor_size_px = '
            f"{list(lens.size)}\n"
            f"window_offset_px = {list(offset)}\nwindow_size_px = {list(kind.window)}\nexposure_s = {kind.exposure_s}\n"
        )
    text += f'[calibration]\nboard = "{kind.board}"\n'
    text += 'intrinsic = "boards/{camera}/lens/*.png"\nextrinsic = "boards/{camera}/world.png"\n'
    for body, own in design.items():
        names = [f"{body[0].upper()}{i + 1}" for i in range(len(own))]
        text += f"[bodies.{body}]\nmarkers = {names}\n".replace("'", '"')
        if kind.layout and body != "ground":
            text += f"layout_m = {own.tolist()}\nlayout_sd_m = {kind.layout_sd_m or 1e-5}\n"
        if body == "host":
            text += f"inner_radius_m = {kind.bodies.inner}\n"
        if body == "nes":
            text += f"radius_m = {kind.bodies.washer}\nmass_kg = 0.0246\ninertia_factor = 0.5\n" + (
                'centre_marker = "N1"\n' if kind.nes_centre else ""
            )
    return text


DARK = {
    "table": 40.0,
    "ring": 60.0,
    "wall": 110.0,
    "outside": 30.0,
    "floor": 85.0,
    "washer": 50.0,
    "side": 25.0,
    "hole": 90.0,
}
HOLED = replace(STILL, hole=0.004)
SHADED = replace(STILL, light=(0.5, 0.3, 0.9), shade=0.5)
EIGHT = (0, 45, 88, 136, 180, 221, 268, 317)
SCREWS = tuple((0.055 * np.cos(a), 0.055 * np.sin(a), 0.012, 0.0019, 35.0) for a in np.radians([50, 140, 230, 340]))
KINDS: dict[str, Kind] = {
    "plain": Kind(),
    "white on dark, holed washer": Kind(bodies=replace(HOLED, greys=DARK), grey=225.0, nes_centre=False),
    "paper ring about each": Kind(paper=235.0, sticker_m={"ground": 0.002, "host": 0.002, "nes": 0.0011}),
    "1280 x 1024, discs of 4 px": Kind((1280, 1024), (1280, 1024), 3.2, board="charuco_9x13_20mm", exposure_s=5e-5),
    "4096 x 688": Kind((4096, 3072), (4096, 688), 6.0),
    "leaning 45 degrees": Kind(leans_deg=(-45.0, 45.0)),
    "one from above, one at 60": Kind(leans_deg=(3.0, 60.0), bodies=replace(STILL, wall=0.008)),
    "500 rad/s": Kind(spin=500.0, exposure_s=3e-5),
    "500 rad/s, 4 px of blur": Kind(spin=500.0, exposure_s=2.3e-4),
    "500 rad/s, 8 close, holed": Kind(
        spin=500.0, exposure_s=1e-4, nes_deg=EIGHT, nes_centre=False, bodies=HOLED, host_centre=True
    ),
    "shadows, vignette, glare": Kind(bodies=SHADED, vignette=0.5, glare=((400, 350, 60, 70), (760, 420, 35, 90))),
    "JPEG in colour": Kind(suffix=".jpg", colour=True, quality=85),
    "12 bit TIFF, photon noise": Kind(suffix=".tif", bits=12, photons=0.1),
    "16 bit PNG": Kind(bits=16, noise=1.0),
    "video": Kind(suffix=".avi"),
    "3 markers each": Kind(nes_deg=(10, 120, 215), nes_centre=False, host_deg=(0, 110, 235), bodies=HOLED),
    "rolled by 90 and 180 degrees": Kind(rolls_deg=(90.0, 181.0), window=(900, 900)),
    "200 fps": Kind(rate_hz=200.0, exposure_s=1e-4),
    "2000 fps, faint": Kind(rate_hz=2000.0, noise=5.0, blur=1.2),
    "high wall": Kind(leans_deg=(-32.0, 32.0), bodies=replace(STILL, wall=0.02)),
    "jittered trigger": Kind(jitter_s=5e-5, exposure_s=1e-4),
    "no layout": Kind(layout=False),
    "screws like markers": Kind(clutter=SCREWS),
    "chamfered, holed washer": Kind(bodies=replace(HOLED, chamfer=0.0003), nes_centre=False),
    "table 10 mm below": Kind(bodies=replace(STILL, table=-0.01)),
    "stickers 30 um off": Kind(layout_sd_m=3e-5),
}
