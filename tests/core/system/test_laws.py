"""Written laws in the simulator: listed effects written as formulas, turned worlds, files, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ovines.camera.boards import BOARDS
from ovines.core import (
    FloorFriction,
    Harmonic,
    Host,
    ImpactLaw,
    Nes,
    Scenario,
    ScenarioError,
    simulate,
    simulate_ensemble,
)
from ovines.core.laws import kernel, quantities, targets
from ovines.core.laws import words as W
from ovines.core.laws.formula import as_latex, as_text, legend
from ovines.core.laws.targets import TARGETS
from ovines.core.laws.terms import Factor, Term, WrittenLaw, rows_of
from ovines.core.laws.words import FUNCTIONS, QUANTITIES
from ovines.core.system import parameters as P
from ovines.errors import InputError
from ovines.law_file import law_text, read_law

RIG = Scenario(
    "rig", Nes(0.01, 0.0246), Host(radius_m=0.05, motion="driven", drive=(Harmonic("x", 0.0164, 11.0, 0.3),)),
    ImpactLaw(0.72, 0.13, 0.49), 0.15, FloorFriction(0.2), (0.03, -0.01, 0.1, 0.0, 0.0, 20.0),
)  # fmt: skip
TARGET_CODES = (
    "FIXED OUTWARDS SWIRL ALONG_V ACROSS_V MIRRORED_V ALONG_U ACROSS_U MIRRORED_R FROM_ROOM FROM_HOST "
    "FRICTION MIRRORED_FRICTION ALONG_BODY SPIN FROM_CONTACT ALONG_W ALONG_A POLAR_FRICTION FLOOR_LEVER FLOOR_TORQUE "
    "ALONG_AIRSPEED"
)
QUANTITY_CODES = (
    "SPEED SLIDING RADIUS GAP SPIN TIME PHASE SINCE AZIMUTH RUN ROOM HOST ALONG VELOCITY APPROACH SLIP BODY CLOCK "
    "SHARE ANGLE WALL_SPEED PASSING INCIDENCE SLIDING_ALONG RADIAL CIRCLING HOST_SPEED HOST_ACCELERATION "
    "FROM_CONTACT CONTACT_TURN LAST_APPROACH SPIN_LEFT SLIDING_DIRECTION ACCELERATION_ALONG ACCELERATION_OUTWARDS "
    "FLOOR_ALONG SINCE_BY_BLOW HEADING SLIDING_HEADING TURNING RIM_TURN LAST_SLIP BLOWS "
    "NUMBER_OF_BLOWS SWING SWING_RATE OVALLING PLACE_ALONG_SLIDING AT_CYLINDER AIRSPEED HOST_PLACE ALONG_ROOM "
    "ACCELERATION_AROUND BREATHING BREATHING_RATE BLOWS_HERE RIM_BLOWS_HERE LAST_SPUN STRUCK_RIM "
    "TURNED_SINCE LAST_LEFT OVALLING_RATE TWIST TWIST_RATE RECENT_RUBBING TURNED NES_PLACE "
    "SLIDING_FROM_BLOW OFF_PATH WAY_SINCE WAY TRAIL_ALONG TRAIL_ACROSS WAY_LATELY RIM_ANGLE "
    "LAST_AZIMUTH WALL_ACCELERATION NORMAL"
)
#: an effect of the library, and the same as a formula
AS_FORMULA = [
    ("table_tilt", {"tilt_rad": 0.03, "direction_rad": 0.4}, Term("fixed_direction", 0.03 * 9.81, x=0.4)),
    ("viscous_drag", {"rate_per_s": 0.6}, Term("along_velocity", -0.6, (Factor("speed"),))),
    ("air_drag", {"rate_per_m": 0.45}, Term("along_velocity", -0.45, (Factor("speed", "power", 2.0),))),
    ("friction_drift", {"relative_per_s": -0.8}, Term("floor_friction", -0.8, (Factor("time"),))),
    (
        "nes_rocking", {"relative": -0.5, "decay_s": 0.02},
        Term("floor_friction", -0.5, (Factor("since", "exponential", 1.0, 0.02),)),
    ),
    (
        "direction_dependent_restitution", {"amplitude": 0.1, "direction_rad": 0.5},
        Term("restitution", 0.1, (Factor("azimuth", "cosine", x=0.5),)),
    ),
    (
        "wall_lobes", {"amplitude": 2e-3, "order": 3.0, "direction_rad": 0.2},
        Term("contact_radius", 2e-3 * 0.04, (Factor("azimuth", "cosine", 3.0, x=0.2),)),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("effect", "sizes", "term"), AS_FORMULA, ids=[one[0] for one in AS_FORMULA])
def test_a_listed_effect_written_as_a_formula_moves_the_disk_alike(effect, sizes, term):
    """Integrated by other steps: paths agree to what impacts make of 1e-11."""
    plain = simulate(RIG).motion["nes_x_m"]
    listed = simulate(replace(RIG, effects={effect: sizes})).motion["nes_x_m"]
    written = simulate(replace(RIG, laws=(WrittenLaw((term,)),))).motion["nes_x_m"]
    assert np.abs(listed - plain).max() > 1e-5
    np.testing.assert_allclose(written, listed, rtol=0, atol=1e-7)


PLAIN_LAWS = (
    WrittenLaw(
        (
            Term("fixed_direction", 0.3, (Factor("phase", "cosine"),), x=0.2),
            Term("mirrored_velocity", -0.4, (Factor("speed"),), x=0.5),
            Term("from_place_in_room", -60.0, (Factor("distance_in_room", x=0.01, y=0.005),), 0.01, 0.005),
            Term("fixed_direction", 200.0, (Factor("along_host", x=0.002, y=0.3),), x=0.3),
            Term("mirrored_floor_friction", 0.2, x=0.9),
            Term("swirl", -3.0, (Factor("radius"),)),
            Term("fixed_direction", -0.3, (Factor("velocity_along", x=1.1),), x=1.1),
            Term("along_airspeed", -0.2, (Factor("airspeed", "power", 2.0, x=1.1, y=-0.8),), 1.1, -0.8),
        )
    ),
    WrittenLaw((Term("floor_friction", 15.0, (Factor("along_room", x=0.003, y=0.7),)),)),
    WrittenLaw(
        (
            Term("restitution", -0.2, (Factor("azimuth", "gaussian", 1.0, 0.5, 0.3),)),
            Term("restitution", -0.2, (Factor("approach", "rising", 1.0, 0.4),)),
            Term("restitution", 0.1, (Factor("approach", "beyond", 1.0, 0.2),)),
        )
    ),
)
# What bends, ends or knows the disk's angle; numbers of the impact that no other law asks for.
BENT_LAWS = (
    WrittenLaw(
        (
            Term("from_place_in_room", -60.0, (Factor("distance_in_room", "above", 1.0, 0.01, 0.01, 0.0),), 0.01, 0.0),
            Term("along_body", 0.8, (Factor("spin", "decay", 1.0, 30.0),), x=0.4),
            Term("fixed_direction", 0.5, (Factor("along_host", "tanh", 1.0, 0.01, 0.002, 0.3),), x=0.3),
            Term("spin", 200.0, (Factor("angle", "cosine", 2.0, x=0.3),)),
            Term("outwards", -0.6, (Factor("azimuth", "within", 1.0, 1.2, 0.5),)),
            Term("floor_friction", -0.4, (Factor("speed", "rational", 2.0, 0.2, 0.05),)),
            Term("polar_floor_friction", 0.3, (Factor("spin", "decay", 1.0, 30.0),)),
            Term("floor_lever", 9.0, (Factor("heading", "cosine", x=0.4), Factor("sliding_heading", "cosine", x=0.2))),
        )
    ),
    WrittenLaw(
        (
            Term("restitution", -0.1, (Factor("incidence", "cosine", 2.0),)),
            Term("restitution", 0.2, (Factor("wall_speed"),)),
            Term("wall_friction", 0.5, (Factor("passing", "absolute_power"),)),
        )
    ),
)
# What goes with the ring's motion, or remembers the contact before; numbers of the impact that add a spin.
RING_LAWS = (
    WrittenLaw(
        (
            Term("outwards", -8.0, (Factor("radial_speed"), Factor("gap", "exponential", 1.0, 0.01))),
            Term("swirl", -0.5, (Factor("circling_speed"),)),
            Term("along_host_velocity", 0.3, (Factor("host_speed"),)),
            Term("along_host_acceleration", 0.01, (Factor("host_acceleration"),)),
            Term("from_last_contact", -20.0, (Factor("from_contact", "below", 1.0, 0.02),)),
            Term("floor_friction", 0.3, (Factor("last_approach"),)),
            Term("floor_friction", 0.4, (Factor("sliding_along", x=0.6),)),
            Term("floor_friction", -0.3, (Factor("sliding_direction", "cosine", 2.0, x=0.4),)),
        )
    ),
    WrittenLaw(
        (
            Term("floor_friction", 0.1, (Factor("radius"), Factor("host_acceleration_outwards"))),
            Term("floor_friction", 0.004, (Factor("host_acceleration_along", x=1.2),)),
            Term("floor_friction", 0.2, (Factor("host_velocity_along", x=-0.7),)),
            Term("floor_torque", -0.5),
            Term("outwards", 0.3, (Factor("turning_azimuth", "cosine", 2.0, x=0.3, y=20.0),)),
            Term("floor_friction", -0.4, (Factor("since_by_blow", "exponential", 1.0, 0.03),)),
            Term("across_sliding", 9.0, (Factor("place_along_sliding", x=0.02, y=0.01),)),
        )
    ),
    WrittenLaw(
        (
            Term("restitution", -0.1, (Factor("contact_turn", "cosine"),)),
            Term("restitution", 0.001, (Factor("wall_acceleration"),)),
            Term("restitution", 0.1, (Factor("azimuth", "sawtooth", x=0.4),)),
            Term("spin_added", -3.0, (Factor("approach"), Factor("spin_left", "sign"))),
            Term("restitution", 0.1, (Factor("rim_turn", "cosine"),)),
            Term("tangential_restitution", 0.2, (Factor("last_slip", "sign"),)),
            Term("restitution", -0.02, (Factor("recent_blows", y=0.05),)),
            Term("restitution", 0.05, (Factor("swing_rate", x=150.0, y=0.05),)),
        )
    ),
)


@pytest.mark.others_further
@pytest.mark.parametrize("laws", [PLAIN_LAWS, BENT_LAWS, RING_LAWS], ids=["plain", "bent", "ring"])
def test_every_law_turns_with_the_world(laws):
    """Start, drive and law turned by one angle give the turned path, and each term of the laws moves the disk."""
    turn = 0.7
    c, s = math.cos(turn), math.sin(turn)
    matrix = np.array([[c, -s], [s, c]])
    x = simulate(replace(RIG, laws=laws, duration_s=0.1))
    for law in laws:
        for term in law.terms:
            fewer = WrittenLaw(tuple(one for one in law.terms if one is not term)) if len(law.terms) > 1 else None
            others = tuple(one for one in (*(o for o in laws if o is not law), fewer) if one is not None)
            moved = simulate(replace(RIG, laws=others, duration_s=0.1)).motion["nes_x_m"] - x.motion["nes_x_m"]
            assert np.abs(moved).max() > 1e-6, as_text(WrittenLaw((term,)))
    start = np.array(RIG.initial_nes)
    turned = replace(
        RIG,
        duration_s=0.1,
        laws=tuple(law.moved(turn) for law in laws),
        host=replace(RIG.host, drive=(Harmonic("x", 0.0164 * c, 11.0, 0.3), Harmonic("y", 0.0164 * s, 11.0, 0.3))),
        initial_nes=(*(matrix @ start[:2]), *(matrix @ start[2:4]), turn, 20.0),
    )
    y = simulate(turned)
    path = np.column_stack([x.motion["nes_x_m"], x.motion["nes_y_m"]]) @ matrix.T
    np.testing.assert_allclose(np.column_stack([y.motion["nes_x_m"], y.motion["nes_y_m"]]), path, rtol=0, atol=1e-8)


@pytest.mark.parametrize("target", ["along_sliding", "across_sliding", "mirrored_velocity", "along_velocity"])
def test_what_acts_along_the_velocity_ends_with_it(target):
    """A direction that a disk at rest turns, or that turns ever faster as it stops, had no end: the next test of a law
    was simulated for a quarter of an hour and more."""
    speed, size, friction = 0.3, -0.5, 0.2
    law = WrittenLaw((Term(target, size),))
    still = replace(
        RIG, host=Host(radius_m=0.05), nes=Nes(0.01, 0.0246), friction=FloorFriction(friction, "coulomb"), laws=(law,),
        initial_nes=(-0.02, 0.0, speed, 0.0, 0.0, 0.0), duration_s=0.4,
    )  # fmt: skip
    moved = simulate(still).motion
    assert abs(moved["nes_vx_m_per_s"][-1]) < 1e-3 and abs(moved["nes_vy_m_per_s"][-1]) < 1e-3
    way = np.hypot(moved["nes_x_m"][-1] + 0.02, moved["nes_y_m"][-1])
    if target.startswith("along"):
        assert way == pytest.approx(speed**2 / (2 * (friction * 9.81 - size)), rel=2e-3)
    # Where the disk is faster than 2 cm/s, the direction is of length 1.
    row, known, out = rows_of([Term(target, 1.0)])[0], np.zeros(W.KNOWN_SIZE), np.zeros(3)
    known[[W.VX, W.UX]] = 0.021
    kernel.push(row, 1.0, known, out)
    assert math.hypot(*out) == 1.0


def test_a_disk_that_goes_along_a_flat_wall_comes_to_rest_there():
    """After a blow without rebound it neither presses on the wall nor leaves it: steps to the next contact had shrunk
    to nothing, and the run went on without an end."""
    corners = ((0.1015, 0.1928), (-0.1928, 0.1015), (-0.1015, -0.1928), (0.1928, -0.1015))
    law = WrittenLaw((Term("restitution", -0.05, (Factor("approach", "absolute_power", -2.0),)),))
    run = Scenario(
        "along", Nes(0.03, 1.0), Host(polygon_m=corners), ImpactLaw(0.69, 0.134, 0.555), 0.6, FloorFriction(0.28),
        (0.0, 0.0, 0.171, 1.993, 1.11, 0.0), laws=(law,),
    )  # fmt: skip
    result = simulate(run)
    assert result.end_s == 0.6 and np.hypot(result.motion["nes_vx_m_per_s"], result.motion["nes_vy_m_per_s"])[-1] < 1e-9
    assert result.impacts["normal_speed_after_m_per_s"][1] == pytest.approx(0.0, abs=1e-12)
    out = [np.hypot(*((np.array(a) + b) / 2)) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    place = np.array([result.motion["nes_x_m"][-1], result.motion["nes_y_m"][-1]])
    gaps = [
        reach - 0.03 - place @ ((np.array(a) + b) / 2 / reach)
        for reach, a, b in zip(out, corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    assert min(gaps) > -1e-9


def test_a_run_whose_steps_come_to_nothing_is_refused():
    """A brake that knows no rest turns the spin's sign at every step that it takes: the run had no end."""
    brake = WrittenLaw((Term("spin", -1000.0, (Factor("spin", "sign"),)),))
    braked = replace(RIG, laws=(brake,), initial_nes=(0.0, 0.0, 0.0, 0.0, 0.0, 20.0), duration_s=0.3)
    assert simulate(replace(braked, duration_s=0.01)).end_s == 0.01  # it brakes still
    with pytest.raises(ScenarioError, match=r"come to nothing at 0.0(19|2)"):
        simulate(braked)
    with pytest.raises(ScenarioError, match="come to nothing"):
        simulate_ensemble(braked, 2, {}, np.random.default_rng(0))


