"""Flights of a disk by collocation: the method's own order, where its steps end, and the Runge-Kutta pair beside it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ovines.core import Harmonic, simulate_ensemble
from ovines.core.engine import run
from ovines.core.integration import collocation as C
from ovines.core.integration.disk_step import CLEAR, singular_ahead
from ovines.core.packing import pack
from ovines.core.system import parameters as P
from ovines.core.system.named import named_scenario
from ovines.core.system.packed import Samples

SHAKEN = named_scenario("table-15-case-2")


@pytest.mark.parametrize("power", range(12))
def test_integrals_are_those_of_lobatto(power):
    """Up to a node exact for the polynomial through the seven nodes, over the whole step up to degree 11."""
    assert C.WEIGHTS @ C.NODES**power == pytest.approx(1 / (power + 1), rel=1e-13)
    if power < C.N_NODES:
        assert C.TO_NODES @ C.NODES**power == pytest.approx(C.NODES ** (power + 1) / (power + 1), abs=1e-14)


def test_a_step_stretched_has_the_same_polynomial():
    rows = np.zeros((2, C.N_NODES))
    rows[0] = 1 + 2 * C.NODES - 3 * C.NODES**5
    C.stretch(rows, 0, 0.3, 1)
    at = 0.3 * C.NODES
    assert rows[0] == pytest.approx(1 + 2 * at - 3 * at**5, rel=1e-13)


def test_stiff_slopes_settle_where_plain_sweeps_run_away():
    """y' = -500 (y - cos t) over 0.1 s: fifty times what plain sweeps can do, to rounding within twenty."""
    h, rate, rows = 0.1, 500.0, np.zeros((4, C.N_NODES))
    slopes, values, damping, room = range(4)
    rows[damping], start = rate, 1.0
    rows[values] = start
    for _ in range(20):
        rows[slopes] = -rate * (rows[values] - np.cos(h * C.NODES))
        C.settle(rows, slopes, start, h, values, damping, room)
    right = (rate**2 * np.cos(h) + rate * np.sin(h) + math.exp(-rate * h)) / (rate**2 + 1)
    assert rows[values, -1] == pytest.approx(right, abs=1e-6)
    assert np.abs(rows[room, 1:]).max() < 1e-9


def test_where_friction_is_not_smooth_ahead():
    """First zero of a parabola on (0, 1), one behind the start, none, and beside the real axis."""
    ahead = [
        singular_ahead(*(f(x) for x in (0.0, 0.5, 1.0)))
        for f in (
            lambda x: (x - 0.4) * (x - 3.0),
            lambda x: (x + 1e-3) * (x - 0.7),
            lambda x: (x + 1.0) * (x + 2.0),
            lambda x: (x - 0.6) ** 2 + 0.64,
        )
    ]
    assert ahead == pytest.approx([0.4, 0.7, math.inf, CLEAR])


@pytest.mark.parametrize(("tolerance", "most", "all_but_few"), [(1e-9, 2e-7, 2e-8), (1e-11, 2e-8, 1e-9)])
def test_flights_hold_the_tolerance(tolerance, most, all_but_few):
    """100 flights of 70 ms from random starts, against themselves at 1e-13."""
    rng = np.random.default_rng(1)
    wide = replace(SHAKEN, host=replace(SHAKEN.host, radius_m=0.3), duration_s=0.07)
    starts = {"nes_vx_m_per_s": rng.uniform(-1, 1, 100), "nes_vy_m_per_s": rng.uniform(-1, 1, 100),
              "nes_spin_rad_per_s": rng.uniform(-20, 20, 100)}  # fmt: skip
    found, right = (simulate_ensemble(wide, 100, starts, rng, tolerance=one) for one in (tolerance, 1e-13))
    assert found.n_impacts.max() == 0
    miss = np.hypot(*(found.final_state - right.final_state)[:, 2:4].T)
    assert miss.max() < most and np.percentile(miss, 95) < all_but_few


@pytest.mark.parametrize("law", ["farkas", "coulomb"])
@pytest.mark.parametrize("axis", ["x", "rotation"])
@pytest.mark.parametrize("acceleration", [2.0, 30.0])
def test_the_runge_kutta_pair_says_the_same(law, axis, acceleration):
    """A disk that friction holds on the floor, or that slides: the same scenario as one that is not plain."""
    size = acceleration / (2 * math.pi * 11.0) ** 2 / (0.02 if axis == "rotation" else 1.0)
    made = replace(
        SHAKEN, host=replace(SHAKEN.host, drive=(Harmonic(axis, size, 11.0),)), duration_s=0.15,
        friction=replace(SHAKEN.friction, law=law), initial_nes=(0.02, 0.0, 0.1, 0.05, 0.0, 3.0),
    )  # fmt: skip
    ends, energies = [], []
    for plain in (True, False):
        packed = pack(made)
        assert packed.k[P.PLAIN]
        packed.k[P.PLAIN] = plain
        y = packed.y.copy()
        none = Samples(np.zeros(0), np.zeros((0, 12)), np.zeros(1, np.int64), np.zeros((0, P.N_STATE)))
        run(packed.system, y, none, np.zeros((0, P.N_IMPACT)), np.zeros((0, 2)), True)
        ends.append(y[:6])
        energies.append(y[P.ENERGIES : P.HOST])
    units = np.array([1.0, 1.0, 1.0, 1.0, 0.02, 0.02])  # a turn counts by the rim's way
    assert units * ends[0] == pytest.approx(units * ends[1], rel=0, abs=1e-8)
    assert energies[0] == pytest.approx(energies[1], rel=0, abs=1e-10)
