"""Videos as phones make them: uneven frame times, rotation flags, colour, rolling shutter."""

from __future__ import annotations

import base64
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ovines.errors import InputError
from ovines.recording import Recording, read_recording
from vision.frames.rolling_shutter import without_rolling_shutter
from vision.frames.sources import open_sources, stream
from vision.frames.times import frame_times
from vision.rendering.images import Pose
from vision.rendering.recording import half_setup
from vision.video import bits_per_channel, presented, rotation_deg

FRAMES, SIZE = 40, (160, 120)
BOXES = (b"moov", b"trak", b"mdia", b"minf", b"stbl")


def written(path: Path, rate_hz: float = 30.0) -> None:
    """A film in which the grey of the left half counts the frames."""
    film = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), rate_hz, SIZE)
    for k in range(FRAMES):
        image = np.full((SIZE[1], SIZE[0], 3), 40, np.uint8)
        image[:, : SIZE[0] // 2] = 60 + 4 * k
        film.write(image)
    film.release()


def changed(data: bytes, change: dict[bytes, object]) -> bytes:
    """An MP4 whose named boxes are what ``change`` makes of their content; sizes of those around them follow."""
    out, at = b"", 0
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at : at + 8])
        content = data[at + 8 : at + size]
        if name in BOXES:
            content = changed(content, change)
        elif name in change:
            content = change[name](content)
        out += struct.pack(">I4s", len(content) + 8, name) + content
        at += size
    return out


