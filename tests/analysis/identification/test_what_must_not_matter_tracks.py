"""What cameras and markers are called, where the board lay, and one ground marker: the answers must not know.  Entry at
tracks.parquet.

Two runs of the sample series through ``ovines identify``, changed as an experimenter might have had them.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from tests.analysis.identification.test_what_must_not_matter import (
    LATE,
    SHIFT_M,
    TURN_RAD,
    Answer,
    answer,
    mapped,
    same,
    same_parameters,
    turned_back,
    without,
)

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "series_tilted"
RUNS = ("run-04", "run-05")
FRAMES = 560  # of each run: some ten impacts
TILT = ["table_tilt_x_m_per_s2", "table_tilt_y_m_per_s2"]
Settings = dict[str, Any]


def toml_of(settings: Settings) -> str:
    """A recording.toml of nested dicts, the values as JSON writes them."""
    lines, sections = [], []
    for key, value in settings.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            sections += [
                f"[[{key}]]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in entry.items()) for entry in value
            ]
        elif isinstance(value, dict):
            plain = {k: v for k, v in value.items() if not isinstance(v, dict)}
            if plain:
                sections.append(f"[{key}]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in plain.items()))
            sections += [
                f"[{key}.{k}]\n" + "".join(f"{a} = {json.dumps(b)}\n" for a, b in v.items())
                for k, v in value.items()
                if isinstance(v, dict)
            ]
        else:
            lines.append(f"{key} = {json.dumps(value)}\n")
    return "".join(lines) + "\n" + "\n".join(sections)


def identified(
    folder: Path,
    tracks: Callable[[pd.DataFrame], pd.DataFrame] = lambda table: table,
    settings: Callable[[Settings], Settings] = lambda settings: settings,
    calibration: Callable[[Settings], Settings] = lambda settings: settings,
    names: tuple[str, ...] = RUNS,
) -> Answer:
    """The two runs, changed, through the command; impacts in the runs' own order."""
    folder.mkdir()
    solved = json.loads((SAMPLE / "calibration.json").read_text(encoding="utf-8"))
    (folder / "calibration.json").write_text(json.dumps(calibration(solved)), encoding="utf-8")
    for run, name in zip(RUNS, names, strict=True):
        (folder / name).mkdir()
        text = (SAMPLE / run / "recording.toml").read_text(encoding="utf-8")
        stated = tomllib.loads(text)
        stated["model"]["effects"].append("table_tilt")  # fitted: a parameter with a direction in the world
        (folder / name / "recording.toml").write_text(toml_of(settings(stated)), encoding="utf-8")
        filmed = pd.read_parquet(SAMPLE / run / "tracks.parquet")
        filmed = filmed[filmed["frame"] < filmed["frame"].min() + FRAMES].reset_index(drop=True)
        tracks(filmed).to_parquet(folder / name / "tracks.parquet", index=False)
    out = folder / "out"
    assert main(["identify", str(folder), "--out", str(out)]) == 0
    return answer(out, names)


@pytest.fixture(scope="module")
def base(tmp_path_factory) -> Answer:
    found = identified(tmp_path_factory.mktemp("base") / "series")
    assert sum(len(one) for one in found.impacts) > 15 and set(TILT) <= set(found.parameters.index)
    return found


WORDS = {
    "H1": "zinc",
    "H2": "H 2",
    "H3": "b",
    "H4": "Ä",
    "N1": "9",
    "N2": "x",
    "N3": "M",
    "N4": "m",
    "N5": "a",
    "G1": "g",
    "G2": "G9",
    "G3": "B",
}
CAMERAS = {"VW1": "right", "VW2": "left"}


def moved(solved: Settings) -> Settings:
    """Cameras that are calibrated in another world."""
    c, s = math.cos(TURN_RAD), math.sin(TURN_RAD)
    turn, shift = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([*SHIFT_M, 0.0])
    for camera in solved["cameras"]:
        rotation = np.array(camera["rotation"]) @ turn.T
        camera["translation_m"] = (np.array(camera["translation_m"]) - rotation @ shift).tolist()
        camera["rotation"] = rotation.tolist()
    return solved


def cameras_otherwise(stated: Settings) -> Settings:
    """The cameras under other names, listed the other way round."""
    stated["cameras"] = [{**camera, "name": CAMERAS[camera["name"]]} for camera in stated["cameras"]][::-1]
    return stated


def markers_otherwise(stated: Settings) -> Settings:
    """The markers under other names, and in another order in their bodies."""
    for body in stated["bodies"].values():
        order = np.random.default_rng(3).permutation(len(body["markers"]))
        body["markers"] = [WORDS[body["markers"][i]] for i in order]
        if "layout_m" in body:
            body["layout_m"] = [body["layout_m"][i] for i in order]
        if "centre_marker" in body:
            body["centre_marker"] = WORDS[body["centre_marker"]]
    return stated


def one_marker_less(stated: Settings) -> Settings:
    """A marker on the ground that is not there."""
    return {**stated, "bodies": stated["bodies"] | {"ground": {"markers": ["G1", "G2"]}}}


@pytest.mark.further
def test_where_the_board_lay_when_the_clock_started_names_and_orders(base, tmp_path):
    """The same pictures from cameras that are calibrated in another world, later; runs, cameras and markers under other
    names and in another order, one marker on the ground less; rows of the table as they fall.

    All at once, because an answer that knows of one of them knows of all: none takes another one back.
    """
    rng = np.random.default_rng(4)

    def tracks(table: pd.DataFrame) -> pd.DataFrame:
        table = table[table["marker"] != "G3"]
        table = table.assign(frame=table["frame"] + LATE, time_s=table["time_s"] + LATE)
        table = table.assign(marker=table["marker"].map(WORDS), camera=table["camera"].map(CAMERAS))
        return table.sample(frac=1.0, random_state=rng.integers(1 << 30))

    found = identified(
        tmp_path / "otherwise",
        tracks,
        lambda stated: markers_otherwise(cameras_otherwise(one_marker_less(stated))),
        lambda solved: cameras_otherwise(moved(solved)),
        names=("y", "Nº 3"),
    )
    back = mapped(found, lambda t: turned_back(t.assign(time_s=t["time_s"] - LATE), TURN_RAD), tilt_rad=-TURN_RAD)
    same_parameters(base.parameters.loc[TILT], back.parameters.loc[TILT], sds_too=False)
    same(without(base, TILT), without(back, TILT))


def test_a_ground_marker_that_is_listed_and_never_seen(base, tmp_path):
    same(base, identified(tmp_path / "less", lambda table: table[table["marker"] != "G3"]))
