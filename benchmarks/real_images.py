"""Points found in pictures that nobody here made: ours beside OpenCV's detectors and plain centres, without a truth.

python benchmarks/real_images.py [FOLDER]    FOLDER holds stereo_dots and charuco_two_webcams (default: ../shared/real)

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
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.boards import Board
from vision.calibration.detection import View, detect
from vision.calibration.images import video_frames

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Found = dict[int, Array]  # pixel by number of the point
ROOT = Path(__file__).resolve().parents[1]
NEAR_PX = 3.0  # of our centre, within which another detector's is the same dot's
FEWEST, FRAMES = 12, 400  # points of a view; frames of a film: all of these
SMOOTH_DEGREE, POINTS_PER_TERM = 4, 3  # of a view's smooth field
POSE = 6  # unknowns of a view
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
) -> None:
    """A row per method, on the points that all methods have in a view; `printed`: a board with errors of its own."""
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


def film_repeats(board: Board, frames: list[Image]) -> None:
    """Claimed sd over what the corners' residuals change by from frame to frame, each view's pose fitted."""
    seen = [detect(image, board) for image in frames]
    count = len(board.points_m())
    whole = [k for k, one in enumerate(seen) if len(one.points) == count]
    points, size = board.points_m().astype(np.float32), (frames[0].shape[1], frames[0].shape[0])
    uv = [seen[k].uv_px.astype(np.float32) for k in whole]
    _, matrix, lens, turns, shifts = cv2.calibrateCamera([points] * len(uv), uv, size, None, None)
    residual = [
        one - cv2.projectPoints(points, turn, shift, matrix, lens)[0].reshape(-1, 2)
        for one, turn, shift in zip(uv, turns, shifts, strict=True)
    ]
    changes, claims = [], []
    for k in range(1, len(whole)):
        moved_px = float(np.linalg.norm((uv[k] - uv[k - 1]).mean(0)))
        if whole[k] == whole[k - 1] + 1 and moved_px < seen[whole[k]].marker_px:
            changes.append(residual[k] - residual[k - 1])
            claims += [seen[whole[j]].sd_px for j in (k - 1, k)]
    freedom = 2 * count / (2 * count - POSE)
    repeats = float(np.sqrt(freedom * np.mean(np.square(changes)) / 2))
    claimed = float(np.sqrt(np.mean(np.square(claims))))
    print(f"  ours, {len(changes)} pairs of frames: repeats {repeats:.4f} px; claimed {claimed:.4f} px, "
          f"{claimed / repeats:.2f} of it")  # fmt: skip


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
    for side in ("left", "right"):
        compare(
            f"chessboard, {side}",
            chess,
            read(ROOT / "sample_data" / "real_chessboard", f"{side}*.jpg"),
            {"OpenCV cornerSubPix": chessboard(chess, usual_flags), "OpenCV SB": chessboard(chess, None)},
        )
    grid = Board("dots", (14, 10), 0.007, kind="dots", rings=((2, 7), (11, 7), (2, 2)))
    plain = {"SimpleBlobDetector": blobs, "ellipse of the outline": ellipses, "grey centroid": centroids}
    for camera in "01":
        compare(
            f"dot grid, camera {camera}",
            grid,
            read(real / "stereo_dots", f"*_{camera}.jpeg"),
            dict(plain),
            printed=False,
        )
    webcams = Board("webcams", (4, 5), 0.054, 0.75 * 0.054, "DICT_4X4_1000", inverted=True)
    for camera in "01":
        film = real / "charuco_two_webcams" / "calibration" / "extrinsic" / f"cam_{camera}.mp4"
        frames = [image for _, image in video_frames(film, FRAMES)]
        compare(f"ChArUco film, camera {camera}", webcams, frames, {"OpenCV ChArUco": charuco(webcams)})
        film_repeats(webcams, frames)
