"""One recording, run to its end: no exception leaves, so that another recording never pays for it."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tqdm import tqdm

from ovines.errors import InputError, refusal_of
from ovines.io.run_log import bars_disabled
from ovines.pipeline.context import Progress
from ovines.pipeline.ownership import refuse_theirs
from ovines.pipeline.pages import recording_figures, remove_figures, write_calibration_page
from ovines.pipeline.runner import Done, run_stages
from ovines.recording import Recording, read_recording
from ovines.system_library import missing_library

Status = Literal["done", "refused", "failed"]


@dataclass(frozen=True)
class Outcome:
    """How one recording ended: ``refused`` for wrong input, ``failed`` for a mistake of the program."""

    folder: Path
    out: Path
    status: Status
    stages: dict[str, str] = field(default_factory=dict)
    message: str = ""
    notes: list[str] = field(default_factory=list)
    verdict: list[str] = field(default_factory=list)  # of the identification's checks, then the principal parameters
    page: Path | None = None  # the report that was written
    whole_series: bool = False  # joint identification and page, not a recording


def run_one(
    folder: Path, out: Path, only: str | None, force: bool, bars: bool, figures: bool = False, in_series: bool = False
) -> Outcome:
    """Run one recording and say how it ended; no exception leaves here."""
    try:
        with _Bar(folder.name, bars) as bar:
            recording = read_recording(folder)
            if figures and only in (None, "report"):
                refuse_theirs(out, [], figures=True)  # before the work, not after
            done = run_stages(recording, out, only, force, bar.stage, bar.compiles if bars else None, in_series)
            _beside(recording, out, only, done, figures)
        verdict = _verdict(out) if only in (None, "identify") else []
        return Outcome(folder, out, "done", done.stages, notes=done.notes, verdict=verdict, page=_page(out, done))
    except InputError as error:
        return Outcome(folder, out, "refused", message=str(error))
    except OSError as error:
        return no_room(folder, out, error)
    except Exception as error:
        line = missing_library(error)
        return Outcome(folder, out, "refused" if line else "failed", message=line or traceback.format_exc())


def _beside(recording: Recording, out: Path, only: str | None, done: Done, figures: bool) -> None:
    """What belongs to the pages and is no stage of its own."""
    if "calibrate" in done.stages:
        write_calibration_page(recording, out, figures and only == "calibrate")
    if only in (None, "report"):
        if figures:
            recording_figures(recording, out)
        elif done.stages.get("report") == "run":
            remove_figures(out)  # of an earlier page


def _verdict(out: Path) -> list[str]:
    """What the checks say, and the principal parameters, in lines; nothing where nothing was identified."""
    from analysis.report.terminal import recording_in_words

    return recording_in_words(out)


def _page(out: Path, done: Done) -> Path | None:
    return out / "report.html" if "report" in done.stages and (out / "report.html").is_file() else None


def no_room(folder: Path, out: Path, error: OSError) -> Outcome:
    """A full disk, a missing permission or a bad path is nothing of ours, and said in three lines; another OSError
    is.
    """
    said = refusal_of(error, out) or missing_library(error)
    if said is None:
        return Outcome(folder, out, "failed", message="".join(traceback.format_exception(error)))
    return Outcome(folder, out, "refused", message=str(said))


class _Bar:
    """A progress bar per stage on standard error, where that is a terminal: hands out `Progress` callbacks."""

    def __init__(self, title: str, shown: bool) -> None:
        self._title, self._shown, self._bar = title, shown, None

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def stage(self, name: str) -> Progress:
        """The bar of one more stage."""
        self.__exit__()
        bar = self._bar = tqdm(desc=f"{self._title}: {name}", disable=bars_disabled(self._shown))

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        return progress

    def compiles(self, text: str, seconds: float) -> None:
        """Show that code is compiled, and leave the time it took out of the forecast."""
        if self._bar is not None and not self._bar.disable:
            self._bar.start_t += seconds
            self._bar.last_print_t += seconds
            self._bar.set_postfix_str(text)
