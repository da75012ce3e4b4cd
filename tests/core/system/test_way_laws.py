"""Laws that remember the disk's way over the floor, in the simulator: against the motion that it gives, turned worlds,
refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, ScenarioError, simulate
from ovines.core.laws import kernel
from ovines.core.laws import words as W
from ovines.core.laws.allowed import OF_FLIGHTS_ONLY
from ovines.core.laws.formula import as_latex, as_text, legend
from ovines.core.laws.memory import LEAST_LATELY, LEAST_TRAIL, memory_units, slid_on, trail, way_lately
from ovines.core.laws.terms import Factor, Term, WrittenLaw

# Without friction at the floor or along the wall nothing but a law turns the disk.
FREE = Scenario(
    "free", Nes(0.01, 0.0246), Host(radius_m=0.05, motion="driven", drive=(Harmonic("x", 0.0164, 11.0, 0.3),)),
    ImpactLaw(0.72, 0.0, 0.0), 0.25, None, (0.03, -0.01, 0.3, 0.2, 0.4, 20.0), sample_rate_hz=2e4,
)  # fmt: skip
RUBBED = replace(FREE, friction=FloorFriction(0.2), impact=ImpactLaw(0.72, 0.13, 0.49), sample_rate_hz=4e3)
LENGTH_M, FADES_S, SIZE = 0.023, 0.07, 30.0
FACTORS = {
    "way": Factor("way"),
    "way_since": Factor("way_since", "cosine", 1.0, 0.004),
    "turned": Factor("turned"),
    "trail_along": Factor("trail_along", y=LENGTH_M),
    "trail_across": Factor("trail_across", y=LENGTH_M),
    "way_lately": Factor("way_lately", y=FADES_S),
    "off_path": Factor("off_path", "gaussian", 1.0, 0.01),
    "sliding_from_blow": Factor("sliding_from_blow", "cosine", x=0.7),
    "rim_angle": Factor("rim_angle", "sine", 2.0),
}


def _values(name, found):
    """What a quantity is along a motion (N,), by sums over its samples alone."""
    m, time_s = found.motion, found.time_s
    place = np.column_stack([m[f"nes_{a}_m"] - m[f"host_{a}_m"] for a in "xy"])
    step = np.diff(place, axis=0)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*step.T))])
    slip = np.gradient(place, time_s, axis=0)
    speed = np.hypot(*slip.T)
    along = slip / speed[:, None]
    impacts = found.impacts["time_s"]
    last = np.searchsorted(impacts, time_s) - 1
    contact = np.column_stack([np.interp(impacts, time_s, one) for one in place.T])
    if name == "way":
        return way
    if name == "turned":
        return m["nes_angle_rad"] - m["nes_angle_rad"][0]
    if name == "way_since":
        return np.cos((way - np.where(last < 0, 0.0, np.interp(impacts, time_s, way)[last])) / 0.004)
    if name == "way_lately":
        out = np.zeros(len(time_s))
        for i in range(1, len(out)):
            out[i] = out[i - 1] * math.exp(-(time_s[i] - time_s[i - 1]) / FADES_S) + way[i] - way[i - 1]
        return out
    if name.startswith("trail"):
        mean = np.zeros((len(time_s), 2))
        for i in range(1, len(mean)):
            kept = math.exp(-(way[i] - way[i - 1]) / LENGTH_M)
            mean[i] = kept * mean[i - 1] + (1 - kept) * step[i - 1] / np.hypot(*step[i - 1])
        if name == "trail_along":
            return np.sum(mean * along, 1)
        return mean[:, 1] * along[:, 0] - mean[:, 0] * along[:, 1]
    if name == "off_path":
        before = contact[last - 1]
        line = contact[last] - before
        far = place - before
        off = (line[:, 0] * far[:, 1] - line[:, 1] * far[:, 0]) / np.maximum(np.hypot(*line.T), 1e-12)
        return np.where(last < 1, 0.0, np.exp(-0.5 * (off / 0.01) ** 2))
    pushed = np.arctan2(contact[last, 1], contact[last, 0])
    if name == "sliding_from_blow":
        return np.where(last < 0, 0.0, np.cos(np.arctan2(along[:, 1], along[:, 0]) - pushed - 0.7))
    return np.sin(2 * np.arctan2(0.01 * m["nes_spin_rad_per_s"], speed))


@pytest.mark.others_further
@pytest.mark.parametrize("name", FACTORS)
def test_a_torque_that_follows_the_way_gives_the_spin_of_its_sum(name):
    """Over several flights: the spin that the law has given is the integral of what the motion says."""
    found = simulate(replace(FREE, laws=(WrittenLaw((Term("spin", SIZE, (FACTORS[name],)),)),)))
    assert len(found.impacts) > 4
    value = _values(name, found)
    spin = found.motion["nes_spin_rad_per_s"]
    gained = np.concatenate([[0.0], np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(found.time_s))]) * SIZE
    assert np.ptp(gained) > 0.05
    np.testing.assert_allclose(spin - spin[0], gained, rtol=0, atol=1e-2 * np.ptp(gained))


def test_what_fades_is_read_between_the_rungs():
    """Along a bent way: directions and ways that fade at any rate, to one in a hundred of a straight sum."""
    rng = np.random.default_rng(0)
    steps = rng.normal(0.0, 1e-3, (400, 2)) + np.column_stack([np.full(400, 1e-3), np.linspace(-2e-3, 2e-3, 400)])
    known, dt = np.zeros(W.KNOWN_SIZE), 1e-3
    known[W.MEMORY_M], known[W.MEMORY_S] = units = memory_units(0.04)
    for step in steps:
        slid_on(known, W.WAY, (step[0], step[1], dt), units, known, W.WAY)
    way = np.hypot(*steps.T)
    assert known[W.WAY] == pytest.approx(way.sum())
    later = way.sum() - np.cumsum(way)
    for length_m in LEAST_TRAIL * 0.04 * np.array([1.0, 1.4, 7.0, 23.0, 60.0]):
        weight = np.exp(-later / length_m) * -np.expm1(-way / length_m)
        np.testing.assert_allclose(trail(length_m, known), weight @ (steps / way[:, None]), rtol=0, atol=6e-3)
    ago = dt * np.arange(399, -1, -1)
    for fades_s in LEAST_LATELY * units[1] * np.array([2.6, 10.0, 100.0]):
        weight = np.exp(-ago / fades_s) * -np.expm1(-dt / fades_s) * fades_s / dt
        assert way_lately(fades_s, known) == pytest.approx(weight @ way, rel=6e-3)


WAY_LAWS = (
    WrittenLaw(
        (
            Term("floor_friction", -0.3, (Factor("trail_along", y=0.02),)),
            Term("across_sliding", 0.8, (Factor("trail_across", y=0.02),)),
            Term(
                "across_sliding", 0.8, (Factor("rim_angle", "sine", 2.0), Factor("sliding_direction", "cosine", x=0.4))
            ),
            Term("floor_friction", 0.4, (Factor("off_path", "gaussian", 1.0, 0.02),)),
            Term("across_sliding", 0.6, (Factor("way_since", "sine", 1.0, 0.005),)),
            Term("spin", 90.0, (Factor("sliding_from_blow", "cosine", x=0.3),)),
            Term("floor_friction", 0.1, (Factor("turned", "cosine", 1.0, 0.7),)),
            Term("floor_friction", 0.9, (Factor("way_lately", y=0.03),)),
        )
    ),
)


def test_laws_of_the_way_turn_with_the_world():
    """Start, drive and laws turned by one angle give the turned path; each term moves the disk."""
    turn = 0.7
    c, s = math.cos(turn), math.sin(turn)
    matrix = np.array([[c, -s], [s, c]])
    x = simulate(replace(RUBBED, laws=WAY_LAWS))
    (law,) = WAY_LAWS
    for term in law.terms:
        fewer = WrittenLaw(tuple(one for one in law.terms if one is not term))
        moved = simulate(replace(RUBBED, laws=(fewer,))).motion["nes_x_m"] - x.motion["nes_x_m"]
        assert np.abs(moved).max() > 1e-6, as_text(WrittenLaw((term,)))
    start = np.array(RUBBED.initial_nes)
    turned = replace(
        RUBBED,
        laws=(law.moved(turn),),
        host=replace(RUBBED.host, drive=(Harmonic("x", 0.0164 * c, 11.0, 0.3), Harmonic("y", 0.0164 * s, 11.0, 0.3))),
        initial_nes=(*(matrix @ start[:2]), *(matrix @ start[2:4]), start[4] + turn, start[5]),
    )
    y = simulate(turned)
    path = np.column_stack([x.motion["nes_x_m"], x.motion["nes_y_m"]]) @ matrix.T
    np.testing.assert_allclose(np.column_stack([y.motion["nes_x_m"], y.motion["nes_y_m"]]), path, rtol=0, atol=1e-7)


def test_a_floor_that_turns_takes_what_lies_on_it_along():
    """A disk that turns with a Host slides nowhere; beside it a still disk slides around the Host's centre."""
    turning = Host(radius_m=0.05, motion="driven", drive=(Harmonic("rotation", 3.0, 0.5, 0.0),))
    law = WrittenLaw((Term("spin", 1.0, (Factor("way"),)),))
    rate = 3.0 * 2 * math.pi * 0.5
    still = simulate(
        replace(FREE, host=turning, laws=(law,), initial_nes=(0.03, 0.0, 0.0, 0.0, 0.0, 0.0), duration_s=0.1)
    )
    slid_m = 0.03 * 3.0 * np.sin(2 * math.pi * 0.5 * still.time_s)
    gained = np.concatenate([[0.0], np.cumsum(0.5 * (slid_m[1:] + slid_m[:-1]) * np.diff(still.time_s))])
    np.testing.assert_allclose(still.motion["nes_spin_rad_per_s"], gained, rtol=1e-3, atol=1e-9)
    assert slid_m[-1] > 0.05 * 0.03 * rate


