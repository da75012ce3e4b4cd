"""The page builder and the writing of numbers."""

from __future__ import annotations

import re
import sys
from functools import partial
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from analysis.figures.style import new_figure
from analysis.report.numbers import interval, length, percent, value_with_digits, value_with_sd, with_unit
from analysis.report.page import Page


@pytest.mark.parametrize(
    "value, sd, text",
    [
        (0.29513, 0.00029, "0.29513(29)"),
        (0.789, 0.0064, "0.789(6)"),
        (-0.5, 0.2, "−0.50(20)"),
        (0.7, 0.0097, "0.700(10)"),
        (0.1, 2.0, "0.1 ± 2.0"),
        (None, 1.0, "–"),
        (float("nan"), 0.1, "–"),
    ],
)
def test_short_form_holds_the_sd_in_the_last_digits(value, sd, text):
    assert value_with_digits(value, sd) == text


@pytest.mark.parametrize(
    ("value", "sd", "unit", "text"),
    [
        (0.7234, 0.0124, "", "0.723 ± 0.012"),
        (0.7234, 0.0354, "", "0.723 ± 0.035"),
        (0.7234, 0.0356, "", "0.72 ± 0.04"),  # beyond 35 one digit is enough
        (0.7234, 0.097, "", "0.72 ± 0.10"),  # 0.097 is 0.10, not 0.1
        (12.345, 0.4, "mm", "(12.3 ± 0.4) mm"),
        (1234.5, 23.0, "", "1234 ± 23"),
        (-0.00004, 0.012, "", "0.000 ± 0.012"),  # no minus zero
        (-1.5, 0.2, "rad", "(−1.50 ± 0.20) rad"),
        (3.2e-7, 1.1e-8, "m", "(3.20 ± 0.11) × 10⁻⁷ m"),
        (0.5, nan, "", "0.500"),
        (0.5, 0.0, "", "0.500"),
        (0.5, inf, "", "0.500"),
        (nan, 0.1, "", "–"),
        (None, None, "m", "–"),
    ],
)
def test_value_with_sd(value, sd, unit, text):
    assert value_with_sd(value, sd, unit) == text


@given(st.floats(-1e3, 1e3), st.floats(1e-5, 1e2))
def test_rounding_moves_a_value_by_less_than_its_sd(value, sd):
    text = value_with_sd(value, sd).replace("−", "-")
    if "×" in text:
        return
    shown, shown_sd = (float(part) for part in text.split(" ± "))
    assert abs(shown - value) <= 0.51 * sd
    assert shown_sd == pytest.approx(sd, rel=0.15)


def test_other_numbers():
    assert with_unit(0.0123456, "m") == "0.0123 m"
    assert with_unit(0.0, "m") == "0 m"
    assert with_unit(1.2e-6, "s", 2) == "1.2 × 10⁻⁶ s"
    assert with_unit(nan, "s") == "–"
    assert interval(0.7101, 0.7349) == "0.710 to 0.735"
    assert interval(2.095e-8, 2.132e-8, "1/px²") == "(2.095 to 2.132) × 10⁻⁸ 1/px²"
    assert interval(-3e-5, 1e-5) == "(-3.0 to 1.0) × 10⁻⁵".replace("-3", "−3")
    assert interval(0.42, nan) == "≥ 0.420"
    assert interval(None, 0.42) == "≤ 0.420"
    assert interval(nan, nan) == "–"
    assert [percent(share) for share in (1.0, 0.99999, 0.5, 1e-9, 0.0, nan)] == [
        "100 %",
        "99.9 %",
        "50 %",
        "0.1 %",
        "0 %",
        "–",
    ]


NASTY = '<script>console.error("in")</script> & "quoted" $x^'


def nasty_page() -> Page:
    page = Page(NASTY, NASTY, NASTY, [(NASTY, NASTY)], footer=NASTY)
    page.add_card(NASTY, NASTY, "good", [NASTY])
    page.actions.append(NASTY)
    for title in ("one", "two", NASTY):
        section = page.add_section(title, "anchor")
        section.add_text(NASTY)
        section.add_heading(NASTY)
        section.add_note(NASTY, "caution", NASTY)
        section.add_missing(NASTY, NASTY)
        section.add_list([NASTY])
        section.add_table([NASTY, "b"], [[NASTY, "1"]], NASTY)
        figure, axes = new_figure()
        axes[0, 0].plot([0, 1], [0, 1])
        section.add_figure("line", figure, NASTY, NASTY)
    return page


