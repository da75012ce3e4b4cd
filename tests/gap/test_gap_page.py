"""gap.html: what it says and shows for an effect, for nothing found, and where data are missing; looked at in a real
browser.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.contact.held_laws import known_at_impacts
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.gap.cause import Cause, Instead
from analysis.gap.diagnose import diagnose
from analysis.gap.page.figures.flights import flight_panels
from analysis.gap.page.figures.impact_ranking import _gains
from analysis.gap.page.figures.impacts import impact_panels
from analysis.gap.page.figures.panels import binned
from analysis.gap.page.figures.paths import chosen_flight, flight_errors, in_host, paths_of
from analysis.gap.page.first_screen import verdict_card
from analysis.gap.page.gap_page import gap_page
from analysis.gap.page.laws import _plain_symbol
from analysis.gap.page.tables import stage_rows
from analysis.gap.page.words import STAGES, parameter_words, shown, shown_interval
from analysis.gap.prediction.how_far import HowFar
from analysis.gap.prediction.probabilities import probabilities
from analysis.gap.selection.centres import centre_offsets, is_effect
from analysis.gap.selection.flights.missing_acceleration import LONG, missing_acceleration, residual_frames
from analysis.gap.selection.impacts.floor import impact_floor
from analysis.gap.series import from_motions
from analysis.report.numbers import percent
from analysis.report.page import Page
from ovines.core.effects import EFFECTS
from ovines.core.laws import words as W
from ovines.core.laws.targets import TARGETS
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.laws.words import QUANTITIES
from tests.analysis.conftest import browse  # noqa: F401  (a fixture)

FIGURES = (
    "gap-ladder",
    "gap-ranking-flights",
    "gap-ranking-impacts",
    "gap-where",
    "gap-trajectory",
    "gap-measured",
    "gap-layout",
)


@pytest.fixture(scope="module")
def page(tilted):
    return gap_page(tilted[0], "a tilted table")


def figures_of(page) -> set[str]:
    return {name for section in page.sections for name in section.figures}


def texts_of(page) -> str:
    return " ".join(f"{b.title} {b.text} {b.rows}" for s in page.sections for b in s.blocks)


def test_first_screen_names_the_effect_its_size_and_what_to_do(page):
    cause, far = page.cards
    assert cause.answer == "Table tilt"
    assert float(far.answer.split()[1].removesuffix("%")) > 90
    assert any("mrad" in d for d in cause.details)
    assert "--write-model" in page.actions[0]
    assert "times what noise moves the answer" in page.actions[1] and page.actions[1].endswith(
        EFFECTS["table_tilt"].words.by_hand
    )


def rows_under(page, first: str) -> tuple[tuple[str, ...], ...]:
    """Rows of the table whose first column is called ``first``."""
    return next(b.rows for s in page.sections for b in s.blocks if b.columns[:1] == (first,))


def test_the_share_on_the_first_screen_is_that_of_the_table(page):
    *stages, whole = rows_under(page, "where")
    parts = [float(row[-1].removesuffix(" %")) for row in stages]
    assert page.cards[1].answer.startswith(f"By {whole[-1]} (")
    assert sum(parts) == pytest.approx(float(whole[-1].removesuffix(" %")), abs=0.6 * len(parts))


@pytest.mark.parametrize("stage", ["impact", "geometry", "measurement", "drive"])
def test_an_effect_of_any_stage_shows_in_the_table_as_in_the_share(stage):
    def sums(flight: float, own: float) -> dict[str, np.ndarray]:
        return {"flight": np.full(3, flight), stage: np.full(3, own)}

    far = HowFar(sums(30.0, 90.0), sums(30.0, 30.0), sums(10.0, 10.0), {"cause": np.full(3, 60.0)})
    share = far.entry(np.random.default_rng(0))["shrinkage"]
    flight, own, whole = stage_rows(far, share)
    assert share == pytest.approx(60 / 100)
    assert flight == (STAGES["flight"], "90.0", "90.0", "30.0", "0 %")
    assert own == (STAGES[stage], "270", "90.0", "30.0", "60 %")
    assert whole == ("in all", "360", "180", "60.0", "60 %")


def test_a_model_that_is_worse_shrinks_by_less_than_nothing():
    """A share is shown as it is, below nothing and above all."""
    far = HowFar(
        {"flight": np.full(3, 20.0)},
        {"flight": np.full(3, 29.0)},
        {"flight": np.full(3, 10.0)},
        {"x": np.full(3, -9.0)},
    )
    share = far.entry(np.random.default_rng(0))["shrinkage"]
    assert [row[-1] for row in stage_rows(far, share)] == ["−90 %", "−90 %"] and percent(1.2) == "120 %"


def test_where_a_law_was_written_something_is_left(tilted):
    """However little of it probes see: what is written for it would seldom come of chance."""
    ladder, entries = tilted[0].ladder, tilted[0].summary["detectable"]
    without, beside = (probabilities(ladder, ladder.causes, entries, 0.9, p) for p in ((), (1e-6,)))
    assert without["unknown"] < 0.2 and beside["unknown"] > 0.95
    assert all(beside[name] == without[name] for name in without if name not in ("unknown", "none"))


def test_a_formula_that_fits_as_well_shares_the_probability_of_the_name_it_may_replace(tilted):
    """Never more than half of it: where it says clearly more, it stands in the name's place."""
    ladder, entries = tilted[0].ladder, tilted[0].summary["detectable"]
    (cause,) = ladder.causes

    def likely(more):
        causes = [replace(cause, instead=Instead("restitution += -0.1 * approach", more))]
        return probabilities(ladder, causes, entries, 0.9)

    plain, much, equal, little = (
        probabilities(ladder, ladder.causes, entries, 0.9), likely(9.0), likely(0.0), likely(-10.0)
    )  # fmt: skip
    assert plain[cause.effect] > 0.99 and plain["unknown"] < 0.2 and plain["none"] < 0.01
    assert much == equal and equal[cause.effect] == pytest.approx(0.5 * plain[cause.effect], abs=1e-3)
    assert equal["unknown"] == pytest.approx(equal[cause.effect], abs=1e-3) and equal["none"] < 0.01
    assert little[cause.effect] > 0.99 * plain[cause.effect] and little["unknown"] == plain["unknown"]


