"""The shipped series whose cause is in nobody's list: its hash, its law, and nothing left once the law is held."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.blind.trial import read_truths
from analysis.gap.diagnose import Diagnosis, verdict_of
from analysis.gap.laws.found_law import law_file
from analysis.report.page import Page
from ovines.__main__ import main
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.conftest import laws_and_ladder

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "series_unknown"
SEED = 4
WIDTH_M = 0.015  # of the plant's pull, in the usual rig's units


def blank(diagnosis: Diagnosis, name: str) -> Page:
    """Nothing of a diagnosis on a page."""
    return Page(name, diagnosis.summary["verdict"])


def as_sealed(law: dict[str, Any]) -> None:
    """A pull towards a place of the room: -k d exp(-(d/w)^2/2), its numbers within their intervals."""
    truth = read_truths(SAMPLE, SEED)["case-001"]  # refuses another hash than the manifest's
    true, world = truth["parameters"]["unknown_magnetic_pull"], truth["world"]
    assert law["shrinkage"] > 0.95 and law["p"] < 1 / 400
    width = WIDTH_M * world["scale"]
    c, s = math.cos(world["turned_rad"]), math.sin(world["turned_rad"])
    x, y = true["pull_x_m"], true["pull_y_m"]
    numbers = {
        "coefficient": -true["pull_m_per_s2"] / width * math.exp(0.5),
        "place_x_m": world["rig_at_m"][0] + c * x - s * y,
        "place_y_m": world["rig_at_m"][1] + s * x + c * y,
        "distance_in_room_scale_m": width,
    }
    assert set(law["parameters"]) == set(numbers)
    for name, value in numbers.items():
        low, high = law["parameters"][name]["low"], law["parameters"][name]["high"]
        assert low - (high - low) / 2 < value < high + (high - low) / 2, name  # 90 % intervals, doubled: four at once


def test_the_law_is_what_was_sealed(tmp_path):
    """Found by the diagnosis' own search, without what it says beside the law."""
    series, _ = load_series(read_series(SAMPLE), tmp_path / "results")
    (law,), ladder = laws_and_ladder(series)
    assert (verdict_of(ladder), ladder.causes) == ("unknown", ())
    assert max(ladder.structure, key=lambda one: one.strength).stage == "flight"
    as_sealed(law.entry(law_file(1), np.random.default_rng(0)))


@pytest.mark.further
def test_the_command_writes_it_and_held_in_the_next_diagnosis_it_leaves_nothing(
    tmp_path, without_next_test, monkeypatch
):
    """Its page blank: a law's is asked in test_laws."""
    monkeypatch.setattr("analysis.gap.page.gap_page.gap_page", blank)
    first, second = tmp_path / "first", tmp_path / "second"
    assert main(["diagnose", str(SAMPLE), "--out", str(first), "--quiet"]) == 0
    answer = json.loads((first / "diagnosis.json").read_text())
    assert answer["verdict"] == "unknown" and answer["effects"] == [] and answer["stage"] == "flight"
    (law,) = answer["laws"]
    as_sealed(law)
    assert main(["diagnose", str(SAMPLE), "--out", str(second), "--law", str(first / "law-1.toml"), "--quiet"]) == 0
    answer = json.loads((second / "diagnosis.json").read_text())
    assert (answer["verdict"], answer["effects"], answer["left"]) == ("none", [], [])
