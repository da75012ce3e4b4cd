"""A second camera whose delay changes within a run: seen as that, and not called a late clock."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.measurement.clock_change import clock_change
from analysis.gap.measurement.tests import measurement_tests
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

LEAST_S = 3e-5
FRAMES, RUNS, PARTS = 400, 4, 4


def frames(delays_s, rng, noise=1.0, along=3e5):
    """Weighted derivatives and residuals of runs whose parts are late by ``delays_s`` (runs, parts)."""
    part = np.repeat(np.arange(RUNS * PARTS), FRAMES // PARTS)
    slope = along * rng.standard_normal(len(part))
    left = slope * np.ravel(delays_s)[part] + noise * rng.standard_normal(len(part))
    return slope, left, part


def test_a_delay_that_changes_is_reported_with_its_size():
    delays = np.zeros((RUNS, PARTS))
    delays[2, 3] = 2e-4
    found = clock_change(*frames(delays, np.random.default_rng(1)), 1.0, 0.0, LEAST_S)
    assert found is not None and found.unit == "s"
    assert found.size == pytest.approx(2e-4, rel=0.05)
    assert found.strength == pytest.approx(found.size / LEAST_S)


def test_no_change_is_found_in_noise_in_one_delay_or_in_a_lens():
    rng = np.random.default_rng(2)
    none = np.zeros((RUNS, PARTS))
    assert not any(clock_change(*frames(none, rng), 1.0, 0.0, LEAST_S) for _ in range(200))
    changed = none.copy()
    changed[0, 0] = 2e-4
    assert clock_change(*frames(changed, rng), 1.0, 5e-4, LEAST_S) is None  # as much as the lens may do
    small = none.copy()
    small[0, 0] = 0.5 * LEAST_S
    assert clock_change(*frames(small, rng, noise=0.1), 1.0, 0.0, LEAST_S) is None


def test_a_frame_that_one_camera_dropped_is_no_late_clock(loaded):
    """Images of the second camera from one frame on are those of the next: half of the frames know nothing of it."""
    _, series = loaded("unknown_lost_frame", 0.8, 2, runs=2)
    tests = measurement_tests(series)
    assert tests.clock_change is not None
    assert tests.clock_change.size == pytest.approx(series.period_s, rel=0.5)
    assert not any(finding.found for finding in tests.findings.values())


@pytest.mark.others_further
@pytest.mark.parametrize(("drive", "size", "noise", "seed"), [("sine", 1.0, "white", 5), ("start_up", 0.66, "ar1", 1)])
def test_a_late_clock_is_still_one(tmp_path, drive, size, noise, seed):
    """Under a drive that starts, too, whose rise and fall no line follows: its path passed for another delay there."""
    late = make_series("camera_clock_offset", size, np.random.default_rng(seed), 2, noise, place=Place(drive=drive))
    write_series(late, tmp_path / "late")
    series, _ = load_series(read_series(tmp_path / "late"), tmp_path / "results")
    tests = measurement_tests(series)
    assert tests.clock_change is None
    assert [finding.effect for finding in tests.findings.values() if finding.found] == ["camera_clock_offset"]