def test_the_page_shows_a_formula_that_fits_as_well_as_a_name(tilted):
    diagnosis = tilted[0]
    (cause,) = diagnosis.ladder.causes
    formula = "restitution += -0.1 * approach"
    for more, is_shown in ((-1.0, True), (-20.0, False)):
        causes = (replace(cause, instead=Instead(formula, more)),)
        page = Page("a tilted table", "gap")
        verdict_card(page, replace(diagnosis, ladder=replace(diagnosis.ladder, causes=causes)))
        assert (formula in " ".join(page.cards[0].details)) is is_shown


def test_what_a_written_law_predicts_is_no_noise(tilted):
    """Rebounds that go with the slip of the blow before, which the free law of the floor does not follow."""
    ladder = tilted[0].ladder
    after, fits, terms = ladder.both_impacts()[1], ladder.flights.fitted.fits, ladder.impacts.restitution_terms
    slip = np.nan_to_num(known_at_impacts(after.data, after.junctions, fits)[:, W.LAST_SLIP])
    less = replace(after, data=replace(after.data, after=after.data.after - 0.1 * np.abs(slip) * after.data.before))
    law = WrittenLaw((Term("restitution", -0.1, (Factor("last_slip", "absolute_power", 1.0),)),))
    noise, blind, knowing = (
        np.sqrt(np.mean(impact_floor(impacts, terms, fits, laws)[0][:, 0] ** 2))
        for impacts, laws in ((after, ()), (less, ()), (less, (law,)))
    )
    assert blind > 3 * noise and knowing == pytest.approx(noise, rel=0.1)


def test_every_figure_is_there_and_the_page_is_light(page):
    assert figures_of(page) >= {*FIGURES, "gap-flights-table-tilt"}
    assert len(page.render()) < 4e6


def test_page_in_a_browser(page, browse):  # noqa: F811
    seen = browse(page.render(), 400)
    assert seen.console == [] and seen.fetched == []
    assert len(seen.pictures) == len(figures_of(page)) and all(w > 0 and h > 0 for _, w, h in seen.pictures)
    assert all(alt for alt, _, _ in seen.pictures) and seen.too_wide <= 0


