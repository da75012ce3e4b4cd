"""What a missing law of the impact may look like: functions of what is known before the impact - approach, slip, angle
of incidence, the wall's own speed, spin, azimuth, the side of the disk, phase, time, rest before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.between_runs import law_between
from analysis.gap.laws.dictionary.candidate import Candidate, waves, ways
from analysis.gap.laws.dictionary.impacts.around import (
    IN_STEP,
    SIDE_ORDERS,
    around_everything,
    creeping,
    in_step,
    meshing,
    swaying,
)
from analysis.gap.laws.dictionary.impacts.memory import (
    BREATHING,
    after_the_way,
    leaning,
    left_fast,
    ringing,
    settling_by_run,
    struck_here,
    swinging,
    turning,
    worn,
)
from analysis.gap.laws.dictionary.impacts.normals import normal_candidates
from analysis.gap.laws.dictionary.modulated import WEARS, Carrier
from analysis.gap.laws.dictionary.parts import plain, scaled
from analysis.gap.laws.dictionary.uneven import of_impacts_uneven, uneven
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
LAWS = ("restitution", "wall_friction", "tangential_restitution", "spin_kept")
# A spin that an impact adds: by what, in the sense of what.
ADDED = (
    ("constant", ()),
    ("with the approach speed", (Factor("approach"),)),
    ("with the approach speed, by the sense of spin", (Factor("approach"), Factor("spin", "sign"))),
    ("with the approach speed, by the sense of slip", (Factor("approach"), Factor("slip", "sign"))),
    ("by the sense of spin", (Factor("spin", "sign"),)),
    ("by the sense of slip", (Factor("slip", "sign"),)),
    ("with the approach speed and the slip", (Factor("approach"), Factor("slip"))),
    ("with the centre's signed speed along the wall", (Factor("passing"),)),
    ("with the approach speed, by the sense of the spin left", (Factor("approach"), Factor("spin_left", "sign"))),
    ("by the sense of the spin left", (Factor("spin_left", "sign"),)),
    ("with the approach speed and the spin left", (Factor("approach"), Factor("spin_left"))),
    ("with the Host's acceleration about its centre", (Factor("host_acceleration_around"),)),
)
WORDS = {
    "restitution": "restitution", "wall_friction": "wall friction",
    "tangential_restitution": "tangential restitution", "spin_kept": "spin kept",
}  # fmt: skip
# Two quantities together.
PRODUCTS = (
    ("approach speed and slip", (Factor("approach"), Factor("slip", "absolute_power"))),
    ("approach speed and spin", (Factor("approach"), Factor("spin", "absolute_power"))),
    ("approach speed and the sense of slip", (Factor("approach"), Factor("slip", "sign"))),
    ("approach speed and the sense of spin", (Factor("approach"), Factor("spin", "sign"))),
    ("the slip against the spin", (Factor("slip", "sign"), Factor("spin"))),
    ("the slip and the spin", (Factor("slip"), Factor("spin"))),
    ("whether slip and spin have one sense", (Factor("slip", "sign"), Factor("spin", "sign"))),
    ("approach speed and the wall's own speed", (Factor("approach"), Factor("wall_speed"))),
    ("slip and the wall's own speed", (Factor("slip", "absolute_power"), Factor("wall_speed"))),
    ("approach speed and time", (Factor("approach"), Factor("time"))),
    ("approach speed and run", (Factor("approach"), Factor("run"))),
    ("slip over approach speed", (Factor("slip", "absolute_power"), Factor("approach", "absolute_power", -1.0))),
    ("spin over approach speed", (Factor("spin", "absolute_power"), Factor("approach", "absolute_power", -1.0))),
    ("whether it slips as the contact before did", (Factor("slip", "sign"), Factor("last_slip", "sign"))),
    (
        "the Host's acceleration about its centre against the slip",
        (Factor("slip", "sign"), Factor("host_acceleration_around")),
    ),
    ("the slip of the contact before, against its own", (Factor("slip", "sign"), Factor("last_slip"))),
)
# Quantiles of a quantity at which a scale starts.
SCALES = (0.1, 0.3, 0.6)
TURNING_ORDERS = (1.0, 2.0)
INVERSE_APPROACH = (Factor("approach", "absolute_power", -1.0),)
# Quantiles of the time in the run at which something changes at once.
CHANGES = (0.2, 0.4, 0.6, 0.8)
# Quantiles of a speed or a spin at which something changes at once.
STEPS = (0.05, 0.15, 0.3, 0.5, 0.7, 0.85)
# Order of a form that falls ever more slowly, as creep does in time and the strength of contacts in the rate of slip:
# 1 / (1 + |x|^order) of a half leaves a hundredth (RMS) of log(1 + |x|) over two decades.
SLOWLY = 0.5
# A wall faces another way than from the Host's centre where the two differ by more (rad): not by a lens residual.
ANOTHER_WAY_RAD = 0.2
# Angles of incidence (rad) at which something changes at once.
GLANCES = (0.2, 0.45, 0.8)


def law_candidates(known: Array) -> list[Candidate]:
    """Candidates for every number of the contact law, from what is known at the impacts (K, KNOWN_SIZE)."""
    out = []
    for target in LAWS:
        if target == "spin_kept":
            out.append(plain(f"{WORDS[target]}: constant", Term("spin_kept", 1.0)))
        out += [plain(f"{WORDS[target]} with {name}", Term(target, 1.0, (factor,))) for name, factor in _plain()]
        out += [plain(f"{WORDS[target]} with {name}", Term(target, 1.0, factors)) for name, factors in PRODUCTS]
        for quantity in ("azimuth", "body_angle", "phase"):
            for factor, name in (
                (Factor("approach"), "the approach speed"),
                (Factor("slip", "sign"), "the sense of slip"),
            ):
                terms = (Term(target, 1.0, (factor, wave)) for wave in waves(quantity))
                out.append(plain(f"{WORDS[target]} with {name} and the {quantity}", *terms))
        out += _by_the_normal(target, known)
        out += [in_step(WORDS[target], target, *orders) for orders in IN_STEP]
        out.append(meshing(WORDS[target], target))
        for quantity in ("host_acceleration_along", "host_velocity_along"):
            terms = (Term(target, 1.0, (way,)) for way in ways(quantity))
            out.append(plain(f"{WORDS[target]} with {quantity.replace('_', ' ')}", *terms))
        out += around_everything(WORDS[target], target, target in ("restitution", "wall_friction"))
        if target in ("restitution", "wall_friction"):
            out += creeping(WORDS[target], target, known)
            out += swaying(WORDS[target], target, known)
        out += _scaled(target, known)
        out += [*leaning(WORDS[target], target, known), *turning(WORDS[target], target, known)]
        out += left_fast(WORDS[target], target, known)
        if target != "spin_kept":
            carrier = Carrier(WORDS[target], (Term(target, 1.0),))
            out += [
                candidate
                for quantity in ("azimuth", "body_angle")
                for one in of_impacts_uneven(known, quantity)
                for candidate in carrier.times(uneven(one, quantity))
            ]
    for target in ("restitution", "wall_friction"):
        out += ringing(WORDS[target], target, known)
    out += swinging("restitution of a wall that swings", "restitution", ("swing_rate",), known, INVERSE_APPROACH)
    out += swinging("restitution of a wall that breathes", "restitution", BREATHING, known)
    out += [plain(f"spin added {name}", Term("spin_added", 1.0, factors)) for name, factors in ADDED]
    out += _resisted(known)
    for order in SIDE_ORDERS:
        sides = (Term("spin_added", 1.0, (Factor("approach"), wave)) for wave in waves("body_angle", order))
        out.append(plain(f"spin added with the approach speed and the side of the disk, order {order:g}", *sides))
    for order in TURNING_ORDERS:  # a wall that turns in its seat, or on a side of it only
        sides = (Term("spin_added", 1.0, (wave,)) for wave in waves("azimuth", order))
        out.append(plain(f"spin added around the wall, order {order:g}", *sides))
    return out + normal_candidates(known)


def _by_the_normal(target: str, known: Array) -> list[Candidate]:
    """By the direction in which the wall faces, with and without the sense of slip, where that is another than the
    direction from the Host's centre: at flat walls and a cylinder."""
    off = known[:, W.NORMAL] - np.arctan2(known[:, W.HY], known[:, W.HX])
    if not np.any(np.abs(np.angle(np.exp(1j * off))) > ANOTHER_WAY_RAD):
        return []
    out = []
    for order in (1.0, 2.0):
        terms = tuple(Term(target, 1.0, (wave,)) for wave in waves("normal_direction", order))
        out.append(plain(f"{WORDS[target]} with the way the wall faces, order {order:g}", *terms))
    terms = tuple(Term(target, 1.0, (Factor("slip", "sign"), wave)) for wave in waves("normal_direction"))
    out.append(plain(f"{WORDS[target]} with the sense of slip and the way the wall faces", *terms))
    return out


