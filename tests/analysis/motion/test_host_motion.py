"""The Host's motion: harmonics where they explain it, further lines, a smooth path for the rest; a Host at rest,
outliers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.motion.host_fit import fit_host_motion
from analysis.motion.host_lines import basis, excess, fit_lines
from analysis.motion.host_table import host_at
from analysis.motion.starting_drive import in_phase

FREQUENCY_HZ = 11.03


def shaken(n=480, sd=1e-5, seed=1):
    t = np.arange(n) / 800
    w = 2 * np.pi * FREQUENCY_HZ
    exact = np.column_stack(
        [
            0.0164 * np.sin(w * t + 0.3) + 2e-5 * np.cos(2 * w * t),
            1e-4 * np.cos(w * t),
            5e-5 * np.sin(w * t),
            0.01 * np.sin(3 * w * t),
        ]
    )
    noise = np.random.default_rng(seed).standard_normal(exact.shape) * sd
    return t, exact, exact + noise, np.full_like(exact, sd)


@pytest.mark.parametrize("asked_hz", [11.0, None])
def test_frequency_and_place_within_their_noise(asked_hz):
    t, exact, seen, sd = shaken()
    host = fit_host_motion(t, seen, sd, asked_hz)
    assert abs(host.frequency_hz - FREQUENCY_HZ) < 4 * host.omega_sd_rad_per_s / (2 * np.pi)
    assert np.sqrt(np.mean((host.at(t) - exact) ** 2)) < 3e-6
    assert abs(host.amplitude_m - 0.0164) < 1e-5


def test_acceleration_is_the_second_derivative():
    t, _, seen, sd = shaken()
    host = fit_host_motion(t, seen, sd, 11.0)
    h = 1e-5
    numeric = (host.at(t + h) - 2 * host.at(t) + host.at(t - h)) / h**2
    np.testing.assert_allclose(host.at(t, 2)[:, 0], numeric[:, 0], rtol=1e-3, atol=0.05)


TURN = 2 * np.pi
RANDOM = np.random.default_rng(7).uniform([3.0, 0.0], [25.0, TURN], (40, 2))
DRIVES = {  # x, y (m) over time (s); the lines beside the main one (Hz), whether a smooth path is needed; main line
    "two lines": (
        lambda t: (0.0164 * np.sin(TURN * 11 * t) + 0.0035 * np.cos(TURN * 17.3 * t), 0 * t), [17.3], False, 11.0
    ),
    "two axes": (lambda t: (0.0164 * np.sin(TURN * 11 * t), 0.005 * np.cos(TURN * 13 * t)), [13.0], False, 11.0),
    "a small line": (
        lambda t: (0.0164 * np.sin(TURN * 11 * t) + 1e-4 * np.sin(TURN * 47 * t), 0 * t), [47.0], False, 11.0
    ),
    "another frequency than asked": (lambda t: (0.0164 * np.sin(TURN * 13.2 * t), 0 * t), [], False, 13.2),
    "chirp": (lambda t: (0.01 * np.sin(TURN * (11 * t + 6 * t * t)), 0 * t), [], True, 0.0),
    "random": (lambda t: (sum(2e-3 * np.sin(TURN * f * t + phase) for f, phase in RANDOM), 0 * t), [], True, 0.0),
    "start-up": (lambda t: (0.0164 * np.sin(TURN * 11 * t) * (1 - np.exp(-(t + 0.6) / 0.15)), 0 * t), [], True, 11.0),
}  # fmt: skip


@pytest.mark.parametrize("askew_rad", [0.0, 0.3, -1.85])
def test_a_slow_sway_is_no_second_line_beside_the_drives_however_the_world_is_turned(askew_rad):
    """In a run of less than a period: two lines a fiftieth of a line's width apart would draw any slow way together."""
    t = np.arange(580) / 800
    along, sway = 0.0164 * np.sin(TURN * 11 * t), 1.26e-4 * np.sin(TURN * 1.28 * t + 0.5)
    c, s = np.cos(askew_rad), np.sin(askew_rad)
    x, y = along * c + sway * np.cos(1.07), along * s + sway * np.sin(1.07)
    noise = 8e-6 * np.random.default_rng(7).standard_normal((len(t), 4))
    host = fit_host_motion(t, np.column_stack([x, y, 0 * t, 0 * t]) + noise, np.full((len(t), 4), 8e-6), 11.0)
    assert len(host.lines_rad_per_s) == 0
    assert host.omega_rad_per_s == pytest.approx(TURN * 11, rel=1e-3)
    assert np.abs(host.harmonics).max() < 0.02


