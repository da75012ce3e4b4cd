"""The ladder: measurement corrected, nominal model refitted, effects added one after the other, probes for what is
left.

Nominal -> recalibrated -> + effect -> + second effect; at each step every candidate is judged on held-out runs, by how
far it exceeds what is negligible, and by whether it holds in most runs.  What probes still find afterwards is structure
without a name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.middle import middle_of_disk, same_middle, with_middle
from analysis.flights.cutting.runs import Run
from analysis.flights.stated_terms import STATED_IN_FLIGHT, stated_sizes
from analysis.gap.cause import Cause, Structure, two_sided
from analysis.gap.drive.findings import DriveSteps
from analysis.gap.drive.steps import beyond_stated_drive, drive_steps
from analysis.gap.finding import Finding
from analysis.gap.measurement.changed_pictures import bent_picture, changed_pictures
from analysis.gap.measurement.corrections import beyond_stated, correct, without_stated
from analysis.gap.measurement.fixed_markers import ground_motion
from analysis.gap.measurement.picture_grid import picture_grid
from analysis.gap.measurement.rigid_bodies import exchanged_structure, rigid_structure
from analysis.gap.measurement.tests import MeasurementTests
from analysis.gap.measurement.turning_picture import turning_picture
from analysis.gap.selection.centres import centre_offsets, is_effect
from analysis.gap.selection.flight_steps import (
    FlightSteps,
    first_flights,
    select_flight_effects,
)
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.terms import EFFECT_TERMS
from analysis.gap.selection.impact_steps import (
    ImpactSteps,
    beside_wall_law,
    select_impact_effects,
    unexplained_scatter,
)
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.gap.selection.inertia import (
    NEGLIGIBLE,
    InertiaStep,
    flights_contradict,
    inertia_step,
    stated_ratio,
    wall_between,
    with_inertia,
)
from analysis.gap.selection.left_in_flights import SHARE_OF_NAMED
from analysis.gap.selection.unfitted_flights import unexplained_misfit
from analysis.gap.series import Series, with_host_moved

Array = NDArray[np.float64]
# Markers that are seen at times of their own displace a body with its velocity, which flights take for a force: up to
# so many times negligible where the delays are the smallest that count (one series: 12 where they are 1.7).
FELT_IN_FLIGHT = 10.0
# What pushes along the path where frames' times scatter: the Host's path tells these times, and swings beside its drive
# go into them (0.12 m/s^2 beside a ringing, three runs).
DRIVING = tuple(term.driving.name for term in EFFECT_TERMS if term.drags)
STAGES = ("measurement", "drive", "flight", "impact", "geometry")
#: stages of what happens at the wall
CONTACT = ("impact", "geometry")


@dataclass(frozen=True, eq=False)
class Ladder:
    """Everything the verdict, the figures and the predictions are made of.

    ``measured`` is the series as it came, ``series`` what the measurement's corrections made of it.  ``centres``: wall,
    mass and marker as measured, placement or effect.
    ``flights`` and ``impacts``: the fits on the way, and what each candidate gained."""

    measured: Series
    series: Series
    measurement: MeasurementTests
    findings: tuple[Finding, ...]
    drive: DriveSteps
    inertia: InertiaStep
    flights: FlightSteps
    impacts: ImpactSteps
    centres: tuple[Cause, ...]
    causes: tuple[Cause, ...]
    structure: tuple[Structure, ...]

    @property
    def left_p(self) -> float:
        """How often chance makes what is left look as it does, over all stages."""
        return float(
            min(1.0, len(STAGES) * min([self.flights.left_p, self.impacts.left_p, *(s.p for s in self.structure)]))
        )

    def both_impacts(self) -> tuple[ImpactFit, ImpactFit]:
        """Wall and law recalibrated and with what was accepted; only where there were impacts enough to fit them."""
        nominal, fitted = self.impacts.nominal, self.impacts.fitted
        assert nominal is not None and fitted is not None, "fewer than eight impacts: look at `impacts` first"
        return nominal, fitted


def run_ladder(series: Series, rng: np.random.Generator, withheld: frozenset[str] = frozenset()) -> Ladder:
    """The whole diagnosis of a series, without its report.

    ``withheld``: effects taken out of the library for a trial; their data must then come back as structure without a
    name.
    """
    measured = correct(without_stated(series), withheld)
    model, effects = series.recordings[0].model, stated_effects(series)
    ground = ground_motion(series)
    corrected = with_inertia(measured.series, stated_ratio(series))
    first = first_flights(corrected, effects)
    # Frames that the Host's path has put in their time are where its drive alone would have them: what it does beside
    # the drive is asked of the path as it was timed, and the frames' times then of a Host that does not.
    drive, as_timed = drive_steps(measured.as_timed, first.fits, withheld, bool(ground))
    if drive.by_effect or drive.structure:
        calm = with_host_moved(measured.as_timed, [-one for one in drive.moves(measured.as_timed.runs)])
        measured = measured.beside(as_timed, calm, withheld)
        corrected = with_inertia(measured.series, stated_ratio(series))
    findings, tests = measured.findings, measured.tests
    inertia, flights, corrected = _flights_and_disk(corrected, first, effects, withheld, tests, rng)
    impacts = select_impact_effects(flights.fitted, effects, withheld, tests.lens_residual_found, rng)
    outside = _outside_the_wall(corrected, impacts)
    if outside is not None:
        outside = _with_stated_inertia(outside, series)
        first = first_flights(outside, effects)
        inertia, flights, corrected = _flights_and_disk(outside, first, effects, withheld, tests, rng)
        impacts = select_impact_effects(flights.fitted, effects, withheld, tests.lens_residual_found, rng)
    if any(one.effect == "trigger_jitter" for one in findings):
        flights = _without(flights, [one for one in flights.structure if one.goes_with in DRIVING])
    offsets = centre_offsets(corrected, flights.fitted, impacts.fitted)
    centres = [c for c in offsets if is_effect(c)]
    rigid = rigid_structure(series, _clock_s(findings))
    felt = _felt(rigid)
    structure = [
        *ground,
        *([tests.clock_change] if tests.clock_change is not None else []),
        *tests.misprinted,
        *rigid,
        *exchanged_structure(series),
        *changed_pictures(series),
        *turning_picture(series),
        *picture_grid(series),
        *drive.structure,
        *(inertia.structure() if inertia.contradicted or (inertia.found and "inertia_error" in withheld) else []),
        *_withheld_measurement(tests, withheld),
        *(s for s in flights.structure if s.strength > felt),
        *impacts.structure,
    ]
    structure += unexplained_scatter(impacts, structure)
    structure += _withheld_centres(centres, withheld)
    causes = [_measured(f) for f in beyond_stated(findings, model)]
    of_flights = [c for c in flights.causes if c.strength > felt]
    known = withheld.union(effects) - _resizable(series)
    causes += beyond_stated_drive(corrected, drive.causes)
    causes += [c for c in (*of_flights, *impacts.causes, *centres, *inertia.cause(corrected)) if c.effect not in known]
    structure += unexplained_misfit(flights.fitted, structure, causes, tests.lens_residual_found)
    structure += bent_picture(series)
    return Ladder(
        measured=series,
        series=corrected,
        measurement=tests,
        findings=findings,
        drive=drive,
        inertia=inertia,
        flights=flights,
        impacts=impacts,
        centres=tuple(offsets),
        causes=tuple(sorted(causes, key=lambda c: -c.weight)),
        structure=tuple(sorted(structure, key=lambda s: -s.weight)),
    )


def with_contacts_of(
    ladder: Ladder,
    flights: FlightFit,
    rng: np.random.Generator,
    withheld: frozenset[str] = frozenset(),
    surely: Sequence[str] = (),
) -> Ladder:
    """The ladder whose impacts and wall lie between other ``flights``, those that hold a law: what a force does to the
    speeds around an impact passes for its restitution otherwise.  ``surely``: effects of the restitution that a law has
    shown."""
    effects, lens = stated_effects(ladder.series), ladder.measurement.lens_residual_found
    impacts = select_impact_effects(flights, effects, withheld, lens, rng, surely)
    offsets = centre_offsets(ladder.series, flights, impacts.fitted)
    centres = [c for c in offsets if is_effect(c)]
    structure = [s for s in ladder.structure if s.stage not in CONTACT]
    structure += impacts.structure
    structure += unexplained_scatter(impacts, structure)
    structure += _withheld_centres(centres, withheld)
    known, before = withheld.union(effects), {id(c) for c in (*ladder.impacts.causes, *ladder.centres)}
    causes = [c for c in ladder.causes if id(c) not in before]
    causes += [c for c in (*impacts.causes, *centres) if c.effect not in known]
    return replace(
        ladder,
        impacts=impacts,
        centres=tuple(offsets),
        causes=tuple(sorted(causes, key=lambda c: -c.weight)),
        structure=tuple(sorted(structure, key=lambda s: -s.weight)),
    )


def with_leaning_wall(
    ladder: Ladder, leaning: ImpactFit, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> Ladder:
    """The ladder whose impacts are at the wall that a law of its shape tells (``leaning``): what is normal of them and
    what tangential passes for restitution and friction otherwise, and a rim that is uneven for a mass centre."""
    impacts = beside_wall_law(ladder.impacts, leaning, stated_effects(ladder.series), withheld, rng)
    offsets = centre_offsets(ladder.series, ladder.flights.fitted, leaning)
    named = {c.effect for c in ladder.centres if is_effect(c)}
    # A law beside which a centre would be off that was none before says so of itself, not of the centre.
    centres = [c for c in offsets if is_effect(c) and c.effect in named]
    known = withheld.union(stated_effects(ladder.series))
    before = {id(c) for c in (*ladder.impacts.causes, *ladder.centres)}
    causes = [c for c in ladder.causes if id(c) not in before]
    causes += [c for c in (*impacts.causes, *centres) if c.effect not in known]
    structure = [s for s in ladder.structure if s.stage != "impact"]
    structure += [s for s in impacts.structure if s.stage == "impact"]
    return replace(
        ladder,
        impacts=impacts,
        centres=tuple(offsets),
        causes=tuple(sorted(causes, key=lambda c: -c.weight)),
        structure=tuple(sorted(structure, key=lambda s: -s.weight)),
    )


def with_held_law(
    ladder: Ladder, runs: Sequence[Run], cause: Cause, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> Ladder:
    """The ladder of ``runs`` that hold a law which is the effect ``cause``: what acts on their flights beside it, the
    disk, impacts and wall are asked anew, for flights that lacked it bent them all."""
    measured, effects = ladder.measured, stated_effects(ladder.series)
    series = _with_stated_inertia(replace(ladder.series, runs=tuple(runs)), measured)
    first = first_flights(series, effects)
    inertia, flights, series = _flights_and_disk(series, first, effects, withheld, ladder.measurement, rng)
    flights = replace(_beyond_held(flights, cause), nominal=ladder.flights.nominal, causes=(*flights.causes, cause))
    before = {c.effect for c in (*ladder.flights.causes, *ladder.inertia.cause(ladder.series))}
    known = withheld.union(effects) - _resizable(series)
    felt = _felt(rigid_structure(measured, _clock_s(ladder.findings)))
    causes = [c for c in ladder.causes if c.effect not in before]
    causes += [c for c in flights.causes if c.effect not in known and (c is cause or c.strength > felt)]
    causes += [c for c in inertia.cause(series) if c.effect not in known]
    structure = [s for s in ladder.structure if s.stage != "flight"]
    structure += [s for s in flights.structure if s.strength > felt]
    ladder = replace(
        ladder, series=series, inertia=inertia, flights=flights, causes=tuple(causes), structure=tuple(structure)
    )
    return with_contacts_of(ladder, flights.fitted, rng, withheld)


def _beyond_held(flights: FlightSteps, cause: Cause) -> FlightSteps:
    """The steps of flights that hold a law which is a ``cause``, without what is left of it by its imperfect form: a
    contact that lasts begins a friction after blows later than the law has it."""
    return _without(flights, [s for s in flights.structure if s.strength <= 1 + SHARE_OF_NAMED * cause.strength])


def _without(flights: FlightSteps, spurious: Sequence[Structure]) -> FlightSteps:
    """The steps of flights without some of what they leave."""
    if not spurious:
        return flights
    left = tuple(one for one in flights.structure if one not in spurious)
    return replace(flights, structure=left, left_p=min([one.p for one in left], default=1.0))


def _with_stated_inertia(series: Series, measured: Series) -> Series:
    """The series whose disk has again the inertia that is stated of the one ``measured``, to be asked for anew."""
    stated = measured.runs[0].data.inertia_factor * stated_ratio(measured)
    return with_inertia(series, stated / series.runs[0].data.inertia_factor)


def stated_effects(series: Series) -> list[str]:
    """Effects of the nominal model."""
    model = series.recordings[0].model
    return list(model.effects) if model else ["floor_friction", "spin_coupling"]


def _felt(rigid: Sequence[Structure]) -> float:
    """How strong a finding of the flights may be that markers seen at times of their own explain."""
    return FELT_IN_FLIGHT * max((one.strength for one in rigid if one.unit == "s"), default=0.0)


def _resizable(series: Series) -> set[str]:
    """What ``[model]`` names is no cause; but an effect of the flights, or of the disk, of another size than it states
    is: these."""
    return {*STATED_IN_FLIGHT, "inertia_error"} & set(stated_sizes(series.recordings[0].model))


def _withheld_centres(centres: Sequence[Cause], withheld: frozenset[str]) -> list[Structure]:
    return [
        Structure(
            c.stage,
            c.phase,
            c.coordinate,
            "a constant offset of a centre",
            c.strength,
            c.gain,
            float(np.linalg.norm([value for value, _ in c.parameters.values()])),
            "m",
            two_sided(np.sqrt(c.gain)),
        )
        for c in centres
        if c.effect in withheld
    ]


def _flights_and_disk(
    series: Series,
    first: FlightFit,
    effects: Sequence[str],
    withheld: frozenset[str],
    tests: MeasurementTests,
    rng: np.random.Generator,
) -> tuple[InertiaStep, FlightSteps, Series]:
    """The disk - its inertia, its geometric centre - and what acts on its flights, which each need the other: what the
    ``first`` flights show of the disk counts once those show it that hold what acts on them, and these are fitted again
    where that changes it."""
    factor, stated = series.runs[0].data.inertia_factor, stated_ratio(series)

    def disk(flights: FlightFit) -> tuple[InertiaStep, float, tuple[float, float]]:
        wall = wall_between(flights)
        inertia_found = inertia_step(wall, flights, factor, stated)
        ratio = inertia_found.ratio if inertia_found.found and "inertia_error" not in withheld else 1.0
        known = wall is not None and "mass_centre_offset" not in withheld
        return inertia_found, ratio, middle_of_disk(wall) if wall is not None and known else (0.0, 0.0)

    inertia_found, ratio, middle_m = disk(first)
    for _ in range(2):
        in_use, centre_m = ratio, middle_m
        series = with_inertia(series, in_use * factor / series.runs[0].data.inertia_factor)
        series = replace(series, runs=tuple(with_middle(series.runs, centre_m)))
        flights = select_flight_effects(series, effects, withheld, tests.lens_residual_found, rng)
        inertia_found, ratio, middle_m = disk(flights.fitted)
        if abs(ratio - in_use) < NEGLIGIBLE and same_middle(middle_m, centre_m, series.contact_radius_m):
            break
    if inertia_found.found and in_use != 1.0:
        stated_runs = with_inertia(series, factor / series.runs[0].data.inertia_factor)
        if flights_contradict(flights.named, stated_runs):
            beside = withheld.union({"inertia_error"})
            inertia_found, flights, series = _flights_and_disk(stated_runs, first, effects, beside, tests, rng)
            return replace(inertia_found, found=False, contradicted=inertia_found.found), flights, series
    return inertia_found, flights, series


def _outside_the_wall(series: Series, impacts: ImpactSteps) -> Series | None:
    """The series without the frames in which the disk is in the wall, where contacts last: they are no flight.  None
    where there are none."""
    if impacts.fitted is None:
        return None
    runs = impacts.fitted.outside_the_wall(series.runs)
    changed = any(one is not run for one, run in zip(runs, series.runs, strict=True))
    return replace(series, runs=tuple(runs)) if changed else None


def _clock_s(findings: Sequence[Finding]) -> float:
    late = [f.parameters["offset_s"][0] for f in findings if f.effect == "camera_clock_offset"]
    return late[0] if late else 0.0


def _measured(finding: Finding) -> Cause:
    return Cause(
        finding.effect,
        "measurement",
        finding.parameters,
        finding.times_least(),
        finding.significance**2,
        "all",
        "all",
        finding.rivals,
        finding.by_run,
    )


def _withheld_measurement(tests: MeasurementTests, withheld: frozenset[str]) -> list[Structure]:
    return [
        Structure(
            "measurement",
            "all",
            "all",
            "a residual between the two cameras, of the Host or of lengths",
            f.size / f.least,
            f.significance**2,
            f.size,
            f.unit,
            two_sided(f.significance),
        )
        for f in tests.findings.values()
        if f.found and f.effect in withheld
    ]
