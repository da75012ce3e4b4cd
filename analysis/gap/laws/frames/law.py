"""The missing law of the measurement: what a camera's picture, a marker on its body or a clock does, found in still
markers, two views, rigid bodies and the Host's path, each taken out before the next is asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.gap.finding import Finding
from analysis.gap.laws.belief import believed
from analysis.gap.laws.choice.search import LEVEL_WHERE_LEFT, find_law
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.found_law import LawFound, replaced
from analysis.gap.laws.frames.bodies.markers import MarkerRows, marker_rows, restless_markers
from analysis.gap.laws.frames.corrected import true_times, without_frame_laws
from analysis.gap.laws.frames.delay import TARGET as DELAY
from analysis.gap.laws.frames.delay import late_camera, least_delay_s
from analysis.gap.laws.frames.dictionary import disk_candidates, frame_candidates, marker_candidates, moved_rms
from analysis.gap.laws.frames.evidence.clock import clock_rows
from analysis.gap.laws.frames.evidence.rows import FrameRows, Key, key_of, picture_rows, view_rows
from analysis.gap.laws.frames.forms.by_run import lone_run, nil_in
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.measurement.body_residuals import loose_m
from analysis.gap.measurement.fixed_markers import STILL_SHARE
from analysis.gap.measurement.rigid_bodies import loose_markers
from analysis.gap.measurement.two_views import two_views
from analysis.gap.series import Series
from analysis.gap.thresholds import LAW_LEAST_CLOSED, NEGLIGIBLE_FRAMES
from ovines.core.laws.targets import NES_PICTURE, PICTURE
from ovines.core.laws.terms import Term, WrittenLaw

# A camera that is asked for frames twice as fast as it films leaves every other one out.
SHORTEST_PERIODS = 0.5
# A clock that cameras share is off by parts of a frame (what the plant's clocks do: 0.1 to 0.7 of one).  A sweep whose
# level and phase are not followed passes for one that is off by 5 to 26 frames, the more the longer the run.
MOST_PERIODS = 2.0
# A path that is followed as it goes leaves this share of a form's squares at the least where it tells of it: 1e-5 of
# one that goes slowly in a run, 0.008 of a step, half or more of what is faster.
LEAST_FREE = 1e-3
# Sd of what a lens residual stretches a marker's way by: RMS over the markers of eight series with smooth residuals of
# 0.14 to 0.45 px.
LENS_SHEAR_SD = 0.001


def find_frame_laws(series: Series, rng: np.random.Generator) -> tuple[tuple[LawFound, ...], Series]:
    """Laws of the cameras' pictures and of the second camera's delay, in this order, each where chance would not find
    as much and where it is larger than what is negligible; and the series without what they say."""
    laws: list[LawFound] = []
    cameras = range(0 if series.cameras is None else len(series.cameras))
    still: list[LawFound] = []
    seen = False
    for camera in cameras:
        rows = picture_rows(series, camera)
        seen = seen or rows is not None
        still += _picture_law(rows, series, rng, camera)
    still = _nil_somewhere(still, series)
    series = without_frame_laws(series, [one.law for one in still])
    laws += still
    rows = view_rows(series, (DELAY,) if seen else (DELAY, *PICTURE))
    found = _law_of(rows, series, rng)
    of_delay = [one for one in found if {term.target for term in one.law.terms} == {DELAY}]
    if of_delay and late_camera(series, of_delay[0].rig_law.terms) == 0:
        found = _law_of(view_rows(series, (DELAY,), 0), series, rng)
    series = without_frame_laws(series, [one.law for one in found])
    laws += found
    return tuple(laws), series


def find_disk_picture_laws(series: Series, rng: np.random.Generator) -> list[tuple[LawFound, Series]]:
    """What a camera's picture does to the disk alone as it turns, and the series without it: once for each camera, for
    the two views say only how they miss each other."""
    out = []
    for camera in range(0 if series.cameras is None else len(series.cameras)):
        rows = view_rows(series, NES_PICTURE, camera)
        if rows is None:
            return []
        found = _law_of(rows, series, rng, disk_candidates(rows, rng))
        out += [(law, without_frame_laws(series, [law.law])) for law in found]
    return out


def find_marker_laws(series: Series, rng: np.random.Generator) -> tuple[tuple[LawFound, ...], Series]:
    """Laws of the markers that were found to move on their bodies, each where chance would not find as much and where
    it is larger than how well markers are glued; of those that no probe found to move, where they are believed; and the
    series without what they say."""
    laws: list[LawFound] = []
    for loose in loose_markers(series):
        found = _marker_law(marker_rows(series, loose.body, loose.marker), series, rng)
        series = without_frame_laws(series, [one.law for one in found])
        laws += found
    known = {key_of(term) for law in laws for term in law.law.terms}
    for rows in restless_markers(series):
        found = [] if rows.key in known else _marker_law(rows, series, rng)
        found = [one for one in found if believed(one, one.size, loose_m(series)) is not None]
        series = without_frame_laws(series, [one.law for one in found])
        laws += found
    return tuple(laws), series


def find_clock_law(series: Series, rng: np.random.Generator) -> tuple[LawFound | None, Series]:
    """The law of the clock that all cameras share, and the series in the times that it tells; none where frames would
    follow each other faster than cameras film, or out of their order, or where times would be off by whole frames."""
    found = _law_of(clock_rows(series), series, rng)
    if not (found and _keeps_frames(found[0], series)) and any(any(run.data.host.smooth) for run in series.runs):
        # A drive that sweeps has no lines, and passes for a clock that is far off: its path is asked.
        rows = clock_rows(series, by_lines=False)
        told = None if rows is None else [one for one in frame_candidates(rows, rng) if _tells(rows, one)]
        found = _law_of(rows, series, rng, told)
    if not (found and _keeps_frames(found[0], series)):
        return None, series
    return found[0], without_frame_laws(series, [found[0].law])


def _tells(rows: FrameRows, one: Candidate) -> bool:
    """Whether the Host's path, without its drive, says anything of a form."""
    free, whole = (np.sum(some.columns(one.terms) ** 2, axis=0) for some in (rows, replace(rows, bases=())))
    return bool(np.all(free > LEAST_FREE * whole))