def test_air_that_moves_past_takes_the_disk_along():
    """On a floor without friction its speed against the air falls as 1 / (1 + c u t), along a straight line of the
    air's frame; where the world's origin lies is nothing to a wind."""
    wind, rate = np.array([1.5, 0.9]), 0.8
    term = Term("along_airspeed", -rate, (Factor("airspeed", "power", 2.0, x=wind[0], y=wind[1]),), *wind)
    law = WrittenLaw((term,))
    start = np.array([0.1, -0.3])
    free = replace(
        RIG, laws=(law,), friction=None, host=Host(radius_m=5.0), initial_nes=(0.0, 0.0, *start, 0.0, 20.0),
    )  # fmt: skip
    end = simulate(free).final_state[2:4]
    u = start - wind
    np.testing.assert_allclose(end, wind + u / (1 + rate * np.hypot(*u) * free.duration_s), rtol=1e-9)
    (moved,) = law.moved(0.5 * math.pi, (3.0, 7.0)).terms
    for one in (moved, moved.factors[0]):
        assert (one.x, one.y) == pytest.approx((-0.9, 1.5))
    assert as_text(law) == ("acceleration += -0.8 1/m * airspeed^2 * along_airspeed(wind 1.749 m/s to 0.54 rad)")
    assert ("v_a", "speed in the room against air that moves there, wind 1.749 m/s to 0.54 rad") in legend(law)