def test_missing_acceleration_is_the_tilt_before_and_nothing_after(tilted):
    diagnosis, truth = tilted
    ladder, true = diagnosis.ladder, truth["parameters"]["table_tilt"]
    expected = (
        GRAVITY_M_PER_S2 * true["tilt_rad"] * np.array([np.cos(true["direction_rad"]), np.sin(true["direction_rad"])])
    )
    for fitted, target in ((ladder.flights.nominal, expected), (ladder.flights.fitted, np.zeros(2))):
        table = missing_acceleration(residual_frames(ladder.series.runs, fitted), LONG)
        found = table[["x", "y"]].median().to_numpy()
        # The nominal fit bends friction to hide a part of the tilt, so "before" holds to a fifth of it only.
        assert np.hypot(*(found - target)) < 0.2 * np.hypot(*expected)
    before, after = (
        np.median(np.abs(getattr(flight_panels(ladder, "table_tilt")[0], which))) for which in ("before", "after")
    )
    assert after < before


def test_trajectory_shows_the_flight_where_the_models_differ_most(tilted):
    diagnosis, _ = tilted
    errors = flight_errors(paths_of(diagnosis.ladder, diagnosis.predictions))
    chosen = chosen_flight(errors)
    assert chosen.apart == max(e.apart for e in errors)
    assert chosen.rms["with_effect"] < chosen.rms["recalibrated"]


def test_motion_alone_gives_named_gaps(tilted, without_next_test):
    series = tilted[0].ladder.series
    short = from_motions(series.recordings[:1], [series.motions[0].iloc[:60]])
    page = gap_page(diagnose(short, np.random.default_rng(0)), "short")
    text = texts_of(page)
    assert "no two views" in text.lower() and "eight impacts" in text and "markers against their layout" in text
    assert "gap-layout" not in figures_of(page) and "gap-ladder" in figures_of(page)
    assert page.cards[0].status == "caution" and any("single" in a for a in page.actions)
    page.render()


def test_unknown_is_said_with_what_it_goes_with(tilted):
    """The page of an unknown: made from a diagnosis whose structure is put there by hand, because only its words are
    tested.
    """
    diagnosis, _ = tilted
    goes = [
        {
            "stage": s,
            "phase": "impact",
            "coordinate": c,
            "goes_with": g,
            "p": 1e-3,
            "size": 0.1,
            "unit": "1",
            "times_negligible": 7.25,
        }
        for s, c, g in (
            ("geometry", "radius", "three times the azimuth"),
            ("impact", "normal", "a place on the wall at azimuth 1.0 rad"),
            ("measurement", "x", "the ground markers, which move together"),
        )
    ]
    summary = {
        **diagnosis.summary,
        "verdict": "unknown",
        "effects": [],
        "equivalent": [],
        "parameters": {},
        "stage": "geometry",
        "left": goes,
    }
    nameless = replace(diagnosis, summary=summary, ladder=replace(diagnosis.ladder, causes=()))
    page = gap_page(nameless, "odd")
    assert page.cards[0].answer == "Unknown" and any("once in 1000" in d for d in page.cards[0].details)
    assert page.cards[1].status == "bad"
    assert "three times the azimuth" in page.lead and "7.2" in texts_of(page)
    assert {"gap-impacts-three-times-the-azimuth", "gap-measured"} <= figures_of(page)
    ladder = next(section for section in page.sections if section.anchor == "ladder")
    assert "with the effect" not in str([block.rows for block in ladder.blocks])


def test_impact_panel_of_an_effect_comes_first(tilted):
    ladder = tilted[0].ladder
    assert "approach speed" in impact_panels(ladder, "finite_contact_time")[0].x_name
    panel = impact_panels(ladder, "wall_ellipticity")[0]
    assert "azimuth" in panel.x_name and "distance" in panel.y_name and np.abs(panel.x).max() <= 180


def test_centre_that_the_model_refits_is_shown_against_the_layout(tilted):
    ladder = tilted[0].ladder
    fitted = ladder.impacts.fitted.wall
    outline = replace(fitted.wall.outline, centre_m=np.array([3e-4, 0.0]))
    wall = replace(fitted, wall=replace(fitted.wall, outline=outline))
    moved = replace(ladder.impacts.fitted, wall=wall)
    both = replace(ladder.impacts, nominal=moved, fitted=moved)
    panel = impact_panels(replace(ladder, impacts=both), "wall_centre_offset")[0]
    added = panel.before - panel.after
    # Along the wall's normal, which a wall off its place turns against the azimuth from the Host's centre.
    normal = (fitted.impacts.normal_rad - fitted.impacts.junctions.host[:, 3])[ladder.impacts.fitted.data.at.index]
    assert np.allclose(added, 300 * np.cos(normal), atol=1e-6)