def _keeps_frames(law: LawFound, series: Series) -> bool:
    """Whether frames, by a law of the clock, stay in their order, no nearer than cameras film, and near their times."""
    true_s, shortest_s = true_times(series, law.law), SHORTEST_PERIODS * series.period_s
    off_s = max(float(np.ptp(time_s - run.data.time_s)) for time_s, run in zip(true_s, series.runs, strict=True))
    return off_s <= MOST_PERIODS * series.period_s and all(np.all(np.diff(time_s) > shortest_s) for time_s in true_s)


def _law_of(
    rows: FrameRows | None, series: Series, rng: np.random.Generator, candidates: Sequence[Candidate] | None = None
) -> list[LawFound]:
    """The law that rows of frames ask for, of all ``candidates`` where none are given: one or none."""
    if rows is None:
        return []
    asked = frame_candidates(rows, rng) if candidates is None else candidates
    found, p = find_law(rows.problem, rows.columns, asked, rng)
    if found is None:
        return []
    moved = moved_rms(rows, found.terms, found.coefficients)
    if not any(moved[key] > least for key, least in _negligible(rows, series).items() if key in moved):
        return []
    return _sized(reported_law(rows, found, p, series.frame), max(moved.values()))


def _picture_law(rows: FrameRows | None, series: Series, rng: np.random.Generator, camera: int) -> list[LawFound]:
    """The law of a camera's picture: one or none.  Where a single run at either end lies apart, that is asked first: a
    shift that settles passes for it.  How runs scatter, four of them hardly say: once in a hundred is enough there, as
    half runs are held out besides."""
    alone = None if rows is None else lone_run(rows, camera, LEVEL_WHERE_LEFT)
    if rows is not None and alone is not None:
        found = _law_of(replace(rows, problem=alone.problem), series, rng, alone.steps)
        if found:
            return found
    return _law_of(rows, series, rng)