def _resisted(known: Array) -> list[Candidate]:
    """A blow that resists the spin, and stops a slow one."""
    values = np.abs(known[:, W.SPIN_LEFT])
    sizes = sorted({float(s) for s in np.quantile(values, SCALES)}) if len(values) else []
    name = "spin added with the approach speed and the spin left, bent"
    return scaled(name, "spin_added", ("spin_left", "tanh", 1.0), sizes, (Factor("approach"),))


def _plain() -> list[tuple[str, Factor]]:
    return [
        ("the approach speed", Factor("approach")),
        ("the approach speed's square", Factor("approach", "power", 2.0)),
        ("the approach speed to the power -1/4", Factor("approach", "absolute_power", -0.25)),
        ("the approach speed to the power 1/5", Factor("approach", "absolute_power", 0.2)),
        ("the inverse approach speed", Factor("approach", "absolute_power", -1.0)),
        ("the inverse square of the approach speed", Factor("approach", "absolute_power", -2.0)),
        ("the slip", Factor("slip", "absolute_power")),
        ("the slip's square", Factor("slip", "power", 2.0)),
        ("the sense of slip", Factor("slip", "sign")),
        ("the signed slip", Factor("slip")),
        ("the angle of incidence", Factor("incidence")),
        ("the angle of incidence, squared", Factor("incidence", "power", 2.0)),
        ("how glancing it is", Factor("incidence", "cosine", 2.0)),
        ("the centre's speed along the wall", Factor("passing", "absolute_power")),
        ("the square of the centre's speed along the wall", Factor("passing", "power", 2.0)),
        ("the centre's signed speed along the wall", Factor("passing")),
        ("the sense of the centre's way along the wall", Factor("passing", "sign")),
        ("the speed against the Host", Factor("sliding_speed")),
        ("the square of the speed against the Host", Factor("sliding_speed", "power", 2.0)),
        ("the wall's own speed", Factor("wall_speed")),
        ("the size of the wall's own speed", Factor("wall_speed", "absolute_power")),
        ("the square of the wall's own speed", Factor("wall_speed", "power", 2.0)),
        ("the sense of the wall's own speed", Factor("wall_speed", "sign")),
        ("the spin", Factor("spin", "absolute_power")),
        ("the spin's square", Factor("spin", "power", 2.0)),
        ("the sense of spin", Factor("spin", "sign")),
        ("the signed spin", Factor("spin")),
        ("the time in the run", Factor("time")),
        ("the run", Factor("run")),
        ("the speed in the room", Factor("speed")),
        ("the square of the speed in the room", Factor("speed", "power", 2.0)),
        ("the size of the Host's acceleration", Factor("host_acceleration")),
        ("the wall's own acceleration", Factor("wall_acceleration")),
        ("the wall's own acceleration alone", Factor("wall_acceleration", "above", 1.0, 0.0)),
        ("the sense of the wall's own acceleration", Factor("wall_acceleration", "sign")),
        ("the Host's acceleration about its centre", Factor("host_acceleration_around")),
        ("the size of the Host's acceleration about its centre", Factor("host_acceleration_around", "absolute_power")),
        ("the size of the wall's own acceleration", Factor("wall_acceleration", "absolute_power")),
        ("the way from the contact before", Factor("from_contact")),
        ("the approach speed of the contact before", Factor("last_approach")),
        ("the slip of the contact before", Factor("last_slip", "absolute_power")),
        ("the signed slip of the contact before", Factor("last_slip")),
        ("the number of blows before", Factor("blows")),
        ("the surface", Factor("at_cylinder")),
    ]


