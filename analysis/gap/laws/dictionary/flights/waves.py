"""What comes and goes along a way: with the way slid (feet that hunt, a face that clogs and clears), with the angle
turned (a bent thread), with the radius (Chladni's circles of a floor that vibrates, grooves turned on a lathe).

The wave's number along its way is searched from a grid in which neighbours are told apart."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.flights.memory import ASIDE, TORQUE
from analysis.gap.laws.dictionary.modulated import FEW, FRICTION, Carrier, Modulator, Products
from analysis.gap.laws.dictionary.parts import RigScales
from ovines.core.laws.terms import Factor, Term

# Phase (rad) by which neighbours differ from one end of the way to the other, and a search's first step of it.
APART, STEP = 3.2, 0.6
# A search's first step of the logarithm of a length in which waves fade, and how many times its start is for ever.
FADE_STEP, UNFADED = 0.7, 20.0
# Way of a flight, over the contact radius; waves from one end to the other, of that and of the radius.
FLIGHT, MOST_IN_FLIGHT, LEAST_ALONG_RADIUS, MOST_ALONG_RADIUS = 2.0, 12, 2, 8
# The slowest of a run are what sways with the time.
LEAST_IN_RUN, MOST_IN_RUN, LEAST_TURNED, MOST_TURNED = 4, 28, 2, 24
_SHAKEN = Factor("host_acceleration")
_SHAKEN_2 = Factor("host_acceleration", "power", 2.0)


def wave_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate that goes in waves along a way."""
    return [candidate for carrier, one in _all(scales) for candidate in carrier.times(one)]


def _all(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    flight = _waves("way_since", FLIGHT * scales.radius_m, 1, MOST_IN_FLIGHT)
    run = _waves("way", scales.way_m, LEAST_IN_RUN, MOST_IN_RUN)
    turned = _waves("turned", scales.turned_rad, LEAST_TURNED, MOST_TURNED)
    for carrier in (FRICTION, ASIDE, TORQUE):
        yield carrier, flight
        yield carrier, _fading(flight, "way_since", FLIGHT * scales.radius_m)
    for carrier in (FRICTION, ASIDE):
        yield carrier, run
    for carrier in (FRICTION, TORQUE):
        yield carrier, turned
    circles = ("radius", scales.radius_m, LEAST_ALONG_RADIUS, MOST_ALONG_RADIUS)
    pull, swirl = FEW[1], FEW[3]
    for carrier in (FRICTION, pull):
        yield carrier, _waves(*circles)
        yield carrier, _waves(*circles, _SHAKEN_2)
    yield pull, _waves(*circles, _SHAKEN)
    yield swirl, _waves(*circles)
    # Of what stands below the table, about the middle of the Host's path.
    room = Carrier("pull in the room", (Term("from_place_in_room", 1.0),))
    yield room, _waves("distance_in_room", *circles[1:])


def _fading(one: Modulator, quantity: str, length: float) -> Modulator:
    """Waves that fade along their way, within about ``length`` at first: a disk that slides through half of a run
    between two blows tells the most of such waves, and nothing but the right one of those that do not fade."""

    def make(scale: float, fades: float) -> Products:
        if fades > UNFADED * length:
            return one.make(scale)
        return tuple((*factors, Factor(quantity, "exponential", 1.0, fades)) for factors in one.make(scale))

    starts = tuple(((*numbers, length), (*steps, FADE_STEP)) for numbers, steps in one.starts)
    return Modulator(f"{one.name}, which fade", make, starts, (True, True))


def _waves(quantity: str, length: float, first: int, last: int, *factors: Factor) -> Modulator:
    """Cosine and sine of a quantity that runs over ``length``, times ``factors``."""

    def make(scale: float) -> Products:
        return tuple((*factors, wave) for wave in waves(quantity, 1.0, scale))

    word = {"host_acceleration": "Host's acceleration"}
    beside = "".join(f" and {'the square of ' if one.order == 2.0 else ''}the {word[one.quantity]}" for one in factors)
    starts = tuple(((length / (APART * n),), (STEP / (APART * n),)) for n in range(first, last + 1))
    return Modulator(f"in waves of the {quantity.replace('_', ' ')}{beside}", make, starts, (True,))