def test_a_height_of_one_line_is_known_as_one_whatever_happens_in_the_plane():
    """Its second derivative is a load of the floor; a path that only follows its frames would be a tenth off."""
    t = np.arange(480) / 800
    x, y = DRIVES["random"][0](t)
    z = 5e-4 * np.sin(TURN * 11 * t + 0.4)
    noise = 1e-5 * np.random.default_rng(4).standard_normal((len(t), 4))
    host = fit_host_motion(t, np.column_stack([x, y, z, 0 * t]) + noise, np.full((len(t), 4), 1e-5), None)
    exact = -5e-4 * (TURN * 11) ** 2 * np.sin(TURN * 11 * t + 0.4)
    off = host.at(t, 2)[:, 2] - exact
    assert np.sqrt(np.mean(off**2)) < 0.01 * np.std(exact)


def seen_under(drive, seed, correlation=0.0, n=800, sd=8e-6):
    """(t, exact (N, 2), seen (N, 4), sd): markers' noise white or AR(1), gaps, gross errors."""
    rng = np.random.default_rng(seed)
    t = (np.arange(n) - 0.5 * n) / 800
    exact = np.stack(DRIVES[drive][0](t), -1)
    noise = rng.standard_normal((n, 4))
    for i in range(1, n):
        noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * noise[i]
    sds = sd * np.array([1.0, 1.0, 2.5, 20.0])
    seen = np.column_stack([exact, np.zeros((n, 2))]) + noise * sds
    seen[rng.random(n) < 0.001] += 3e-4
    seen[200:225] = np.nan
    return t, exact, seen, np.broadcast_to(sds, (n, 4))


@pytest.mark.others_further
@pytest.mark.parametrize("across", ["a line of its own", "along with the drive"])
def test_the_way_across_a_sweeping_drive_is_followed(across):
    """A hundredth of the drive, under correlated noise of 50 um: a line that it keeps, or the drive's own path. The
    sweep's mean frequency missed the drive's own by 63 um, which to every test of the residuals was such noise."""
    t, off = np.arange(660) / 1340 - 0.25, []
    x = 0.039 * np.sin(TURN * (7.6 * t + 2.3 * t * t))
    y = 4e-4 * np.sin(TURN * 9.1 * t + 0.7) if across == "a line of its own" else 0.01 * x
    for seed in range(6):
        white = np.random.default_rng(seed).standard_normal((len(t), 4))
        noise = 5e-5 * np.sqrt(1 - 0.6**2) * lfilter([1.0], [1.0, -0.6], white, axis=0) * np.array([1, 1, 1.5, 5])
        seen = np.column_stack([x, y, 0 * t, 0 * t]) + noise
        host = fit_host_motion(t, seen, np.tile(noise.std(0), (len(t), 1)), None)
        off.append(np.std(host.at(t)[:, 1] - y))
    assert np.sqrt(np.mean(np.square(off))) < 1.4e-5


@pytest.mark.further
def test_a_height_keeps_its_frequency_while_the_drive_starts():
    """The start bends the drive's frequency, which a height known by 25 um would follow: 0.034 of its load then, over
    these ten runs."""
    t, w, sd, off = np.arange(400) / 733.7, 2 * np.pi * 9.4436, np.array([7e-6, 7e-6, 2.5e-5, 1e-4]), []
    height = 1.15e-3 * np.sin(w * t + 1.0)
    for seed in range(10):
        x = 0.03 * np.sin(w * t + 0.4 + seed) * (1 - np.exp(-t / 0.15))
        exact = np.column_stack([x, 0.01 * x, height, np.zeros(len(t))])
        seen = exact + sd * np.random.default_rng(seed).standard_normal(exact.shape)
        host = fit_host_motion(t - t.mean(), seen, np.tile(sd, (len(t), 1)), 9.4436)
        off.append(np.std(host.at(t - t.mean(), 2)[:, 2] + w**2 * height) / np.std(w**2 * height))
    assert np.sqrt(np.mean(np.square(off))) < 0.028


