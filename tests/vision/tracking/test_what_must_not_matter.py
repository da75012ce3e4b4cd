"""The same film put otherwise - other lengths, world, orders, names, numbers, formats, pixels - is tracked the same,
by ``ovines track``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

import vision.track
from ovines.__main__ import main
from ovines.camera import Camera, write_calibration
from ovines.recording import read_recording
from ovines.tables import read_table
from tests.vision.tracking.test_track import FRAME_RATE_HZ, GROUND, HOST, NES, SIZE, film

FRAMES = 12
EQUAL_PX = 2e-5  # the same in other units differs by a few 1e-7 px
CONVERGED_PX = 1e-3  # steps of a fit below this end it: begun from elsewhere it may end as far off


@dataclass(frozen=True)
class Body:
    """A body of recording.toml: markers, their places, lengths by key."""

    markers: tuple[str, ...]
    layout_m: np.ndarray | None
    lengths_m: dict[str, float]


@dataclass(frozen=True)
class Recorded:
    """What a recording holds: cameras, windows, bodies, pictures of each camera, numbers and clock."""

    cameras: tuple[Camera, ...]
    offsets: tuple[tuple[int, int], ...]
    bodies: dict[str, Body]
    pictures: tuple[tuple[np.ndarray, ...], ...]
    first: int = 0
    clock_s: float | None = None
    suffix: str = ".tif"
    options: tuple[int, ...] = (cv2.IMWRITE_TIFF_COMPRESSION, 1, cv2.IMWRITE_PNG_COMPRESSION, 1)


def written(folder: Path, recorded: Recorded) -> Path:
    """The recording's folder."""
    folder.mkdir(parents=True, exist_ok=True)
    text = f"format = 1\n[time]\nframe_rate_hz = {FRAME_RATE_HZ}\n"
    if recorded.clock_s is not None:
        numbers = np.arange(FRAMES) + recorded.first
        pd.DataFrame({"frame": numbers, "time_s": recorded.clock_s + np.arange(FRAMES) / FRAME_RATE_HZ}).to_csv(
            folder / "trigger.csv", index=False
        )
        text += 'trigger = "trigger.csv"\n'
    for camera, offset, pictures in zip(recorded.cameras, recorded.offsets, recorded.pictures, strict=True):
        _save(folder / camera.name, recorded, pictures)
        size = list(pictures[0].shape[::-1])
        text += (
            f'[[cameras]]\nname = "{camera.name}"\nframes = "{camera.name}/*{recorded.suffix}"\nsensor_size_px = '
            f"{list(camera.sensor_size_px)}\n"
            f"window_offset_px = {list(offset)}\nwindow_size_px = {size}\n"
        )
    text += '[calibration]\nfile = "calibration.json"\n'
    for name, body in recorded.bodies.items():
        text += f"[bodies.{name}]\nmarkers = {list(body.markers)}\n" + "".join(
            f"{key} = {value!r}\n" for key, value in body.lengths_m.items()
        )
        text += "" if body.layout_m is None else f"layout_m = {body.layout_m.tolist()}\n"
    write_calibration(recorded.cameras, folder / "calibration.json")
    (folder / "recording.toml").write_text(text + "mass_kg = 0.02\n" * (name == "nes"))
    return folder


def _save(folder: Path, recorded: Recorded, pictures: tuple[np.ndarray, ...]) -> None:
    folder.mkdir()
    if recorded.suffix == ".avi":
        video = cv2.VideoWriter(
            str(folder / "film.avi"), cv2.VideoWriter_fourcc(*"FFV1"), 25, pictures[0].shape[::-1], False
        )
        if not video.isOpened():
            pytest.skip("this OpenCV writes no lossless video")
        for picture in pictures:
            video.write(picture)
        video.release()
        return
    for k, picture in enumerate(pictures):
        cv2.imwrite(str(folder / f"f{recorded.first + k:08d}{recorded.suffix}"), picture, recorded.options)