def test_names_are_escaped():
    text = nasty_page().render()
    assert "<script>" not in text
    assert text.count("&lt;script&gt;") > 20


def test_indices_of_symbols_are_set_low_and_nothing_else_is():
    page = Page("t", "k")
    page.add_section("s", "s").add_text("μ_c and <b>v_t</b> but not run_s or R_cx")
    assert "μ<sub>c</sub> and &lt;b&gt;v<sub>t</sub>&lt;/b&gt; but not run_s or R_cx" in page.render()


def test_the_browser_would_tell(browse):
    """The check itself: a page that complains, fetches and lacks a picture is seen to do so."""
    seen = browse(
        '<html><body><img alt="gone" src="missing.png"><img alt="far" '
        'src="https://example.org/x.png"><script>console.error("oh")</script></body></html>'
    )
    assert seen.console
    assert any("missing.png" in address for address in seen.fetched)
    assert any("example.org" in address for address in seen.fetched)
    assert seen.pictures == [("gone", 0, 0), ("far", 0, 0)]


@pytest.mark.parametrize("width_px", [1200, 400])
def test_page_in_a_browser(browse, width_px):
    seen = browse(nasty_page().render(), width_px)
    assert seen.console == []
    assert seen.fetched == []
    assert [picture[0] for picture in seen.pictures] == [NASTY] * 3
    assert all(width > 0 for _, width, _ in seen.pictures)
    assert seen.too_wide == 0


def test_figures_are_saved_as_svg_and_pdf(tmp_path):
    files = nasty_page().save_figures(tmp_path / "figures")
    assert {file.name for file in files} == {"line.svg", "line.pdf"}
    assert (tmp_path / "figures" / "line.pdf").read_bytes().startswith(b"%PDF")
    assert not list(tmp_path.glob("**/*.unfinished"))


def test_the_same_figure_gives_the_same_page():
    assert nasty_page().render() == nasty_page().render()


def drawn_page(*names: str) -> Page:
    """A page whose figures are built when it is rendered, each with another curve; of "no figure" nothing is built."""
    page = Page("t", "k")
    section = page.add_section("s", "s")

    def built(number: int, name: str) -> Figure:
        if name == "no figure":
            raise ValueError("nothing to show")
        figure, axes = new_figure()
        axes[0, 0].plot([0, number], [0, 1], "o-")
        return figure

    for number, name in enumerate(names):
        section.add_figure(name, partial(built, number, name), name, name, "png" if number % 2 else "svg")
    return page


@pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux only")
def test_figures_drawn_by_two_processes_are_those_of_one(monkeypatch):
    def render(processors: int) -> str:
        monkeypatch.setattr("ovines.workers.beside.os.cpu_count", lambda: processors)
        return drawn_page(*"abcdef").render()

    alone = render(1)
    assert alone.count("data:image") == 6 and len(set(re.findall('src="data[^"]+"', alone))) == 6
    assert render(2) == alone


@pytest.mark.parametrize("processors", [1, 2])
def test_a_figure_that_fails_is_named(monkeypatch, processors):
    monkeypatch.setattr("ovines.workers.beside.os.cpu_count", lambda: processors)
    with pytest.raises(ValueError, match="nothing to show") as raised:
        drawn_page("a", "no figure", "c").render()
    assert raised.value.__notes__ == ["in the figure 'no figure'"]


@pytest.mark.parametrize(
    ("value_m", "text"),
    [
        (9.3e-7, "0.93 µm"),
        (1.7e-6, "1.7 µm"),
        (-2.34e-4, "−0.23 mm"),
        (0.05, "50 mm"),
        (4e-9, "4.0 nm"),
        (0.0, "0 nm"),
        (1.5, "1.5 m"),
        (nan, "–"),
        (None, "–"),
    ],
)
def test_lengths_choose_their_unit(value_m, text):
    assert length(value_m) == text
