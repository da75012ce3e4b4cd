"""What several areas of the tests share: where the shared material lies, and a small recording with known truth."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

# As the commands do (ovines/__main__.py), and before numpy is loaded: with a thread per core in each of two test
# processes, the small matrices of identification took 2.5 times as long.
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, settings

from ovines.camera import Camera, write_calibration
from ovines.tables import write_table
from tests.processes import alone, forked, fresh

# Drawn inputs are the same ones in every run, so that CI does not fail by luck; `pytest --hypothesis-profile long`
# draws others each time, and twenty times as many.
settings.register_profile("ci", derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck))
settings.register_profile("long", settings.get_profile("ci"), derandomize=False, max_examples=2000, print_blob=True)
settings.load_profile("ci")
alone()
# As the commands do: series are many small objects without circles, and looking for these takes a tenth of the time.
gc.set_threshold(20_000)


def drawn(count: int) -> settings:
    """A decorator: ``count`` drawn inputs, twenty times as many in the profile `long`."""
    return settings(max_examples=count if settings().derandomize else 20 * count)


def pytest_addoption(parser):
    """`--all`: the whole suite with its further cases; `--turn K`: with one of :data:`TURNS` parts of these."""
    parser.addoption("--all", action="store_true", dest="all_cases", help="all tests with all their cases")
    parser.addoption("--turn", type=int, metavar="K", help=f"besides, the further cases whose turn of {TURNS} it is")


def pytest_collection_modifyitems(config, items):
    """The whole suite leaves out further cases; whoever names a file, a folder, a word or a mark gets all of it."""
    named = any(Path(arg.partition("::")[0]).resolve() not in SUITE for arg in config.args)
    if named or config.option.keyword or config.option.markexpr != WHOLE or config.option.all_cases:
        return
    items[:], further = without_further(items, config.option.turn)
    config.hook.pytest_deselected(items=further)


def without_further(
    items: Sequence[pytest.Item], turn: int | None = None
) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Without those that are marked `further`, and of a test that is marked `others_further` without all cases but the
    first, unless it is their ``turn``; and these.
    """
    begun, kept, further = set[str](), list[pytest.Item](), list[pytest.Item]()
    for item in items:
        test = item.nodeid.partition("[")[0]
        another = item.get_closest_marker("others_further") is not None and test in begun
        begun.add(test)
        is_further = another or item.get_closest_marker("further") is not None
        has_turn = turn is not None and zlib.crc32(item.nodeid.encode()) % TURNS == turn % TURNS
        (further if is_further and not has_turn else kept).append(item)
    return kept, further


def pytest_collection_finish():
    """What is loaded by now stays: nobody looks through it for circles again."""
    gc.freeze()


def pytest_sessionfinish():
    """Nor when all is done: pytest would look through it five times more."""
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session):
    """On a fresh checkout both halves of the whole suite soon ask for the blind plant, which takes a minute to compile
    and which one process compiles: the first compiles the simulator meanwhile, and does not wait.
    """
    if os.environ.get("PYTEST_XDIST_WORKER") == "gw0" and len(session.items) > MANY_TESTS:
        from ovines.core import Host, ImpactLaw, Nes, Scenario, simulate

        simulate(Scenario("first", Nes(0.01, 0.0246), Host(radius_m=0.05), ImpactLaw(0.7, 0.1, 0.5), 0.01))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Each worker begins with one half of the tests and at the end takes from the other's: what a module's tests share
    is mostly made once, not once in each worker.
    """
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log) if config.getoption("dist") == "load" else None


#: what stands for the whole suite: its folders, and the marks that pyproject.toml asks for
WHOLE = "not long"
SUITE = (Path(__file__).resolve().parent, Path(__file__).resolve().parents[1])
TURNS = 8  # parts of the further cases: each commit asks one of them
MANY_TESTS = 1000  # a file or a folder has fewer: what it does not ask for need not be compiled
SHARED = Path(__file__).resolve().parents[1].parent / "shared"
OFFSET_PX = {"VW1": (0, 1192), "VW2": (0, 900)}
HOST_LAYOUT_M = np.array(
    [
        [0.046359, 0.01873, 0.01],
        [-0.023474, 0.044147, 0.01],
        [-0.045315, -0.021131, 0.01],
        [0.031466, -0.038857, 0.01],
    ]
)
NES_LAYOUT_M = np.array(
    [
        [0, 0, 0.01],
        [0.0061, 0.0003, 0.01],
        [-0.0008, 0.006, 0.01],
        [-0.0058, -0.0017, 0.01],
        [0.0024, -0.0056, 0.01],
    ]
)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of practice series and real images beside the checkout; without it the test is skipped."""
    if not SHARED.is_dir():
        pytest.skip(f"no {SHARED}")
    return SHARED


