"""From measured impacts to the contact law's quantities, in closed form; what restitution goes with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.contact.impacts import QUANTITIES, Impacts, Junctions
from analysis.contact.law import LawData, law_data, restitution_gain
from analysis.walls.wall import Wall
from tests.analysis.contact.test_contact_law import series

RADIUS_M, Q = 0.01, 0.5


def impacts_of(rng: np.random.Generator, count: int) -> tuple[Impacts, dict[str, np.ndarray]]:
    """Impacts from drawn impulses: the contact point's velocity changes by (1 + 1/q) j_t, the spin by j_t / (q R)."""
    normal, back, slip, impulse, spin = (
        rng.uniform(0.1, 3, count),
        rng.uniform(0, 2, count),
        *rng.normal(0, 1, (2, count)),
        rng.normal(0, 30, count),
    )
    value = np.zeros((count, 8))
    columns = {
        "normal_before": normal,
        "normal_after": back,
        "tangential_before": slip,
        "tangential_after": slip + (1 + 1 / Q) * impulse,
        "spin_before": spin,
        "spin_after": spin + impulse / (Q * RADIUS_M),
        "gap": np.zeros(count),
        "time": np.arange(count) / 10,
    }
    for name, numbers in columns.items():
        value[:, QUANTITIES.index(name)] = numbers
    root = rng.normal(0, 1e-2, (count, 8, 8))
    numbers = {
        "host": rng.normal(0, 1, (count, 4)),
        "drive_rad": rng.uniform(0, 6, count),
        "drive_start_rad": rng.uniform(0, 6, count),
        "run": np.arange(count) % 3,
    }
    none = np.zeros(count)
    junctions = Junctions(
        np.zeros((count, 12)),
        columns["time"],
        np.zeros((count, 13, 13)),
        numbers["host"],
        np.zeros((count, 4)),
        none,
        none,
        numbers["run"],
        none.astype(int),
        numbers["drive_rad"],
        numbers["drive_start_rad"],
        none,
        none,
        RADIUS_M,
    )
    azimuth = rng.uniform(-3, 3, count)
    impacts = Impacts(
        value,
        root @ np.swapaxes(root, 1, 2),
        azimuth,
        none,
        azimuth,
        none.astype(int),
        Wall.ring(0.04),
        junctions,
    )
    return impacts, {**columns, **numbers, "impulse": impulse}


def test_impulses_are_those_that_were_given():
    impacts, true = impacts_of(np.random.default_rng(1), 40)
    used = np.arange(40) % 4 != 0
    data = law_data(impacts, used, RADIUS_M, Q)
    assert len(data) == 30 and (data.at.index == np.flatnonzero(used)).all()
    for ours, name in (
        (data.before, "normal_before"),
        (data.after, "normal_after"),
        (data.slip, "tangential_before"),
        (data.at.spin, "spin_before"),
        (data.at.time_s, "time"),
        (data.at.drive_rad, "drive_rad"),
        (data.at.drive_start_rad, "drive_start_rad"),
        (data.at.run, "run"),
    ):
        assert ours == pytest.approx(true[name][used], rel=1e-12), name
    assert data.normal_impulse == pytest.approx((true["normal_before"] + true["normal_after"])[used], rel=1e-12)
    assert data.tangential_impulse == pytest.approx(true["impulse"][used], rel=1e-12, abs=1e-15)
    assert data.angular == pytest.approx(np.zeros(30), abs=1e-12)
    assert np.array_equal(data.at.host_angle_rad, true["host"][used, 3])
    assert np.array_equal(data.at.azimuth_rad, impacts.azimuth_rad[used])


def test_sds_are_those_of_drawn_errors():
    """The sd of the impulses against the spread of errors drawn from the covariance."""
    impacts, _ = impacts_of(np.random.default_rng(2), 3)
    data = law_data(impacts, np.ones(3, bool), RADIUS_M, Q)
    rng = np.random.default_rng(3)
    for k in range(3):
        drawn = rng.multivariate_normal(impacts.value[k], impacts.covariance[k], 20000)
        at = {name: drawn[:, i] for i, name in enumerate(QUANTITIES)}
        tangential = (at["tangential_after"] - at["tangential_before"]) / (1 + 1 / Q)
        angular = Q * RADIUS_M * (at["spin_after"] - at["spin_before"]) - tangential
        for ours, errors in ((data.tangential_sd[k], tangential), (data.angular_sd[k], angular)):
            assert ours == pytest.approx(np.hypot(errors.std(), 2e-4), rel=0.03)  # 20000 draws: 0.5 % sd


def with_column(data: LawData, size: float, column: np.ndarray) -> LawData:
    return replace(data, after=data.after + size * column * data.before)


def test_what_restitution_goes_with_is_found_with_its_size():
    rng = np.random.default_rng(4)
    column = rng.uniform(-1, 1, 200)
    plain = series(rng, 200)
    gain, found, sd = restitution_gain(with_column(plain, 0.1, column), [column])
    assert abs(found[0] - 0.1) < 4 * sd[0] and 0.002 < sd[0] < 0.01
    # without the column its spread (0.1^2 / 3) goes into the scatter of 0.03: the variance's logarithm rises for each
    # of 200
    assert gain == pytest.approx(200 * np.log(1 + 0.1**2 / 3 / 0.03**2), rel=0.25)
    nothing = restitution_gain(plain, [column])
    assert 0 <= nothing[0] < 12 and abs(nothing[1][0]) < 4 * nothing[2][0]
