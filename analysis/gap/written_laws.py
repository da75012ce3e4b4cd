"""The laws of a diagnosis: one for each stage in which something is left.  A law that is an effect of the library is
reported by its name, and the ladder holds it like any other effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.flights.fit import FlightFits
from analysis.gap.cause import Cause, Instead, Structure
from analysis.gap.ladder import Ladder, with_contacts_of, with_leaning_wall
from analysis.gap.laws.belief import UNPROMPTED_CLOSED, believed, structure_of_law
from analysis.gap.laws.choice.search import LEVEL_BELIEVED, LEVEL_WHERE_LEFT
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.asked import measurement_laws, seen_disk_law, seen_host_law
from analysis.gap.laws.impact_law import (
    ACTS_ON,
    find_impact_law,
    find_wall_law,
    impact_law_sizes,
    leaning_wall,
    needless_beside,
)
from analysis.gap.laws.instead.flights import flight_law_beyond, flight_law_instead
from analysis.gap.laws.instead.impacts import RestitutionInstead, restitution_law_instead, without_effects
from analysis.gap.laws.instead.wall import is_lasting, wall_law_instead
from analysis.gap.named_laws import NamedPart, effect_of_restitution, named_part, with_named_contact_law, with_named_law
from analysis.gap.selection.flight_steps import FlightSteps
from analysis.gap.selection.flights_beside_law import sized_beside
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.gap.selection.impacts.gain import mattering
from analysis.gap.thresholds import (
    DISTANCE_NEGLIGIBLE,
    ELLIPTICITY_NEGLIGIBLE,
    ELLIPTICITY_UNDER_LENS,
    LAW_LEAST_CLOSED,
)
from ovines.core.laws.formula import as_text
from ovines.workers.beside import made_beside

# A name says as much beside a law of the wall where it keeps this share of its gain (an oval disk took 0.41 of a loss
# with the speed that was none).
SAYS_AS_MUCH = 0.75
#: coordinate of an impact that a law's target is one of
COORDINATES = {target: coordinate for coordinate, targets in ACTS_ON.items() for target in targets}


def write_laws(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> tuple[tuple[LawFound, ...], Ladder]:
    """Laws for what is left in the measurement, in flights, impacts and the wall's shape, in this order, none where
    nothing is left or chance would find as much; and the ladder without the named effects that had imitated a part of a
    law, and with the effect that a law is, unless it is ``withheld``.

    A law comes on top of what the named effects explain, and is asked of the same runs; one of the measurement is taken
    out first, and everything asked again."""
    of_measurement, rng = rng.spawn(1)[0], rng.spawn(1)[0]
    begun, measured = _begun_beside(ladder, of_measurement, rng, withheld)
    if measured is None:
        measured, again, seen = _measured_laws(ladder, of_measurement, withheld)
        if seen:  # nothing else is left
            return measured, again
        begun, ladder = begun if again is ladder else None, again
    left = _left_stages(ladder)
    laws: list[LawFound | None] = []
    law, ladder = _flight_law(ladder, left, rng, withheld, begun)
    laws.append(law)
    flights = ladder.flights.fitted
    if law is not None and law.fitted is not None and law.closed > UNPROMPTED_CLOSED:
        flights = law.fitted[1]
        ladder = with_contacts_of(ladder, flights, rng, withheld)
    found, unprompted, ladder = _contact_laws(ladder, flights.fits, rng, withheld)
    # A law that is surely an effect of the library has its name: a drift of the restitution that gains less than a name
    # must.
    names = [_surely_effect(one, ladder, flights.fits) for one in found if one is not None]
    name = next((one for one in names if one is not None), None)
    if name is not None and name not in (*withheld, *ladder.impacts.restitution_terms):
        ladder = with_contacts_of(ladder, flights, rng, withheld, (name,))
        found, unprompted, ladder = _contact_laws(ladder, flights.fits, rng, withheld)
    ladder = _with_structure(ladder, unprompted)
    known = withheld
    while (part := _named_contact_part(found, known)) is not None:
        law, named = part
        ladder, flights = with_named_contact_law(ladder, law, named, flights, rng, withheld)
        known = known.union({named.effect.name})
        found, unprompted, ladder = _contact_laws(ladder, flights.fits, rng, withheld)
        ladder = _with_structure(ladder, unprompted)
    laws += found
    return (*measured, *(one for one in laws if one is not None and one.closed > LAW_LEAST_CLOSED)), ladder


def _left_stages(ladder: Ladder) -> set[str]:
    """Stages in which something is left that the measurement's corrections do not take out."""
    return {one.stage for one in ladder.structure if not one.is_taken_out}


