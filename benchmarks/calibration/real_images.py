"""Points found in pictures that nobody here made: ours beside OpenCV's detectors and plain centres, without a truth.

    python benchmarks/calibration/real_images.py [FOLDER]

FOLDER holds stereo_dots and charuco_two_webcams (default: ../shared/real); trackpy takes part where it is installed.

All points go through the same solver, OpenCV's calibrateCamera with five lens terms.  Columns, per image coordinate:

    views, points   in which the board was found, and how many points all methods share
    held out        RMS, px, on every second view, whose pose alone is fitted, with the lens of the others
    board freed     of a printed board: RMS, px, where its own points are unknowns too (calibrateCameraRO)
    noise           the same without a smooth field in each view (a quartic over the board, where it has points enough):
                    a board that moves while its rows are read, or bends, displaces neighbouring points alike
    claimed         RMS and median of our points' own standard deviations, px, which the noise should equal
    repeats         of a film: RMS, px, of what changes from a frame to the next where the board moves less than a
                    marker's edge: print, lens and camera are the same in both, so that noise alone is left
    board off       RMS, um, of the freed board from the stated grid after the best similarity: known lengths
    target          of pairs: every second pair's points, triangulated with the cameras of the other pairs, off the
                    rigid board as stated: RMS, um, per coordinate in its plane and across it
    length          of the same: the distance of the two points farthest apart, RMS off the stated one, um
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.images import video_frames
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import View, detect

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Found = dict[int, Array]  # pixel by number of the point
ROOT = Path(__file__).resolve().parents[2]
NEAR_PX = 3.0  # of our centre, within which another detector's is the same dot's
FEWEST, FRAMES = 12, 400  # points of a view; frames of a film: all of these
SMOOTH_DEGREE, POINTS_PER_TERM = 4, 3  # of a view's smooth field
POSE = 6  # unknowns of a view
MASK_SHARE = 2.0  # of a dot's size: trackpy's mask
FREED = 40  # points of a board at most that are unknowns


def chessboard(board: Board, flags: int | None) -> Callable[[Image, View], Found]:
    """OpenCV's corners: refined by cornerSubPix, or (None) those of its sector-based finder."""
    size = (board.squares[0] - 1, board.squares[1] - 1)

    def find(image: Image, ours: View) -> Found:
        if flags is None:
            good, corners = cv2.findChessboardCornersSB(image, size, flags=cv2.CALIB_CB_EXHAUSTIVE)
        else:
            good, corners = cv2.findChessboardCorners(image, size, flags=flags)
        if not good:
            return {}
        if flags is not None:
            corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), (3, 50, 1e-3))
        return nearest(corners.reshape(-1, 2), ours)

    return find


def nearest(uv: Array, ours: View) -> Found:
    """Of the pixels ``uv`` (n, 2) those next to our points, under their numbers."""
    if not len(uv) or not len(ours.points):
        return {}
    apart = np.linalg.norm(np.asarray(uv, float)[:, None] - ours.uv_px[None], axis=-1)
    return {
        int(number): np.asarray(uv[k], float)
        for number, k, gap in zip(ours.points, apart.argmin(0), apart.min(0), strict=True)
        if gap < NEAR_PX
    }


def blobs(image: Image, ours: View) -> Found:
    """SimpleBlobDetector, dark blobs, its filters on shape as they are."""
    settings = cv2.SimpleBlobDetector_Params()
    settings.minArea, settings.maxArea, settings.minDistBetweenBlobs = 20, 20000, 3
    return nearest(np.array([k.pt for k in cv2.SimpleBlobDetector_create(settings).detect(image)]).reshape(-1, 2), ours)


