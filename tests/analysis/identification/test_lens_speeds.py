"""What a lens residual leaves open of the restitution: its gradient against finite differences, its size against
impacts measured through one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from analysis.flights.cutting.run_data import LENS_POWERS, LENS_TERMS, lens_basis
from analysis.identification.lens_residual import LensResidual, lens_gradient, restitution_sd

RADIUS_M, RESTITUTION = 0.04, 0.7


def test_the_gradient_is_that_of_the_basis():
    xy = np.random.default_rng(1).uniform(-0.04, 0.04, (9, 2))
    found = lens_gradient(xy, RADIUS_M)
    for axis in (0, 1):
        step = np.eye(2)[axis] * 1e-7
        difference = (lens_basis(xy + step, RADIUS_M) - lens_basis(xy - step, RADIUS_M)) / 2e-7
        np.testing.assert_allclose(found[:, :, axis], difference, atol=1e-5)


@dataclass(frozen=True, eq=False)
class Seen:
    """What the lens' share needs of the law's data."""

    at: SimpleNamespace
    before: np.ndarray
    after: np.ndarray
    normal_sd: np.ndarray

    def __len__(self) -> int:
        return len(self.before)


def impacts_seen_through(scales: np.ndarray, rng: np.random.Generator, count: int = 200):
    """Impacts of one restitution on a moving Host, their world speeds along x and y too long by ``scales``; (impacts,
    law data).
    """
    azimuth, approach, host = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.5, 3.0, count), rng.uniform(-1, 1, count)
    normal = np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    host_velocity = np.column_stack([host, np.zeros(count)])
    before, after = (host_velocity + speed[:, None] * normal for speed in (approach, -RESTITUTION * approach))
    state = np.zeros((count, 12))
    state[:, :2] = state[:, 6:8] = RADIUS_M * normal
    state[:, 3:5], state[:, 9:11] = before * (1 + scales), after * (1 + scales)
    seen = [np.sum((state[:, at : at + 2] - host_velocity) * normal, 1) for at in (3, 9)]
    impacts = SimpleNamespace(junctions=SimpleNamespace(state=state), normal_rad=azimuth)
    return impacts, Seen(SimpleNamespace(index=np.arange(count)), seen[0], -seen[1], np.full(count, 1e-4))


def test_speeds_too_long_move_the_restitution_as_far_as_its_sd_says():
    """Scales along x and y drawn with the residual's sd, 300 times over the same impacts."""
    scale_sd = 1e-3
    covariance = np.zeros((len(LENS_TERMS), len(LENS_TERMS)))
    for at in (LENS_POWERS.index((1, 0)), len(LENS_POWERS) + LENS_POWERS.index((0, 1))):
        covariance[at, at] = (scale_sd * RADIUS_M) ** 2
    lens = LensResidual(3e-5, 3e-5 / RADIUS_M, covariance, covariance)
    law = SimpleNamespace(restitution=RESTITUTION, scatter=0.0)
    errors = []
    for seed in range(300):
        impacts, data = impacts_seen_through(
            np.random.default_rng(seed).normal(0, scale_sd, 2), np.random.default_rng(7)
        )
        errors.append(np.sum(data.before * data.after) / np.sum(data.before**2) - RESTITUTION)
    impacts, data = impacts_seen_through(np.zeros(2), np.random.default_rng(7))
    expected = restitution_sd(lens, impacts, data, law, RADIUS_M)
    # 300 draws tell an rms to 4 %.
    assert abs(np.sqrt(np.mean(np.square(errors))) / expected - 1) < 0.15
    assert restitution_sd(replace(lens, amplitude_m=0.0), impacts, data, law, RADIUS_M) == 0.0