def test_a_wall_a_millimetre_off_its_stated_radius_is_an_effect(tilted):
    ladder = tilted[0].ladder
    series, flights, impacts = ladder.series, ladder.flights.fitted, ladder.impacts.fitted

    def stated(by_m: float) -> Cause:
        first, *others = series.runs
        moved = replace(first, data=replace(first.data, stated=first.data.wall.grown(by_m)))
        found = centre_offsets(replace(series, runs=(moved, *others)), flights, impacts)
        return next(c for c in found if c.effect == "stated_radius")

    assert not is_effect(stated(0.0))
    assert is_effect(stated(1e-3))
    value, sd = stated(1e-3).parameters["radius_m"]
    assert abs(value + 1e-3) < 1e-5 + 3 * sd


def test_the_map_of_residuals_lies_inside_the_wall(tilted):
    paths = paths_of(tilted[0].ladder, tilted[0].predictions)
    for path in paths:
        place = in_host(path)
        inside = path.run.data.wall.gap(place, np.zeros(len(place)))
        assert len(place) == len(path.frame) and np.nanmax(inside) < 1e-3 and np.nanmin(inside) < -0.02


def test_held_out_gain_knows_signal_from_noise():
    rng = np.random.default_rng(3)
    run = np.repeat(np.arange(6), 40)
    x = rng.normal(size=240)
    one = np.ones((240, 1))
    noise = rng.normal(size=240)
    (signal,) = _gains(0.5 * x + noise, np.ones(240), one, [x[:, None]], run, 6)
    (nothing,) = _gains(noise, np.ones(240), one, [x[:, None]], run, 6)
    # 240 points of 0.5 sd each: expected gain 240 x 0.25 = 60, held out a little less.
    assert 35 < signal.sum() < 85 and (signal > 0).mean() > 0.8
    assert nothing.sum() < 4


def test_bins_follow_a_curve_and_leave_out_empty_ones():
    x = np.linspace(0, 1, 600)
    centres, middles, errors = binned(x, x**2)
    assert len(centres) == 12 and np.allclose(middles, centres**2, atol=2e-3) and (errors > 0).all()
    centres, _, _ = binned(np.full(50, 10.0), np.zeros(50), circular=True)
    assert len(centres) == 1
    assert all(len(v) == 0 for v in binned(np.zeros(0), np.zeros(0)))


def test_words_and_units():
    words = [effect.words for effect in EFFECTS.values()]
    assert all(map(all, words)) and len({one.title for one in words}) == len(words)
    assert (
        shown("tilt_rad", 0.01755) == "17.6 mrad"
        and shown("speed_scale_m_per_s", 1.2) == "1.20 m/s"
        and shown("rate_per_m", 0.05) == "0.0500 1/m"
        and shown("slope_s_per_m", -0.1294) == "−0.129 s/m"
        and shown("rate_per_s2", 9.65) == "9.65 1/s²"
        and parameter_words("slope_s_per_m") == "slope"
        and parameter_words("speed_scale_m_per_s") == "speed scale"
        and shown("offset_s", 1.474e-4) == "147 µs"
        and shown("x_m", 2e-4) == "0.200 mm"
    )
    assert (
        shown("ratio", 1.00025) == "1.00025" and shown("rate_per_s", 0.3) == "0.300 1/s" and shown("size", None) == "–"
    )
    assert (
        shown_interval("direction_rad", 0.0, np.pi / 2).endswith("°")
        and parameter_words("speed_scale_m_per_s") == "speed scale"
    )


def test_every_symbol_of_a_law_is_explained_in_plain_characters():
    """A direction and its length are two symbols in the table, and no command of LaTeX is left."""
    symbols = [_plain_symbol(one.symbol) for one in (*TARGETS.values(), *QUANTITIES.values())]
    assert not [one for one in symbols if "\\" in one or "{" in one]
    assert _plain_symbol(r"\hat d") == "d\u0302" and _plain_symbol("d_H") == "d_H"
    assert _plain_symbol("v_n") == "vₙ" and _plain_symbol(r"v_{\varphi}") == "vᵩ"