def ellipses(image: Image, ours: View) -> Found:
    """Ellipses fitted to the outlines at one threshold (Otsu)."""
    _, binary = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    outlines, _ = cv2.findContours(binary, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    centres = [cv2.fitEllipse(one)[0] for one in outlines if len(one) >= 12]
    return nearest(np.array(centres).reshape(-1, 2), ours)


def centroids(image: Image, ours: View) -> Found:
    """Centroids of the darkness in a window of 1.5 radii about our centre."""
    out: Found = {}
    half = round(0.75 * ours.marker_px)
    for number, (u, v) in zip(ours.points, ours.uv_px, strict=True):
        row, column = round(v), round(u)
        patch = image[max(row - half, 0) : row + half + 1, max(column - half, 0) : column + half + 1].astype(float)
        if patch.shape == (2 * half + 1, 2 * half + 1):
            weight = np.percentile(patch, 90) - patch.clip(None, np.percentile(patch, 90))
            rows, columns = np.mgrid[row - half : row + half + 1, column - half : column + half + 1]
            out[int(number)] = np.array([(weight * columns).sum(), (weight * rows).sum()]) / weight.sum()
    return out


def tracked_features(image: Image, ours: View) -> Found:
    """trackpy's centroids, in masks of twice a dot's size: of 1 to 2.6 times what serves it best on these dots."""
    import trackpy

    trackpy.quiet()
    found = trackpy.locate(image, 2 * round(MASK_SHARE * 0.5 * ours.marker_px) + 1, invert=True)
    return nearest(found[["x", "y"]].to_numpy(), ours)


def charuco(board: Board) -> Callable[[Image, View], Found]:
    """OpenCV's ChArUco corners as its detector gives them."""
    detector = cv2.aruco.CharucoDetector(board.opencv())

    def find(image: Image, _: View) -> Found:
        corners, numbers, _, _ = detector.detectBoard(255 - image if board.inverted else image)
        if corners is None:
            return {}
        return {int(n): uv for n, uv in zip(np.ravel(numbers), corners.reshape(-1, 2).astype(float), strict=True)}

    return find


def compare(
    name: str,
    board: Board,
    images: list[Image],
    others: dict[str, Callable[[Image, View], Found]],
    printed: bool = True,
) -> dict[str, list[Found]]:
    """A row per method, on the points that all methods have in a view; `printed`: a board with errors of its own.

    Gives what each method found in each picture.
    """
    seen = [detect(image, board) for image in images]
    every = {"ours": [dict(zip(map(int, v.points), v.uv_px, strict=True)) for v in seen]}
    every |= {what: [find(image, v) for image, v in zip(images, seen, strict=True)] for what, find in others.items()}
    usual = {what: [one for one in found if len(one) >= FEWEST] for what, found in every.items()}
    both = [sorted(set.intersection(*(set(found[k]) for found in every.values()))) for k in range(len(images))]
    kept = [k for k, numbers in enumerate(both) if len(numbers) >= FEWEST]
    whole = sorted(set.intersection(*(set(both[k]) for k in kept))) if kept else []
    sd = np.concatenate([seen[k].sd_px for k in kept])
    print(f"\n{name}: {len(images)} pictures, {len(kept)} views with {sum(len(both[k]) for k in kept)} shared points")
    for what, found in every.items():
        held = held_out(board, [found[k] for k in kept], [both[k] for k in kept], images[0].shape[::-1])
        freed = ""
        if printed and len(whole) >= FEWEST:
            freed_px, noise_px, off_m = board_freed(board, [found[k] for k in kept], whole, images[0].shape[::-1])
            freed = f"; board freed {freed_px:.4f} px, noise {noise_px:.4f} px, off {1e6 * off_m:.1f} um"
        counts = f"{len(usual[what]):3d} views, {sum(map(len, usual[what])):5d} points"
        claimed = f"; claimed {np.sqrt(np.nanmean(sd**2)):.4f}, {np.nanmedian(sd):.4f} px" if what == "ours" else ""
        print(f"  {what:22s} {counts}; held out {held:.4f} px{freed}{claimed}", flush=True)

    if printed:
        own_views(board, seen, images[0].shape[::-1])
    return every


def own_views(board: Board, seen: list[View], size: tuple[int, ...]) -> None:
    """Noise and claim of ours over all views that show the board whole, whatever other methods find."""
    most = max(len(one.points) for one in seen)
    whole = [one for one in seen if len(one.points) == most >= FEWEST]
    found: list[Found] = [dict(zip(map(int, one.points), one.uv_px, strict=True)) for one in whole]
    freed_px, noise_px, _ = board_freed(board, found, sorted(found[0]), size)
    claimed = float(np.sqrt(np.nanmean(np.concatenate([one.sd_px for one in whole]) ** 2)))
    print(
        f"  ours, its {len(whole)} whole views: board freed {freed_px:.4f} px, noise {noise_px:.4f} px; "
        f"claimed {claimed:.4f} px, {claimed / noise_px:.2f} of it"
    )


def film_repeats(board: Board, frames: list[Image], every: dict[str, list[Found]]) -> None:
    """What the corners' residuals change by from frame to frame, each view's pose fitted, and ours against its sd."""
    seen = [detect(image, board) for image in frames]
    count = len(board.points_m())
    whole = [k for k in range(len(frames)) if all(len(found[k]) == count for found in every.values())]
    points, size = board.points_m().astype(np.float32), (frames[0].shape[1], frames[0].shape[0])
    for what, found in every.items():
        uv = [np.array([found[k][n] for n in range(count)], np.float32) for k in whole]
        _, matrix, lens, turns, shifts = cv2.calibrateCamera([points] * len(uv), uv, size, None, None)
        residual = [
            one - cv2.projectPoints(points, turn, shift, matrix, lens)[0].reshape(-1, 2)
            for one, turn, shift in zip(uv, turns, shifts, strict=True)
        ]
        changes, claims = [], []
        for k in range(1, len(whole)):
            first, second = seen[whole[k - 1]], seen[whole[k]]
            moved_px = float(np.linalg.norm((second.uv_px - first.uv_px).mean(0)))
            if whole[k] == whole[k - 1] + 1 and moved_px < second.marker_px:
                changes.append(residual[k] - residual[k - 1])
                claims += [first.sd_px, second.sd_px]
        freedom = 2 * count / (2 * count - POSE)
        repeats = float(np.sqrt(freedom * np.mean(np.square(changes)) / 2))
        claimed = float(np.sqrt(np.mean(np.square(claims))))
        against = f"; claimed {claimed:.4f} px, {claimed / repeats:.2f} of it" if what == "ours" else ""
        print(f"  {what:22s} {len(changes)} pairs of frames: repeats {repeats:.4f} px{against}", flush=True)


def pairs(name: str, board: Board, both: tuple[dict[str, list[Found]], ...], size: tuple[int, ...]) -> None:
    """Per method: every second pair triangulated with the cameras of the others, against the rigid board as stated."""
    points, sensor = board.points_m().astype(np.float32), (int(size[0]), int(size[1]))
    instants = range(len(next(iter(both[0].values()))))
    shared = [sorted(set.intersection(*(set(one[k]) for camera in both for one in camera.values()))) for k in instants]
    kept = [k for k in instants if len(shared[k]) >= FEWEST]
    print(f"\n{name}: {len(kept)} pairs with {sum(len(shared[k]) for k in kept)} shared points")
    for what in both[0]:
        off, lengths = [], []
        for part in (0, 1):
            learn, world = [k for i, k in enumerate(kept) if i % 2 != part], []
            uv: list[list[NDArray[Any]]] = [[], []]
            for k in learn:
                world.append(points[shared[k]])
                for camera in (0, 1):
                    uv[camera].append(np.array([both[camera][what][k][n] for n in shared[k]], np.float32))
            lenses = [cv2.calibrateCamera(world, one, sensor, None, None)[1:3] for one in uv]
            _, k1, d1, k2, d2, turn, shift, _, _ = cv2.stereoCalibrate(
                world, *uv, *lenses[0], *lenses[1], sensor, flags=cv2.CALIB_USE_INTRINSIC_GUESS
            )
            for k in kept[part::2]:
                rays = [
                    cv2.undistortPoints(
                        np.array([both[camera][what][k][n] for n in shared[k]])[:, None], matrix, lens
                    ).reshape(-1, 2)
                    for camera, (matrix, lens) in enumerate(((k1, d1), (k2, d2)))
                ]
                seen = cv2.triangulatePoints(np.eye(3, 4), np.hstack([turn, shift]), rays[0].T, rays[1].T)
                placed, true = (seen[:3] / seen[3]).T, points[shared[k]].astype(float)
                a, b = true - true.mean(0), placed - placed.mean(0)
                u, _, vt = np.linalg.svd(b.T @ a)
                off.append(b @ (u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt) - a)
                apart = np.linalg.norm(true[:, None] - true[None], axis=-1)
                i, j = np.unravel_index(apart.argmax(), apart.shape)
                lengths.append(float(np.linalg.norm(placed[i] - placed[j]) - apart[i, j]))
        rms = 1e6 * np.sqrt(np.mean(np.square(np.concatenate(off)), axis=0))
        print(
            f"  {what:22s} target {np.hypot(rms[0], rms[1]) / np.sqrt(2):.1f}, {rms[2]:.1f} um; "
            f"length {1e6 * np.sqrt(np.mean(np.square(lengths))):.1f} um",
            flush=True,
        )


def held_out(board: Board, found: list[Found], numbers: list[list[int]], size: tuple[int, ...]) -> float:
    """RMS per coordinate [px] on every second view, with the lens of the others."""
    points = board.points_m().astype(np.float32)
    world = [points[n] for n in numbers]
    image = [np.array([one[k] for k in n], np.float32) for one, n in zip(found, numbers, strict=True)]
    squares, count = 0.0, 0
    for part in (0, 1):
        learn = [k for k in range(len(world)) if k % 2 != part]
        _, matrix, lens, _, _ = cv2.calibrateCamera(
            [world[k] for k in learn], [image[k] for k in learn], (int(size[0]), int(size[1])), None, None
        )
        for k in range(part, len(world), 2):
            _, turn, shift = cv2.solvePnP(world[k], image[k], matrix, lens)
            off = cv2.projectPoints(world[k], turn, shift, matrix, lens)[0].reshape(-1, 2) - image[k]
            squares, count = squares + float((off**2).sum()), count + off.size
    return float(np.sqrt(squares / count))


def board_freed(
    board: Board, found: list[Found], whole: list[int], size: tuple[int, ...]
) -> tuple[float, float, float]:
    """RMS per coordinate [px] with the board's points as unknowns, the same without a smooth field in each view,
    freedom counted; RMS [m] of the points off the grid."""
    whole = whole[:: max(1, len(whole) // FREED)]  # its time grows with the cube of their number
    points = board.points_m().astype(np.float32)[whole]
    views = [np.array([one[k] for k in whole], np.float32) for one in found]
    # The solver holds three points, the first, the fixed one and the last: a row's end and the last make the frame.
    fixed = int(np.argmax(points[:, 0] - points[:, 1]))
    rms, matrix, lens, turns, shifts, placed = cv2.calibrateCameraRO(
        [points] * len(views), views, (int(size[0]), int(size[1])), fixed, None, None
    )
    count, shared = 2 * len(views) * len(whole), 9 - 7 + 3 * len(whole)
    residual = rms * np.sqrt(len(views) * len(whole) / (count - 6 * len(views) - shared))
    left = [
        uv - cv2.projectPoints(placed.reshape(-1, 3), turn, shift, matrix, lens)[0].reshape(-1, 2)
        for uv, turn, shift in zip(views, turns, shifts, strict=True)
    ]
    noise = smooth_apart(points, left) or residual
    grid, flat = points[:, :2].astype(float), placed.reshape(-1, 3)[:, :2].astype(float)
    a, b = grid - grid.mean(0), flat - flat.mean(0)
    u, s, vt = np.linalg.svd(b.T @ a)
    off = b @ (u @ vt) * (s.sum() / (b**2).sum()) - a
    return float(residual), noise, float(np.sqrt(np.mean(off**2)))


def smooth_apart(points: NDArray[Any], left: list[NDArray[Any]]) -> float | None:
    """RMS per coordinate [px] of residuals without a polynomial over the board in each view; None of few points."""
    x, y = (points[:, :2] - points[:, :2].mean(0)).T / np.ptp(points[:, :2])
    terms = np.stack([x**i * y**j for i in range(SMOOTH_DEGREE + 1) for j in range(SMOOTH_DEGREE + 1 - i)], -1)
    free = len(points) - terms.shape[1]
    if len(points) < POINTS_PER_TERM * terms.shape[1]:
        return None
    apart = [one - terms @ np.linalg.lstsq(terms, one, rcond=None)[0] for one in left]
    # What is not smooth of the board's own points was fitted, too: two coordinates show it, hardly the third.
    return float(np.sqrt(sum((one**2).sum() for one in apart) / (2 * free * (len(left) - 1))))


def read(folder: Path, pattern: str) -> list[Image]:
    """Grey pictures in order."""
    return [np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8) for path in sorted(folder.glob(pattern))]


if __name__ == "__main__":
    real = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "real"
    chess = Board("chessboard", (10, 7), 0.025, kind="chessboard")
    usual_flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    corners = {"OpenCV cornerSubPix": chessboard(chess, usual_flags), "OpenCV SB": chessboard(chess, None)}
    found = []
    for side in ("left", "right"):
        pictures = read(ROOT / "sample_data" / "real_chessboard", f"{side}*.jpg")
        found.append(compare(f"chessboard, {side}", chess, pictures, dict(corners)))
    pairs("chessboard, pairs", chess, tuple(found), pictures[0].shape[::-1])
    grid = Board("dots", (14, 10), 0.007, kind="dots", rings=((2, 7), (11, 7), (2, 2)))
    plain = {"SimpleBlobDetector": blobs, "ellipse of the outline": ellipses, "grey centroid": centroids}
    if find_spec("trackpy"):
        plain["trackpy"] = tracked_features
    found = []
    for camera in "01":
        pictures = read(real / "stereo_dots", f"*_{camera}.jpeg")
        found.append(compare(f"dot grid, camera {camera}", grid, pictures, dict(plain), printed=False))
    pairs("dot grid, pairs", grid, tuple(found), pictures[0].shape[::-1])
    webcams = Board("webcams", (4, 5), 0.054, 0.75 * 0.054, "DICT_4X4_1000", inverted=True)
    for camera in "01":
        film = real / "charuco_two_webcams" / "calibration" / "extrinsic" / f"cam_{camera}.mp4"
        frames = [image for _, image in video_frames(film, FRAMES)]
        methods = compare(f"ChArUco film, camera {camera}", webcams, frames, {"OpenCV ChArUco": charuco(webcams)})
        film_repeats(webcams, frames, methods)