@pytest.mark.others_further
@pytest.mark.parametrize("correlation", [0.0, 0.6])
@pytest.mark.parametrize("drive", DRIVES)
def test_any_drive_is_followed_within_its_own_sds(drive, correlation):
    lines, smooth, main = DRIVES[drive][1:]
    squares = []
    for seed in range(2):
        t, exact, seen, sd = seen_under(drive, seed, correlation)
        host = fit_host_motion(t, seen, sd, 11.0)
        np.testing.assert_allclose(host.lines_rad_per_s / TURN, lines, atol=0.2)
        assert host.frequency_hz == pytest.approx(main, abs=0.05)
        assert any(one is not None for one in host.smooth) == smooth and host.harmonic == (not lines and not smooth)
        inside = slice(10, -10)  # the ends of a path that steps are no smooth motion
        step = 1e-5
        speed = (np.stack(DRIVES[drive][0](t + step), -1) - np.stack(DRIVES[drive][0](t - step), -1)) / (2 * step)
        covariance = host.covariance(t)[inside, :2]
        for order, true in enumerate((exact, speed)):
            miss = (host.at(t, order)[:, :2] - true)[inside]
            variance = covariance[:, :, order, order]
            assert np.all(miss[variance == 0] == 0)  # an axis without a line has no speed
            squares.append(np.mean(miss**2 / np.maximum(variance, 1e-300), 0))
    assert np.all(np.sqrt(np.mean(np.array(squares).reshape(2, 2, 2), 0)) < 2.5)


def test_a_host_that_steps_back_at_impacts_is_followed_below_its_noise():
    """Kinks of 2 mm/s are no smooth motion; the path is within the noise of a frame all the same."""
    rng = np.random.default_rng(11)
    t = np.arange(800) / 800 - 0.5
    steps = list(zip(np.sort(rng.uniform(-0.48, 0.45, 15)), 2e-3 * rng.choice([-1, 1], 15), strict=True))

    def exact(at):
        late = [np.clip(at - when, 0, None) for when, _ in steps]
        back = sum(size * one * np.exp(-one / 0.03) for one, (_, size) in zip(late, steps, strict=True))
        return 0.0164 * np.sin(TURN * 11 * at) + back

    seen = np.column_stack([exact(t), np.zeros((800, 3))]) + 8e-6 * rng.standard_normal((800, 4))
    host = fit_host_motion(t, seen, np.full((800, 4), 8e-6), 11.0)
    assert not host.harmonic and host.frequency_hz == pytest.approx(11.0, abs=0.02)
    assert np.std((host.at(t)[:, 0] - exact(t))[10:-10]) < 5e-6
    speed = (exact(t + 1e-5) - exact(t - 1e-5)) / 2e-5
    assert np.std((host.at(t, 1)[:, 0] - speed)[10:-10]) < 1e-3


@pytest.mark.parametrize("drive", ["two lines", "chirp", "start-up"])
def test_compiled_code_takes_the_same_path(drive):
    t, _, seen, sd = seen_under(drive, 0)
    host = fit_host_motion(t, seen, sd, 11.0)
    table = host.table(t[0], t[-1])
    times = np.linspace(t[0], t[-1], 1777)
    found = np.array([host_at(one, table) for one in times])
    np.testing.assert_allclose(found[:, :4], host.at(times), atol=1e-10)
    np.testing.assert_allclose(found[:, 4:8], host.at(times, 1), atol=1e-7)
    assert np.abs(found[:, 8] - host.at(times, 2)[:, 2]).max() < 1e-6 * np.abs(host.at(times, 2)).max()
    far = host_at(t[-1] + 1.0, table)
    last = host_at(t[-1] + 0.5, table)
    assert far.x - last.x == pytest.approx(0.5 * far.vx) and far.lift == 0.0  # beyond it goes on as it went


