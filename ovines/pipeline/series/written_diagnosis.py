"""The diagnosis of a series, written into its folder: diagnosis.json, predictions.parquet, laws and gap.html."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tqdm import tqdm

from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.io.lock import locked
from ovines.io.provenance import program, provenance, sha256_of
from ovines.io.run_log import LOG, LOGGER, bars_disabled, logged
from ovines.pipeline.ownership import (
    SOURCE,
    refuse_folder,
    refuse_other_source,
    refuse_theirs,
    refuse_to_replace,
    write_source,
)
from ovines.pipeline.series.diagnosis import load_impacts, load_series
from ovines.pipeline.series.recordings import is_recording, refuse_large
from ovines.recording import Recording, read_series
from ovines.tables import TABLES, write_table
from ovines.workers.budget import interruptibly

if TYPE_CHECKING:
    import pandas as pd

    from analysis.gap.laws.found_law import LawFound
    from analysis.report.page import Page

PREDICTIONS, DIAGNOSIS, PAGE = "predictions.parquet", "diagnosis.json", "gap.html"


@dataclass(frozen=True)
class Asked:
    """What is diagnosed, and how: the folder of the ``series`` (or of one recording) and the one for the results;
    files of written ``laws`` that the nominal model holds; effects ``withheld`` from the library; the ``seed`` of the
    bootstrap; the file for the ``model`` with the effect added (None: none); ``yes``: whatever it costs."""

    series: Path
    out: Path
    laws: Sequence[Path] = ()
    withheld: Sequence[str] = ()
    seed: int = 0
    model: Path | None = None
    yes: bool = False


def write_diagnosis(asked: Asked) -> list[str]:
    """Diagnose a series and write the answer into its folder.

    Returns
    -------
    list of str
        The answer in words, its parameters and laws, what to do next and where the page lies.

    Raises
    ------
    InputError
        The series cannot be used, or a folder or file holds something else.
    """
    from analysis.gap.answer import answer_in_words, model_section

    out = asked.out
    recordings = read_series(asked.series)
    single = is_recording(asked.series)
    owner = recordings[0].folder if single else asked.series
    refuse_folder(out)
    refuse_other_source(out, owner, recordings[0] if single else None)
    refuse_theirs(out, [LOG, PREDICTIONS, DIAGNOSIS, PAGE, *law_files(out)])
    if asked.model is not None:
        refuse_to_replace(asked.model, "--write-model", "")
    for recording in recordings:
        refuse_large(recording.folder, asked.yes)
    with locked(out), logged(out), tqdm(total=4, desc="diagnose", disable=bars_disabled()) as bar:
        if not (out / SOURCE).is_file():
            write_source(out, owner, "recording" if single else "series")
        LOGGER.info("diagnose %s: %d recordings, by %s", owner.resolve(), len(recordings), program())
        alone = all(recording.entry() == "impacts" for recording in recordings)
        answer = (_of_impacts if alone else _of_motion)(asked, recordings, bar)
        for path in answer.sources.values():
            LOGGER.info("reads %s", path)
        bar.update()
        bar.set_postfix_str("report")
        _write(answer, asked, owner)
        bar.update()
        if asked.model is not None:
            model = model_section(answer.summary, recordings[0].model, answer.values, answer.lengths)
            write_text_whole(model, asked.model)
        bar.update()
        lines = [answer_in_words(answer.summary), *details(answer.summary)]
        for line in lines:
            LOGGER.info("%s", line)
    return [*lines, f"page: {out / PAGE}"]


class _Answer(NamedTuple):
    """What was found: for diagnosis.json, the predictions, the laws, how to ``draw`` the page, ``values`` for a
    ``[model]`` and ``lengths`` for a ``[bodies.host]`` by name, and the files that were read."""

    summary: dict[str, Any]
    predictions: pd.DataFrame
    laws: Sequence[LawFound]
    draw: Callable[[], Page]
    values: dict[str, float]
    lengths: Mapping[str, Any]
    sources: Mapping[str, Path]


def _of_impacts(asked: Asked, recordings: Sequence[Recording], bar: Any) -> _Answer:
    """The diagnosis of impacts by themselves, without the motion between them."""
    import numpy as np
    import pandas as pd

    from analysis.gap.impacts_alone import diagnose_impacts
    from analysis.gap.page.impacts_page import impacts_page

    withheld = known_effects(asked.withheld)
    if asked.laws:
        raise InputError("--law, and impacts by themselves", "a series with its motion", "leave --law away")
    brought, sources = load_impacts(recordings)
    bar.update()
    rng = np.random.default_rng(asked.seed)
    summary = interruptibly(lambda: diagnose_impacts(brought, recordings, rng, withheld))
    predictions = pd.DataFrame({name: [] for name in TABLES["predictions"].names})
    draw = partial(impacts_page, summary, asked.series.resolve().name, len(recordings))
    values = {n: one["with_effect"] for n, one in summary["nominal"].items() if np.isfinite(one["with_effect"])}
    return _Answer(summary, predictions, (), draw, values, {}, sources)


def _of_motion(asked: Asked, recordings: Sequence[Recording], bar: Any) -> _Answer:
    """The diagnosis of a series with its motion."""
    import numpy as np

    from analysis.gap.answer import model_values, wall_lengths
    from analysis.gap.diagnose import diagnose
    from analysis.gap.page.gap_page import gap_page

    withheld = known_effects(asked.withheld)
    series, sources = load_series(recordings, asked.out, asked.laws)
    sources |= {f"--law {path.name}": path for path in asked.laws}
    bar.update()
    bar.set_postfix_str("flights, impacts, candidates")
    diagnosis = interruptibly(lambda: diagnose(series, np.random.default_rng(asked.seed), withheld))
    return _Answer(
        diagnosis.summary,
        diagnosis.predictions,
        diagnosis.laws,
        partial(gap_page, diagnosis, asked.series.resolve().name),
        model_values(diagnosis.ladder, diagnosis.estimates),
        wall_lengths(diagnosis.ladder, diagnosis.estimates),
        sources,
    )


def _write(answer: _Answer, asked: Asked, owner: Path) -> None:
    """Predictions, diagnosis, laws and page into the folder for results."""
    from analysis.gap.answer import plain
    from analysis.report.page import pages_beside, source_of

    out = asked.out
    hashes = {name: sha256_of(path) for name, path in answer.sources.items()}
    made = provenance("diagnose", {"seed": asked.seed}, hashes)
    write_table(answer.predictions, "predictions", out / PREDICTIONS, made)
    # The answer first: the page is drawn from it.
    text = json.dumps(plain({**answer.summary, "provenance": made}), indent=1, allow_nan=False)
    write_text_whole(text + "\n", out / DIAGNOSIS)
    write_law_files(answer.laws, asked.series.resolve().name, out)
    page = answer.draw()
    page.source = source_of(owner, out)
    page.links = pages_beside(out, ("report.html",))
    write_text_whole(page.render(), out / PAGE)


def law_files(out: Path) -> list[str]:
    """Names of the law files in a folder of results."""
    return sorted(path.name for path in out.glob("law-*.toml"))


def write_law_files(laws: Sequence[LawFound], name: str, out: Path) -> None:
    """``law-1.toml`` and on; those of an earlier diagnosis are removed."""
    from analysis.gap.laws.found_law import law_file
    from ovines.law_file import law_text

    for old in law_files(out):
        (out / old).unlink()
    for number, one in enumerate(laws, 1):
        said = [f"p = {one.p:.2g} by chance; what else it may be stands in diagnosis.json"]
        write_text_whole(law_text(one.law, f"law {number} of {name}", said), out / law_file(number))


def details(summary: Mapping[str, Any]) -> list[str]:
    """The parameters of the effects with their intervals, and what to do next."""
    from analysis.report.numbers import interval, with_unit

    lines = []
    for effect, parameters in summary["parameters"].items():
        for name, one in parameters.items():
            ends = interval(one["low"], one["high"])
            lines.append(f"{effect} {name} = {with_unit(one['value'], digits=4)} (90 %: {ends})")
    for law in summary.get("laws", ()):
        ends = interval(100 * law["shrinkage_low"], 100 * law["shrinkage_high"])
        lines.append(f"law of the {law['stage']}: {law['formula']}")
        lines.append(f"  closes {100 * law['shrinkage']:.0f} % ({ends} %) of what is left, in {law['file']}")
        if law.get("halves") and not law["halves"]["agree"]:
            lines.append("  do not use this law: the halves of the runs disagree on its size")
    return [*lines, f"Do: {summary['next_test']}"]


def known_effects(names: Sequence[str]) -> frozenset[str]:
    """The names given to --withhold, each an effect of the library."""
    from ovines.core.effects import EFFECTS

    for name in names:
        if name not in EFFECTS:
            raise InputError(f"--withhold {name}", "one of " + ", ".join(EFFECTS), "correct the name")
    return frozenset(names)
