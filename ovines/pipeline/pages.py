"""What a recording's results hold beside the stages' own files: the calibration page, the figures as files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ovines.io.lock import locked
from ovines.pipeline.ownership import FIGURE_MARKS, FIGURES, ours_to_remove, refuse_theirs
from ovines.pipeline.stages import CALIBRATION_PAGE
from ovines.recording import Recording


def write_calibration_page(recording: Recording, out: Path, figures: bool) -> None:
    """``calibration.html`` in ``out`` from the calibration there; a page that is there stays (the stage removes an old
    one).
    """
    if (out / CALIBRATION_PAGE).is_file() and not figures:
        return
    from analysis.report.pages.calibration_report import write_calibration_report

    refuse_theirs(out, [CALIBRATION_PAGE], figures)
    with locked(out):
        write_calibration_report(out, recording, figures)


@contextmanager
def calibration_page_beside(recording: Recording, out: Path) -> Iterator[None]:
    """``calibration.html``, where it is missing, drawn by a second process while this one goes on; where that cannot
    be, :func:`write_calibration_page` draws it later.
    """
    path = out / CALIBRATION_PAGE
    if path.exists() or not (out / "calibration_views.parquet").exists():
        yield
        return
    from ovines.io.atomic_write import write_text_whole
    from ovines.workers.beside import made_beside

    def page() -> str:
        # here: this process loads them for its report, and need not wait for them
        from analysis.report.page import PAGES
        from analysis.report.pages.calibration_report import whole_calibration_page
        from analysis.report.results import read_results

        report = "report.html"
        return whole_calibration_page(read_results(out, recording), out, [(PAGES[report], report)]).render()

    with made_beside(page) as drawn:
        yield
        text = drawn()
    if text is not None:
        write_text_whole(text, path)


def recording_figures(recording: Recording, out: Path) -> None:
    """Every figure of ``report.html`` as SVG and PDF in ``out/figures``, those of an earlier page removed."""
    from analysis.report.pages.recording_report import recording_page
    from analysis.report.results import read_results
    from ovines.pipeline.functions import first_frames

    refuse_theirs(out, [], figures=True)
    with locked(out):
        remove_figures(out)
        recording_page(read_results(out, recording, first_frames(recording))).save_figures(out / FIGURES)


def remove_figures(out: Path) -> None:
    """Remove the figures of an earlier page; other files of the folder, and pictures that ovines did not draw, stay."""
    for ending in FIGURE_MARKS:
        for path in (out / FIGURES).glob(f"*{ending}"):
            if ours_to_remove(path):
                path.unlink()
    if (out / FIGURES).is_dir() and not any((out / FIGURES).iterdir()):
        (out / FIGURES).rmdir()