def followed(folder: Path, recorded: Recorded) -> pd.DataFrame:
    """Tracks, one row per camera, frame and marker, as the command writes them."""
    out = folder.with_name(f"{folder.name} out")
    assert main(["track", str(written(folder, recorded)), "--out", str(out)]) == 0
    tracks = read_table(out / "tracks.parquet", "tracks")
    return tracks.set_index(["camera", "frame", "marker"])[["u_px", "v_px", "time_s"]]


def same(one: pd.DataFrame, other: pd.DataFrame, within_px: float) -> None:
    """The same rows, at the same places."""
    assert set(one.index) == set(other.index)
    off = (one[["u_px", "v_px"]] - other.loc[one.index, ["u_px", "v_px"]]).abs().to_numpy()
    assert off.max() < within_px


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Recorded:
    """Twelve frames at 500 rad/s with an impact, markers hidden for some; every body with its layout."""
    folder = tmp_path_factory.mktemp("film")
    cameras, _ = film(folder, FRAMES, np.random.default_rng(1), hide=[("N3", 4, 6, "VW1"), ("H2", 3, 5, "VW2")])
    pictures = tuple(
        tuple(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((folder / camera.name).glob("*.bmp")))
        for camera in cameras
    )
    offsets = tuple(read_recording(folder).window_offset_px[camera.name] for camera in cameras)
    bodies = {
        "ground": Body(("G1", "G2", "G3"), GROUND, {}),
        "host": Body(("H1", "H2", "H3", "H4"), HOST, {"inner_radius_m": 0.026}),
        "nes": Body(("N1", "N2", "N3", "N4", "N5"), NES, {"radius_m": 0.01}),
    }
    return Recorded(tuple(cameras), offsets, bodies, pictures)


@pytest.fixture(autouse=True)
def no_walls(monkeypatch, request):
    """The rims cost more than all the rest, and only the lengths' test is about them."""
    if "walls" not in request.fixturenames:
        monkeypatch.setattr(vision.track, "rims_at", lambda *_: [])


@pytest.fixture
def walls() -> None:
    """Lets the rims be fitted."""


