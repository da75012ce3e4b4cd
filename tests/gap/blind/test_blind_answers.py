"""Answering a trial: can be interrupted; the short version of the whole trial with the real diagnosis."""

import argparse
import json

import pytest

from ovines.commands.diagnosis import blind
from ovines.errors import InputError
from ovines.pipeline.blind import answers


def _run(*arguments):
    parser = argparse.ArgumentParser()
    blind.add_arguments(parser)
    return blind.run(parser.parse_args([str(a) for a in arguments]))


def test_answering_goes_on_where_it_stopped(tmp_path, monkeypatch):
    _run("make", tmp_path / "t", "--cases", 2, "--seed", 3, "--runs", 1, "--kinds", "none")
    asked = []

    def answer(series, out):
        asked.append(series.name)
        assert (series / "run-01" / "tracks.parquet").exists()
        if len(asked) == 2:
            raise KeyboardInterrupt
        out.mkdir(parents=True, exist_ok=True)
        (out / "diagnosis.json").write_text(
            json.dumps({"verdict": "none", "effects": [], "equivalent": [], "stage": None})
        )

    monkeypatch.setattr(answers, "diagnose", answer)
    with pytest.raises(KeyboardInterrupt):
        _run("answer", tmp_path / "t")
    assert _run("score", tmp_path / "t", "--partial") == 0
    assert _run("answer", tmp_path / "t") == 0
    assert asked == ["case-001", "case-002", "case-002"]
    assert _run("score", tmp_path / "t") == 0
    figures = {f["name"]: f for f in json.loads((tmp_path / "t" / "score.json").read_text())["figures"]}
    assert figures["false alarms"]["n"] == 2 and figures["false alarms"]["value"] == 0.0


def test_a_case_that_ends_in_an_error_costs_only_itself(tmp_path, monkeypatch, capsys):
    _run("make", tmp_path / "t", "--cases", 2, "--seed", 3, "--runs", 1, "--kinds", "none")

    def answer(series, out):
        if series.name == "case-001":
            raise ArithmeticError("no eigenvalues")
        out.mkdir(parents=True, exist_ok=True)
        verdict = {"verdict": "none", "effects": [], "equivalent": [], "stage": None}
        (out / "diagnosis.json").write_text(json.dumps(verdict))

    monkeypatch.setattr(answers, "diagnose", answer)
    assert _run("answer", tmp_path / "t") == 1
    said = capsys.readouterr()
    printed = said.out + said.err
    assert "case-001: no answer (ArithmeticError: no eigenvalues" in printed and "2/2 case-002: none" in printed
    failed = tmp_path / "t" / "answers" / "case-001" / "failed.txt"
    assert "no eigenvalues" in failed.read_text()
    with pytest.raises(InputError, match="case-001 has no answer"):
        _run("score", tmp_path / "t")
    monkeypatch.setattr(answers, "diagnose", lambda series, out: answer(series.with_name("case-002"), out))
    assert _run("answer", tmp_path / "t") == 0 and not failed.exists()


def test_another_seed_is_no_oracle_and_laws_need_one(tmp_path):
    """Its outlines are other cases: what the plant did again would be held against answers to these."""
    folder = tmp_path / "t"
    _run("make", folder, "--cases", 1, "--seed", 3, "--runs", 1, "--kinds", "none")
    (folder / "answers" / "case-001").mkdir(parents=True)
    verdict = {"verdict": "none", "effects": [], "equivalent": [], "stage": None}
    (folder / "answers" / "case-001" / "diagnosis.json").write_text(json.dumps(verdict))
    with pytest.raises(InputError, match="another hash"):
        _run("score", folder, "--seed", 4)
    with pytest.raises(InputError, match="--laws without the seed"):
        _run("score", folder, "--laws")
    assert _run("score", folder, "--seed", 3, "--laws") == 0
    assert json.loads((folder / "score.json").read_text())["laws"] == []
    assert "## Laws against the plant's own" in (folder / "score.md").read_text()


@pytest.mark.long
def test_short_trial_with_the_real_diagnosis(tmp_path):
    """Nine sealed cases, large sizes: four without effect, four listed, one unknown. One may go wrong."""
    trial = tmp_path / "trial"
    kinds = "none,table_tilt,speed_dependent_restitution,wall_ellipticity,camera_clock_offset,unknown_central"
    assert _run("make", trial, "--cases", 9, "--seed", 17, "--kinds", kinds, "--sizes", "1", "--seal") == 0
    assert _run("answer", trial) == 0
    assert _run("score", trial, "--seed", 17) == 0
    cases = json.loads((trial / "score.json").read_text())["cases"]
    right = [
        c["verdict"] == "none"
        if c["group"] == "none"
        else c["verdict"] == "unknown"
        if c["group"] == "unknown"
        else c["first_right"]
        for c in cases
    ]
    assert len(right) == 9 and sum(right) >= 8
