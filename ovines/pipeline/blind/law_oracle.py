"""Written laws held against the plant's own: on the rows in which laws are searched, on runs held out.

The oracle is a law of one term, what the plant's cause does where the disk really was
(`analysis.blind.scoring.plants_law`).  Its size alone is fitted, to the other runs, like that of any law: what it
leaves is what no law could take.  What the lenses leave in the frames stays in the rows with and without it, so that
it may be asked in a series with lens noise, too.

Not asked of causes of the measurement and of the drive: they move frames before flights and impacts are made of them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.blind.causes.named import CAUSES
from analysis.blind.plant.dynamics import Motion
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.recording.place import Place
from analysis.blind.scoring.intervals import Figure, proportion
from analysis.blind.scoring.plants_law import blow_changes, physics_without, pushes
from analysis.blind.series import Outline, run_outline
from analysis.contact.law import fit_tangential, predicted_tangential
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.flight_rows import FlightRegression, flight_regression
from analysis.gap.laws.impact_rows import TANGENTIAL, ImpactRegression, distance_regression, law_regression
from analysis.gap.laws.regression.problem import Profile, Regression, held_out_squares
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import WrittenLaw
from ovines.law_file import read_law
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

Array = NDArray[np.float64]
ASKED = ("flight", "impact", "geometry")
# A blow of the plant's and one that was measured are the same within this (usual rig; from blow to blow about 60 ms).
SAME_S = 4e-3
ENOUGH = 0.8


@dataclass(frozen=True)
class LawShare:
    """One unlisted cause: mean square of a row on runs held out ``before`` and with the plant's own law (``oracle``; 1
    is noise), the ``size`` that this is given (1: its own), and the share that the written laws of its stage close of
    what it closes (``law``; 0 without one)."""

    case: str
    cause: str
    stage: str
    before: float
    oracle: float
    size: float
    law: float


@dataclass(frozen=True, eq=False)
class PlantsRuns:
    """What really happened: the ``motions`` of a series, remembered, the numbers of each run ``without`` a cause, and
    the rig's ``place``."""

    motions: Sequence[Motion]
    without: Sequence[PlantParameters]
    place: Place

    @staticmethod
    def of(outline: Outline, motions: Sequence[Motion], cause: str) -> PlantsRuns:
        """Of an outlined series; `ValueError` where the cause cannot be taken out."""
        runs = outline.truth["runs"]
        without = [physics_without(outline.draft, cause, run, runs, one) for run, one in enumerate(motions)]
        return PlantsRuns(motions, without, outline.place)

    def since_first_frame(self, run: int, time_s: Array, frame: RigFrame) -> Array:
        """Times of a run (N,) in the series' frame, on the plant's clock of this rig."""
        start_s = self.place.start_s[run] if self.place.start_s else 0.0
        return time_s * frame.factor("time_s") + frame.middle_s[run] - start_s


def remembered_runs(outline: Outline, seed: Sequence[int]) -> list[Motion]:
    """The motions of an outlined series once more, with all that disk, floor and wall remember."""
    return run_outline(outline, np.random.default_rng(seed), remembered=True).motions


def unlisted_asked(outline: Outline) -> list[str]:
    """Unlisted causes of a series of which the oracle can be asked."""
    names = outline.truth["effect"].split("+")
    return [one for one in names if one in CAUSES and not CAUSES[one].listed and CAUSES[one].stage in ASKED]


def rows_of(ladder: Ladder, stage: str) -> FlightRegression | ImpactRegression:
    """The rows in which a law of a ``stage`` of :data:`ASKED` is searched; of flights alone where ``ladder`` has fewer
    than eight impacts."""
    if stage == "flight":
        return flight_regression(ladder.flights.named)
    fitted, fits = ladder.impacts.fitted, ladder.flights.fitted.fits
    assert fitted is not None, "fewer than eight impacts"
    if stage == "impact":
        return law_regression(fitted, fits, ladder.impacts.restitution_terms)
    return distance_regression(fitted, fits)


def oracle_columns(ladder: Ladder, rows: FlightRegression | ImpactRegression, stage: str, plants: PlantsRuns) -> Array:
    """What the plant's cause does to the rows of its ``stage``, (M, 1)."""
    if isinstance(rows, FlightRegression):
        return flight_columns(rows, ladder.series.frame, plants)
    return _of_blows(ladder, rows, stage, plants)


def held_out(problem: Regression, columns: Array) -> float:
    """Mean square of a row on runs that ``columns`` (M, C) were not fitted to."""
    return float(held_out_squares(problem, columns).sum()) / len(problem.residual)


def shares_of_case(folder: Path, outline: Outline, seed: Sequence[int]) -> list[LawShare]:
    """Of a case of the trial in ``folder``, what its answered laws close of what the plant's own close: of each
    unlisted cause of which that can be asked.  The plant runs again, and the ladder of the diagnosis for its rows (half
    a minute to three).  Without enough impacts to fit a law to, none is asked of impacts and wall."""
    asked, case = unlisted_asked(outline), outline.truth["case"]
    if not asked:
        return []
    with tempfile.TemporaryDirectory() as out:
        series, _ = load_series(read_series(folder / "cases" / case), Path(out))
        ladder = run_ladder(series, np.random.default_rng(0))
    if ladder.impacts.fitted is None:
        asked = [one for one in asked if CAUSES[one].stage == "flight"]
    laws = [read_law(path) for path in sorted((folder / "answers" / case).glob("law-*.toml"))]
    motions = remembered_runs(outline, seed)
    return [law_share(case, one, ladder, laws, PlantsRuns.of(outline, motions, one)) for one in asked]