def uneven(durations: list[int]):
    """The table of frame durations, in ticks of the track's own clock."""

    def table(content: bytes) -> bytes:
        tick = struct.unpack(">I", content[12:16])[0]  # of one frame as it was written
        rows = b"".join(struct.pack(">II", 1, n * tick // 2) for n in durations)
        return content[:4] + struct.pack(">I", len(durations)) + rows

    return table


def turned_by_90(content: bytes) -> bytes:
    matrix = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, SIZE[1] << 16, 0, 1 << 30)
    return content[:40] + matrix + content[76:]


def recording(folder: Path, rate: str = "frame_rate_hz = 30.0", size: tuple[int, int] = SIZE) -> Recording:
    (folder / "recording.toml").write_text(
        f'format = 1\n[time]\n{rate}\n[[cameras]]\nname = "P"\nframes = "film.mp4"\nsensor_size_px = {list(size)}\n'
    )
    return read_recording(folder)


DURATIONS = [2] * 10 + [4] + [2] * 9 + [3, 1] + [2] * 18  # in half frames: one dropped, one late


def test_presentation_times_of_an_uneven_video_are_used(tmp_path):
    written(tmp_path / "film.mp4")
    data = (tmp_path / "film.mp4").read_bytes()
    even = presented(tmp_path / "film.mp4")
    assert even is not None and even.even and even.rate_hz == pytest.approx(30.0, rel=1e-3)
    times, notes = frame_times(recording(tmp_path), np.arange(FRAMES))
    assert np.allclose(times, np.arange(FRAMES) / 30.0, rtol=1e-5, atol=1e-8) and not notes
    (tmp_path / "film.mp4").write_bytes(changed(data, {b"stts": uneven(DURATIONS)}))
    times, notes = frame_times(recording(tmp_path), np.arange(FRAMES))
    truth = np.concatenate([[0], np.cumsum(DURATIONS[:-1])]) / 60.0
    assert np.allclose(times - times[0], truth, atol=1e-3)
    assert "uneven times" in " ".join(notes)
    slow, notes = frame_times(recording(tmp_path, "frame_rate_hz = 240.0"), np.arange(FRAMES))
    assert np.allclose(slow, truth / 8, atol=2e-4) and "slow motion" in " ".join(notes)
    (tmp_path / "trigger.csv").write_text("frame,time_s\n" + "".join(f"{k},{k * 0.1}\n" for k in range(FRAMES)))
    own, _ = frame_times(recording(tmp_path, 'trigger = "trigger.csv"'), np.arange(FRAMES))
    assert np.allclose(own, 0.1 * np.arange(FRAMES), rtol=1e-5, atol=1e-8)  # measured times win


def test_a_video_says_its_rate_where_nobody_does(tmp_path):
    written(tmp_path / "film.mp4", 25.0)
    times, notes = frame_times(recording(tmp_path, ""), np.arange(FRAMES + 2))
    assert np.allclose(times, np.arange(FRAMES + 2) / 25.0, atol=1e-3) and "25" in notes[0]


def test_a_rotation_flag_is_not_obeyed_and_a_turned_size_is_reported(tmp_path):
    written(tmp_path / "film.mp4")
    data = (tmp_path / "film.mp4").read_bytes()
    (tmp_path / "film.mp4").write_bytes(changed(data, {b"tkhd": turned_by_90}))
    assert rotation_deg(tmp_path / "film.mp4") in (90, 270)
    obeyed = cv2.VideoCapture(str(tmp_path / "film.mp4")).read()[1]
    assert obeyed.shape[:2] == SIZE  # as players show it
    images = [images[0] for _, images in stream(open_sources(recording(tmp_path))[0], [])]
    assert len(images) == FRAMES and images[0].shape == SIZE[::-1]
    grey = np.array([np.median(image[:, 10:70]) for image in images])
    assert np.abs(grey - (60 + 4 * np.arange(FRAMES))).max() < 4 and images[0][:, 90:].max() < 60
    with pytest.raises(InputError, match="asks players to turn"):
        list(stream(open_sources(recording(tmp_path, size=SIZE[::-1]))[0], []))


# Two grey frames of 32 x 32 px, H.264 in 4:2:0 of 10 bit: ffmpeg -f lavfi -i color=c=gray:s=32x32:r=10:d=0.2
# -pix_fmt yuv420p10le -c:v libx264 -bsf:v filter_units=remove_types=6 -flags:v +bitexact film.mp4, packed.
TEN_BITS = (
    b"c-muNU{FXasVvAW&d+6FU}6B#Kx~v)mTZ_?U}DI?z`&7Kl$r{pb#hY@OMtX+YDWu$(Eoqm*WPb5Ym9pPJ@@iQpfIQ7EX5p0`F~pvFfcI"
    b"l=H};@0R?k%%Q8|JPyq7_AaR0$kpYAdfDu&{I^Tf-FJJ<qn3AHzY#=+PBpYleGZxcMVCW>qUIi#-U{Fa-DJcfhGO0PmB}h6>AoMa`$xX"
    b">j1nJ04LHD}`C^#8HkAOM487VnMFqyK<lvHGuVL*PqM`B(|PAW(ZV|{LBUK)@gQkDxg6xo?7DG)iCl%mu$BuDX-7Ud{F*o^kYB}q9z_W"
    b"t6M;uIt`>p>BXBPc+gR$%Y|(jG7sJU&463OSic6-H(z*djvW|9>E93RLCHn8(2N{~?1!I*?v=cFME^E}%GJ0TBT<9@8Qi8Q3yjKR&H=;"
    b"P0<rAguxgiNys_XMnIsQb`dsj9C{zFoQ&K2{`;=&IQIh3y3WO^cJ!>2+IJ)lF`JNkmRaR(+`6<5c5LJO3p{pX8^>ur70z#I5o{p1=Ap)"
    b"h#Y^wI4?>pD9Aw$3yw@+A^`yTQhQ+"
)


def film_of_one_colour(folder: Path, size: tuple[int, int]) -> tuple[np.ndarray, list[str]]:
    notes: list[str] = []
    sources, said = open_sources(recording(folder, size=size))
    pictures = [images[0] for _, images in stream(sources, notes)]
    return pictures[0], said


def test_a_film_of_ten_bits_is_read_with_eight_and_says_so(tmp_path):
    (tmp_path / "film.mp4").write_bytes(zlib.decompress(base64.b85decode(TEN_BITS)))
    assert bits_per_channel(tmp_path / "film.mp4") == 10
    picture, notes = film_of_one_colour(tmp_path, (32, 32))
    assert picture.dtype == np.uint8 and abs(int(np.median(picture)) - 128) < 4
    assert "10 bits per channel, read with 8" in " ".join(notes)
    written(tmp_path / "film.mp4")
    assert bits_per_channel(tmp_path / "film.mp4") == 8 and not film_of_one_colour(tmp_path, SIZE)[1]


def test_a_film_of_sixteen_bits_of_grey_is_read_whole(tmp_path):
    grey = (np.arange(48 * 64).reshape(48, 64) * 20).astype(np.uint16)
    deep = [cv2.VIDEOWRITER_PROP_DEPTH, cv2.CV_16U, cv2.VIDEOWRITER_PROP_IS_COLOR, 0]
    film = cv2.VideoWriter(
        str(tmp_path / "film.mkv"), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*"FFV1"), 10.0, (64, 48), deep
    )
    for _ in range(3):
        film.write(grey)
    film.release()
    (tmp_path / "film.mkv").rename(tmp_path / "film.mp4")
    picture, notes = film_of_one_colour(tmp_path, (64, 48))
    np.testing.assert_array_equal(picture, grey)
    assert not notes


def poses(t: float) -> dict[str, Pose]:
    x = 0.02 + 0.012 * np.sin(2 * np.pi * 11 * t)
    return {
        "host": Pose(x, -0.028),
        "nes": Pose(x + 0.015 * np.cos(40 * t), -0.028 + 0.015 * np.sin(33 * t), 0, 60 * t),
    }


