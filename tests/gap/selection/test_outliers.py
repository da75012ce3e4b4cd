"""Impacts off the law: an outlier is left out, many are structure that a fit must keep."""

from __future__ import annotations

import numpy as np

from analysis.contact.law import OUTLIER_SHARE, Circumstances, LawData, fit_restitution
from analysis.gap.selection.impacts.fit import _with_structure


def impacts(rng: np.random.Generator, lower: int, count: int = 200) -> LawData:
    """``count`` impacts of restitution 0.72 +- 0.01, seen with 2 mm/s; the first ``lower`` of them with 0.3 less."""
    before = rng.uniform(0.3, 2.0, count)
    restitution = 0.72 + 0.01 * rng.standard_normal(count) - 0.3 * (np.arange(count) < lower)
    after = restitution * before + 2e-3 * rng.standard_normal(count)
    none, sd = np.zeros(count), np.full(count, 2e-3)
    azimuth = np.sort(rng.uniform(0, 2 * np.pi, count))  # the lower ones lie together: a soft spot
    return LawData(
        before=before,
        after=after,
        slip=none,
        normal_impulse=before + after,
        tangential_impulse=none,
        angular=none,
        normal_sd=sd,
        tangential_sd=sd,
        angular_sd=sd,
        at=Circumstances(
            spin=none,
            run=none.astype(int),
            time_s=np.arange(count) / 100,
            azimuth_rad=azimuth,
            host_angle_rad=none,
            drive_rad=none,
            drive_start_rad=none,
            index=np.arange(count),
        ),
        inertia_factor=0.5,
    )


def test_one_gross_outlier_stays_out_and_moves_nothing():
    data = _with_structure(impacts(np.random.default_rng(1), 1))
    assert data.outliers == OUTLIER_SHARE
    (restitution,), covariance, _, _ = fit_restitution(data)
    assert abs(restitution - 0.72) < 4 * np.sqrt(covariance[0, 0])


def test_a_soft_spot_is_no_outlier():
    data = _with_structure(impacts(np.random.default_rng(2), 14))
    assert data.outliers == 0.0
    (restitution,), _, scatter, _ = fit_restitution(data)
    assert scatter > 0.05 and abs(restitution - (0.72 - 0.3 * 14 / 200)) < 0.012


def test_a_handful_of_impacts_keeps_what_it_was_given():
    few = impacts(np.random.default_rng(3), 3, count=12)
    assert _with_structure(few) is few