def test_what_rises_and_what_sets_in():
    """1 - exp(-|q| / s) to both sides of nothing; 1 from s on, 0 before: with what holds below, always 1."""
    known = np.zeros(W.KNOWN_SIZE)
    rising = Term("spin", 1.0, (Factor("spin", "rising", 1.0, 3.0),))
    sides = [Term("spin", 1.0, (Factor("spin", name, 1.0, 3.0),)) for name in ("below", "beyond")]
    for spin in (-6.0, 0.0, 2.9, 3.0, 6.0):
        known[W.SPIN] = spin
        assert kernel.size(np.array(rising.row()), known) == pytest.approx(1 - math.exp(-abs(spin) / 3.0))
        assert [kernel.size(np.array(one.row()), known) for one in sides] == [spin < 3.0, spin >= 3.0]
    assert as_text(WrittenLaw((rising,))) == "spin' += 1 1/s^2 * (1 - exp(-|spin| / 3 rad/s))"
    assert as_text(WrittenLaw(sides[1:])) == "spin' += 1 1/s^2 * [spin >= 3 rad/s]"


def test_a_law_after_a_blow_says_so_in_words():
    """Any speed after it is beyond 0; a threshold that is none reads as what it means."""
    seen, fast = (Factor("last_left", "beyond", 1.0, speed) for speed in (0.0, 0.5))
    law = WrittenLaw((Term("floor_friction", 0.3, (seen,)), Term("floor_friction", 0.2, (fast,))))
    assert "* [after a blow that was seen]" in as_text(law) and "[last_left >= 0.5 m/s]" in as_text(law)
    assert r"[\mathrm{after\ a\ blow\ that\ was\ seen}]" in as_latex(law)


