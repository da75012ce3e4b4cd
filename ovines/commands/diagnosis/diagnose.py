"""`ovines diagnose`: where simulator and experiment differ, which effect causes it, how far it shrinks."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tqdm import tqdm

from ovines.commands.options import results_folder, whole_number
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
from ovines.workers.budget import add_yes, interruptibly

if TYPE_CHECKING:
    import pandas as pd

    from analysis.gap.laws.found_law import LawFound
    from analysis.report.page import Page

NAME = "diagnose"
HELP = "the sim-to-real gap of a series: where it lies, which effect causes it, how far it shrinks"
WRITES = ("predictions.parquet", "diagnosis.json", "gap.html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``SERIES --out DIR --write-model FILE --law FILE --seed N``."""
    parser.add_argument("series", type=Path, metavar="SERIES", help="folder of recordings (or one recording)")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the results (default: results/ inside the series)"
    )
    parser.add_argument(
        "--write-model",
        type=Path,
        metavar="FILE",
        help="write the nominal model with the effect added, as a [model] section (and [bodies.host], of another wall)",
    )
    parser.add_argument(
        "--law",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="a written law that the nominal model holds beside [model]; may be given several times",
    )
    parser.add_argument(
        "--withhold",
        action="append",
        default=[],
        metavar="EFFECT",
        help="take an effect out of the library for a trial: the answer must become unknown",
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="N",
        help="of the bootstrap of the shrinkage's interval (default: 0)",
    )
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Diagnose, write diagnosis.json, predictions.parquet and gap.html, say the verdict."""
    from analysis.gap.answer import answer_in_words, model_section

    out = results_folder(args.series, args.out)
    recordings = read_series(args.series)
    single = is_recording(args.series)
    owner = recordings[0].folder if single else args.series
    refuse_folder(out)
    refuse_other_source(out, owner, recordings[0] if single else None)
    refuse_theirs(out, [LOG, *WRITES, *law_files(out)])
    if args.write_model is not None:
        refuse_to_replace(args.write_model, "--write-model", "")
    for recording in recordings:
        refuse_large(recording.folder, args.yes)
    with locked(out), logged(out), tqdm(total=4, desc="diagnose", disable=bars_disabled()) as bar:
        if not (out / SOURCE).is_file():
            write_source(out, owner, "recording" if single else "series")
        LOGGER.info("diagnose %s: %d recordings, by %s", owner.resolve(), len(recordings), program())
        alone = all(recording.entry() == "impacts" for recording in recordings)
        answer = _of_impacts(args, recordings, bar) if alone else _of_motion(args, recordings, out, bar)
        for path in answer.sources.values():
            LOGGER.info("reads %s", path)
        bar.update()
        bar.set_postfix_str("report")
        _write(answer, args, owner, out)
        bar.update()
        if args.write_model is not None:
            model = model_section(answer.summary, recordings[0].model, answer.values, answer.lengths)
            write_text_whole(model, args.write_model)
        bar.update()
        lines = [answer_in_words(answer.summary), *details(answer.summary)]
        for line in lines:
            LOGGER.info("%s", line)
    print("\n  ".join([*lines, f"page: {out / WRITES[2]}"]))
    return 0


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


def _of_impacts(args: argparse.Namespace, recordings: Sequence[Recording], bar: Any) -> _Answer:
    """The diagnosis of impacts by themselves, without the motion between them."""
    import numpy as np
    import pandas as pd

    from analysis.gap.impacts_alone import diagnose_impacts
    from analysis.gap.page.impacts_page import impacts_page

    withheld = known_effects(args.withhold)
    if args.law:
        raise InputError("--law, and impacts by themselves", "a series with its motion", "leave --law away")
    brought, sources = load_impacts(recordings)
    bar.update()
    rng = np.random.default_rng(args.seed)
    summary = interruptibly(lambda: diagnose_impacts(brought, recordings, rng, withheld))
    predictions = pd.DataFrame({name: [] for name in TABLES["predictions"].names})
    draw = partial(impacts_page, summary, args.series.resolve().name, len(recordings))
    values = {n: one["with_effect"] for n, one in summary["nominal"].items() if np.isfinite(one["with_effect"])}
    return _Answer(summary, predictions, (), draw, values, {}, sources)


def _of_motion(args: argparse.Namespace, recordings: Sequence[Recording], out: Path, bar: Any) -> _Answer:
    """The diagnosis of a series with its motion."""
    import numpy as np

    from analysis.gap.answer import model_values, wall_lengths
    from analysis.gap.diagnose import diagnose
    from analysis.gap.page.gap_page import gap_page

    withheld = known_effects(args.withhold)
    series, sources = load_series(recordings, out, args.law)
    sources |= {f"--law {path.name}": path for path in args.law}
    bar.update()
    bar.set_postfix_str("flights, impacts, candidates")
    diagnosis = interruptibly(lambda: diagnose(series, np.random.default_rng(args.seed), withheld))
    return _Answer(
        diagnosis.summary,
        diagnosis.predictions,
        diagnosis.laws,
        partial(gap_page, diagnosis, args.series.resolve().name),
        model_values(diagnosis.ladder, diagnosis.estimates),
        wall_lengths(diagnosis.ladder, diagnosis.estimates),
        sources,
    )


def _write(answer: _Answer, args: argparse.Namespace, owner: Path, out: Path) -> None:
    """Predictions, diagnosis, laws and page into ``out``."""
    from analysis.gap.answer import plain
    from analysis.report.page import pages_beside, source_of

    hashes = {name: sha256_of(path) for name, path in answer.sources.items()}
    made = provenance("diagnose", {"seed": args.seed}, hashes)
    write_table(answer.predictions, "predictions", out / WRITES[0], made)
    # The answer first: the page is drawn from it.
    told = json.dumps(plain({**answer.summary, "provenance": made}), indent=1, allow_nan=False)
    write_text_whole(told + "\n", out / WRITES[1])
    write_law_files(answer.laws, args.series.resolve().name, out)
    page = answer.draw()
    page.source = source_of(owner, out)
    page.links = pages_beside(out, ("report.html",))
    write_text_whole(page.render(), out / WRITES[2])


def law_files(out: Path) -> list[str]:
    """Names of the law files in a folder of results."""
    return sorted(path.name for path in out.glob("law-*.toml"))


def write_law_files(laws: Sequence[LawFound], name: str, out: Path) -> None:
    """``law-1.toml`` and on; those of an earlier diagnosis are removed."""
    from ovines.law_file import law_text

    for old in law_files(out):
        (out / old).unlink()
    for number, one in enumerate(laws, 1):
        said = [f"p = {one.p:.2g} by chance; what else it may be stands in diagnosis.json"]
        write_text_whole(law_text(one.law, f"law {number} of {name}", said), out / f"law-{number}.toml")


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