def law_figure(shares: Sequence[LawShare]) -> Figure:
    """How many of the laws that could be written close enough of what the plant's own closes."""
    return proportion(
        "a law that closes 0.8 of what the plant's own closes", [one.law >= ENOUGH for one in shares], 0.7
    )


def law_markdown(shares: Sequence[LawShare]) -> str:
    """A table of score.md."""
    head = "| case | cause | stage | before | oracle | closed |\n|---|---|---|---|---|---|\n"
    return f"\n## Laws against the plant's own\n\n{head}" + "".join(
        f"| {one.case} | {one.cause} | {one.stage} | {one.before:.3g} | {one.oracle:.3g} | {one.law:.2f} |\n"
        for one in shares
    )


def law_share(case: str, cause: str, ladder: Ladder, laws: Sequence[WrittenLaw], plants: PlantsRuns) -> LawShare:
    """What ``laws`` of the world close of what the plant's own law closes; their sizes are fitted to the other runs,
    like the oracle's, their forms and the numbers inside are as written."""
    stage = CAUSES[cause].stage
    rows = rows_of(ladder, stage)
    problem, own = rows.problem, oracle_columns(ladder, rows, stage, plants)
    terms = [term for law in laws if law.stage == stage for term in ladder.series.frame.law(law).terms]
    written = written_columns(ladder, rows, WrittenLaw(tuple(terms))) if terms else own[:, :0]
    before, oracle, law = (held_out(problem, one) for one in (own[:, :0], own, written))
    size = float(Profile.of(problem).gain(own)[1][0])
    return LawShare(case, cause, stage, before, oracle, size, (before - law) / (before - oracle))


def written_columns(ladder: Ladder, rows: FlightRegression | ImpactRegression, law: WrittenLaw) -> Array:
    """What a law of the series' frame does to the ``rows`` of its stage, (M, T): each term by itself.

    What it makes of friction and tangential restitution is one column, the impulse that it predicts beyond the nominal
    law's: beside it other impacts stick, as beside the plant's own."""
    along = [term for term in law.terms if term.target in TANGENTIAL]
    if not along or isinstance(rows, FlightRegression):
        return rows.columns(law.terms)
    fitted, fits = ladder.impacts.fitted, ladder.flights.fitted.fits
    assert fitted is not None, "fewer than eight impacts"
    beside = law_regression(fitted, fits, ladder.impacts.restitution_terms, law, sides_of_law=True).along
    assert beside is not None, "rows of the impulse"
    more = predicted_tangential(fitted.data, np.maximum(beside[0], 0.0), beside[1]) - _nominal(fitted)
    others = rows.columns([term for term in law.terms if term not in along])
    return np.column_stack([others, rows.impulse_column(more)])


def flight_columns(rows: FlightRegression, frame: RigFrame, plants: PlantsRuns) -> Array:
    """What the plant's cause does to rows of flights, (M, 1)."""
    problem = rows.problem
    back = plants_turn(frame)
    units = np.array([frame.factor("m_per_s2"), frame.factor("m_per_s2"), frame.factor("rad_per_s2")])
    given = []
    for k, flight in enumerate(rows.flights):
        run = int(problem.run[np.flatnonzero(problem.block == k)[0]])
        time_s = plants.since_first_frame(run, flight.times, frame)
        pushed = pushes(plants.motions[run], plants.without[run], time_s, plants.place)
        given.append((pushed @ back / units)[:, :, None])
    return rows.pushed_columns(given)


def plants_turn(frame: RigFrame) -> Array:
    """Of vectors of the world with a turn (N, 3), into the frame: what they are to be multiplied with from the
    right."""
    c, s = np.cos(frame.turn_rad), np.sin(frame.turn_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _of_blows(ladder: Ladder, rows: ImpactRegression, stage: str, plants: PlantsRuns) -> Array:
    """Zero at blows that the plant does not know."""
    fitted, frame = ladder.impacts.fitted, ladder.series.frame
    assert fitted is not None, "fewer than eight impacts"
    data, junctions = fitted.data, fitted.junctions
    changes = np.zeros((4, len(data)))
    for run in np.unique(data.at.run):
        here = np.flatnonzero(data.at.run == run)
        time_s = plants.since_first_frame(int(run), junctions.time_s[data.at.index[here]], frame)
        own = blow_changes(plants.motions[run], plants.without[run], plants.place)
        nearest = np.argmin(np.abs(time_s[:, None] - own.time_s[None]), 1)
        same = np.abs(time_s - own.time_s[nearest]) < SAME_S * plants.place.slower
        changes[:, here[same]] = np.nan_to_num(np.array(own[1:])[:, nearest[same]])
    restitution, along, turned, reach = changes
    if stage == "geometry":
        return np.asarray(rows.answers["contact_radius"] * reach / frame.factor("m"), float)[:, None]
    speed = frame.factor("m_per_s")
    out = rows.answers["restitution"] * np.tile(restitution, 3)
    along, turned = along / speed, turned / speed
    return (out + rows.impulse_column(along + _plain(fitted, along) - _nominal(fitted), turned))[:, None]


def _nominal(fitted: ImpactFit) -> Array:
    """Impulses along the wall (K,) of the law that was fitted."""
    return predicted_tangential(fitted.data, fitted.law.wall_friction, fitted.law.tangential_restitution)


def _plain(fitted: ImpactFit, along: Array) -> Array:
    """Impulses along the wall (K,) of the law that fits the impacts without what a cause adds ``along`` it (K,)."""
    rest = replace(fitted.data, tangential_impulse=fitted.data.tangential_impulse - along)
    (friction,), beta, *_ = fit_tangential(rest, start=(fitted.law.wall_friction, fitted.law.tangential_restitution))
    return predicted_tangential(fitted.data, friction, beta)
