"""The score of a trial: its answers beside the truths, what an oracle and the plant's own laws would close."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.blind import trial
from analysis.blind.scoring import report, score
from analysis.blind.scoring.intervals import Figure
from analysis.blind.scoring.marks import Row, mark
from analysis.blind.scoring.oracle import in_flights, oracle_share
from analysis.blind.scoring.probabilities import probability_figures, reliability
from analysis.blind.series import Outline, run_outline
from ovines import __version__
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.pipeline.blind.answers import read_answer
from ovines.pipeline.blind.processes import of_each, well_formed
from ovines.pipeline.series.written_diagnosis import DIAGNOSIS, PREDICTIONS
from ovines.tables import read_table

if TYPE_CHECKING:
    from ovines.pipeline.blind.law_oracle import LawShare


@dataclass(frozen=True, eq=False)
class Marked:
    """A trial's ``rows``, one for each answered case, and the ``answers`` by case, of ``count`` cases in all; its
    ``seed`` (None: unknown) draws what the plant did once more."""

    folder: Path
    seed: int | None
    rows: list[Row]
    answers: dict[str, dict[str, Any]]
    count: int

    def again(self) -> list[tuple[Outline, list[int]]]:
        """Outlines of the answered cases, each with the seed of its runs; `InputError` where the seed is another."""
        if self.seed is None:
            return []
        every = trial.outlines_again(self.folder, self.seed)
        return [
            (outline, [self.seed, i, 1]) for i, outline in enumerate(every, 1) if outline.truth["case"] in self.answers
        ]


def mark_trial(folder: Path, seed: int | None, partial: bool) -> Marked:
    """Each answered case beside its truth; with ``partial``, cases may be without an answer."""
    with well_formed(folder):
        truths = trial.read_truths(folder, seed)
        rows: list[Row] = []
        answers: dict[str, dict[str, Any]] = {}
        for case, truth in truths.items():
            out = folder / "answers" / case
            if not (out / DIAGNOSIS).exists():
                if partial:
                    continue
                raise InputError(
                    f"{case} has no answer",
                    "an answer to every case",
                    "run `ovines blind answer` to the end, or score with --partial",
                )
            answers[case] = read_answer(out)
            clock = out / "seconds.json"
            rows.append(mark(truth, answers[case], json.loads(clock.read_text()) if clock.exists() else None))
    if not rows:
        raise InputError(f"no answers in {folder}", "at least one", "run `ovines blind answer` first")
    return Marked(folder, seed, rows, answers, len(truths))


def oracle_shares(marked: Marked, jobs: int) -> list[float]:
    """What the answers close of what an oracle closes, of the cases whose causes all lie in the flights; the plant runs
    again for it."""
    asked = [(marked.folder, outline, seed) for outline, seed in marked.again() if in_flights(outline.truth)]
    return [share for share in of_each(_oracle_case, asked, jobs, ordered=True) if share is not None]


def _oracle_case(folder: Path, outline: Outline, seed: list[int]) -> float | None:
    predictions = read_table(folder / "answers" / outline.truth["case"] / PREDICTIONS, "predictions")
    return oracle_share(predictions, run_outline(outline, np.random.default_rng(seed)).states, outline.place)


def law_shares(marked: Marked, jobs: int) -> list[LawShare]:
    """What written laws close of what the plant's own close, by case."""
    asked = [(marked.folder, outline, seed) for outline, seed in marked.again()]
    return [share for some in of_each(_law_case, asked, jobs, ordered=True) for share in some]


def _law_case(folder: Path, outline: Outline, seed: list[int]) -> list[LawShare]:
    from ovines.pipeline.blind.law_oracle import shares_of_case

    return shares_of_case(folder, outline, seed)


def write_score(marked: Marked, jobs: int, with_laws: bool) -> str:
    """Write score.json, score.md, confusion.png and reliability.png into the trial's folder; the text of score.md."""
    folder, rows, rng = marked.folder, marked.rows, np.random.default_rng(0)
    figures = score.figures_of(rows, rng) + probability_figures(rows, rng)
    figures.append(score.oracle_figure(oracle_shares(marked, jobs), rng))
    laws = law_shares(marked, jobs) if with_laws else []
    law_table = _add_laws(laws, figures) if with_laws else ""
    bands = reliability(rows)
    causes = score.per_cause(rows, marked.answers)
    result = {
        "format": 1,
        "figures": [asdict(f) for f in figures],
        "reliability": bands,
        "causes": causes,
        "cases": [r.flat() for r in rows],
    }
    result |= {"laws": [asdict(one) for one in laws]} if with_laws else {}
    write_text_whole(json.dumps(result, indent=1), folder / "score.json")
    command = f"ovines blind score {folder.name}` on {len(rows)} of {marked.count} cases, `ovines {__version__}"
    text = report.markdown(figures, causes, rows, bands, command) + law_table
    write_text_whole(text, folder / "score.md")
    report.confusion_picture(rows, folder / "confusion.png")
    report.reliability_picture(bands, folder / "reliability.png")
    return text


def _add_laws(laws: list[LawShare], figures: list[Figure]) -> str:
    """The figure of the laws to the others; their table for score.md."""
    from ovines.pipeline.blind.law_oracle import law_figure, law_markdown

    figures.append(law_figure(laws))
    return law_markdown(laws)