@pytest.mark.further
@pytest.mark.parametrize(
    ("term", "rounded_rad"),
    [
        (Term("contact_radius", 3e-4, (Factor("azimuth", "gaussian", 1.0, 0.4, 0.9),)), 0.0),
        (Term("contact_radius", -4e-4, (Factor("azimuth", "sawtooth", x=-2.0),)), 0.15),
        (Term("contact_radius", 3e-4, (Factor("azimuth", "within", 1.0, 0.7, 0.5),)), 0.15),
        (Term("contact_radius", 2e-4, (Factor("azimuth", "cosine", 1.0, x=0.3),)), 0.0),
    ],
    ids=["dent", "step", "arc", "shifted"],
)
def test_a_wall_of_any_shape_is_met_where_its_law_says(term, rounded_rad):
    """At every impact the disk's centre is as far out as the round wall's and the law together; sudden edges are
    rounded over a few degrees."""
    rig = replace(RIG, laws=(WrittenLaw((term,)),), duration_s=0.8, sample_rate_hz=0.0)
    found = simulate(rig)
    row, known, off, near = np.array(term.row()), np.zeros(W.KNOWN_SIZE), [], []
    edges = np.array([f.x + s for f in term.factors for s in ({"within": (0.7, -0.7)}.get(f.function, (0.0,)))])
    steps = simulate(replace(rig, sample_rate_hz=2e5))
    x = np.column_stack([steps.motion[f"nes_{a}_m"] - steps.motion[f"host_{a}_m"] for a in "xy"])
    for impact in found.impacts:
        at = np.searchsorted(steps.time_s, impact.time_s)
        place = max((x[k] for k in (at - 1, at) if k < len(x)), key=lambda one: np.hypot(*one))
        known[W.HX], known[W.HY] = place
        off.append(np.hypot(*place) - 0.04 - kernel.size(row, known))
        away = np.arctan2(place[1], place[0]) - edges
        near.append(np.abs(np.arctan2(np.sin(away), np.cos(away))).min())
    off, near = np.array(off), np.array(near)
    clear = near > rounded_rad
    assert clear.sum() > 15
    assert np.abs(off[clear]).max() < 0.06 * abs(term.coefficient)


def test_what_remembers_the_contact_before():
    """A run cut at an impact and begun anew from there goes on as it did, if it is given the impact; and nothing is
    remembered before the first one."""
    pull = WrittenLaw((Term("from_last_contact", -6.0, (Factor("from_contact", "below", 1.0, 0.03),)),))
    harder = WrittenLaw((Term("floor_friction", 0.5, (Factor("last_approach"),)),))
    both = simulate(replace(RIG, laws=(pull, harder), sample_rate_hz=4000.0))
    first_s = both.impacts.time_s[0]
    plain = simulate(replace(RIG, sample_rate_hz=4000.0))
    before, after = both.time_s < first_s, (both.time_s > first_s + 0.004) & (both.time_s < first_s + 0.01)
    np.testing.assert_allclose(both.motion["nes_x_m"][before], plain.motion["nes_x_m"][before], rtol=0, atol=1e-9)
    assert np.abs(both.motion["nes_x_m"] - plain.motion["nes_x_m"])[after].max() > 1e-5

    impact = both.impacts[0]
    start = simulate(replace(RIG, laws=(pull, harder), max_impacts=1)).final_state[:6]
    turned = tuple(
        replace(one, phase_rad=one.phase_rad + 2 * math.pi * one.frequency_hz * impact.time_s) for one in RIG.host.drive
    )
    begun = replace(
        RIG, laws=(pull, harder), host=replace(RIG.host, drive=turned), initial_nes=tuple(start), duration_s=0.01,
        begins_with_m_per_s=float(impact.normal_speed_before_m_per_s), sample_rate_hz=4000.0,
    )  # fmt: skip
    again, forgot = simulate(begun), simulate(replace(begun, begins_with_m_per_s=None))
    x = np.interp(again.time_s + impact.time_s, both.time_s, both.motion["nes_x_m"])
    assert np.abs(again.motion["nes_x_m"] - x)[1:].max() < 2e-6  # the first lies in the kink
    assert np.abs(forgot.motion["nes_x_m"] - x).max() > 1e-5