def test_a_path_goes_on_beyond_its_ends_with_the_velocity_it_has():
    t, _, seen, sd = seen_under("chirp", 0)
    path = fit_host_motion(t, seen, sd, None).smooth[0]
    beyond = path.last_s + np.array([0.0, 0.1, 0.2])
    assert np.ptp(np.diff(path.at(beyond))) < 1e-12 and np.ptp(path.at(beyond, 1)) == 0.0
    assert path.at(beyond[1:], 2).tolist() == [0.0, 0.0]


def test_noise_alone_is_no_motion():
    """Neither a Host at rest nor a shaken one gets lines or a path from noise, white or correlated."""
    for correlation in (0.0, 0.5, 0.7):
        for seed in range(12):
            rng = np.random.default_rng(seed)
            noise = rng.standard_normal((600, 4))
            for i in range(1, 600):
                noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * noise[i]
            t, exact, _, sd = shaken(600)
            assert fit_host_motion(t, exact + 1e-5 * noise, sd, 11.0).harmonic
            still = fit_host_motion(t, 1e-5 * noise, sd, None)
            assert still.harmonic and not still.moves


def test_outliers_and_gaps_do_no_harm():
    t, exact, seen, sd = shaken()
    seen[50, 0] += 2e-3
    seen[200:240] = np.nan
    host = fit_host_motion(t, seen, sd, 11.0)
    assert np.abs(host.at(t) - exact).max() < 2e-5


def test_the_phase_is_that_of_a_sine():
    t, _, seen, sd = shaken()
    assert fit_host_motion(t, seen, sd, 11.0).phase_rad == pytest.approx(0.3, abs=2e-3)


def test_a_host_at_rest_has_means_only():
    seen = np.full((50, 4), 0.01) + 1e-6 * np.random.default_rng(1).standard_normal((50, 4))
    host = fit_host_motion(np.arange(50) / 800, seen, np.full((50, 4), 1e-6), None)
    assert host.omega_rad_per_s == 0.0 and host.amplitude_m == 0.0
    np.testing.assert_allclose(host.at(np.array([0.0, 1.0])), 0.01, atol=1e-6)


def test_nothing_seen_is_a_host_at_the_origin():
    host = fit_host_motion(np.arange(5) / 800, np.full((5, 4), np.nan), np.full((5, 4), 1e-5), None)
    assert np.all(host.at(np.zeros(1)) == 0.0)


def test_a_slow_path_of_a_short_run_is_seen_beside_three_columns_of_noise():
    """Six times the noise, 320 frames: what correlation the noise has one column leaves open, four do not."""
    time_s = np.arange(320) / 800
    slow = 8e-5 * np.cos(2 * np.pi * 13 * time_s) * np.sin(2 * np.pi * 3.1 * time_s)
    for seed in range(20):
        residual = np.random.default_rng(seed).normal(0, 1.3e-5, (320, 4))
        residual[:, 2] += slow
        assert [one.there for one in excess(time_s, residual)] == [False, False, True, False]


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.7])
def test_noise_alone_is_no_motion_however_it_goes_on_from_frame_to_frame(correlation):
    time_s = np.arange(320) / 800
    for seed in range(40):
        white = np.random.default_rng([seed, 7]).normal(0, 1.3e-5, (360, 4))
        noise = lfilter([1.0], [1.0, -correlation], white, axis=0)[40:]
        assert not any(one.there for one in excess(time_s, noise))


