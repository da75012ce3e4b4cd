"""``fuzz_campaign.py``: command lines that work as they stand, and the shelf of small valid files that they read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from tests.conftest import bouncing_motion, recording_toml, write_small_recording
from tests.house.damage.test_fuzz import BOARD, CSV, LENSES, NAMES, SCENARIO, TRC, TRIGGER
from tests.house.files.test_impacts_alone import impacts

RING = "[bodies.host]\ninner_radius_m = 0.05\n[bodies.nes]\nradius_m = 0.01\nmass_kg = 0.0246\ninertia_factor = 0.5\n"
MODEL = """[model]
effects = ["floor_friction", "spin_coupling"]
restitution = 0.7
wall_friction = 0.13
tangential_restitution = 0.4
"""
DRIVE = "[excitation]\nfrequency_hz = 11.0\nacceleration_g = 8.0\n"
MOTION = f"format = 1\n[time]\nframe_rate_hz = 800.0\n{RING}{DRIVE}{MODEL}"
LAW = """format = 1
name = "a law"
[[terms]]
target = "across_velocity"
coefficient = 0.0226
unit = "1"
factors = [{quantity = "speed"}, {quantity = "spin"}]
"""


@dataclass(frozen=True)
class Line:
    """A command line that works; the files (globs of the shelf) that it reads; how often it is drawn."""

    words: str
    reads: tuple[str, ...] = ()
    weight: float = 1.0

    @property
    def command(self) -> str:
        """The command, with the step of one that has steps."""
        words = self.words.split()
        return " ".join(words[: 1 + (words[0] in ("blind", "orbits"))])


# A file per camera, or one of all of them
CALIBRATIONS = [(lens, lens if lens.endswith(".toml") else f"VW1={lens} VW2={lens}") for lens in LENSES]
RUN = ("run/recording.toml", "run/tracks.parquet", "calibration.json")
RESULTS = ("results/*",)
LINES = (
    Line("check run", RUN, 16),
    Line("check motion", ("motion/*",), 16),
    Line("check film", ("film/*", "film/VW1/*"), 10),
    Line("check day", ("day/*/*",), 5),
    Line("check impacts", ("impacts/*",), 5),
    Line("triangulate run --out made", RUN, 12),
    Line("analyse run --out made", RUN, 8),
    Line("lens run --out made", RUN, 4),
    Line("track film --names names.csv --out made", ("film/*", "film/VW1/*", "names.csv"), 4),
    Line("calibrate boards --out made", ("boards/*", "boards/VW1/*"), 0.3),
    Line("identify motion --out made", ("motion/*",), 1.5),
    Line("identify impacts --out made", ("impacts/*",), 4),
    Line("run impacts --out made", ("impacts/*",), 1),
    Line("run motion --out made", ("motion/*",), 1),
    Line("report results", RESULTS, 6),
    *(Line(f"export results --to {to} --out made", RESULTS, 3) for to in ("csv", "mat", "trc", "c3d", "netcdf")),
    Line("export results --to latex --out made", RESULTS, 3),
    Line("export results --to figures --out made --width 90", RESULTS, 0.3),
    *(
        Line(f"export calibration.json --to {to} --out made", ("calibration.json",), 2)
        for to in ("opencv", "kalibr", "mrcal", "caliscope", "anipose")
    ),
    Line("compare results again --out made", ("results/*", "again/*"), 2),
    Line("compare motion --out results --runs 1", ("motion/*", "results/*"), 1),
    Line("diagnose day --out made", ("day/*/*",), 0.4),
    Line("diagnose day --out made --law law.toml", ("law.toml",), 0.39),
    Line("simulate scenario.toml --out made", ("scenario.toml",), 14),
    Line("simulate laws.toml --out made", ("laws.toml", "law.toml"), 8),
    Line("simulate scenario.toml --out made --runs 3 --spread 0.01 --seed 1", ("scenario.toml",), 3),
    Line("simulate --list", (), 0.5),
    Line("sweep scenario.toml --over drive_amplitude_factor=0.9:1.1:2 --runs 2 --out made", ("scenario.toml",), 1),
    Line("design sprung-host --band 0.9:1.1:2 --runs 1 --transient 2 --periods 2 --out made", (), 1),
    Line("orbits lyapunov long.toml --periods 1 --transient 2 --out made", ("long.toml",), 1),
    Line("orbits section scenario.toml --periods 5 --transient 2 --out made", ("scenario.toml",), 1),
    Line("orbits sensitivities scenario.toml --out made", ("scenario.toml",), 0.3),
    Line("shaker --frequency-hz 11 --acceleration-g 8 --out made", (), 5),
    Line("import target --tracks VW1=a.csv VW2=a.csv --out made", ("a.csv", "target/recording.toml"), 6),
    Line("import target --points a.trc --out made", ("a.trc", "target/recording.toml"), 6),
    *(Line(f"import lens --calibration {given} --unit m --out made", (lens,), 4) for lens, given in CALIBRATIONS),
    Line("import target --plane VW1=plane.csv VW2=plane.csv --out made", ("plane.csv",), 4),
    Line("import target --motion motion.csv --unit m --out made", ("motion.csv",), 5),
    Line("import target --impacts impacts.csv --out made", ("impacts.csv",), 5),
    Line("board charuco_5x7_8mm --out made", (), 0.5),
    Line("board mine --kind chessboard --squares 10 7 --square-mm 25 --out made", (), 4),
    Line("new fresh --cameras a b --sensor 4096 3072 --rate-hz 800 --host-radius-mm 50 --nes-radius-mm 10", (), 7),
    Line("pick film --all --names made.csv --accept", ("film/*", "film/VW1/*"), 3),
    Line("animate motion --out made.gif --start 0 --end 0.02", ("motion/*",), 1),
    Line("view motion --save made.rrd", ("motion/*",), 2),
    Line("blind score answered", ("answered/*", "answered/answers/*/*"), 3),
    Line("blind answer sealed", ("sealed/*",), 0.3),
    Line("plan motion --as-stated --days 1 --runs 1 --duration-s 0.2 --px-per-mm 5 --out made", ("motion/*.toml",), 3),
)


def write_shelf(place: Path) -> None:
    """Small valid files of every kind."""
    write_small_recording(place / "run", frames=40)
    motion = bouncing_motion(160, 800.0)
    for folder in ("motion", "day/run-1", "day/run-2"):
        (place / folder).mkdir(parents=True)
        (place / folder / "recording.toml").write_text(MOTION)
        motion.to_parquet(place / folder / "motion.parquet", index=False)
    motion.rename(columns={"nes_x_m": "x", "nes_y_m": "y", "time_s": "t"})[["t", "x", "y"]].to_csv(
        place / "motion.csv", index=False
    )
    (place / "impacts").mkdir()
    (place / "impacts/recording.toml").write_text("format = 1\n" + RING)
    given = impacts(np.random.default_rng(1), 30)
    given.to_csv(place / "impacts.csv", index=False)
    grey = np.random.default_rng(0).integers(0, 255, (48, 64)).astype(np.uint8)
    film = recording_toml("film").replace("[4096, 688]", "[64, 48]")
    for camera, offset in (("VW1", "[0, 1192]"), ("VW2", "[0, 900]")):
        film = film.replace(f'name = "{camera}"\n', f'name = "{camera}"\nframes = "{camera}/*.png"\n')
        film = film.replace(offset, "[0, 0]")
        for folder in ("film", "boards"):
            (place / folder / camera).mkdir(parents=True)
            for number in range(3):
                cv2.imwrite(str(place / folder / camera / f"frame_{number}.png"), grey)
    (place / "film/recording.toml").write_text(film)
    boards = film.replace('file = "../calibration.json"', 'board = "charuco_5x7_8mm"\nintrinsic = "{camera}/*.png"\n'
                          'extrinsic = "{camera}/frame_0.png"')  # fmt: skip
    (place / "boards/recording.toml").write_text(boards)
    (place / "target").mkdir()
    (place / "lens").mkdir()
    (place / "lens/recording.toml").write_text(film.replace("[4096, 3072]", "[40, 30]").replace("[64, 48]", "[40, 30]"))
    (place / "target/recording.toml").write_text(
        recording_toml("target").split("[calibration]")[0]
        + RING.replace("inner_radius", 'markers = ["N1"]\ninner_radius').replace(
            "radius_m = 0.01", 'markers = ["N2"]\nradius_m = 0.01'
        )
    )
    texts = {
        "scenario.toml": SCENARIO, "laws.toml": SCENARIO.replace("[nes]", 'laws = ["law.toml"]\n[nes]', 1),
        "long.toml": SCENARIO.replace("duration_s = 1.0", "duration_s = 3.0"), "law.toml": LAW, "names.csv": NAMES,
        "trigger.csv": TRIGGER, "board.toml": BOARD, "a.csv": CSV, "a.trc": TRC,
        "plane.csv": "u_px,v_px,x_mm,y_mm\n1,44,-100,-80\n60,45,100,-80\n58,3,100,80\n3,2,-100,80\n30,22,0,0\n",
        "note.txt": "note", **LENSES,
    }  # fmt: skip
    second = (
        LENSES["lens.toml"].replace("cam_0", "cam_1").replace("VW1", "VW2").replace("[0.1, 0.0, 0.5]", "[-0.2, 0, 0.5]")
    )
    texts["lens.toml"] = LENSES["lens.toml"] + second
    for name, text in texts.items():
        (place / name).write_text(text)
    (place / "empty").mkdir()
