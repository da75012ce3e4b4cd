"""What remembers the contact before: where on the wall it was, and how hard."""

from __future__ import annotations

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.forces import TIMES
from analysis.gap.laws.dictionary.impacts import WEARS
from analysis.gap.laws.dictionary.parts import SCALE_STEP, RigScales, plain, scaled
from ovines.core.laws.terms import Factor, Term

# Distances over the contact radius up to which the place of a contact is felt.
REACHES = (0.1, 0.2, 0.35, 0.6)


def _worn(fades_s: float) -> tuple[Term, ...]:
    return (Term("floor_friction", 1.0, (Factor("recent_blows", y=fades_s),)),)


def memory_candidates(scales: RigScales) -> list[Candidate]:
    """Pulls towards the place of the contact before, friction and drag by how far it is or how hard it was."""
    reaches = [share * scales.radius_m for share in REACHES]
    times = [share * scales.flight_s for share in TIMES]
    target, after = "from_last_contact", ("since", "exponential", 1.0)
    out = [
        plain("pull to the last contact", Term(target, 1.0)),
        plain("spring to the last contact", Term(target, 1.0, (Factor("from_contact"),))),
    ]
    out += scaled("pull to the last contact that ends", target, ("from_contact", "below", 1.0), reaches)
    out += scaled("pull to the last contact that fades", target, ("from_contact", "exponential", 1.0), reaches)
    spring = (Factor("from_contact"),)
    out += scaled("spring to the last contact that ends", target, ("from_contact", "below", 1.0), reaches, spring)
    out += scaled("pull to the last contact, for a time", target, after, times)
    out += scaled("pull to the last contact, until a time", target, ("since", "below", 1.0), times)
    friction, hard = "floor_friction", (Factor("last_approach"),)
    out.append(plain("friction with the number of blows before", Term(friction, 1.0, (Factor("blows"),))))
    out += scaled("friction that the blows wear off", friction, ("blows", "exponential", 1.0), WEARS)
    out.append(plain("friction with the last blow", Term(friction, 1.0, hard)))
    out += [
        Candidate("friction with the recent blows", _worn, (float(time),), (SCALE_STEP,), (True,)) for time in times
    ]
    out += scaled("friction with the last blow, for a time", friction, after, times, hard)
    out += scaled("friction near the last contact", friction, ("from_contact", "exponential", 1.0), reaches)
    # A blow that tosses the disk up, or sets it rocking, does so the longer the harder it was.
    by_blow = [time / scales.speed_m_per_s for time in times]
    for function, word in (("below", "until"), ("exponential", "for")):
        shape = ("since_by_blow", function, 1.0)
        out += scaled(f"friction {word} a time that goes with the last blow", friction, shape, by_blow)
    out += scaled("drag after the last blow, by its speed", "along_velocity", after, times, (Factor("speed"), *hard))
    out += scaled("force outwards after the last blow, by its speed", "outwards", after, times, hard)
    return out