def test_what_a_law_of_the_way_says_of_itself():
    law = WAY_LAWS[0]
    text, latex = as_text(law), as_latex(law)
    assert "trail_along(within 20 mm) * floor_friction" in text
    assert "exp(-(off_path / 0.02 m)^2 / 2)" in text
    assert r"\bar e_\parallel" in latex
    meanings = dict(legend(law))
    assert meanings[r"\bar s"].endswith("within 0.03 s") and meanings[r"\bar e_\perp"].endswith("within 20 mm")
    small = law.in_units(0.5, 2.0).terms
    assert small[0].factors[0].y == pytest.approx(0.04)
    assert small[-1].factors[0].y == pytest.approx(0.015)
    with pytest.raises(ScenarioError):
        Factor("trail_along")
    for name in OF_FLIGHTS_ONLY:
        own = {"y": 0.01} if name in ("trail_along", "trail_across", "way_lately") else {}
        with pytest.raises(ScenarioError):
            WrittenLaw((Term("restitution", 1.0, (Factor(name, **own),)),))


def test_nothing_is_off_a_path_that_nobody_saw():
    known = np.full(W.KNOWN_SIZE, 0.02)
    row = np.array(Term("spin", 1.0, (Factor("off_path", "gaussian", 1.0, 0.01),)).row())
    known[W.HX], known[W.BEFORE_X] = 0.01, -0.02
    assert kernel.size(row, known) > 0.0
    known[W.BEFORE_X] = known[W.BEFORE_Y] = 0.0
    assert kernel.size(row, known) == 0.0