@pytest.fixture
def ovines() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run the command line as a process of its own; with ``anew`` or ``env`` in a new interpreter."""

    def run(
        *arguments: object,
        timeout_s: float = 120,
        cwd: Path | None = None,
        anew: bool = False,
        env: dict[str, str] | None = None,
        file_limit_bytes: int | None = None,
    ) -> subprocess.CompletedProcess[str]:
        command = [str(one) for one in arguments]
        if anew or env or sys.platform == "win32":
            return fresh(command, timeout_s, cwd, env or {}, file_limit_bytes)
        return forked(command, timeout_s, cwd, file_limit_bytes)

    return run


@pytest.fixture(scope="module")
def without_next_test() -> Iterator[None]:
    """No simulation of the settings for a next test: in a diagnosis of a few runs it takes as long as all the rest,
    changes nothing else of the answer, and has its own tests (test_by_chance, test_gap_page, test_diagnose's first).
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.gap.diagnose.next_tests", lambda *_: None)
        yield


@pytest.fixture
def without_laws(monkeypatch) -> None:
    """No formula is searched for what the named effects leave: where an effect is the answer, the search takes as long
    as all the rest and finds nothing, and has its own tests (tests/gap/laws, the tutorial's).
    """
    monkeypatch.setattr("analysis.gap.diagnose.write_laws", lambda ladder, *_: ((), ladder))


@pytest.fixture
def unpainted(monkeypatch) -> None:
    """Pages hold all their figures, and none is turned into a picture, which takes longer than all the rest: where the
    data are no special ones, and pages like this are painted in another test (test_gap_page, test_report, commands).
    """
    monkeypatch.setattr("analysis.report.page.data_uri", lambda figure, image: "")


def draw_nothing(patched: pytest.MonkeyPatch) -> None:
    """Files of figures hold empty pictures, where only their coming and going is tested."""
    from matplotlib.figure import Figure

    from analysis.figures import style

    save = style._save
    patched.setattr(style, "_save", lambda figure, target, image: save(Figure(), target, image))


def refused(result: subprocess.CompletedProcess, *words: str) -> None:
    """The end that every wrong input must have: status 2, three lines, no traceback, the words in them."""
    text = result.stdout + result.stderr
    assert result.returncode == 2, text
    assert "Traceback" not in text
    for line in ("found:", "expected:", "do:"):
        assert line in text, text
    for word in words:
        assert word in text, text


def two_cameras() -> tuple[Camera, Camera]:
    """Two cameras 0.5 m above the plane, 0.4 m apart, looking at the origin."""
    cameras = []
    for name, x_m in (("VW1", -0.2), ("VW2", 0.2)):
        centre = np.array([x_m, 0.0, 0.5])
        forward = -centre / np.linalg.norm(centre)
        right = np.array([forward[2], 0.0, -forward[0]]) * -1.0
        right /= np.linalg.norm(right)
        rotation = np.array([right, np.cross(forward, right), forward])
        centre_px = (2047.5, OFFSET_PX[name][1] + 343.5)  # the window looks at the origin
        matrix = np.array([[3000.0, 0, centre_px[0]], [0, 3000.0, centre_px[1]], [0, 0, 1]])
        cameras.append(
            Camera(name, (4096, 3072), matrix, np.array([-0.05, 0.02, 0, 0, 0]), rotation, -rotation @ centre)
        )
    return cameras[0], cameras[1]


def moved(layout_m: np.ndarray, x_m: np.ndarray, y_m: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """Marker positions (frames, markers, 3) of a body at those poses."""
    c, s = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    x = x_m[:, None] + c * layout_m[:, 0] - s * layout_m[:, 1]
    y = y_m[:, None] + s * layout_m[:, 0] + c * layout_m[:, 1]
    return np.stack([x, y, np.broadcast_to(layout_m[:, 2], x.shape)], -1)


@dataclass(frozen=True)
class Truth:
    """The small recording's folder and what really moved."""

    folder: Path
    motion: pd.DataFrame


def bouncing_motion(frames: int, rate_hz: float, restitution: float = 0.72) -> pd.DataFrame:
    """A disk of 10 mm that bounces without friction in a ring of 50 mm at rest: straight flights, exact instants.

    Keep below 0.5 s: the normal speed falls by the restitution at each bounce, and the bounces crowd together.
    """
    reach = 0.04
    position, velocity, now = np.array([0.0, 0.013]), np.array([1.9, 0.35]), 0.0
    legs = []
    while now < frames / rate_hz:
        along, square = position @ velocity, velocity @ velocity
        flight_s = (-along + np.sqrt(along**2 + square * (reach**2 - position @ position))) / square
        legs.append((now, position, velocity))
        position, now = position + velocity * flight_s, now + flight_s
        normal = position / np.linalg.norm(position)
        velocity = velocity - (1 + restitution) * (velocity @ normal) * normal
        position = normal * reach * (1 - 1e-12)
    time_s = np.arange(frames) / rate_hz
    which = np.searchsorted([leg[0] for leg in legs], time_s, side="right") - 1
    nes = np.array([legs[i][1] + legs[i][2] * (t - legs[i][0]) for i, t in zip(which, time_s, strict=True)])
    still = np.zeros(frames)
    return pd.DataFrame(
        {
            "frame": np.arange(frames), "time_s": time_s,
            "nes_x_m": nes[:, 0], "nes_y_m": nes[:, 1], "nes_z_m": still, "nes_angle_rad": 3.0 * time_s,
            "host_x_m": still, "host_y_m": still, "host_z_m": still, "host_angle_rad": still,
        }
    )  # fmt: skip


def tracks_of(motion: pd.DataFrame, cameras: Sequence[Camera], sd_px: float, rng: np.random.Generator) -> pd.DataFrame:
    """Exact projections of the markers with Gaussian noise, in window pixels."""
    parts = []
    for prefix, body, layout in (("H", "host", HOST_LAYOUT_M), ("N", "nes", NES_LAYOUT_M)):
        pose = [motion[f"{body}_{name}"].to_numpy() for name in ("x_m", "y_m", "angle_rad")]
        points = moved(layout, *pose)
        for camera in cameras:
            uv = camera.project(points) - OFFSET_PX[camera.name] + rng.normal(0, sd_px, (*points.shape[:2], 2))
            count, markers = len(motion), [f"{prefix}{i + 1}" for i in range(len(layout))]
            parts.append((np.full(count * len(layout), camera.name, object), np.repeat(markers, count),
                          np.tile(motion["frame"], len(layout)), np.tile(motion["time_s"], len(layout)),
                          *uv.transpose(2, 1, 0).reshape(2, -1)))  # fmt: skip
    camera_of, marker_of, frame, time_s, u_px, v_px = (np.concatenate(column) for column in zip(*parts, strict=True))
    return pd.DataFrame(
        {
            "camera": camera_of.astype(str), "frame": frame, "time_s": time_s, "marker": marker_of, "u_px": u_px,
            "v_px": v_px, "sd_px": sd_px,
        }
    )  # fmt: skip


def recording_toml(name: str = "small") -> str:
    cameras = "".join(
        f'[[cameras]]\nname = "{camera}"\nsensor_size_px = [4096, 3072]\n'
        f"window_offset_px = {list(offset)}\nwindow_size_px = [4096, 688]\n\n"
        for camera, offset in OFFSET_PX.items()
    )
    return (
        f'format = 1\nname = "{name}"\n\n[time]\nframe_rate_hz = 800.0\n\n{cameras}'
        '[calibration]\nfile = "../calibration.json"\n\n'
        '[bodies.host]\nmarkers = ["H1", "H2", "H3", "H4"]\ninner_radius_m = 0.05\n'
        f"layout_m = {HOST_LAYOUT_M.tolist()}\n\n"
        '[bodies.nes]\nmarkers = ["N1", "N2", "N3", "N4", "N5"]\ncentre_marker = "N1"\n'
        f"radius_m = 0.01\nmass_kg = 0.0246\ninertia_factor = 0.5\nlayout_m = {NES_LAYOUT_M.tolist()}\n"
    )


@cache
def _small_tracks(frames: int, seed: int) -> tuple[bytes, pd.DataFrame]:
    """The file tracks.parquet of the small recording, and what really moved: hundreds of tests ask for the same."""
    motion = bouncing_motion(frames, 800.0)
    tracks = tracks_of(motion, two_cameras(), 0.02, np.random.default_rng(seed))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tracks.parquet"
        write_table(tracks, "tracks", path, {})
        return path.read_bytes(), motion


def write_small_recording(folder: Path, frames: int = 200, seed: int = 1) -> Truth:
    """A recording that enters at tracks.parquet, its calibration beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    tracks, motion = _small_tracks(frames, seed)
    (folder / "tracks.parquet").write_bytes(tracks)
    write_calibration(two_cameras(), folder.parent / "calibration.json")
    (folder / "recording.toml").write_text(recording_toml(folder.name), encoding="utf-8")
    return Truth(folder, motion.copy())


@pytest.fixture
def small_recording(tmp_path: Path) -> Truth:
    return write_small_recording(tmp_path / "series" / "run-01")


@pytest.fixture
def small_series(tmp_path: Path) -> Path:
    """Three small recordings."""
    for number in (1, 2, 3):
        write_small_recording(tmp_path / "series" / f"run-{number:02d}", seed=number)
    return tmp_path / "series"
