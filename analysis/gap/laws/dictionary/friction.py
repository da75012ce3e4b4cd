"""How the floor's friction may differ: with place, speed, spin, time, angle; by directions; in patches, seams and
grooves.  What is lifted off the floor by its own speed is less friction, too."""

from __future__ import annotations

import math

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.forces import BEYOND, CHANGES, FADES, RANGES, SPEEDS, TIMES, changed_runs
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, PLACE_STEP, RigScales, lines, pair, plain, scaled, spots
from analysis.gap.laws.dictionary.places import WAVE_DIRECTIONS, WIDTHS
from ovines.core.laws.terms import Factor, Term

TARGET = "floor_friction"
SPINS, LIFTS = (0.3, 1.0), (0.5, 1.0)
SEAM_DIRECTIONS, SEAM_PLACES = 8, (-0.6, -0.3, 0.0, 0.3, 0.6)
# Radii and widths of a worn track, over the contact radius.
TRACKS, TRACK_WIDTHS = (0.3, 0.5, 0.7, 0.9), (0.06, 0.15)
# Middles and width of a band of sliding speeds, over the usual speed.
BANDS, BAND = (0.3, 0.6, 1.0, 1.4), 0.15
# Lengths of a groove's wave (over a turn of 2 pi), over the contact radius.
GROOVES = (0.05, 0.08, 0.13, 0.21, 0.34)


def friction_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate for a change of the floor's friction, as a share of it."""
    return [*_smooth(), *_scaled(scales), *_bands(scales), *_tracks(scales), *_of_places(scales)]


def _smooth() -> list[Candidate]:
    out = []
    for factor, word in (
        (Factor("radius"), "the radius"), (Factor("radius", "power", 2.0), "the radius' square"),
        (Factor("radius", "power", 4.0), "the radius to the fourth"),
        (Factor("sliding_speed"), "the sliding speed"),
        (Factor("sliding_speed", "power", 2.0), "the sliding speed's square"),
        (Factor("speed"), "the speed"), (Factor("speed", "power", 2.0), "the speed's square"),
        (Factor("time"), "time"), (Factor("run"), "the run"), (Factor("spin", "absolute_power"), "the spin"),
        (Factor("spin", "power", 2.0), "the spin's square"), (Factor("spin", "sign"), "the sense of spin"),
    ):  # fmt: skip
        out.append(plain(f"friction with {word}", Term(TARGET, 1.0, (factor,))))
    for quantity, word in (
        ("sliding_along", "the way it slides"),
        ("host_acceleration_along", "the Host's acceleration along a direction"),
        ("host_velocity_along", "the Host's velocity along a direction"), ("along_host", "the place in the Host"),
    ):  # fmt: skip
        out.append(plain(f"friction with {word}", *(Term(TARGET, 1.0, (way,)) for way in ways(quantity))))
    # A floor that pitches as it is accelerated presses at one side: place times acceleration.
    outwards = Factor("host_acceleration_outwards")
    out.append(plain("friction with the Host's acceleration outwards", Term(TARGET, 1.0, (outwards,))))
    pitching = Term(TARGET, 1.0, (Factor("radius"), outwards))
    out.append(plain("friction with the radius and the Host's acceleration outwards", pitching))
    for quantity, orders in (
        ("phase", (1.0, 2.0)), ("clock", (1.0,)), ("angle", (1.0, 2.0)), ("azimuth", (1.0, 2.0, 3.0)),
        ("body_angle", (1.0,)), ("sliding_direction", (1.0, 2.0)), ("sliding_heading", (1.0, 2.0)),
    ):  # fmt: skip
        for order in orders:
            terms = (Term(TARGET, 1.0, (wave,)) for wave in waves(quantity, order))
            out.append(plain(f"friction with the {quantity}, order {order:g}", *terms))
    for word, factors in (
        ("", ()), (" with the spin", (Factor("spin", "absolute_power"),)),
        (" with the sliding speed", (Factor("sliding_speed"),)), (" with the radius", (Factor("radius"),)),
    ):  # fmt: skip
        out.append(plain(f"torque of the floor's friction{word}", Term("floor_torque", 1.0, factors)))
    mirrored = pair("mirrored_floor_friction", 0.25 * math.pi)
    out.append(plain("friction that acts off the mass centre", *pair("floor_lever", QUARTER)))
    # Marks around the Host's centre hold what slides across them.
    for word, factors in (("", ()), (" with the radius", (Factor("radius"),))):
        out.append(plain(f"friction along the radius and across it{word}", Term("polar_floor_friction", 1.0, factors)))
    return [*out, plain("friction that differs by direction", *mirrored)]


