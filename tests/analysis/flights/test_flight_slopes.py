"""Derivatives of the flight's equation of motion and of whole flights, against differences."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.flights.cutting.flight_rig import NO_LAW, FlightRig
from analysis.flights.equation import parameters as P
from analysis.flights.equation.law_slopes import law_work
from analysis.flights.equation.model import STATES, acceleration, fly
from analysis.flights.equation.slopes import acceleration_slopes
from analysis.flights.single_flight import fly_with_derivatives
from analysis.motion.host_path import HostMotion
from ovines.core.laws.terms import Factor, Term, rows_of

OMEGA = 2 * np.pi * 11.0
# Shaken along x with an overtone, lifted, and turning: every way in which the Host enters.
HARMONICS = np.zeros((4, 5))
HARMONICS[0, 2], HARMONICS[1, 3], HARMONICS[2, 1], HARMONICS[3, 2] = 0.0164, 5e-4, 2e-4, 0.02
SHAKEN = HostMotion(HARMONICS, OMEGA, 0.3, np.zeros(4), 0.0, np.zeros((0, 4)))
STILL = HostMotion(np.zeros((4, 1)), 0.0, 0.0, np.zeros(4), 0.0, np.zeros((0, 4)))
RIG = FlightRig(SHAKEN.table(-0.1, 1.0), OMEGA, 0.01, 0.5, 0.04, 0.3)
QUIET = RIG._replace(host=STILL.table(-0.1, 1.0), omega_rad_per_s=0.0)
LAW = rows_of(
    [
        Term("outwards", 3.0, (Factor("radius", "exponential", scale=0.01),)),
        Term("along_sliding", -0.5, (Factor("sliding_speed", "tanh", scale=0.3), Factor("angle", "cosine"))),
        Term("floor_friction", 0.3, (Factor("spin", "gaussian", scale=60.0),)),
        Term("mirrored_floor_friction", 0.2, (), x=0.4),
        Term("along_body", 0.4, (Factor("phase", "sine"),), x=0.1),
        Term("spin", 5.0, (Factor("speed"),)),
        Term("polar_floor_friction", 0.2, (Factor("radius"),)),
        Term("floor_lever", 9.0, (Factor("heading", "cosine", x=0.4),), x=0.3),
    ]
)
#: everything but the instant of the impact before, which is no unknown
UNKNOWNS = [place for name, place in P.INDEX.items() if name not in P.GIVEN]
NAMES = list(P.INDEX)


def plain(friction=0.25, coupling=1.0, **given):
    p = np.zeros(len(NAMES))
    p[P.FRICTION], p[P.COUPLING], p[P.IMPACT_BEFORE_S] = friction, coupling, -0.01
    for name, value in given.items():
        p[P.INDEX[name]] = value
    return p


def everything(rng):
    """Every parameter of a size that it may have, all terms of the law among them."""
    p = np.zeros(len(NAMES))
    p[UNKNOWNS] = rng.normal(0.0, 0.3, len(UNKNOWNS))
    p[P.FRICTION], p[P.COUPLING], p[P.IMPACT_BEFORE_S] = 0.25, 0.6, -0.01
    return p


def state_at(rng, slow):
    """Any state of the disk, or one ``slow`` (m/s) against the floor."""
    t = rng.uniform(0.0, 0.5)
    place, rate = SHAKEN.at(np.array([t]))[0], SHAKEN.at(np.array([t]), 1)[0]
    y = np.array([*rng.normal(0, 0.02, 2), rng.normal(), *rng.normal(0, 0.5, 2), rng.normal(0, 40)])
    if slow:
        arm = y[:2] - place[:2]
        y[3:5] = rate[:2] + rate[3] * np.array([-arm[1], arm[0]]) + slow * rng.normal(size=2)
        y[5] = rate[3] + slow / 0.01 * rng.normal()
    return t, y


def by_difference(at, place, h, in_state):
    """Central difference (3,) of the acceleration with respect to an entry of the state, or of the parameters."""
    t, y, p, rig = at
    ends = []
    for sign in (1.0, -1.0):
        moved = (y if in_state else p).copy()
        moved[place] += sign * h
        one = acceleration(t, moved, p, rig) if in_state else acceleration(t, y, moved, rig)
        ends.append(np.array([one.x, one.y, one.spin]))
    return (ends[0] - ends[1]) / (2 * h)


@pytest.mark.further
@pytest.mark.parametrize("middle", [(0.0, 0.0), (7e-4, -4e-4)], ids=["middle", "off the middle"])
@pytest.mark.parametrize("law", [NO_LAW, LAW], ids=["no law", "law"])
@pytest.mark.parametrize("slow", [0.0, 3e-3, 1e-4])
def test_every_term_has_its_derivatives(slow, law, middle):
    """Central differences: of a state within a hundredth of the smoothed speed, of parameters whatever step, for the
    acceleration is linear in each (but for a product of two that it holds)."""
    rng = np.random.default_rng(3)
    rig = RIG._replace(law=law, middle_x_m=middle[0], middle_y_m=middle[1])
    for _ in range(20):
        (t, y), p = state_at(rng, slow), everything(rng)
        state, every = np.empty((3, STATES)), np.empty((3, len(p)))
        got = acceleration_slopes(t, y, p, rig, law_work(), state, every)
        assert np.allclose(got, acceleration(t, y, p, rig), rtol=1e-9, atol=1e-9)

        step = 1e-3 * (slow or 1e-2)
        for place, h in enumerate((0.1 * step, 0.1 * step, 1e-5, step, step, step / 0.01)):
            expected = by_difference((t, y, p, rig), place, h, True)
            assert np.all(np.abs(state[:, place] - expected) < 1e-3 * (np.abs(expected).max() + 1.0)), place
        for place in UNKNOWNS:
            expected = by_difference((t, y, p, rig), place, 1e-4, False)
            # Micrometres per second squared of rounding, over the step.
            assert np.all(np.abs(every[:, place] - expected) < 1e-5 * np.abs(expected).max() + 1e-8), NAMES[place]


# name -> start, span (s) from 0.02 s on, parameters, rig
FLIGHTS = {
    "sliding": ((0.01, 0.0, 0.1, 0.6, -0.4, 40.0), 0.05, plain(), RIG),
    "backwards": ((0.01, 0.0, 0.1, 0.6, -0.4, 40.0), -0.02, plain(), RIG),
    "a little coupled": ((0.01, 0.0, 0.1, 0.6, -0.4, 4.0), 0.05, plain(coupling=0.3, magnus=1e-3), RIG),
    "without friction": ((0.01, 0.0, 0.1, 0.6, -0.4, 40.0), 0.05, plain(friction=0.0, air=0.3), RIG),
    "every probe": ((0.01, 0.0, 0.1, 0.6, -0.4, 40.0), 0.05, everything(np.random.default_rng(8)), RIG),
    "friction turns": ((0.0, 0.0, 0.0, 0.4, 0.02, 1.0), 0.15, plain(), RIG),
    "comes to rest": ((0.01, 0.0, 0.1, 0.15, -0.05, 10.0), 0.1, plain(tilt_x=0.05), QUIET),
    "before the table": ((0.01, 0.0, 0.1, 0.6, -0.4, 40.0), -0.2, plain(friction_cos=0.1), RIG),
    "off the middle": ((0.01, 0.0, 0.1, 0.6, -0.4, 40.0), 0.05, plain(), RIG._replace(middle_x_m=7e-4)),
    "under a law": (
        (0.01, 0.0, 0.1, 0.6, -0.4, 40.0),
        0.05,
        everything(np.random.default_rng(8)),
        RIG._replace(law=LAW),
    ),
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_derivatives_of_a_flight(name):
    """Against central differences of two flights: a column's places, and its rates, to 3e-4 of the largest."""
    start, span, p, rig = FLIGHTS[name]
    start, t0 = np.array(start), 0.02
    times = np.sort(t0 + np.linspace(0.0, span, 60))
    free = np.array([place for place in UNKNOWNS if place != P.FRICTION or p[P.FRICTION] > 0.0])
    out, derivative = np.empty((60, STATES)), np.empty((60, STATES, STATES + len(free)))
    fly_with_derivatives(start, t0, times, p, free, rig, out, derivative)

    def flown(y, q):
        states = np.empty((60, STATES))
        fly(y, t0, times, q, rig, states)
        return states

    # A disk at rest keeps a spin of rounding's size (rad/s).
    assert np.abs(out - flown(start, p)).max() < 1e-9
    for column in range(STATES + len(free)):
        ends = []
        for sign in (1.0, -1.0):
            y, q = start.copy(), p.copy()
            if column < STATES:
                h = (1e-6, 1e-6, 1e-5, 1e-6, 1e-6, 1e-4)[column]
                y[column] += sign * h
            else:
                h = 1e-5
                q[free[column - STATES]] += sign * h
            ends.append(flown(y, q))
        expected = (ends[0] - ends[1]) / (2 * h)
        for part in (slice(0, 3), slice(3, 6)):
            size = np.abs(expected[:, part]).max()
            assert np.abs(derivative[:, part, column] - expected[:, part]).max() < 3e-4 * size + 1e-8, column
