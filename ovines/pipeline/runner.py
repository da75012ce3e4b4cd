"""Run the stages of one recording: what is stale, under a lock, nothing half written."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from ovines.camera import Camera, calibration_json, write_calibration
from ovines.errors import InputError
from ovines.io.atomic_write import remove_unfinished, write_text_whole
from ovines.io.hashing import hash_inputs
from ovines.io.lock import locked
from ovines.io.provenance import program
from ovines.io.run_log import LOG, LOGGER, logged
from ovines.pipeline.context import Progress, StageContext
from ovines.pipeline.ownership import (
    ours_to_remove,
    read_source,
    refuse_folder,
    refuse_strange_results,
    refuse_theirs,
    write_source,
)
from ovines.pipeline.pages import calibration_page_beside
from ovines.pipeline.stages import (
    ENTRY_STAGE,
    HTML_MARK,
    STAGES,
    Stage,
    inputs_of,
    is_fresh,
    stages_of,
    state_of,
    stored_state,
    with_content,
    written_from,
)
from ovines.plausibility.recording import refuse_contradictions
from ovines.recording import Recording
from ovines.tables import write_table
from ovines.workers.budget import interruptibly

AFTER_MOTION = ("identify", "report")  # stages beside which calibration.html is drawn: what it shows is there


@dataclass
class Done:
    """What happened to each stage, in order: "run" or "up to date"; and what there was to note."""

    stages: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def no_progress(done: int, total: int) -> None:
    """The progress callback that shows nothing."""


def run_stages(
    recording: Recording,
    out: Path,
    only: str | None = None,
    force: bool = False,
    progress: Callable[[str], Progress] = lambda stage: no_progress,
    compiles: Callable[[str, float], None] | None = None,
    in_series: bool = False,
) -> Done:
    """Bring ``out`` up to date: every stage that the recording needs, or those up to the stage ``only``.

    A stage runs when an output is missing or the hash of what it reads, of its own parameters or of its code has
    changed; ``force`` runs it anyway (with ``only``: that one). Before a stage runs, its outputs and those of the
    stages after it are removed: what stands in a results folder was made from what stands there.  ``compiles`` is
    called with what to show while code is compiled (:func:`ovines.first_run.compiling`); with it a second process
    helps. ``in_series``: a page of the series stands above ``out``.
    """
    refuse_folder(out)
    refuse_contradictions(recording)
    chosen = _up_to(only, recording)
    done, page_waits = Done(), "report" in (one.name for one in chosen)
    refuse_strange_results(out, recording)
    refuse_theirs(out, [LOG, *written_from(chosen[0])])
    with locked(out), logged(out), ExitStack() as beside:
        remove_unfinished(out)
        entered = ENTRY_STAGE[recording.entry()] in (one.name for one in chosen)
        write_source(out, recording.folder, "recording", recording if entered else None)
        LOGGER.info(
            "%s: %s, enters at %s, by %s", recording.folder.resolve(), recording.name, recording.entry(), program()
        )
        _remove_strays(recording, out)
        for one in chosen:
            inputs = inputs_of(one, recording, out)
            hashes = hash_inputs(inputs, recording.folder)
            state = state_of(one, recording, hashes)
            forced = force and only in (None, one.name)
            if not forced and is_fresh(one, out, state["key"]):
                done.stages[one.name] = "up to date"
                LOGGER.info("%s: up to date", one.name)
                continue
            LOGGER.info("%s: runs, because %s", one.name, "of --force" if forced else why_stale(one, out, state))
            for artifact, paths in inputs.items():
                LOGGER.info("%s: reads %s (%s)", one.name, in_words(artifact, paths), hashes[artifact][:12])
            began = time.monotonic()
            _remove_outputs(one, out)
            # here: cv2, numba and matplotlib are slow to load, and `check` needs none of them
            import ovines.pipeline.functions

            if compiles is not None and "run" not in done.stages.values():
                from ovines.first_run import compiling

                beside.enter_context(compiling([stage.name for stage in chosen[chosen.index(one) :]], compiles))
            if page_waits and one.name in AFTER_MOTION:
                page_waits = False
                beside.enter_context(calibration_page_beside(recording, out))
            above = in_series or "series" in read_source(out.parent)
            work = StageContext(recording, inputs, out, progress(one.name), in_series=above)
            stage_function = getattr(ovines.pipeline.functions, one.name)
            results = interruptibly(partial(stage_function, work))
            _write(one, results, out, {**state, "notes": work.notes})
            for note in work.notes:
                LOGGER.info("%s: note: %s", one.name, note)
            written = ", ".join(name for name in one.writes if name in results)
            LOGGER.info("%s: %s after %.1f s", one.name, written, time.monotonic() - began)
            done.notes += work.notes
            done.stages[one.name] = "run"
    return done


def _up_to(only: str | None, recording: Recording) -> list[Stage]:
    """The stages to look at: all, or those up to ``only``; a report is written from what is there."""
    needed = stages_of(recording)
    if only is None:
        return list(needed)
    names = [one.name for one in needed]
    if only not in names:
        raise InputError(
            f"'{only}' has nothing to do: {recording.folder} enters the chain at {recording.entry()}"
            + ("" if recording.calibration_file is None else " with a solved calibration"),
            "a stage after the entry: " + ", ".join(names),
            "run one of these",
        )
    last = names.index(only)
    return list(needed[last if only == "report" else 0 : last + 1])


def why_stale(one: Stage, out: Path, state: Mapping[str, Any]) -> str:
    """Why the outputs in ``out`` are not those of ``state``, in a few words."""
    old = stored_state(out / one.writes[0])
    if not old:
        return f"there is no {one.writes[0]}"
    words = {"version": "the version", "parameters": "its settings", "inputs": "what it reads", "code": "its code"}
    changed = [word for key, word in words.items() if old.get(key) != state[key]]
    return f"{' and '.join(changed)} changed" if changed else "an output is missing"


def in_words(artifact: str, paths: Sequence[Path]) -> str:
    """The files of an artifact: the one, or how many and where."""
    if len(paths) == 1:
        return str(paths[0])
    return f"{len(paths)} {artifact} from {paths[0]} on"


def _remove_outputs(first: Stage, out: Path) -> None:
    for name in written_from(first):
        (out / name).unlink(missing_ok=True)


def _remove_strays(recording: Recording, out: Path) -> None:
    """Results of stages that the recording no longer needs (it has got a solved calibration, say): the page would show
    them.
    """
    needed = stages_of(recording)
    strays = [name for one in STAGES if one not in needed for name in one.writes]
    for name in strays:
        if ours_to_remove(out / name):
            (out / name).unlink()


def _write(one: Stage, results: Mapping[str, Any], out: Path, state: Mapping[str, Any]) -> None:
    """Write a stage's results by the ending of their names; a kill between two leaves the stage stale, not wrong."""
    unknown = set(results) - set(one.writes)
    if unknown or one.writes[0] not in results:
        raise ValueError(f"stage {one.name} gave {sorted(results)}, declared are {one.writes}")
    outputs = [name for name in one.writes if name in results]
    provenance = {**state, "outputs": outputs}
    for name in reversed(outputs):  # the first one last: it is the one that vouches for the others
        write_output(results[name], out / name, provenance)


def write_output(content: pd.DataFrame | Sequence[Camera] | str, path: Path, provenance: Mapping[str, Any]) -> None:
    """A DataFrame as table, cameras as calibration.json, text as page, each with its provenance inside."""
    if isinstance(content, pd.DataFrame):
        write_table(content, path.stem, path, provenance)
    elif isinstance(content, str):
        mark = json.dumps(with_content(provenance, content), sort_keys=True)
        mark = mark.replace("--", "-\\u002d")  # it would end the comment
        write_text_whole(f"{content}\n{HTML_MARK}{mark} -->\n", path)
    else:
        written = json.dumps(calibration_json(content), sort_keys=True)
        write_calibration(content, path, provenance=with_content(provenance, written))