def _nil_somewhere(laws: list[LawFound], series: Series) -> list[LawFound]:
    """Laws of pictures that go with the run, each nil in the run - the first, the last or halfway - that leaves the
    least of a window's offset beside them, where there is one: still markers know nothing of a constant, and a camera
    was calibrated before somebody knocked against it, or when it had warmed up."""
    last = len(series.runs) - 1.0
    for i, law in enumerate(laws):
        window = _window(series, laws)
        if window is None or not window.found:
            break
        others = [replaced(law, nil_in(law.rig_law.terms, run, last), series.frame) for run in (0, last, 0.5 * last)]
        tried = [laws, *([*laws[:i], one, *laws[i + 1 :]] for one in others if one is not None)]
        laws = min(tried, key=lambda some: getattr(_window(series, some), "size", np.inf))
    return laws


def _window(series: Series, laws: Sequence[LawFound]) -> Finding | None:
    """What two views say of the second camera's window without what ``laws`` say."""
    found = two_views(without_frame_laws(series, [one.law for one in laws]), []).findings
    return next((one for one in found if one.effect == "sensor_window_offset"), None)


def _marker_law(rows: MarkerRows | None, series: Series, rng: np.random.Generator) -> list[LawFound]:
    """The law that rows of a marker ask for: one or none."""
    if rows is None:
        return []
    found, p = find_law(rows.problem, rows.columns, marker_candidates(rows, rng), rng)
    if found is None:
        return []
    size_m = rows.moved_rms(found.terms, found.coefficients)
    law = reported_law(rows, found, p, series.frame)
    return _sized(_open_to_lens(law, series), size_m) if size_m > loose_m(series) else []


def _open_to_lens(law: LawFound, series: Series) -> LawFound:
    """Where a lens leaves something over, what it may do to a marker of which no field was learnt: that goes with the
    marker's way, and under a sine with the Host's acceleration."""
    if series.cameras is None or series.cameras[0].field is None:
        return law
    hosts = [(run.data.host, run.data.time_s) for run in series.runs]
    way, push = (np.concatenate([host.at(time_s, order)[:, :2] for host, time_s in hosts]) for order in (0, 2))
    open_s2 = LENS_SHEAR_SD * float(np.std(way) / max(np.std(push), 1e-300))

    def wider(term: Term) -> Term:
        bends = any(factor.quantity == "host_acceleration_along" for factor in term.factors)
        return replace(term, sd=float(np.hypot(term.sd, open_s2))) if bends else term

    widened = WrittenLaw(tuple(wider(term) for term in law.law.terms))
    many = len(widened.terms) > 1
    numbers = dict(law.numbers)
    for i, term in enumerate(widened.terms):
        numbers[f"coefficient_{i + 1}" if many else "coefficient"] = (term.coefficient, term.sd, term.unit)
    rig_law = WrittenLaw(tuple(wider(term) for term in law.rig_law.terms))
    return replace(law, law=widened, rig_law=rig_law, numbers=numbers)


def _sized(law: LawFound, size: float) -> list[LawFound]:
    """The law of a ``size``, where it closes enough; no floor is above the best model."""
    law = replace(law, size=size, floor=law.floor * min(1.0, float(law.after.sum() / law.floor.sum())))
    return [law] if law.closed > LAW_LEAST_CLOSED else []


def _negligible(rows: FrameRows, series: Series) -> dict[Key, float]:
    """Sizes (RMS) that are not worth a law: what moves a still marker by less than counts as still, what makes less of
    the frames' times than the smallest scatter of them."""
    out: dict[Key, float] = {}
    for key in rows.units:
        if key[0] in (*PICTURE, *NES_PICTURE):
            assert series.cameras is not None
            camera, still_m = series.cameras[key[1]], STILL_SHARE * series.contact_radius_m
            away_m = float(np.linalg.norm(camera.centre_m))
            still_px = still_m * float(camera.matrix[0, 0]) / away_m
            # Shares and turns count by what they do at the picture's half width.
            lever_px = 0.5 * camera.sensor_size_px[0] if key[0] in ("picture_zoom", "picture_turn") else 1.0
            out[key] = still_px / lever_px
        else:
            jitter_s = NEGLIGIBLE_FRAMES["trigger_jitter"] * series.period_s
            out[key] = least_delay_s(series) if key[0] == DELAY else jitter_s
    return out