def test_what_asks_for_a_contact_that_nobody_saw_is_nil():
    """However long ago an impact was: between flights that do not join, its place is not known."""
    known = np.full(W.KNOWN_SIZE, 0.02)
    known[W.ANGLE] = 0.05
    terms = [Term("restitution", 1.0, (Factor(name),)) for name in W.OF_LAST_CONTACT]
    pull = np.array(Term("from_last_contact", 1.0).row())
    known[W.WAY], known[W.BEFORE_X] = 0.05, -0.01
    for place, nil in ((0.03, False), (0.0, True)):
        known[W.LAST_X] = known[W.LAST_Y] = place
        known[W.HY] = 0.01
        assert [kernel.size(np.array(one.row()), known) == 0.0 for one in terms] == [nil] * len(terms)
        out = np.zeros(3)
        kernel.push(pull, 1.0, known, out)
        assert (not out.any()) == nil


def test_recent_blows_are_added_up_as_they_fade():
    """Over a run: the sum of the squared approaches before each impact, held against the table of impacts."""
    fades_s, size = 0.04, -0.03
    law = WrittenLaw((Term("restitution", size, (Factor("recent_blows", y=fades_s),)),))
    rig = replace(RIG, laws=(law,), duration_s=1.5)
    impacts = simulate(rig).impacts
    assert len(impacts) > W.MOST_BLOWS + 2
    time_s, approach = impacts["time_s"], impacts["normal_speed_before_m_per_s"]
    for k in range(len(impacts)):
        last = slice(max(k - W.MOST_BLOWS, 0), k)
        blows = np.sum(approach[last] ** 2 * np.exp(-(time_s[k] - time_s[last]) / fades_s))
        expected = rig.impact.restitution + size * blows
        assert -impacts["normal_speed_after_m_per_s"][k] / approach[k] == pytest.approx(expected, abs=1e-6)
    with pytest.raises(ScenarioError):
        Factor("recent_blows")


@pytest.mark.others_further
@pytest.mark.parametrize(
    "quantity",
    [
        *("swing", "swing_rate", "ovalling", "ovalling_rate", "breathing", "breathing_rate", "twist", "twist_rate"),
        *("recent_rubbing", "blows", "at_cylinder"),
    ],
)
def test_what_blows_set_swinging_and_how_many_there_were(quantity):
    """Over a run with a cylinder, which the disk pushes the other way, held against the table of impacts."""
    rate, fades_s, size = 150.0, 0.05, 0.02
    swings = quantity not in ("recent_rubbing", "blows", "at_cylinder")
    own = {"x": rate, "y": fades_s} if swings else {"y": fades_s} if quantity == "recent_rubbing" else {}
    law = WrittenLaw((Term("restitution", size / (10 if quantity == "blows" else 1), (Factor(quantity, **own),)),))
    rig = replace(RIG, laws=(law,), duration_s=2.5, host=replace(RIG.host, obstacle_radius_m=0.012))
    impacts = simulate(rig).impacts
    time_s, approach = impacts["time_s"], impacts["normal_speed_before_m_per_s"]
    slip = impacts["tangential_speed_before_m_per_s"]
    inwards = impacts["wall"] == P.OBSTACLE
    assert len(impacts) > W.MOST_BLOWS + 2 and 0 < np.count_nonzero(inwards) < len(impacts)
    place = impacts["azimuth_rad"]
    way = place + np.where(inwards, math.pi, 0.0)
    for k in range(len(impacts)):
        last = slice(max(k - W.MOST_BLOWS, 0), k)
        since, across = time_s[k] - time_s[last], place[k] - way[last]
        faded = approach[last] * np.exp(-since / fades_s)
        value = {
            "swing": np.sum(faded * np.sin(rate * since) * np.cos(across)),
            "swing_rate": np.sum(faded * np.cos(rate * since) * np.cos(across)),
            "ovalling": np.sum(faded * np.sin(rate * since) * np.cos(2 * across)),
            "ovalling_rate": np.sum(faded * np.cos(rate * since) * np.cos(2 * across)),
            "twist": np.sum(slip[last] * np.exp(-since / fades_s) * np.sin(rate * since)),
            "twist_rate": np.sum(slip[last] * np.exp(-since / fades_s) * np.cos(rate * since)),
            "recent_rubbing": np.sum(faded * np.abs(slip[last])),
            "breathing": np.sum(faded * np.sin(rate * since)),
            "breathing_rate": np.sum(faded * np.cos(rate * since)),
            "blows": k / 10,
            "at_cylinder": float(inwards[k]),
        }[quantity]
        expected = rig.impact.restitution + size * value
        assert -impacts["normal_speed_after_m_per_s"][k] / approach[k] == pytest.approx(expected, abs=1e-6)
    if swings:
        for wrong in ({"x": rate}, {"x": -rate, "y": fades_s}):
            with pytest.raises(ScenarioError):
                Factor(quantity, **wrong)


def test_what_a_blow_leaves_without_swinging_back_is_reported_without_a_rate():
    law = WrittenLaw((Term("restitution", 0.1, (Factor("swing_rate", y=0.05),)),))
    assert as_text(law) == "restitution += 0.1 s/m * swing_rate(within 0.05 s)"
    assert legend(law)[-1][1].endswith("where the disk is, within 0.05 s")