def test_a_drive_that_starts_keeps_its_frequency():
    """A line through the start gave way to it by some per cent; overtones, noise of both kinds, three lengths."""
    squares = []
    for number, length in enumerate((0.45, 0.6, 1.2)):
        for seed in range(4):
            rng = np.random.default_rng([number, seed])
            t = np.arange(0.0, length, 1 / 800) - 0.5 * length
            w, turn = 70.0 * rng.uniform(0.9, 1.1), rng.uniform(0, TURN)
            x = 0.016 * (1 - np.exp(-(t - t[0]) / 0.15)) * np.cos(w * t + turn) + 1.5e-4 * np.cos(2 * w * t)
            noise = 8e-6 * lfilter([1.0], [1.0, -0.3 * (seed % 2)], rng.standard_normal((len(t), 4)), axis=0)
            seen = np.column_stack([x, 0 * x, 0 * x, 0 * x]) + noise
            host = fit_host_motion(t, seen, np.full(seen.shape, 8e-6), 11.0)
            assert host.omega_sd_rad_per_s < 5e-5 * w
            squares.append(((host.omega_rad_per_s - w) / host.omega_sd_rad_per_s) ** 2)
    assert 0.6 < np.sqrt(np.mean(squares)) < 1.6


def test_what_changes_its_frequency_has_none_of_one_sine():
    """A drive that sweeps, and one that hops to another frequency half way, are no sine of changing size."""
    t = np.arange(800) / 800 - 0.5
    hop = np.where(t < 0, np.sin(70.0 * t), np.sin(75.0 * t))
    for way in (0.01 * np.sin(TURN * (11 * t + t * t)), 0.01 * hop):
        found = in_phase(t, way + 8e-6 * np.random.default_rng(0).standard_normal(800), 70.0, 3)
        assert found.left_m > 2e-5


def test_a_size_that_goes_through_zero_makes_no_other_frequency():
    """Of two and a half periods of a steady sine: looked for 1.5 turns to both sides a slower one, 1.33 Hz, stood in
    its place."""
    t = np.arange(800) / 800 - 0.5
    way = 0.01 * np.sin(TURN * 2.5 * t + 0.3) + 5e-6 * np.random.default_rng(1).standard_normal(800)
    found = in_phase(t, way, TURN * 2.6)
    assert found is not None and abs(found.omega_rad_per_s - TURN * 2.5) < 1e-3 * TURN * 2.5


@pytest.mark.parametrize("seed", range(6))
def test_lines_that_come_to_no_rest_still_are_the_path_that_they_leave_their_residual_of(seed):
    """Two lines nearer than a line's width, on a path that is none: their frequencies had moved on after the last
    amplitudes, and the path was 5 mm off the one that the residual was taken from."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(1200) / 1600
    size, rate, phase = rng.normal(0, 1e-3, 12), rng.uniform(60, 220, 12), rng.uniform(0, 6, 12)
    swings = size[:, None] * np.cos(rate[:, None] * time_s + phase[:, None])
    place = np.column_stack([swings.sum(0), *np.zeros((3, len(time_s)))]) + rng.normal(0, 5e-6, (len(time_s), 4))
    fit = fit_lines(time_s, place, np.full(place.shape, 5e-6), np.array([138.0, 141.0]), 3)
    path = basis(time_s, fit.omegas) @ fit.coefficients[0]
    np.testing.assert_allclose(path + fit.residual[:, 0], place[:, 0], rtol=0, atol=1e-9)


@pytest.mark.others_further
@pytest.mark.parametrize("seed", range(8))
def test_the_path_of_a_random_drive_is_where_its_residual_says(seed):
    """And its velocity is its own derivative, beside a rise and fall and a sway that have lines of their own."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(1200) / 1600
    size, rate, phase = rng.normal(0, 2e-3, 9), rng.uniform(60, 220, 9), rng.uniform(0, 6, 9)
    swings = size[:, None] * np.cos(rate[:, None] * time_s + phase[:, None])
    place = rng.normal(0, 5e-6, (len(time_s), 4))
    place[:, 0] += swings.sum(0)
    place[:, 1] += 5e-5 * np.cos(124.9 * time_s)
    place[:, 2] += 2e-4 * np.cos(124.8 * time_s + 1.0)
    motion = fit_host_motion(time_s, place, np.full(place.shape, 5e-6), None)
    # Frequencies that rest move by a thousandth of their sds after the last amplitudes.
    np.testing.assert_allclose(motion.at(time_s) + motion.residual, place, rtol=0, atol=1e-7)
    assert np.sqrt(np.mean(motion.residual[:, :2] ** 2)) < 8e-6
