"""One self-contained HTML page in the house style: verdict cards, sections, figures, tables.

Every report of the application (recording, series, calibration, gap) is built from these pieces.  Text is
escaped when the page is rendered; figures are drawn into the page as data URIs, so it needs no network and
can be mailed.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Literal

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from analysis.figures.style import FigureFormat, data_uri, save_figure
from ovines.io.atomic_write import write_text_whole
from ovines.io.provenance import program, today
from ovines.workers.beside import made_by_two

Status = Literal["good", "caution", "bad", "neutral"]
Drawing = Figure | Callable[[], Figure]  # a figure, or what draws it when it is wanted
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Card:
    """One answer on the first screen: the question, the answer in a few words, and what it rests on."""

    question: str
    answer: str
    status: Status
    details: tuple[str, ...] = ()


@dataclass(frozen=True)
class Block:
    """A piece of a section; ``kind`` tells the template which of the fields to show."""

    kind: Literal["text", "heading", "note", "missing", "figure", "table", "list"]
    text: str = ""
    status: Status = "neutral"
    title: str = ""
    image: str = ""  # source of a figure's image, once it is drawn
    alt: str = ""
    draw: Callable[[], str] | None = None  # what makes it
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    items: tuple[str, ...] = ()
    text_columns: frozenset[int] = frozenset()
    links: tuple[str, ...] = ()


@dataclass
class Section:
    """A heading and what stands below it, in the order of the calls."""

    title: str
    anchor: str
    level: int = 2
    blocks: list[Block] = field(default_factory=list)
    figures: dict[str, Drawing] = field(default_factory=dict)

    def add_text(self, text: str) -> None:
        """A paragraph."""
        self.blocks.append(Block("text", text))

    def add_heading(self, text: str) -> None:
        """A heading within the section."""
        self.blocks.append(Block("heading", text))

    def add_note(self, text: str, status: Status = "neutral", title: str = "") -> None:
        """A paragraph that must not be overlooked."""
        self.blocks.append(Block("note", text, status, title))

    def add_missing(self, what: str, why: str) -> None:
        """A named gap: what would stand here, and why it does not."""
        self.blocks.append(Block("missing", why, title=what))

    def add_list(self, items: Sequence[str]) -> None:
        """A bulleted list."""
        self.blocks.append(Block("list", items=tuple(items)))

    def add_figure(self, name: str, figure: Drawing, caption: str, alt: str, image: FigureFormat = "svg") -> None:
        """A figure in the page, drawn with it; ``name`` is its file name when the figures are saved too.

        ``figure``: of one that takes time, better the function without arguments that gives it: the page's figures are
        drawn on two processors.  ``image="png"`` for pictures and dense maps, which a vector file would make heavy.
        """
        self.figures[name] = figure
        self.blocks.append(Block("figure", caption, alt=alt, draw=partial(_drawn, name, figure, image)))

    def add_table(
        self,
        columns: Sequence[str],
        rows: Sequence[Sequence[str]],
        caption: str = "",
        text_columns: Sequence[int] = (0,),
        links: Sequence[str] = (),
    ) -> None:
        """A table of ready-made texts; columns other than ``text_columns`` are set flush right.

        ``links``: per row the address that its first cell leads to, "" for none.
        """
        self.blocks.append(
            Block(
                "table",
                caption,
                columns=tuple(columns),
                rows=tuple(tuple(row) for row in rows),
                text_columns=frozenset(text_columns),
                links=tuple(links) or ("",) * len(rows),
            )
        )


@dataclass
class Page:
    """A page under construction.

    ``facts`` are label and value pairs for the line under the title; ``footer`` says where its numbers stand,
    ``source`` what it was made from; ``links`` are titles and addresses of pages that belong to it.
    """

    title: str
    kind: str
    lead: str = ""
    facts: list[tuple[str, str]] = field(default_factory=list)
    cards: list[Card] = field(default_factory=list)
    actions: list[str] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)
    footer: str = ""
    source: str = ""
    links: list[tuple[str, str]] = field(default_factory=list)

    @property
    def made(self) -> str:
        """When, from what and by which program the page was made."""
        return f"Made {today()}" + (f" from {self.source}" if self.source else "") + f" by {program()}."

    def add_card(self, question: str, answer: str, status: Status, details: Sequence[str] = ()) -> None:
        """A card at the top of the page: a question, its answer, and what that rests on."""
        self.cards.append(Card(question, answer, status, tuple(details)))

    def add_section(self, title: str, anchor: str) -> Section:
        """Start a section; ``anchor`` is its address within the page (letters, digits, hyphens)."""
        section = Section(title, anchor)
        self.sections.append(section)
        return section

    def render(self) -> str:
        """The whole page as one HTML text; draws the figures that it has not drawn yet."""
        places = [(s, k) for s in self.sections for k, block in enumerate(s.blocks) if block.draw and not block.image]
        works = [draw for section, k in places if (draw := section.blocks[k].draw) is not None]
        for (section, k), image in zip(places, made_by_two(works), strict=True):
            section.blocks[k] = replace(section.blocks[k], image=image)
        return (
            _environment().get_template("page.html.j2").render(page=self, style=(HERE / "style.css").read_text("utf-8"))
        )

    def write(self, path: Path) -> Path:
        """Render into the file ``path``, whole or not at all."""
        write_text_whole(self.render(), path)
        return path

    def save_figures(self, folder: Path, formats: Sequence[FigureFormat] = ("svg", "pdf")) -> list[Path]:
        """Each figure as files of its own for a paper or a talk."""
        folder.mkdir(parents=True, exist_ok=True)
        return [
            save_figure(drawn, folder / f"{name}.{image}")
            for section in self.sections
            for name, figure in section.figures.items()
            for drawn in [figure_of(name, figure)]
            for image in formats
        ]


def figure_of(name: str, figure: Drawing) -> Figure:
    """The figure ``name``, built if it is not; what stops that tells which it was."""
    with _naming(name):
        return _built(figure)


def _built(figure: Drawing) -> Figure:
    return figure if isinstance(figure, Figure) else figure()


def _drawn(name: str, figure: Drawing, image: FigureFormat) -> str:
    """The figure as the source of an HTML image."""
    with _naming(name):
        return data_uri(_built(figure), image)


@contextmanager
def _naming(name: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        error.add_note(f"in the figure '{name}'")
        raise


PAGES = {
    "report.html": "Report",
    "calibration.html": "Calibration",
    "compare.html": "Measured and simulated",
    "gap.html": "Why simulator and experiment differ",
}


def pages_beside(folder: Path, names: Sequence[str]) -> list[tuple[str, str]]:
    """Title and address of those of the pages ``names`` that lie in ``folder``."""
    return [(PAGES[name], name) for name in names if (folder / name).is_file()]


def source_of(source: Path, folder: Path) -> str:
    """The way from the page's ``folder`` to what it was made from."""
    return os.path.relpath(source.resolve(), folder.resolve())


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["symbols"] = _with_symbols
    return environment


def _with_symbols(text: str) -> Markup:
    """The text escaped, with the indices of our symbols set low (μ_c, μ_s, R_c, J_t, v_t, v_n) and `what is typed` as
    code.
    """
    low = re.sub(r"\b(μ|R|J|v)_([csnt])\b", r"\1<sub>\2</sub>", str(escape(text)))
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", low))