@pytest.mark.others_further
@pytest.mark.parametrize("quantity", ["turned", "turned_since", "last_left"])
def test_how_far_the_disk_has_turned_and_how_fast_a_blow_has_left_it(quantity):
    """Over a run that begins at an angle, with every turn counted, held against the motion: a few thousandths is what
    frames of 20 kHz say of an instant."""
    law = WrittenLaw((Term("restitution", {"last_left": 0.02}.get(quantity, 0.002), (Factor(quantity),)),))
    start = (*RIG.initial_nes[:4], 2.9, 40.0)
    rig = replace(RIG, laws=(law,), duration_s=0.6, sample_rate_hz=2e4, initial_nes=start)
    found = simulate(rig)
    impacts, motion = found.impacts, found.motion
    angle = np.interp(impacts["time_s"], found.time_s, motion["nes_angle_rad"])
    after = np.searchsorted(found.time_s, impacts["time_s"]) + 1
    left = np.hypot(*(motion[f"nes_v{a}_m_per_s"] - motion[f"host_v{a}_m_per_s"] for a in "xy"))
    left = left[np.minimum(after, len(left) - 1)]
    assert angle.max() - angle.min() > 2 * math.pi
    for k in range(len(impacts)):
        value = {
            "turned": angle[k] - 2.9,
            "turned_since": angle[k] - angle[k - 1] if k else 0.0,
            "last_left": left[k - 1] if k else 0.0,
        }[quantity]
        expected = rig.impact.restitution + law.terms[0].coefficient * value
        ratio = -impacts["normal_speed_after_m_per_s"][k] / impacts["normal_speed_before_m_per_s"][k]
        assert ratio == pytest.approx(expected, abs=1e-3)


def test_where_the_disk_has_struck_last():
    """The direction of each impact, held against the table of them; nothing before the first."""
    law = WrittenLaw((Term("restitution", 0.05, (Factor("last_azimuth", "cosine", x=0.4),)),))
    rig = replace(RIG, laws=(law,), duration_s=0.6)
    impacts = simulate(rig).impacts
    ratio = -impacts["normal_speed_after_m_per_s"] / impacts["normal_speed_before_m_per_s"]
    assert len(impacts) > 5 and ratio[0] == pytest.approx(rig.impact.restitution, abs=1e-9)
    expected = rig.impact.restitution + 0.05 * np.cos(impacts["azimuth_rad"][:-1] - 0.4)
    assert ratio[1:] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("fades_s", [0.0, 0.2])
def test_blows_here_are_those_that_struck_near(fades_s):
    """Over a run with a cylinder: the speeds before each impact, by how near it pushed the Host, held against the table
    of impacts; along the rim the same where the disk does not turn."""
    width, size = 0.5, 0.01
    law = WrittenLaw((Term("restitution", size, (Factor("blows_here", x=fades_s, y=width),)),))
    rig = replace(RIG, laws=(law,), duration_s=1.5, host=replace(RIG.host, obstacle_radius_m=0.012))
    impacts = simulate(rig).impacts
    time_s, approach = impacts["time_s"], impacts["normal_speed_before_m_per_s"]
    way = impacts["azimuth_rad"] + np.where(impacts["wall"] == P.OBSTACLE, math.pi, 0.0)
    assert len(impacts) > W.MOST_BLOWS + 2
    for k in range(len(impacts)):
        last = slice(max(k - W.MOST_BLOWS, 0), k)
        off = np.angle(np.exp(1j * (way[k] - way[last]))) / width
        faded = np.exp(-(time_s[k] - time_s[last]) / fades_s) if fades_s else 1.0
        expected = rig.impact.restitution + size * np.sum(approach[last] * np.exp(-0.5 * off**2) * faded)
        assert -impacts["normal_speed_after_m_per_s"][k] / approach[k] == pytest.approx(expected, abs=1e-6)
    known = np.zeros(W.KNOWN_SIZE)
    known[[W.HX, W.ANGLE, W.TIME]] = 0.04, 0.9, 0.3
    known[[W.BLOW_SPEEDS, W.BLOW_WAYS, W.BLOW_SIDES, W.BLOW_TIMES]] = 2.0, 0.4, -0.6, 0.1
    for name, off in (("blows_here", -0.4), ("rim_blows_here", -0.3)):
        value = kernel.size(np.array(Term("restitution", 1.0, (Factor(name, x=fades_s, y=width),)).row()), known)
        faded = math.exp(-0.2 / fades_s) if fades_s else 1.0
        assert value == pytest.approx(2.0 * math.exp(-0.5 * (off / width) ** 2) * faded)
    assert "blows_here(within 0.5 rad" in as_text(law)
    for wrong in ({}, {"x": -1.0, "y": width}):
        with pytest.raises(ScenarioError):
            Factor("blows_here", **wrong)


def test_the_rim_remembers_where_it_was_struck():
    """A disk that turns between two impacts: the place on the rim is that of the first contact, seen from the disk."""
    size, width = 0.015, 0.4
    law = WrittenLaw((Term("restitution", size, (Factor("rim_blows_here", y=width),)),))
    rig = replace(RIG, laws=(law,), duration_s=1.0, sample_rate_hz=2e4)
    found = simulate(rig)
    impacts = found.impacts
    angle = np.interp(impacts["time_s"], found.time_s, found.motion["nes_angle_rad"])
    side, approach = impacts["azimuth_rad"] - angle, impacts["normal_speed_before_m_per_s"]
    for k in range(min(len(impacts), W.MOST_BLOWS)):
        off = np.angle(np.exp(1j * (side[k] - side[:k]))) / width
        expected = rig.impact.restitution + size * np.sum(approach[:k] * np.exp(-0.5 * off**2))
        assert -impacts["normal_speed_after_m_per_s"][k] / approach[k] == pytest.approx(expected, abs=2e-3)


def test_the_hosts_acceleration_has_two_parts_where_the_disk_is():
    known = np.zeros(W.KNOWN_SIZE)
    known[[W.HX, W.HY, W.HOST_AX, W.HOST_AY]] = 0.03 * math.cos(0.7), 0.03 * math.sin(0.7), 5.0, -2.0
    for name, direction in (("host_acceleration_outwards", 0.7), ("host_acceleration_around", 0.7 + 0.5 * math.pi)):
        value = kernel.size(np.array(Term("restitution", 1.0, (Factor(name),)).row()), known)
        assert value == pytest.approx(5.0 * math.cos(direction) - 2.0 * math.sin(direction))