def _scaled(scales: RigScales) -> list[Candidate]:
    speeds, times, radii, spins, ranges, lifts, fades = (
        [share * unit for share in shares]
        for shares, unit in (
            (SPEEDS, scales.speed_m_per_s), (TIMES, scales.flight_s), (BEYOND, scales.radius_m),
            (SPINS, scales.spin_rad_per_s), (RANGES, scales.radius_m), (LIFTS, scales.speed_m_per_s),
            (FADES, scales.run_s),
        )
    )  # fmt: skip
    out = []
    for name, shape, sizes in (
        ("friction at slow sliding", ("sliding_speed", "exponential", 1.0), speeds),
        ("friction at slow motion", ("speed", "exponential", 1.0), speeds),
        ("friction that the speed takes", ("speed", "rational", 2.0), lifts),
        ("friction that sliding takes", ("sliding_speed", "rational", 2.0), lifts),
        ("friction beyond a speed", ("speed", "above", 1.0), lifts),
        ("friction at slow spin", ("spin", "decay", 1.0), spins),
        ("friction at spins below one", ("spin", "gaussian", 1.0), spins),
        ("friction after an impact", ("since", "exponential", 1.0), times),
        ("friction just after an impact", ("since", "below", 1.0), times),
        ("friction inside a radius", ("radius", "below", 1.0), radii),
        ("friction beyond a radius", ("radius", "above", 1.0), radii),
        ("friction near the wall", ("gap", "exponential", 1.0), ranges),
        ("friction that settles in the run", ("time", "exponential", 1.0), fades),
        ("friction that changes at once", ("time", "below", 1.0), [share * scales.run_s for share in CHANGES]),
    ):
        out += scaled(name, TARGET, shape, sizes)
    return out + changed_runs("friction", TARGET, scales)


def _bands(scales: RigScales) -> list[Candidate]:
    """Friction that differs in a band of sliding speeds, as where the disk chatters."""

    def band(speed: float, width: float) -> tuple[Term, ...]:
        return (Term(TARGET, 1.0, (Factor("sliding_speed", "gaussian", 1.0, width, speed),)),)

    unit, steps = scales.speed_m_per_s, (0.1 * scales.speed_m_per_s, 0.2)
    return [
        Candidate("friction in a band of sliding speeds", band, (share * unit, BAND * unit), steps, (False, True))
        for share in BANDS
    ]


def _tracks(scales: RigScales) -> list[Candidate]:
    """A worn or oily track around the Host's centre."""

    def track(radius: float, width: float) -> tuple[Term, ...]:
        return (Term(TARGET, 1.0, (Factor("radius", "gaussian", 1.0, width, radius),)),)

    unit, steps = scales.radius_m, (PLACE_STEP * scales.radius_m, 0.2)
    return [
        Candidate("friction of a track", track, (share * unit, width * unit), steps, (False, True))
        for share in TRACKS
        for width in TRACK_WIDTHS
    ]


def _of_places(scales: RigScales) -> list[Candidate]:
    step = PLACE_STEP * scales.radius_m
    out = []

    def patch(x: float, y: float, width: float) -> tuple[Term, ...]:
        return (Term(TARGET, 1.0, (Factor("distance_in_host", "gaussian", 1.0, width, x, y),)),)

    for x, y in spots(scales):
        for share in WIDTHS:
            numbers = (x, y, share * scales.radius_m)
            out.append(Candidate("friction of a patch", patch, numbers, (step, step, 0.2), (False, False, True)))

    def seam(angle: float, place: float) -> tuple[Term, ...]:
        return (Term(TARGET, 1.0, (Factor("along_host", "below", 1.0, place, 0.0, angle),)),)

    for angle, place in lines(SEAM_DIRECTIONS, SEAM_PLACES, scales):
        name = "friction on one side of a seam"
        out.append(Candidate(name, seam, (angle, place), (ANGLE_STEP, step), (False, False)))

    def groove(angle: float, length: float) -> tuple[Term, ...]:
        return tuple(
            Term(TARGET, 1.0, (Factor("along_host", wave.function, 1.0, length, 0.0, angle),))
            for wave in waves("along_host")
        )

    for i in range(WAVE_DIRECTIONS):
        for share in GROOVES:
            wave = (math.pi * i / WAVE_DIRECTIONS, share * scales.radius_m)
            out.append(Candidate("friction of grooves", groove, wave, (ANGLE_STEP, 0.1), (False, True)))
    return out