def _scaled(target: str, known: Array) -> list[Candidate]:
    """What fades, bends or saturates at a scale of its own."""
    word, out = WORDS[target], worn(WORDS[target], target, known)
    out += struck_here(word, target, known)
    out += scaled(f"{word} that the blows wear off", target, ("blows", "exponential", 1.0), WEARS)
    out += after_the_way(word, target, known)
    for name, column, shape, at in (
        ("the time since the impact before", W.SINCE, ("since", "exponential", 1.0), SCALES),
        ("the approach speed, ending", W.APPROACH, ("approach", "exponential", 1.0), SCALES),
        ("the approach speed, fading", W.APPROACH, ("approach", "rational", 2.0), SCALES),
        ("the approach speed beyond one", W.APPROACH, ("approach", "above", 1.0), SCALES[1:]),
        ("the approach speed, at once", W.APPROACH, ("approach", "beyond", 1.0), STEPS),
        ("the number of blows before, at once", W.BLOWS, ("blows", "below", 1.0), CHANGES),
        ("the slip, at once", W.SLIP, ("slip", "within", 1.0), STEPS),
        ("the spin, at once", W.SPIN, ("spin", "within", 1.0), STEPS),
        (
            "the approach speed of the contact before, up to an end",
            W.LAST_APPROACH,
            ("last_approach", "rational", 2.0),
            SCALES,
        ),
        ("the slip of the contact before, ending", W.LAST_SLIP, ("last_slip", "decay", 1.0), SCALES[1:]),
        ("the slip, ending", W.SLIP, ("slip", "decay", 1.0), SCALES[1:]),
        ("the slip, bent", W.SLIP, ("slip", "tanh", 1.0), SCALES[1:]),
        ("the slip, fading", W.SLIP, ("slip", "rational", 1.0), SCALES[1:]),
        ("the slip, ever more slowly", W.SLIP, ("slip", "rational", SLOWLY), SCALES[1:]),
        ("the spin, ending", W.SPIN, ("spin", "decay", 1.0), SCALES[1:]),
        ("the time in the run, settling", W.TIME, ("time", "exponential", 1.0), SCALES),
        ("the time in the run, ever more slowly", W.TIME, ("time", "rational", SLOWLY), SCALES),
        ("the time in the run, at once", W.TIME, ("time", "below", 1.0), CHANGES),
    ):
        values = np.abs(known[:, column])
        seen = values[values < 0.5 * W.LONG_AGO_S]
        sizes = sorted({float(s) for s in np.quantile(seen, at)}) if len(seen) else []
        out += scaled(f"{word} with {name}", target, shape, sizes)
        if column == W.SINCE:  # as hard as that impact was
            out += scaled(f"{word} with {name} and its speed", target, shape, sizes, (Factor("last_approach"),))
    out += [*settling_by_run(word, target, known), *law_between(word, target, known)]
    return out + scaled(f"{word} with the angle of incidence, at once", target, ("incidence", "within", 1.0), GLANCES)
