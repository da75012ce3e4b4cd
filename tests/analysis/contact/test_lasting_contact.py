"""Along the wall during a contact that lasts, against an integration that is not ours, and data of both laws."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from analysis.contact.tangential.lasting import LastingContact, fit_lasting, friction_share, stiffness_of
from analysis.contact.tangential.search import Impulses


def integrated(stiffness, stopping, decay, friction=0.17, duration=8e-4, approach=0.4):
    """Stopping impulse over the friction's, share of the friction's impulse and restitution of a contact that lasts
    with a damper's ``decay`` in it; the slip is ``stopping`` times the friction's impulse, were it 1.7 of the
    approach.
    """
    decay = decay / duration
    spring = (np.pi / duration) ** 2 + decay**2
    slip = stopping * friction * 1.7 * approach  # of a body of mobility 1

    def force(state):
        return max(spring * state[0] + 2 * decay * state[1], 0.0)

    def rate(_, state):
        _, speed, slip, stretch, _ = state
        limit, tangential = friction * force(state), stiffness * spring * stretch
        # A narrow spring beyond the limit stands for sliding.
        held = np.clip(tangential, -limit, limit)
        let_go = (tangential - held) / (stiffness * spring) / (1e-3 * duration)
        return [speed, -force(state), -held, slip - let_go, held]

    def left(_, state):
        return state[0] + 1e-12 * (state[1] > 0)

    left.terminal, left.direction = True, -1
    end = solve_ivp(
        rate, (0, 1.2 * duration), [0.0, approach, slip, 0.0, 0.0], max_step=duration / 500, events=left, rtol=1e-7
    )
    whole = friction * (approach - end.y[1, -1])
    return slip / whole, end.y[4, -1] / whole, -end.y[1, -1] / approach


@pytest.mark.others_further
@pytest.mark.parametrize("stiffness", [0.3, 1.0, 2.4])
@pytest.mark.parametrize("decay", [0.15, 0.6])
def test_the_share_is_that_of_an_integration(stiffness, decay):
    for wanted in (0.2, 0.5, 0.8, 1.5):
        stopping, expected, restitution = integrated(stiffness, wanted, decay)
        assert friction_share(restitution)((np.log(stiffness), stopping)) == pytest.approx(expected, abs=5e-3)


def test_what_slides_throughout_has_the_friction_s_impulse_and_what_does_not_slip_none():
    share = friction_share(0.7)
    assert share((0.0, 0.0)) == 0.0
    assert share((0.0, 20.0)) == pytest.approx(1.0, abs=1e-3)


def impulses_with(tangential_of, rng, count=120, noise=1e-3):
    slip = rng.choice([-1.0, 1.0], count) * 10 ** rng.uniform(-2, 0.5, count)
    normal, mobility = rng.uniform(0.2, 2.0, count), np.full(count, 2.6)
    tangential = tangential_of(-slip / mobility, normal) + noise * rng.standard_normal(count)
    variance = np.full(count, noise**2)
    broad = (0.25 * normal) ** 2
    return Impulses(slip, normal, tangential, mobility, np.zeros(count), variance, broad, 0.01, np.ones((count, 1)))


def test_friction_and_stiffness_are_found():
    share, rng = friction_share(0.75), np.random.default_rng(3)

    def lasting(stopping, normal):
        ratio = np.minimum(np.abs(stopping) / (0.16 * normal), 49.0)
        return np.sign(stopping) * 0.16 * normal * share(np.column_stack([np.full(len(ratio), np.log(2.2)), ratio]))

    found = fit_lasting(impulses_with(lasting, rng), 0.75, 0.2, 5e-3)
    assert found.wall_friction == pytest.approx(0.16, abs=5e-4)
    assert found.stiffness == pytest.approx(2.2, rel=0.02)


def test_a_spring_as_stiff_as_a_scenario_s_stands_for_its_tangential_restitution_and_a_stiffer_one_for_none():
    for restitution in (0.5, 0.8):
        for beta in (-0.4, 0.0, 0.45, 0.99):
            law = LastingContact(0.2, stiffness_of(beta, restitution), restitution, 0.0)
            assert law.tangential_restitution == pytest.approx(beta)
        stiffest = stiffness_of(1.0, restitution)
        assert np.isnan(LastingContact(0.2, 1.01 * stiffest, restitution, 0.0).tangential_restitution)


def test_a_wall_that_gives_back_next_to_nothing_has_a_law_too():
    """No damper of a spring that never pulls gives back less than exp(-2): the fit had ended in an error below 0.18."""
    assert 0.9 < friction_share(0.05)((0.0, 20.0)) <= 1.0 + 1e-9