@pytest.mark.parametrize(
    "wall", [{"polygon_m": ((0.06, 0.05), (-0.05, 0.06), (-0.06, -0.05), (0.05, -0.06))},
             {"radius_m": 0.06, "obstacle_radius_m": 0.008}],
)  # fmt: skip
def test_the_walls_acceleration_is_along_its_normal(wall):
    """At a flat wall that is not the direction from the Host's centre, at a cylinder the opposite one."""
    size, drive, uneven = 0.002, RIG.host.drive[0], 0.05
    faces = Term("restitution", uneven, (Factor("normal_direction", "cosine", x=0.4),))
    law = WrittenLaw((Term("restitution", size, (Factor("wall_acceleration"),)), faces))
    rig = replace(RIG, host=replace(RIG.host, **({"radius_m": None} | wall)), laws=(law,), duration_s=1.0)
    hit = simulate(rig).impacts
    rate = 2 * math.pi * drive.frequency_hz
    pushed = -drive.amplitude * rate**2 * np.sin(rate * hit["time_s"] + drive.phase_rad) * np.cos(hit["normal_rad"])
    found = -hit["normal_speed_after_m_per_s"] / hit["normal_speed_before_m_per_s"]
    assert len(hit) > 8 and np.ptp(pushed) > 50.0
    expected = rig.impact.restitution + size * pushed + uneven * np.cos(hit["normal_rad"] - 0.4)
    assert found == pytest.approx(np.clip(expected, 0, 1), abs=1e-9)
    assert np.any(np.abs(np.angle(np.exp(1j * (hit["normal_rad"] - hit["azimuth_rad"])))) > 0.1)


def test_a_sawtooth_is_a_step_of_mean_zero():
    """Up by one where it stands, falling evenly around; of what has no turns at every multiple of a period."""
    known = np.zeros(W.KNOWN_SIZE)
    angles = np.linspace(-3.1, 3.1, 1001)
    row = np.array(Term("contact_radius", 1.0, (Factor("azimuth", "sawtooth", x=0.4),)).row())
    values = []
    for angle in angles:
        known[W.HX], known[W.HY] = math.cos(angle), math.sin(angle)
        values.append(kernel.size(row, known))
    assert np.mean(values) == pytest.approx(0.0, abs=0.01)
    assert np.diff(values).max() == pytest.approx(1.0, abs=0.01)
    assert angles[np.argmax(np.diff(values))] == pytest.approx(0.4, abs=0.01)
    ticks = Term("clock_delay", 2e-4, (Factor("time", "sawtooth", 1.0, 0.05, x=0.01),))
    row, out = np.array(ticks.row()), []
    for known[W.TIME] in (0.0101, 0.035, 0.0599, 0.0601):
        out.append(kernel.size(row, known))
    assert out == pytest.approx([1e-4, 0.0, -1e-4, 1e-4], abs=1e-6)
    assert as_text(WrittenLaw((ticks,))).endswith("sawtooth((time - 0.01 s), every 0.05 s)")
    assert r"\mathrm{saw}" in as_latex(WrittenLaw((ticks,)))
    with pytest.raises(ScenarioError):
        Factor("speed", "sawtooth", 2.0)


def test_words_and_compiled_codes_are_the_same():
    """Names of `words` against the numbers of `kernel`, one by one."""
    flights = [one.code for one in TARGETS.values() if one.stage == "flight"]
    assert [getattr(kernel, name) for name in TARGET_CODES.split()] == flights
    numbered = [getattr(quantities, f"Q_{name}") for name in QUANTITY_CODES.split()]
    assert numbered == [one.code for one in QUANTITIES.values()]
    functions = ["POWER", "ABSOLUTE", "COSINE", "SINE", "EXPONENTIAL", "GAUSSIAN", "BELOW", "SIGN", "PULSES", "GATES"]
    functions += ["ABOVE", "TANH", "DECAY", "RATIONAL", "WITHIN", "SAWTOOTH", "RISING", "BEYOND"]
    assert [getattr(kernel, name) for name in functions] == [code for code, _ in FUNCTIONS.values()]


def test_a_law_file_comes_back_as_it_was_written(tmp_path):
    """Numbers to eight digits, units checked on the way in."""
    law = WrittenLaw(
        (
            Term("across_velocity", 0.005, (Factor("speed"), Factor("spin")), sd=1e-4),
            Term("outwards", -0.3, (Factor("gap", "exponential", 1.0, 0.004),)),
        )
    )
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law, "a law"))
    back = read_law(path)
    assert [one.factors for one in back.terms] == [one.factors for one in law.terms]
    assert [(one.target, one.coefficient, one.unit) for one in back.terms] == [
        ("across_velocity", 0.005, "1"), ("outwards", -0.3, "m/s^2"),
    ]  # fmt: skip
    path.write_text(law_text(law, "a law").replace('unit = "m/s^2"', 'unit = "1/s"'))
    with pytest.raises(InputError, match=r"unit '1/s' of term 2"):
        read_law(path)


def test_formulas_name_units_and_meanings():
    """A line of text, LaTeX, and what each symbol means."""
    law = WrittenLaw((Term("outwards", -13.3, (Factor("radius"),)),))
    assert as_text(law) == "acceleration += -13.3 1/s^2 * radius * outwards"
    assert as_latex(law) == r"\Delta\vec a = -13.3\,\mathrm{1/s^{2}}\,r\,\hat r"
    assert ("r", "distance from the Host's centre") in legend(law)
    glint = WrittenLaw((Term("nes_picture_u", 0.25, (Factor("angle", "cosine", x=-0.2),), 1.0),))
    assert as_text(glint) == "picture u of the NES in camera 2 += 0.25 px * cos(angle + 0.2 rad)"
    assert as_latex(glint) == r"\Delta u^{\mathrm{NES}}_{2} = 0.25\,\mathrm{px}\,\cos(\psi+ 0.2)"