@pytest.fixture(scope="module")
def usual(recorded, tmp_path_factory) -> pd.DataFrame:
    """The film's tracks: all but the hidden markers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vision.track, "rims_at", lambda *_: [])
        tracks = followed(tmp_path_factory.mktemp("usual") / "film", recorded)
    assert len(tracks) == 2 * FRAMES * 12 - 4
    return tracks


def without_ground_layout(recorded: Recorded) -> Recorded:
    return replace(recorded, bodies=recorded.bodies | {"ground": replace(recorded.bodies["ground"], layout_m=None)})


@pytest.mark.further
@pytest.mark.parametrize("factor", [0.2, 5.0])
@pytest.mark.parametrize("ground", ["placed", "found"])
def test_all_lengths_times_the_same(recorded, usual, tmp_path, factor, ground):
    recorded = recorded if ground == "placed" else without_ground_layout(recorded)
    long = replace(
        recorded,
        cameras=tuple(replace(camera, translation_m=factor * camera.translation_m) for camera in recorded.cameras),
        bodies={
            name: Body(
                body.markers,
                None if body.layout_m is None else factor * body.layout_m,
                {key: factor * value for key, value in body.lengths_m.items()},
            )
            for name, body in recorded.bodies.items()
        },
    )
    same(usual, followed(tmp_path / "film", long), EQUAL_PX if ground == "placed" else CONVERGED_PX)


@pytest.mark.further
def test_the_walls_scale_with_the_lengths(recorded, tmp_path, walls):
    few = replace(recorded, pictures=tuple(own[:3] for own in recorded.pictures))
    long = replace(
        few,
        cameras=tuple(replace(camera, translation_m=5 * camera.translation_m) for camera in recorded.cameras),
        bodies={
            name: Body(body.markers, 5 * body.layout_m, {key: 5 * value for key, value in body.lengths_m.items()})
            for name, body in recorded.bodies.items()
        },
    )
    seen = [
        vision.track.track(read_recording(written(tmp_path / name, one)), one.cameras).walls
        for name, one in (("few", few), ("long", long))
    ]
    assert len(seen[0]) == 6
    assert seen[1].radius_m.to_numpy() == pytest.approx(5 * seen[0].radius_m.to_numpy(), rel=1e-5)


@pytest.mark.further
@pytest.mark.parametrize(("turn_rad", "shift_m"), [(2.1, (0.0, 0.0)), (0.0, (2.0, -1.3)), (-0.8, (-1.1, 1.6))])
def test_a_world_elsewhere_and_turned(recorded, usual, tmp_path, turn_rad, shift_m):
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    turn, shift = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.append(shift_m, 0.0)
    cameras = tuple(
        replace(
            camera,
            rotation=camera.rotation @ turn.T,
            translation_m=camera.translation_m - camera.rotation @ turn.T @ shift,
        )
        for camera in recorded.cameras
    )
    ground = replace(recorded.bodies["ground"], layout_m=GROUND @ turn.T + shift)
    same(
        usual,
        followed(tmp_path / "placed", replace(recorded, cameras=cameras, bodies=recorded.bodies | {"ground": ground})),
        CONVERGED_PX,
    )
    found = followed(tmp_path / "found", without_ground_layout(replace(recorded, cameras=cameras))).reset_index()
    places = (
        found[found.marker.str.startswith("G")].groupby("camera").u_px
    )  # their names follow the world's x, their places do not
    wanted = usual.reset_index().loc[lambda own: own.marker.str.startswith("G")].groupby("camera").u_px
    assert places.count().equals(wanted.count()) and np.allclose(places.sum(), wanted.sum(), atol=0.1)


def test_a_mirrored_world(recorded, usual, tmp_path):
    """Pictures turned over, cameras and layouts with them."""
    flip, width = np.diag([-1.0, 1.0, 1.0]), SIZE[0]
    cameras, offsets = [], []
    for camera, offset in zip(recorded.cameras, recorded.offsets, strict=True):
        matrix, distortion = camera.matrix.copy(), camera.distortion.copy()
        matrix[0, 2] = camera.sensor_size_px[0] - 1 - matrix[0, 2]
        distortion[3] *= -1
        offsets.append((camera.sensor_size_px[0] - width - offset[0], offset[1]))
        cameras.append(
            replace(
                camera,
                matrix=matrix,
                distortion=distortion,
                rotation=flip @ camera.rotation @ flip,
                translation_m=flip @ camera.translation_m,
            )
        )
    bodies = {name: replace(body, layout_m=body.layout_m @ flip) for name, body in recorded.bodies.items()}
    pictures = tuple(tuple(np.ascontiguousarray(picture[:, ::-1]) for picture in own) for own in recorded.pictures)
    found = followed(
        tmp_path / "film",
        replace(recorded, cameras=tuple(cameras), offsets=tuple(offsets), bodies=bodies, pictures=pictures),
    )
    same(usual, found.assign(u_px=width - 1 - found.u_px), 0.003)  # sums in single precision, in another order


def test_other_orders_and_names(recorded, usual, tmp_path):
    names = {
        "G1": "a",
        "G2": "Z",
        "G3": "m 3",
        "H1": "N1",
        "H2": "host",
        "H3": "9",
        "H4": "H-4",
        "N1": "x",
        "N2": "H1",
        "N3": "n",
        "N4": "G1",
        "N5": "0",
    }
    cameras = {"VW1": "right", "VW2": "a camera"}
    order = {"ground": [2, 0, 1], "host": [1, 3, 0, 2], "nes": [4, 2, 0, 3, 1]}
    bodies = {
        name: Body(
            tuple(names[recorded.bodies[name].markers[k]] for k in order[name]),
            recorded.bodies[name].layout_m[order[name]],
            recorded.bodies[name].lengths_m,
        )
        for name in ("host", "ground", "nes")
    }
    other = replace(
        recorded,
        cameras=tuple(replace(camera, name=cameras[camera.name]) for camera in recorded.cameras[::-1]),
        offsets=recorded.offsets[::-1],
        pictures=recorded.pictures[::-1],
        bodies=bodies,
    )
    same(
        usual.rename(index=cameras, level="camera").rename(index=names, level="marker"),
        followed(tmp_path / "film", other),
        CONVERGED_PX,
    )


def test_other_numbers_and_another_clock(recorded, usual, tmp_path):
    found = followed(tmp_path / "film", replace(recorded, first=1_000_000, clock_s=1e6))
    same(usual, found, 1e-12)
    assert np.allclose(found.time_s - 1e6, usual.loc[found.index].time_s, atol=1e-8)


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("suffix", "options"), [(".png", ()), (".tif", (cv2.IMWRITE_TIFF_COMPRESSION, 5)), (".bmp", ()), (".avi", ())]
)
def test_lossless_formats(recorded, usual, tmp_path, suffix, options):
    same(usual, followed(tmp_path / "film", replace(recorded, suffix=suffix, options=options)), 1e-12)


@pytest.mark.further
@pytest.mark.parametrize(("suffix", "factor"), [(".tif", 256), (".png", 257), (".tif", 16), (".png", 1)])
def test_16_bits(recorded, usual, tmp_path, suffix, factor):
    """Greys as they are, times 16 (12 bits), 256 and 257.  Finer greys have less rounding to allow for: that decides
    doubtful pixels.
    """
    deep = replace(
        recorded,
        suffix=suffix,
        pictures=tuple(tuple(picture.astype(np.uint16) * factor for picture in own) for own in recorded.pictures),
    )
    same(usual, followed(tmp_path / "film", deep), 0.005)


@pytest.mark.further
def test_twice_the_pixels(recorded, usual, tmp_path):
    """Pictures and intrinsics: a pixel becomes four, and its centre is where theirs is.  Finer pixels are no finer
    picture: a tenth of a pixel.
    """
    cameras = []
    for camera in recorded.cameras:
        matrix = camera.matrix.copy()
        matrix[:2] *= 2
        matrix[:2, 2] += 0.5
        cameras.append(
            replace(camera, matrix=matrix, sensor_size_px=(2 * camera.sensor_size_px[0], 2 * camera.sensor_size_px[1]))
        )
    pictures = tuple(
        tuple(cv2.resize(picture, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC) for picture in own)
        for own in recorded.pictures
    )
    twice = replace(
        recorded, cameras=tuple(cameras), offsets=tuple((2 * u, 2 * v) for u, v in recorded.offsets), pictures=pictures
    )
    for name, one in (("placed", twice), ("found", without_ground_layout(twice))):
        found = followed(tmp_path / name, one)
        same(usual, found.assign(u_px=0.5 * (found.u_px - 0.5), v_px=0.5 * (found.v_px - 0.5)), 0.1)


def test_one_ground_marker_less(recorded, usual, tmp_path):
    """It is still in the pictures, and nobody asks for it."""
    ground = Body(("G1", "G3"), GROUND[[0, 2]], {})
    found = followed(tmp_path / "film", replace(recorded, bodies=recorded.bodies | {"ground": ground}))
    same(usual.drop("G2", level="marker"), found, CONVERGED_PX)


def test_a_recording_cut_in_two(recorded, usual, tmp_path):
    """The second part knows nothing of the first: shapes are fitted anew, so that centres differ by less than the noise
    moves them.
    """
    parts = [
        followed(
            tmp_path / f"part{first}", replace(recorded, pictures=tuple(own[first:last] for own in recorded.pictures))
        )
        for first, last in ((0, 5), (5, FRAMES))
    ]
    later = parts[1].reset_index()
    later["frame"] += 5
    same(usual, pd.concat([parts[0], later.set_index(["camera", "frame", "marker"])]), 0.02)
