"""What is more on one side than on the other and changes besides, air that moves past the rig, what sets in: forms that
no list of causes held, and two causes of the plant's that ask for them.  In view, therefore no blind result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.series import make_series
from analysis.contact.law import fit_law, stick_impulse, sticks
from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.gap.ladder import run_ladder
from analysis.gap.laws.choice.listed import columns_of
from analysis.gap.laws.choice.numbers_inside import searched
from analysis.gap.laws.choice.shortlist import SHORTLIST
from analysis.gap.laws.dictionary.candidate import Candidate, law_at, named_numbers, with_sds
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.dictionary.modulated import fixed
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.dictionary.uneven import evenly, uneven
from analysis.gap.laws.flight_rows import flight_regression
from analysis.gap.laws.impact_rows import distance_regression, law_regression
from analysis.gap.laws.regression.forms import Forms, _scores, forms_of, held_out_gains
from analysis.gap.laws.regression.problem import Profile
from analysis.gap.prediction.detectable import detectable_sizes
from analysis.gap.prediction.probabilities import probabilities
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.written_laws import write_laws
from ovines.core.laws import words as W
from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import Factor, Term
from tests.gap.conftest import brought, laws_and_ladder
from tests.gap.laws.test_memory_laws import EFFECTS, made_series, quantities

# What one candidate alone must close of a cause.
ENOUGH = 0.9
COSINE, SIDE = Factor("azimuth", "cosine", x=0.7), Factor("body_angle", "cosine", x=-1.1)
TIME, RUN, PHASE = Factor("time"), Factor("run"), Factor("phase", "cosine", x=0.4)
EAST = Factor("along_host", y=0.3)
#: causes as somebody might have them, of one coefficient: a term and, with it, what it is uneven by
FLIGHTS = {
    "a side of the floor that wears": (Term("floor_friction", 1.0, (TIME,)), COSINE),
    "a side of the floor that wears from run to run": (Term("floor_friction", 1.0, (RUN,)), COSINE),
    "oil from one side, spread after each blow": (
        Term("floor_friction", 1.0, (Factor("since", "exponential", 1.0, 0.015),)), COSINE,
    ),
    "a track that wears": (Term("floor_friction", 1.0, (Factor("radius", "gaussian", 1.0, 0.0065, 0.021), RUN)), None),
    "one half that wears": (
        Term("floor_friction", 1.0, (Factor("along_host", "below", 1.0, 0.004, 0.0, 0.3), RUN)), None,
    ),
    "a plate that bends about a line in step": (Term("floor_friction", 1.0, (EAST, PHASE)), None),
    "a sheet that leans with the place, in step": (Term("fixed_direction", 1.0, (EAST, PHASE), x=0.3), None),
    "a table that is knocked in the run": (
        Term("fixed_direction", 1.0, (Factor("time", "beyond", 1.0, 0.21),), x=2.0), None,
    ),
    "a table that is levelled anew between two runs": (
        Term("fixed_direction", 1.0, (Factor("run", "sign", x=2.5),), x=2.0), None,
    ),
    "a disk with poles beside a ring of steel": (
        Term("outwards", 1.0, (Factor("gap", "exponential", 1.0, 0.005),)), Factor("body_angle", "cosine", 2.0, x=0.3),
    ),
    "air under a warped disk's shadow": (Term("along_sliding", -1.0, (Factor("sliding_speed"),)), COSINE),
    "air that turns with a fan": (
        Term("spin", -1.0, (Factor("spin", x=80.0), Factor("spin", "absolute_power", x=80.0))), None,
    ),
    "a disk with a pole in a gradient": (Term("along_body", 1.0, (EAST,), x=0.5), None),
    "two plates at a step": (
        Term("fixed_direction", 1.0, (Factor("along_host", "gaussian", 1.0, 0.005, 0.009, 0.9),), x=0.9), None,
    ),
    "a magnet beneath one side of the room": (Term("floor_friction", 1.0, (Factor("along_room", y=0.7),)), None),
    "a fan": (
        Term("along_airspeed", -1.0, (Factor("airspeed", "power", 2.0, x=-1.1, y=1.6),), -1.1, 1.6), None,
    ),
}  # fmt: skip
IMPACTS = {
    "a wall that warms on one side": (Term("restitution", 1.0, (Factor("time", "rising", 1.0, 0.3),)), COSINE),
    "a clamp that is lost on one side": (Term("restitution", 1.0, (Factor("time", "beyond", 1.0, 0.6),)), COSINE),
    "one side cleaned before a run": (Term("wall_friction", 1.0, (Factor("run", "beyond", 1.0, 2.5),)), COSINE),
    "a side of the rim that wears": (Term("wall_friction", 1.0, (Factor("blows"),)), SIDE),
    "a lining thicker on one side, at slow blows": (
        Term("tangential_restitution", 1.0, (Factor("approach", "exponential", 1.0, 0.8),)), COSINE,
    ),
    "oil picked up by the way": (Term("restitution", 1.0, (Factor("from_contact", "exponential", 1.0, 0.015),)), None),
    "a ring that lifts when it is driven out": (
        Term("restitution", 1.0, (Factor("host_acceleration_outwards", "above", 1.0, 0.0),)), None,
    ),
    "a lining that gives way at a speed": (Term("restitution", 1.0, (Factor("approach", "beyond", 1.0, 0.9),)), None),
    "a lining that blows dent where they strike": (Term("restitution", 1.0, (Factor("blows_here", y=0.4),)), None),
    "a lining that comes back where it was struck": (
        Term("wall_friction", 1.0, (Factor("blows_here", x=0.2, y=0.5),)), None,
    ),
    "a rim that is polished where it strikes": (
        Term("restitution", 1.0, (Factor("rim_blows_here", "rational", 1.0, 1.5, y=0.5),)), None,
    ),
    "a ring that breathes after blows": (Term("restitution", 1.0, (Factor("breathing", x=90.0, y=0.06),)), None),
    "a ring that rolls in its seat as it is driven": (
        Term("restitution", 1.0, (Factor("host_acceleration_around"),)), None,
    ),
    "screws that work loose from run to run": (
        Term("restitution", 1.0, (Factor("run", "exponential", 1.0, 1.2),)), None,
    ),
    "a lamp that comes on and off": (Term("restitution", 1.0, (Factor("time", "cosine", 1.0, 0.08, 0.2),)), None),
    "a crack at the eighth blow": (Term("restitution", 1.0, (Factor("blows", "below", 1.0, 7.5),)), None),
    "a lining that tears when it is hit askew": (
        Term("restitution", 1.0, (Factor("incidence", "within", 1.0, 0.4),)), None,
    ),
    "a saw-toothed lining": (Term("restitution", 1.0, (Factor("passing", "sign"),)), None),
    "a wave that goes round in step": (Term("restitution", 1.0, (COSINE, PHASE)), None),
}  # fmt: skip
WALLS = {
    "a ring that slips once": (Term("contact_radius", 1.0, (Factor("time", "beyond", 1.0, 0.6), COSINE)), None),
    "one side swells with the blows": (Term("contact_radius", 1.0, (Factor("blows", "rising", 1.0, 9.0),)), COSINE),
    "a ring with play": (Term("contact_radius", 1.0, (Factor("host_acceleration_outwards", "sign"),)), None),
    "a ring that is dragged back in its seat": (
        Term("contact_radius", 1.0, (Factor("host_velocity_along", "tanh", 1.0, 0.5), Factor("azimuth", "cosine"))),
        None,
    ),
    "a lining that blows pack": (Term("contact_radius", 1.0, (Factor("blows_here", y=0.4),)), None),
    "a ring that breathes after blows": (Term("contact_radius", 1.0, (Factor("breathing", x=90.0, y=0.06),)), None),
    "a ring that flexes in step": (Term("contact_radius", 1.0, (replace(COSINE, order=2.0), PHASE)), None),
}


@dataclass(frozen=True)
class Asked:
    """Candidates with their columns in rows, which no cause changes: asked of many causes they are made once."""

    rows: Any
    candidates: Sequence[Candidate]
    table: np.ndarray
    forms: Forms

    @classmethod
    def of(cls, rows, candidates):
        table, groups = columns_of(candidates, rows.columns, rows.problem.block)
        return cls(rows, candidates, table, forms_of(rows.problem, table, groups))

    def closed(self, cause):
        """What a candidate of a shortlist closes of a cause without noise, on runs held out, and its name: of the first
        that closes nine tenths as it starts or once its numbers are searched, of the best where none does."""
        term, beside = cause
        rows, candidates = self.rows, self.candidates
        whole = rows.columns([term, *([replace(term, factors=(*term.factors, beside))] if beside else [])]).sum(1)
        problem = replace(rows.problem, residual=100.0 * whole / np.linalg.norm(whole))
        left = 0.0
        for run in np.unique(problem.run):
            out = problem.run == run
            free, prior = problem.nuisances, np.diag(problem.prior)
            others = free[~out].T @ free[~out] + prior
            known = np.linalg.lstsq(others, free[~out].T @ problem.residual[~out], rcond=None)[0]
            left += np.sum((problem.residual[out] - free[out] @ known) ** 2)
        signs = np.ones((1, len(self.forms.fold)))
        gains = held_out_gains(self.forms, signs, _scores(problem, self.table, problem.residual))[0] / left
        first = {}  # the best start of each name
        for i in np.argsort(-gains):
            first.setdefault(candidates[i].name, int(i))
        best = (-np.inf, "none")
        for name, i in list(first.items())[:SHORTLIST]:
            if gains[i] >= ENOUGH:
                return float(gains[i]), name
            near = searched(Profile.of(problem), rows.columns, candidates[i])
            best = max(best, (self._gain(problem, near) / left, name))
            if best[0] >= ENOUGH:
                break
        return best

    def _gain(self, problem, one):
        forms = forms_of(problem, *columns_of([one], self.rows.columns, problem.block))
        return float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0])


@pytest.fixture(scope="module")
def recorded(loaded):
    """Rows and candidates of six runs in which nothing acts."""
    _, series = loaded("none", 1.0, 12, runs=6)
    fitted = first_flights(series, EFFECTS)
    impacts = fit_impacts(fitted.fits)
    flights = flight_regression(fitted)
    laws, walls = law_regression(impacts, fitted.fits, ()), distance_regression(impacts, fitted.fits)
    scales = RigScales.of(flights.known, float(series.runs[0].data.host.omega_rad_per_s))
    return {
        "recorded": (impacts, fitted.fits),
        "flights": (flights, flight_candidates(scales)),
        "impacts": (laws, law_candidates(laws.known)),
        "walls": (walls, wall_candidates(walls.known)),
    }


@pytest.mark.further
@pytest.mark.parametrize(("stage", "causes"), [("flights", FLIGHTS), ("impacts", IMPACTS), ("walls", WALLS)])
def test_causes_that_nobody_listed_are_in_the_dictionary(recorded, stage, causes):
    """One candidate alone closes nine tenths of each on runs that have not seen it."""
    rows, candidates = recorded[stage]
    asked = Asked.of(rows, candidates)
    closed = {name: asked.closed(cause) for name, cause in causes.items()}
    assert {name: one for name, one in closed.items() if one[0] < ENOUGH} == {}


def test_a_law_of_the_few_impacts_that_slide_keeps_its_size(recorded):
    """What it does to them is large against what most, which stick, leave: cut as gross, its coefficient was three
    quarters of the true one."""
    (impacts, fits), size = recorded["recorded"], 0.06
    data, law = impacts.data, impacts.law
    slides = ~sticks(data, law.wall_friction, law.tangential_restitution)
    sense = np.sign(stick_impulse(data, law.tangential_restitution))
    more = size * np.cos(np.arctan2(*recorded["impacts"][0].known[:, [W.HY, W.HX]].T)) * slides
    data = replace(data, tangential_impulse=data.tangential_impulse + more * sense * data.normal_impulse)
    rows = law_regression(replace(impacts, data=data, law=fit_law(data)), fits, ())
    waves = rows.columns([Term("wall_friction", 1.0, (Factor("azimuth", one),)) for one in ("cosine", "sine")])
    _, (cosine, sine), _ = Profile.of(rows.problem).gain(waves)
    assert 0.1 < slides.mean() < 0.5
    assert cosine == pytest.approx(size, rel=0.1) and abs(sine) < 0.1 * size


@pytest.mark.further
def test_a_fan_is_a_drag_against_moving_air(tmp_path):
    """With the air's own speed and direction.  The constant part of it is no tilt, the linear part no drag: beside
    these names a drag that differs by direction closed as much; the formula stands in their place, and their
    probability is what they gain beside it."""
    series, true = made_series(tmp_path, "unknown_cooling_fan", 0.9, 71, runs=3)
    rng = np.random.default_rng(0)
    named = run_ladder(series, rng)
    assert {cause.effect for cause in named.causes} & {"table_tilt", "viscous_drag"}
    (law,), ladder = write_laws(named, rng)
    assert ladder.causes == ()
    assert quantities(law) == [("along_airspeed", ["airspeed"])], as_text(law.law)
    (speed, sd, _), (way, _, _) = law.numbers["wind_m_per_s"], law.numbers["wind_rad"]
    assert speed == pytest.approx(PlantParameters().fan_m_per_s, abs=max(4 * sd, 0.1))
    assert abs(np.angle(np.exp(1j * (way - true["fan_rad"])))) < 0.05
    assert law.closed > 0.9
    likely = probabilities(ladder, ladder.causes, detectable_sizes(ladder), 1.0)
    # 1.0 as names; beside the law nothing is left for them, nor for what else may imitate a wind.
    assert all(likely[name] < 0.3 for name in ("table_tilt", "viscous_drag", "air_drag"))


@pytest.mark.further
def test_a_wall_that_a_lamp_warms_from_one_side_is_one_formula(tmp_path):
    """Neither a drift nor a direction that the restitution has, which its parts have the form of."""
    series, _ = made_series(tmp_path, "unknown_lamplit_side", 1.0, 72, runs=3)
    rng = np.random.default_rng(0)
    named = run_ladder(series, rng)
    assert {cause.effect for cause in named.causes} & set(RESTITUTION_EFFECTS)
    (law,), ladder = write_laws(named, rng)
    assert ladder.causes == () and ladder.impacts.restitution_terms == ()
    # What is left is named by the law that stands there, not by the one that stood beside the names.
    followed = [one.goes_with for one in ladder.structure if one.stage == "impact"]
    assert followed and all("goes round" not in one for one in followed), followed
    assert {target for target, _ in quantities(law)} == {"restitution"}
    assert sorted({name for _, names in quantities(law) for name in names}) == ["azimuth", "time"], as_text(law.law)


@pytest.mark.further
def test_a_drift_beside_a_law_keeps_its_name(tmp_path, without_flight_laws):
    """A formula that stands in its place is sought, and does not need less without it."""
    made = make_series("restitution_drift+unknown_soft_spot", 1.0, np.random.default_rng(73), runs=3, noise="white")
    series = brought(made, tmp_path / "series")
    (law,), ladder = laws_and_ladder(series)
    assert {target for target, _ in quantities(law)} == {"restitution"}, as_text(law.law)
    assert {cause.effect for cause in ladder.causes} == {"restitution_drift"}


def test_what_is_uneven_is_as_it_is_and_with_both_waves():
    """Of what changes and of what stays, once around or more often."""
    waves = [Factor("azimuth", name, 2.0) for name in ("cosine", "sine")]
    assert uneven(fixed("with time", (TIME,)), "azimuth", 2.0).make() == ((TIME,), *((TIME, one) for one in waves))
    assert evenly("azimuth", 2.0).make() == ((), *((one,) for one in waves))


def test_a_wind_has_a_speed_and_a_direction():
    """With sds of both from those of its two parts."""

    def drag(x, y):
        return (Term("along_airspeed", 1.0, (Factor("airspeed", "power", 2.0, x=x, y=y),), x, y),)

    part = Candidate("drag", drag, (3.0, 4.0), (0.1, 0.1), (False, False))

    def build(values):
        return law_at((part,), values)

    values = np.array([-0.2, 3.0, 4.0])
    assert named_numbers(build(values)) == {
        "coefficient": (-0.2, "1/m"), "wind_m_per_s": (5.0, "m/s"),
        "wind_rad": (pytest.approx(np.arctan2(4, 3)), "rad"),
    }  # fmt: skip
    numbers = with_sds(build, values, np.diag([0.01, 0.1, 0.1]) ** 2)
    assert numbers["wind_m_per_s"][1] == pytest.approx(0.1, rel=1e-3)
    assert numbers["wind_rad"][1] == pytest.approx(0.02, rel=1e-3)