@pytest.mark.parametrize(
    ("law", "word"),
    [
        (lambda: Term("outward", 1.0), "target 'outward'"),
        (lambda: Factor("speeed"), "quantity 'speeed'"),
        (lambda: Factor("speed", "cube"), "function 'cube'"),
        (lambda: Factor("gap", "exponential", 1.0, 0.0), "scale"),
        (lambda: WrittenLaw(()), "0 terms"),
        (lambda: WrittenLaw((Term("picture_u", 1.0, (Factor("angle"),)),)), "angle in a law of the measurement"),
        (lambda: WrittenLaw((Term("outwards", 1.0), Term("restitution", 0.1))), "several stages"),
    ],
)
def test_what_is_no_law_is_refused(law, word):
    """Found, expected, do."""
    with pytest.raises(ScenarioError, match=word):
        law()


@pytest.mark.parametrize("turn_rad", [0.08, -0.05])
def test_a_blow_is_turned_from_the_walls_normal(turn_rad):
    """A disk that comes straight to a fixed wall leaves as from a wall that is turned: by restitution along its normal,
    by friction's cone or beta_0 along its tangent, and the contact point's impulse alone turns it."""
    for friction in (0.02, 0.5):
        rig = Scenario(
            "turned", Nes(0.01, 0.0246), Host(radius_m=0.05), ImpactLaw(0.7, friction, 0.5), 0.03,
            initial_nes=(0.025, 0.0, 1.0, 0.0, 0.0, 0.0), laws=(WrittenLaw((Term("contact_normal", turn_rad),)),),
        )  # fmt: skip
        blow = simulate(rig).impacts[0]
        c, s, q = math.cos(turn_rad), math.sin(turn_rad), 0.5
        normal, slip = c, -s
        along = min(1.5 * abs(slip) / (1 + 1 / q), friction * 1.7 * normal) * math.copysign(1.0, turn_rad)
        jump = np.array([[c, -s], [s, c]]) @ [-1.7 * normal, along]
        turned = along / (q * 0.01)
        assert blow["normal_speed_before_m_per_s"] == pytest.approx(1.0, rel=1e-9)
        assert blow["normal_speed_after_m_per_s"] == pytest.approx(1.0 + jump[0], rel=1e-9)
        assert blow["tangential_speed_after_m_per_s"] == pytest.approx(jump[1] + 0.01 * turned, rel=1e-9)
        assert blow["spin_after_rad_per_s"] == pytest.approx(turned, rel=1e-9)


def test_a_blow_that_is_turned_takes_no_energy_and_stays_inside():
    """Without friction and losses the speed stays, however the blows are turned; and none goes through the wall."""
    rig = Scenario(
        "turned", Nes(0.01, 0.0246), Host(radius_m=0.05), ImpactLaw(1.0, 0.0, 0.0), 1.0,
        initial_nes=(0.01, 0.005, 1.0, 0.4, 0.0, 0.0),
        laws=(WrittenLaw((Term("contact_normal", 0.15, (Factor("azimuth", "cosine", 3.0),)),)),),
    )  # fmt: skip
    run = simulate(rig)
    assert len(run.impacts) > 8
    speed = np.hypot(run.motion["nes_vx_m_per_s"], run.motion["nes_vy_m_per_s"])
    assert np.hypot(run.motion["nes_x_m"], run.motion["nes_y_m"]).max() < 0.04 + 1e-9
    assert np.ptp(speed) < 1e-9


@pytest.mark.parametrize("target", ["restitution", "wall_friction", "tangential_restitution"])
def test_contacts_that_last_follow_what_laws_add(target):
    """A constant that a law adds is that number of the contact law: the same motion to the last digit."""
    lasting = replace(RIG, effects={"finite_contact_time": {"duration_s": 2e-4}})
    added = simulate(replace(lasting, laws=(WrittenLaw((Term(target, -0.05),)),))).motion["nes_x_m"]
    number = getattr(lasting.impact, target) - 0.05
    stated = simulate(replace(lasting, impact=replace(lasting.impact, **{target: number}))).motion["nes_x_m"]
    np.testing.assert_allclose(added, stated, rtol=0, atol=1e-9)
    assert np.abs(simulate(lasting).motion["nes_x_m"] - stated).max() > 1e-5


def test_the_simulator_refuses_what_it_cannot_hold():
    """A wall that follows the spin; a law in step with a drive that has no frequency; turned blows of contacts that
    last."""
    turns = WrittenLaw((Term("contact_normal", 0.05),))
    with pytest.raises(ScenarioError, match="contacts that last"):
        simulate(replace(RIG, laws=(turns,), effects={"finite_contact_time": {"duration_s": 2e-4}}))
    wall = WrittenLaw((Term("contact_radius", 1e-4, (Factor("spin"),)),))
    with pytest.raises(ScenarioError, match="follows more than the azimuth"):
        simulate(replace(RIG, laws=(wall,)))
    still = replace(RIG, host=Host(radius_m=0.05))
    beat = WrittenLaw((Term("fixed_direction", 0.1, (Factor("phase", "cosine"),)),))
    with pytest.raises(ScenarioError, match="without harmonics"):
        simulate(replace(still, laws=(beat,)))


def test_a_law_of_boards_follows_nothing():
    """It is the same in all frames: a factor would be forgotten in silence."""
    WrittenLaw((Term("board_stretch", 0.004, (), 0.3),))
    assert targets.BOARDS == BOARDS
    for target in BOARDS:
        with pytest.raises(ScenarioError, match="time in a law of the measurement"):
            WrittenLaw((Term(target, 0.004, (Factor("time"),), 0.3),))
