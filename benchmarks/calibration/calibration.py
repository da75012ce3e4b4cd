"""What a calibration says of itself, held against the truth: flags, and the 90 % band over image and plane.

    python benchmarks/calibration/calibration.py WHAT [...]

    flags [CASES] [BOARD] [FIRST]       model errors of 0.05 px flagged, and false flags; FIRST: seed of the first case
    band [CASES] [VIEWS] [FIRST]        true errors inside 1.645 sd: lens over the image, plane
    spline [CASES] [FIRST]              the lens chosen for cameras with smooth residuals of 0.25 and 0.05 px and for
                                        one without; what is left, and whether the sd covers that
    rendered-flags [CASES] [FIRST]      both with images rendered and corners found in them
    rendered-band [CASES] [VIEWS] [FIRST]
    real FOLDER                         real chessboard pairs, and FOLDER/stereo_dots

Cameras and board of the rendered rig.  Corners are true ones with Gaussian noise; where they are rendered the cameras
have half its pixels along each side, and a model error is in the rays of the pictures.
A board that spans a quarter of the image is used: a small one's own pose takes up whatever bends slowly.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from ovines.camera import Camera
from vision.calibrate import Calibration, calibrate
from vision.calibration.bundle.unknowns import N_CAMERA
from vision.calibration.single_camera import Single, solve_camera
from vision.calibration.targets.boards import WORLD_FROM_BOARD, Board, find_board
from vision.calibration.targets.detection import View, detect
from vision.calibration.uncertainty import shifts
from vision.pinhole import N_INTRINSICS, intrinsics_of
from vision.rendering.board import render_board
from vision.rendering.images import SPLINE_PX, Look
from vision.rendering.images import View as Shown
from vision.rendering.recording import Setup, board_poses, half_setup
from vision.validation.halves import compare_halves, flagged, residual_field
from vision.validation.image_map import image_map
from vision.validation.lens_choice import choose_lens

Array = NDArray[np.float64]
NOISE_PX, ERROR_PX, LENGTH = 0.05, 0.05, 500 / 4096  # a field's structure, of the sensor's longer side
RESIDUAL_PX = 0.25  # of a lens that needs a spline
TURN_RAD = 1e-5  # of a camera, for differences of pictures
BAND = 1.645  # sd: 90 %
REPORT_EVERY = 20  # calibrations
UNBENDING_STEPS = 4  # a field of 0.05 px over 100 px is undone to 1e-12 px
Bend = Callable[[Array], Array]


class BentView(Shown):
    """A camera whose pixels look where a smooth field has moved them."""

    bend: Bend

    @cached_property
    def _splines(self) -> tuple[RectBivariateSpline, RectBivariateSpline]:
        width, height = self.size_px
        u, v = (np.linspace(-SPLINE_PX, n + SPLINE_PX, n // SPLINE_PX + 3) for n in (width, height))
        at = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
        before = at
        for _ in range(UNBENDING_STEPS):
            before = before + at - self.bend(before)
        xy = self.camera.normalise(before).reshape(len(v), len(u), 2)
        return RectBivariateSpline(v, u, xy[..., 0]), RectBivariateSpline(v, u, xy[..., 1])


def setup_of(seed: int, board: str = "charuco_9x13_20mm", rendered: bool = False) -> tuple[Setup, np.random.Generator]:
    """The rendered rig, a little different each time."""
    rng = np.random.default_rng(seed)
    setup = replace(half_setup(rng), board=find_board(board))
    return (replace(setup, cameras=tuple(map(halved, setup.cameras))) if rendered else setup), rng


def halved(camera: Camera) -> Camera:
    """The same lens before half as many pixels along each side: a sixth of the time to render and search."""
    matrix = camera.matrix.copy()
    matrix[:2] *= 0.5
    matrix[:2, 2] -= 0.25
    width, height = camera.sensor_size_px
    return replace(camera, matrix=matrix, sensor_size_px=(width // 2, height // 2))


def smooth_field(rms_px: float, sensor_px: int, seed: int) -> Bend:
    """Pixels (n, 2) moved by a smooth random field that no lens model has."""
    rng = np.random.default_rng(seed)
    waves, phase = rng.normal(0, 1 / (LENGTH * sensor_px), (2, 60, 2)), rng.uniform(0, 2 * np.pi, (2, 60))

    def moved(uv_px: Array) -> Array:
        shift = [np.cos(uv_px @ waves[c].T + phase[c]).sum(1) * np.sqrt(2 / 60) for c in (0, 1)]
        return np.asarray(uv_px + rms_px / np.sqrt(2) * np.stack(shift, -1))

    return moved


def views_of(
    setup: Setup, c: int, count: int, rng: np.random.Generator, rendered: bool, bend: Bend | None = None
) -> list[View]:
    """Hand-held views of camera ``c``, their corners moved by ``bend``."""
    camera, points = setup.cameras[c], setup.board.points_m()
    shown = Shown(camera)
    if bend is not None:
        shown = BentView(camera)
        object.__setattr__(shown, "bend", bend)
    still = replace(camera, rotation=np.eye(3), translation_m=np.zeros(3))
    found = []
    for k, (turn, shift) in enumerate(board_poses(setup, c, count, rng)):
        name = f"{camera.name}-{k:02d}"
        if rendered:
            image, _ = render_board(shown, setup.board, turn, shift, Look(), rng)
            found.append(detect(image, setup.board, name))
            continue
        uv = still.project(points @ turn.T + shift)
        seen = ((uv > 3) & (uv < np.array(camera.sensor_size_px) - 4)).all(1)
        found.append(noisy(name, np.flatnonzero(seen), uv[seen] if bend is None else bend(uv[seen]), rng))
    return [view for view in found if len(view.points) >= 12]


def noisy(name: str, points: Array, uv_px: Array, rng: np.random.Generator) -> View:
    """A view with corner noise."""
    return View(name, points, uv_px + rng.normal(0, NOISE_PX, uv_px.shape), np.full(len(uv_px), NOISE_PX), 40.0)


def flags(cases: int, board: str = "charuco_9x13_20mm", first: int = 0, rendered: bool = False) -> None:
    """How many of ``cases`` are flagged with a model error, and without."""
    for error_px in (ERROR_PX, 0.0):
        by_halves = by_field = either = 0
        for seed in range(first, first + cases):
            setup, rng = setup_of(seed, board, rendered)
            camera = setup.cameras[0]
            bend = smooth_field(error_px, camera.sensor_size_px[0], 1000 + seed) if error_px else None
            views = views_of(setup, 0, 16, rng, rendered, bend)
            single = solve_camera(views, setup.board, camera.sensor_size_px)
            if single is None:
                continue
            at = image_map(single.adjusted.state.intrinsics[0], camera.sensor_size_px, single.views)
            halves, residuals = compare_halves(single, setup.board, at), residual_field(single, setup.board)
            halves_speak, field_speaks = flagged(halves, residuals)
            by_halves, by_field = by_halves + halves_speak, by_field + field_speaks
            either += halves_speak or field_speaks
        print(
            f"model error {error_px} px RMS{', rendered' if rendered else ''}: flagged in {either} of {cases} "
            f"(halves {by_halves}, residuals {by_field})",
            flush=True,
        )


def spline(cases: int, first: int = 0) -> None:
    """How often a spline is chosen with a residual and without, and what it leaves where boards were seen."""
    for residual_px in (RESIDUAL_PX, ERROR_PX, 0.0):
        chosen, reported, falls, left, without, inside = 0, 0, [], [], [], []
        for seed in range(first, first + cases):
            setup, rng = setup_of(seed)
            camera = setup.cameras[0]
            bend = smooth_field(residual_px, camera.sensor_size_px[0], 1000 + seed) if residual_px else None
            views = views_of(setup, 0, 16, rng, False, bend)
            usual = solve_camera(views, setup.board, camera.sensor_size_px)
            if usual is None:
                continue
            single, tried = choose_lens(usual, views, setup.board, camera.sensor_size_px)
            taken = single.adjusted.state.splines[0] is not None
            chosen += taken
            at = image_map(
                single.adjusted.state.intrinsics[0],
                camera.sensor_size_px,
                single.views,
                single.adjusted.state.splines[0],
            )
            flags_now = flagged(compare_halves(single, setup.board, at), residual_field(single, setup.board))
            reported += taken or any(flags_now)
            if not taken or bend is None:
                continue
            held_out = [one.held_out_px for one in tried if np.isfinite(one.held_out_px)]
            falls.append(1 - held_out[-1] / min(held_out[:-1]))
            without.append(np.sqrt(np.mean(wrong_px(usual, camera, bend)[0] ** 2)))
            off, sd = wrong_px(single, camera, bend)
            left.append(np.sqrt(np.mean(off**2)))
            inside.append(np.mean(np.abs(off) < BAND * sd[:, None]))
        print(
            f"residual of {residual_px} px RMS: a spline chosen in {chosen} of {cases}, or flagged: {reported}",
            end="",
        )
        if left:
            print(
                f"; held-out RMS falls by {np.median(falls):.0%} (median) below the best of the others; wrong where "
                f"boards were seen (RMS of a coordinate): {np.median(without):.3f} px with the usual lens, "
                f"{np.median(left):.3f} px (at most {max(left):.3f}) with it; {np.mean(inside):.1%} inside the 90 % "
                "band",
                end="",
            )
        print(flush=True)


def wrong_px(single: Single, camera: Camera, bend: Bend) -> tuple[Array, Array]:
    """What is wrong of a lens where boards were seen, a turn of the camera taken off, (n, 2), and its sd (n,)."""
    state = single.adjusted.state
    at = image_map(state.intrinsics[0], camera.sensor_size_px, single.views, state.splines[0])
    uv = at.uv_px[at.visited]
    rays = np.column_stack([state.lens(0).normalise(uv), np.ones(len(uv))])
    still = replace(camera, rotation=np.eye(3), translation_m=np.zeros(3))
    off, moved = uv - bend(still.project(rays)), []
    for axis in np.eye(3):  # by differences of pictures
        turn = np.asarray(cv2.Rodrigues(TURN_RAD * axis)[0], float)
        moved.append((still.project(rays @ turn.T) - still.project(rays)).ravel() / TURN_RAD)
    turns = np.stack(moved, -1)
    off = off.ravel() - turns @ np.linalg.lstsq(turns, off.ravel(), rcond=None)[0]
    sd = at.sd_px(np.nan_to_num(single.adjusted.lens_covariance(0)))[at.visited]
    return off.reshape(-1, 2), sd


def band(cases: int, views: int, rendered: bool = False, first: int = 0) -> None:
    """Share of true errors within the 90 % band."""
    lens, plane = [], []
    for seed in range(first, first + cases):
        setup, rng = setup_of(seed, rendered=rendered)
        found = calibrated(setup, views, rng, rendered)
        covariance = np.nan_to_num(found.covariance)
        for c, (camera, true) in enumerate(zip(found.cameras, setup.cameras, strict=True)):
            at = image_map(intrinsics_of(camera), camera.sensor_size_px, [])
            own = covariance[N_CAMERA * c :, N_CAMERA * c :][:N_INTRINSICS, :N_INTRINSICS]
            off = at.moved(intrinsics_of(camera) - intrinsics_of(true))
            lens.append(np.mean(np.abs(off) < BAND * np.sqrt(np.einsum("nci,ij,ncj->nc", at.slopes, own, at.slopes))))
        table = found.tables["calibration_plane"]
        places = np.column_stack([table[["x_m", "y_m"]], np.zeros(len(table))])
        change = np.concatenate([change_of(a, b) for a, b in zip(found.cameras, setup.cameras, strict=True)])
        off = shifts(places, found.cameras) @ change
        plane.append(np.mean(np.abs(off) < BAND * table[["x_sd_m", "y_sd_m", "z_sd_m"]].to_numpy(float), axis=0))
        if (seed + 1 - first) % REPORT_EVERY == 0 or seed + 1 == first + cases:
            say_band(seed + 1 - first, views, rendered, lens, plane)


def say_band(cases: int, views: int, rendered: bool, lens: list[Array], plane: list[Array]) -> None:
    """Shares inside so far, with their standard errors over the calibrations."""
    per_case = np.asarray(lens).reshape(cases, -1).mean(1)
    of_lens, of_plane = per_case.mean(), np.mean(plane, 0)
    lens_error, error = (np.std(one) / np.sqrt(cases) for one in (per_case, [np.mean(one) for one in plane]))
    print(
        f"{cases} calibrations of {views} views{' rendered' if rendered else ''}: inside the 90 % band, lens over the "
        f"image {of_lens:.1%} +- {lens_error:.1%}, plane x {of_plane[0]:.1%}, y {of_plane[1]:.1%}, "
        f"z {of_plane[2]:.1%}, all {np.mean(plane):.1%} +- {error:.1%}",
        flush=True,
    )


def change_of(found: Camera, true: Camera) -> Array:
    """Parameters found minus the true ones (N_CAMERA,)."""
    turn = np.asarray(cv2.Rodrigues(found.rotation @ true.rotation.T)[0], float).ravel()
    return np.concatenate([intrinsics_of(found) - intrinsics_of(true), turn, found.translation_m - true.translation_m])


def calibrated(setup: Setup, views: int, rng: np.random.Generator, rendered: bool) -> Calibration:
    """Both cameras from their own views and one of the board in the world position."""
    board, points = setup.board, setup.board.points_m()
    seen = {camera.name: views_of(setup, c, views, rng, rendered) for c, camera in enumerate(setup.cameras)}
    world = {}
    for camera in setup.cameras:
        if rendered:
            turn = camera.rotation @ WORLD_FROM_BOARD
            image, _ = render_board(Shown(camera), board, turn, camera.translation_m, Look(), rng)
            world[camera.name] = detect(image, board, "world")
        else:
            uv = camera.project(points @ WORLD_FROM_BOARD.T)
            inside = ((uv > 3) & (uv < np.array(camera.sensor_size_px) - 4)).all(1)
            world[camera.name] = noisy("world", np.flatnonzero(inside), uv[inside], rng)
    sizes = {camera.name: camera.sensor_size_px for camera in setup.cameras}
    return calibrate(board, seen, sizes, world, simultaneous=False)


def real(folder: Path) -> None:
    """Sets of image pairs that nobody here made: what each camera's lens is, and what is said of it."""
    chess = Path(__file__).resolve().parents[2] / "sample_data" / "real_chessboard"
    sets = (
        (Board("chessboard", (10, 7), 0.025, kind="chessboard"), chess, {"left": "left*.jpg", "right": "right*.jpg"}),
        (
            Board("dots", (14, 10), 0.007, kind="dots", rings=((2, 7), (11, 7), (2, 2))),
            folder / "stereo_dots",
            {"0": "*_0.jpeg", "1": "*_1.jpeg"},
        ),
    )
    for board, images, patterns in sets:
        views, size = {}, (0, 0)
        for camera, pattern in patterns.items():
            pictures = {path.stem: cv2.imread(str(path), 0) for path in sorted(images.glob(pattern))}
            size = next(iter(pictures.values())).shape[::-1]
            views[camera] = [
                detect(picture, board, re.sub(r"^(left|right)|_\d$", "", name)) for name, picture in pictures.items()
            ]
        world = {camera: own[0] for camera, own in views.items()}
        found = calibrate(board, views, dict.fromkeys(views, size), world, simultaneous=True)
        apart_m = float(np.linalg.norm(found.cameras[0].centre_m - found.cameras[1].centre_m))
        print(f"{images.name}: cameras {1e3 * apart_m:.2f} mm apart")
        for camera in found.cameras:
            print(f"  {camera.name}: RMS {camera.rms_px:.4f} px, fx {camera.matrix[0, 0]:.1f} px")
        print(found.tables["calibration_lens"].drop(columns="p").to_string(index=False))
        print(*(line for line in found.advice), sep="\n", flush=True)


if __name__ == "__main__":
    what, *given = sys.argv[1:]
    if what == "real":
        real(Path(given[0]))
    elif what == "flags":
        flags(int(given[0]) if given else 20, *given[1:2], *map(int, given[2:]))
    elif what == "spline":
        spline(int(given[0]) if given else 20, int(given[1]) if len(given) > 1 else 0)
    elif what == "rendered-flags":
        flags(int(given[0]) if given else 20, first=int(given[1]) if len(given) > 1 else 0, rendered=True)
    else:
        cases, views, first = (int(given[k]) if len(given) > k else usual for k, usual in enumerate((200, 7, 0)))
        band(cases, views, what == "rendered-band", first)