def _measured_laws(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[tuple[LawFound, ...], Ladder, bool]:
    """Laws of the measurement, of where the Host is seen and of where the disk is; the ladder of the series without
    them; and whether there is one of the disk."""
    measured, ladder = measurement_laws(ladder, rng, withheld)
    host, ladder = seen_host_law(ladder, rng, withheld)
    disk, ladder = seen_disk_law(ladder, rng, withheld)
    return (*measured, *host, *disk), ladder, bool(disk)


class _FlightsAsked(NamedTuple):
    """The dictionary of the flights (None: too few speak), the law that they ask for beside what they name, and the
    steps beside it."""

    search: FlightSearch | None
    law: LawFound | None
    steps: FlightSteps


def _begun_beside(
    ladder: Ladder, of_measurement: np.random.Generator, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[_FlightsAsked | None, tuple[LawFound, ...] | None]:
    """The flights asked for a law by this process, while a second one asks the measurement for its own: no laws of it
    where there are none, None where there are or nobody asked.

    Only where nothing is left of the measurement or the Host's path: there a law of it is seldom found, and little work
    is wasted."""
    if {one.stage for one in ladder.structure} & {"measurement", "drive"}:
        return None, None

    def nothing() -> bool:
        return _measured_laws(ladder, of_measurement, withheld)[1] is ladder

    with made_beside(nothing) as nothing_there:
        begun = _flights_asked(ladder, _left_stages(ladder), rng)
        return begun, () if nothing_there() else None


def _flights_asked(ladder: Ladder, left: set[str], rng: np.random.Generator) -> _FlightsAsked:
    """What the flights ask for."""
    runs, frame = ladder.series.runs, ladder.series.frame
    search = FlightSearch.of(runs, ladder.flights.named, rng)
    law, steps = find_flight_law(runs, ladder.flights, frame, rng, _least_push(ladder, left), search=search)
    return _FlightsAsked(search, law, steps)


def _least_push(ladder: Ladder, left: set[str]) -> float:
    """What a law of the flights must push by (m/s^2): nothing where a probe asks for one."""
    return 0.0 if "flight" in left else ladder.flights.units.negligible_m_per_s2


def _named_contact_part(found: Sequence[LawFound | None], known: frozenset[str]) -> tuple[LawFound, NamedPart] | None:
    """A law of impacts or wall that is an effect of the library, or holds one that is not ``known``, and that."""
    parts = ((law, named_part(law, known)) for law in found if law is not None and law.closed > LAW_LEAST_CLOSED)
    return next(((law, part) for law, part in parts if part is not None), None)


def _with_structure(ladder: Ladder, more: Sequence[Structure]) -> Ladder:
    """The ladder with what is left beside what its probes found; the same one where nothing is."""
    if not more:
        return ladder
    return replace(ladder, structure=tuple(sorted((*ladder.structure, *more), key=lambda one: -one.weight)))


def _flight_law(
    ladder: Ladder,
    left: set[str],
    rng: np.random.Generator,
    withheld: frozenset[str],
    begun: _FlightsAsked | None = None,
) -> tuple[LawFound | None, Ladder]:
    """The law of the flights, and the ladder whose names and sizes are those beside it; ``begun``: what they ask for,
    where it is known.

    It is searched whether or not a probe found something, as those of the impacts are: a name may have taken what was
    another law's.  Where something is left of the measurement or the Host's path, only a probe asks: either bends
    flights like a law."""
    if "flight" not in left and left & {"measurement", "drive"}:
        return None, ladder
    search, law, steps = begun or _flights_asked(ladder, left, rng)
    least, asked, frame = _least_push(ladder, left), "flight" in left, ladder.series.frame

    def stands(one: LawFound) -> bool:
        """Whether a law is one: a probe asks for it, or it is believed by itself."""
        return one.closed > LAW_LEAST_CLOSED and (asked or believed(one, one.size, least) is not None)

    if law is None or not stands(law):
        beyond = None if search is None else flight_law_beyond(search, ladder.flights, frame, rng, least)
        if beyond is None:
            return None, ladder  # nor does it change the names beside it, or their sizes
        law, steps = beyond
    else:
        instead = None if search is None else flight_law_instead(search, steps, law, frame, rng)
        # What is not believed where no probe asks stands in no name's place.
        if instead is not None and stands(instead[0]):
            law, steps = instead
    if not asked:
        structure = (*ladder.structure, structure_of_law(law, "flight", "x", law.size, least))
        ladder = replace(ladder, structure=tuple(sorted(structure, key=lambda one: -one.weight)))
    ladder = _sized_beside(ladder, law, steps)
    part = named_part(law, withheld)
    if part is None:
        return law, ladder
    named = with_named_law(ladder, law, part, rng, withheld)
    left = {one.stage for one in named.structure}
    if len(law.rig_law.terms) == len(part.terms) and "flight" not in left:
        return None, named
    # What is left beside the part that has a name is asked once more: another law, or nothing that is not named now.
    return _flight_law(named, left, rng, withheld.union({part.effect.name}))


def _sized_beside(ladder: Ladder, law: LawFound, steps: FlightSteps) -> Ladder:
    """The ladder with the names and sizes that the flights have beside a law (``steps``)."""
    gone = {c.effect for c in ladder.flights.causes} - {c.effect for c in steps.causes}
    if law.fitted is not None:
        steps = sized_beside(law.fitted[1], steps, ladder.series)
    sized = {c.effect: c for c in steps.causes}
    causes = tuple(sized.get(c.effect, c) for c in ladder.causes if c.effect not in gone)
    return replace(ladder, flights=steps, causes=causes)


def _contact_laws(
    ladder: Ladder, fits: Sequence[FlightFits], rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[list[LawFound | None], list[Structure], Ladder]:
    """Laws of the impacts and the wall's shape, what is left where only they show it, and the ladder without the names
    that they make needless.

    ``fits``: the flights between which the ladder's impacts lie.  Both are searched whether or not a probe found
    something: probes ask for a few forms, the dictionary for many.  What it finds unprompted counts where it is more
    than negligible and halves of the runs agree."""
    if ladder.impacts.fitted is None:
        return [], [], ladder
    lens, left = ladder.measurement.lens_residual_found, {one.stage for one in ladder.structure}
    laws, structure = list[LawFound | None](), list[Structure]()
    under_lens = ELLIPTICITY_UNDER_LENS / ELLIPTICITY_NEGLIGIBLE if lens and "geometry" not in left else 1.0
    least_m = DISTANCE_NEGLIGIBLE * ladder.series.contact_radius_m * under_lens
    wall, ladder = _wall_law_instead(ladder, fits, least_m, rng)
    # A contact that lasts follows another tangential law, and its distances grow with the speed.
    instant = not ladder.impacts.shape.finite
    if wall is None and (instant or "geometry" in left):
        wall = _wall_law(ladder, fits, "geometry" in left, least_m, rng)
    if wall is not None and wall.closed > LAW_LEAST_CLOSED:
        before = ladder.impacts.causes
        ladder = with_leaning_wall(ladder, leaning_wall(wall, _fitted(ladder), fits), rng, withheld)
        taken = taken_by_wall(before, ladder.impacts.causes)
        ladder = _without(ladder, without_effects(ladder.impacts, taken)) if taken else ladder
        left = {one.stage for one in ladder.structure}
        if "geometry" not in left:
            stage = "impact" if is_lasting(wall) else "geometry"
            structure.append(structure_of_law(wall, stage, "radius", wall.size, least_m))
    if instant or "impact" in left:
        law, more, ladder = _impact_law(ladder, fits, "impact" in left, rng)
        laws, structure = [law], [*more, *structure]
    return [*laws, wall], structure, ladder


def _wall_law_instead(
    ladder: Ladder, fits: Sequence[FlightFits], least_m: float, rng: np.random.Generator
) -> tuple[LawFound | None, Ladder]:
    """The law of the wall's shape where one formula says more than the named shapes, and the ladder without these."""
    found = wall_law_instead(ladder.impacts, fits, ladder.series.frame, least_m, rng)
    if found is None or believed(found[0], found[0].size, least_m) is None:
        return None, ladder
    return found[0], _without(ladder, found[1])


def _wall_law(
    ladder: Ladder, fits: Sequence[FlightFits], asked: bool, least_m: float, rng: np.random.Generator
) -> LawFound | None:
    """The law of the wall's shape beside the named ones (``asked``: a probe has found something)."""
    level = LEVEL_WHERE_LEFT if asked else LEVEL_BELIEVED
    found = find_wall_law(_fitted(ladder), fits, ladder.series.frame, least_m, rng, level)
    return found if found is None or asked else believed(found, found.size, least_m)


def taken_by_wall(before: Sequence[Cause], beside: Sequence[Cause]) -> tuple[str, ...]:
    """Names of the restitution that say clearly less ``beside`` a law of the wall than ``before``: what a leaning wall
    makes of the speeds passes for a loss with the speed.  A true one says more where the wall scatters less."""
    said = {cause.effect: cause.gain for cause in before}
    return tuple(
        cause.effect
        for cause in beside
        if cause.effect in RESTITUTION_EFFECTS and cause.gain < SAYS_AS_MUCH * said.get(cause.effect, 0.0)
    )


def _fitted(ladder: Ladder) -> ImpactFit:
    assert ladder.impacts.fitted is not None, "no impacts: there is nothing to ask"
    return ladder.impacts.fitted


def _impact_law(
    ladder: Ladder, fits: Sequence[FlightFits], asked: bool, rng: np.random.Generator
) -> tuple[LawFound | None, tuple[Structure, ...], Ladder]:
    """The law of the impacts, what is left where only it shows it (``asked``: a probe has), and the ladder without the
    effects of the restitution that had imitated a part of it."""
    law, structure = _asked_impact_law(ladder, fits, asked, rng)
    if law is not None and law.closed <= LAW_LEAST_CLOSED:
        return law, structure, ladder
    gone = () if law is None else needless_beside(law, ladder.impacts, fits)
    if gone:
        fewer = _without(ladder, without_effects(ladder.impacts, gone))
        again, rest = _asked_impact_law(fewer, fits, asked, rng)
        if again is not None and again.closed > LAW_LEAST_CLOSED:
            law, structure, ladder = again, rest, fewer
    left = [one for one in ladder.structure if one.stage == "impact"]
    instead = restitution_law_instead(law, ladder.impacts, fits, ladder.series.frame, rng, left)
    if instead is not None and instead.replaces:
        fewer = _without(ladder, instead.steps)
        alone, rest = (instead.law, ()) if asked else _believed_impact_law(instead.law, fewer, fits)
        if alone is not None and alone.closed > LAW_LEAST_CLOSED:
            return alone, rest, fewer
    elif instead is not None and law is None:
        ladder = _with_formula_beside(ladder, instead)
    return law, structure, ladder


def _with_formula_beside(ladder: Ladder, instead: RestitutionInstead) -> Ladder:
    """The ladder whose effects of the restitution know the formula that might stand in their place."""
    formula = Instead(as_text(instead.law.law), instead.more)
    needed = {cause.effect for cause in instead.steps.causes}

    def knows(cause: Cause) -> Cause:
        replaced = cause.effect in RESTITUTION_EFFECTS and cause.effect not in needed
        return replace(cause, instead=formula) if replaced else cause

    impacts = replace(ladder.impacts, causes=tuple(map(knows, ladder.impacts.causes)))
    return replace(ladder, impacts=impacts, causes=tuple(map(knows, ladder.causes)))


def _without(ladder: Ladder, impacts: ImpactSteps) -> Ladder:
    """The ladder whose impacts have fewer named effects."""
    gone = {c.effect for c in ladder.impacts.causes} - {c.effect for c in impacts.causes}
    return replace(ladder, impacts=impacts, causes=tuple(c for c in ladder.causes if c.effect not in gone))


def _asked_impact_law(
    ladder: Ladder, fits: Sequence[FlightFits], asked: bool, rng: np.random.Generator
) -> tuple[LawFound | None, tuple[Structure, ...]]:
    impacts, level = _fitted(ladder), LEVEL_WHERE_LEFT if asked else LEVEL_BELIEVED
    probes = [one for one in ladder.structure if one.stage == "impact"]
    law = find_impact_law(impacts, fits, ladder.impacts.restitution_terms, ladder.series.frame, rng, level, probes)
    return (law, ()) if law is None or asked else _believed_impact_law(law, ladder, fits)


def _believed_impact_law(
    law: LawFound, ladder: Ladder, fits: Sequence[FlightFits]
) -> tuple[LawFound | None, tuple[Structure, ...]]:
    """A law of the impacts that no probe has asked for, where it is believed, and what it leaves to be reported."""
    sizes = impact_law_sizes(law, _fitted(ladder), fits, ladder.impacts.restitution_terms)
    target = max(sizes, key=lambda one: sizes[one][0] / sizes[one][1])
    if believed(law, *sizes[target]) is None:
        return None, ()
    return law, (
        structure_of_law(law, "impact", COORDINATES[target], *sizes[target], mattering(_fitted(ladder).lasts)),
    )


def _surely_effect(law: LawFound, ladder: Ladder, fits: Sequence[FlightFits]) -> str | None:
    """The effect of the restitution that a law is, where it would be believed if no probe had asked for it."""
    name, impacts = effect_of_restitution(law.rig_law), ladder.impacts.fitted
    if name is None or impacts is None:
        return None
    sizes = impact_law_sizes(law, impacts, fits)
    return name if believed(law, *sizes["restitution"]) is not None else None