def rolled(
    setup, readout_s: float, rng: np.random.Generator, seconds: float = 0.4
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tracks of one camera whose rows are read one after another, and as if at once; 200 frames per second."""
    camera, offset, height = setup.cameras[0], np.array(setup.window_offset_px[0]), setup.window_size_px[1]
    rows, truth = [], []
    for frame in range(int(200 * seconds)):
        t = frame / 200
        for body in ("host", "nes"):
            one = setup.rig.markers[body]
            for name, place in zip(one.names, one.layout_m, strict=True):

                def at(late_s, place=place, body=body, t=t):
                    pose = poses(t + late_s)[body]
                    return camera.project(pose.rotation @ place + pose.position_m) - offset

                uv = still = at(0.0)
                for _ in range(6):  # the row in which it is seen says when it is seen
                    uv = at(readout_s * ((uv[1] + 0.5) / height - 0.5))
                noise = 0.02 * rng.normal(size=2)
                rows.append(("VW1", frame, t, name, *(uv + noise), 0.02))
                truth.append(("VW1", frame, t, name, *(still + noise), 0.02))
    columns = ["camera", "frame", "time_s", "marker", "u_px", "v_px", "sd_px"]
    return pd.DataFrame(rows, columns=columns), pd.DataFrame(truth, columns=columns)


@pytest.mark.further
@pytest.mark.parametrize(("readout_s", "given"), [(4e-3, None), (-3e-3, None), (4e-3, 4e-3), (0.0, None)])
def test_a_rolling_shutter_is_reported_and_taken_out(tmp_path, readout_s, given):
    """4 of 5 ms: pixels come out within 0.15 px rms of the film without it (5 ms of 11 Hz are interpolated by
    parabolas; 0.02 px are noise), by the stated time and by the fitted one, which is right to 5 %; without one nothing
    is reported.
    """
    text = (Path(__file__).parents[3] / "sample_data" / "rendered" / "recording.toml").read_text()
    (tmp_path / "recording.toml").write_text(text.replace("frame_rate_hz = 800.0", "frame_rate_hz = 200.0"))
    setup = half_setup(np.random.default_rng(0))
    record = read_recording(tmp_path)
    first = record.settings.cameras[0].model_copy(
        update={"window_offset_px": setup.window_offset_px[0], "readout_s": given}
    )
    record = replace(record, settings=record.settings.model_copy(update={"cameras": (first,)}))
    layouts = {body: one.layout_m for body, one in setup.rig.markers.items()}
    seen, truth = rolled(setup, readout_s, np.random.default_rng(1))
    out, notes = without_rolling_shutter(seen, record, {"VW1": setup.cameras[0]}, layouts)
    before, after = (
        np.sqrt(np.mean((one[["u_px", "v_px"]] - truth[["u_px", "v_px"]]).to_numpy()[18:-18] ** 2))
        for one in (seen, out)
    )
    if not readout_s:
        assert not notes and after == 0.0
        return
    assert after < 0.15 and after < 0.2 * before
    if given is None:
        said = float(notes[0].split("after another, ")[1].split(" ms")[0])
        assert said == pytest.approx(1e3 * readout_s, rel=0.05)
    else:
        assert not notes


@pytest.mark.further
@pytest.mark.parametrize("run", ["run-01", "run-04"])
def test_no_rolling_shutter_is_reported_of_cameras_without_one(run):
    """Tracks of another renderer, with a tilted table, impacts and a lens: not a pixel is moved."""
    from ovines.camera import read_calibration
    from ovines.tables import read_table

    folder = Path(__file__).parents[3] / "sample_data" / "series_tilted" / run
    record, tracks = read_recording(folder), read_table(folder / "tracks.parquet", "tracks")
    cameras = {camera.name: camera for camera in read_calibration(folder.parent / "calibration.json")}
    layouts = {name: np.array(body.layout_m) for name, body in record.bodies.items() if body.layout_m}
    out, notes = without_rolling_shutter(tracks, record, cameras, layouts)
    assert not notes and (out[["u_px", "v_px"]] == tracks[["u_px", "v_px"]]).all(axis=None)


def test_a_video_is_read_in_order_whichever_thread_comes_first(tmp_path):
    """The second piece asked for first: it waits for its turn."""
    from concurrent.futures import ThreadPoolExecutor

    from vision.frames.sources import _Reader

    written(tmp_path / "film.mp4")
    reader = _Reader(open_sources(recording(tmp_path))[0][0], [])
    with ThreadPoolExecutor(2) as pool:
        later = pool.submit(reader.read, list(range(8, 16)), 1)
        first = pool.submit(reader.read, list(range(8)), 0)
        greys = [np.median(image[:, 10:70]) for image in first.result(30) + later.result(30)]
    assert (np.diff(greys) > 0).all()
