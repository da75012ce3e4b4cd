"""Clocks, markers, light and pictures: each cause does what its formula says."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series
from analysis.blind.plant.host import host_pose
from analysis.blind.recording.clock import dropped_s, free_running_s, grounded_s, pulsed_s, shocked_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import glared, glinted, shaded, shadowed, through_lid, trailed
from analysis.blind.recording.markers import bent_m, carded, draw_marks, flung, world_points
from analysis.blind.recording.picture import shake_px, tripod_px, twist_rad, twisted
from analysis.blind.recording.tracker import blocked
from analysis.blind.recording.views import DISK, MARKERS, draw_views
from tests.gap.blind.plant.rig import DRIVE, HOST, MEANT, STILL, TIMES, film, pictured, rms


def test_a_clock_of_its_own_gains_evenly():
    time = np.array([0.1, 0.4, 0.9])
    late = free_running_s(time, ViewErrors(free_running=1.2e-3))
    assert late == pytest.approx([-4.8e-4, -1.2e-4, 4.8e-4], abs=1e-12)
    assert np.all(free_running_s(time, ViewErrors()) == 0.0)


def test_a_grounded_trigger_is_late_with_the_hosts_acceleration():
    time = np.array([0.0, 0.01, 0.033])
    host = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
    assert grounded_s(time, HOST, ViewErrors(grounded_s=4e-4)) == pytest.approx(4e-4 * host / 78.5, abs=1e-12)
    assert np.all(grounded_s(time, HOST, ViewErrors()) == 0.0)


def test_pulses_set_a_clock_right():
    errors = ViewErrors(sync_s=6e-4, sync_every_s=0.3, sync_late_s=0.1)
    late = pulsed_s(np.array([0.1, 0.25, 0.3999, 0.4, 0.05]), errors)
    assert late == pytest.approx(6e-4 * np.array([-0.5, 0.0, 0.5, -0.5, 1.0 / 3.0]), abs=1e-6)


def test_a_shocked_trigger_recovers():
    errors = ViewErrors(shocked_s=1e-4)
    kicks = np.array([[1.2, -1.6], [0.0, 1.0]])
    time = np.array([0.0, 0.1, 0.14, 0.2, 0.24])
    expected = 1e-4 * np.array([0.0, 2.0, 2.0 * np.exp(-1.0), 1.0, np.exp(-1.0)])
    assert shocked_s(time, np.array([0.1, 0.2]), kicks, errors) == pytest.approx(expected)
    assert np.all(shocked_s(time, np.zeros(0), np.zeros((0, 2)), errors) == 0.0)


def test_a_dropped_frame_makes_the_rest_one_later():
    errors = ViewErrors(dropped_from=(1.0, 0.4))
    assert np.all(dropped_s(10, 0, 800.0, errors) == 0.0)
    assert dropped_s(10, 1, 800.0, errors) == pytest.approx(np.array([0.0] * 4 + [1.0 / 800.0] * 6))
    assert np.all(dropped_s(10, 0, 800.0, ViewErrors()) == 0.0)
    for size, least, most in ((0.3, 1, 2), (1.0, 4, 6), (1.2, 5, 7)):
        draft = draft_series("unknown_dropped_frame", size, np.random.default_rng(1), 12)
        shares = np.array(draft.view["dropped_from"])
        lost = shares < 1.0
        assert np.sum(lost) == draft.parameters["unknown_dropped_frame"]["runs_dropped"] and len(shares) == 12
        assert least <= np.sum(lost) <= most and np.all((shares[lost] > 0.3) & (shares[lost] < 0.7))


def test_a_dropped_frame_is_seen_from_where_it_was_lost():
    """The second camera shows the frame after, and the film is as long."""
    name = "unknown_dropped_frame"
    moved = pictured(name, 1.0, lambda camera, marker, view: camera == "VW2")
    assert moved > 5.0 * MEANT["measurement"][1]  # one frame's way is what it is
    (seen, view), (plain, _) = film(name, 1.0), film("none", 1.0)
    frames = plain.index.get_level_values("frame").max() + 1
    off = np.hypot(*(seen - plain).dropna().loc["VW2"].to_numpy().T)
    frame = (seen - plain).dropna().loc["VW2"].index.get_level_values("frame")
    from_here = frame >= view["dropped_from"][0] * frames
    assert off[~from_here].max() < 1e-9 and rms(off[from_here]) > 1.0
    shown, follows = (q.loc["VW2"].xs("H1", level="marker")["u_px"] for q in (seen, plain))
    late = shown.index[shown.index >= view["dropped_from"][0] * frames]
    both = late.intersection(follows.index - 1)
    noise = (shown.loc[both].to_numpy() - follows.loc[both + 1].to_numpy()).std()
    assert noise < 0.6 and len(both) > 100


def test_a_tab_bends_back_and_leaves_the_other_markers():
    time, errors = np.array([0.0, 0.01, 0.033]), ViewErrors(tab_m=5e-4, tab_marker=2)
    pull = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0) / 78.5
    bent = bent_m(time, HOST, errors)
    assert bent == pytest.approx(np.column_stack([-5e-4 * pull, np.zeros(3)]), abs=1e-12)
    marks, poses = draw_marks((0.0, 0.0), np.random.default_rng(1)), np.zeros((3, 4))
    moved = world_points(poses, poses, marks, errors, bent) - world_points(poses, poses, marks, ViewErrors())
    assert np.flatnonzero(np.abs(moved).max(axis=(0, 2))).tolist() == [5]  # G1 to G3, H1, H2, H3
    assert moved[:, 5, :2] == pytest.approx(bent, abs=1e-12)


def test_a_loose_sticker_is_flung_outwards():
    points = np.zeros((5, len(MARKERS), 3))
    points[:, 9, :2] = [0.0, 0.006]  # N3, from a middle one at the origin
    time = np.arange(5) / 800.0
    for spin, share in ((40.0, 0.5), (-80.0, 0.8), (0.0, 0.0)):
        off = flung(points, spin * time, time, ViewErrors(flung_m=3e-4, flung_marker=2)) - points
        assert off[:, 9] == pytest.approx(np.tile([0.0, 3e-4 * share, 0.0], (5, 1)))
        assert np.all(np.delete(off, 9, axis=1) == 0.0)


def test_a_card_swings_after_a_blow():
    nes, time = np.zeros((5, 4)), np.array([0.0, 0.1, 0.105, 0.11, 0.13])
    swung = carded(nes, time, np.array([[0.1, 40.0], [0.11, -20.0]]), ViewErrors(card_s=1e-3, card_hz=50.0))

    def swing(since):
        return -1e-3 * np.exp(-since / 0.03) * np.sin(100.0 * np.pi * since)

    expected = [0.0, 0.0, 40.0 * swing(0.005), 40.0 * swing(0.01), 40.0 * swing(0.03) - 20.0 * swing(0.02)]
    assert swung[:, 3] == pytest.approx(np.array(expected), abs=1e-12)
    assert np.all(swung[:, :3] == 0.0) and np.all(nes == 0.0)


def test_a_reflection_draws_markers_towards_it():
    view = draw_views(np.random.default_rng(8))[1]
    errors = ViewErrors(glare_px=2.0, glare_m=(0.01, -0.015), glare_camera=1)
    points = np.array([[[0.01, -0.015, 0.01], [0.018, -0.015, 0.01], [0.06, -0.015, 0.01]]])
    plain = view.pixels(points)
    moved = glared(plain, 1, view, errors) - plain
    back = (plain[0, 0] - plain[0, 1]) / np.hypot(*(plain[0, 0] - plain[0, 1]))
    assert moved[0] == pytest.approx(np.array([[0.0, 0.0], 2.0 * back, [0.0, 0.0]]), abs=1e-4)
    assert np.array_equal(glared(plain, 0, view, errors), plain)


def test_a_pane_displaces_what_lies_beyond_its_edge():
    view = draw_views(np.random.default_rng(8))[1]
    errors = ViewErrors(lid_px=1.2, lid_m=(0.01, -0.005), lid_rad=np.pi / 2, lid_camera=1)
    points = np.array([[[0.03, -0.004, 0.01], [-0.03, -0.006, 0.01]]])
    plain = view.pixels(points)
    moved = through_lid(plain, 1, view, errors) - plain
    up = view.pixels(np.array([[0.01, 0.005, 0.01], [0.01, -0.005, 0.01]]))
    across = (up[0] - up[1]) / np.hypot(*(up[0] - up[1]))
    assert moved[0] == pytest.approx(np.array([1.2 * across, [0.0, 0.0]]), abs=1e-9)
    assert np.array_equal(through_lid(plain, 0, view, errors), plain)


def test_a_low_lamp_shades_the_disk_near_the_wall():
    """A lamp along x: the markers of a disk near the wall there move back along x, those elsewhere and of the Host do
    not."""
    view = draw_views(np.random.default_rng(1))[0]
    points = np.zeros((4, len(MARKERS), 3))
    points[:, 3:7, :2] = 0.05 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    points[:, 7:, 0] = np.array([-0.03, 0.012, 0.022, 0.04])[:, None]
    pixels = view.pixels(points)
    off = shaded(pixels, points, view, ViewErrors(shade_px=1.4)) - pixels
    assert np.all(off[:, :7] == 0.0)
    across = np.subtract(*view.pixels(np.array([[0.0, 0.0, 0.01], [0.01, 0.0, 0.01]])))
    across /= np.hypot(*across)
    for frame, deep in enumerate((0.0, 0.0, 0.5, 1.0)):
        assert off[frame, 7:] == pytest.approx(np.tile(1.4 * deep * across, (5, 1)), abs=5e-3)


def test_a_shadow_moves_markers_near_the_wall_inwards():
    host = np.array([[0.01, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    points = np.zeros((2, 12, 3))
    points[0, DISK, 0] = 0.01 + np.array([0.0, 0.03, 0.04, 0.045, 0.05])
    points[1, DISK, 1] = -np.array([0.0, 0.03, 0.04, 0.045, 0.05])
    off = shadowed(points, host, ViewErrors(shadow_m=4e-4)) - points
    inwards = 4e-4 * np.array([0.0, 0.0, 0.0, 0.5, 1.0])
    assert off[0, DISK, 0] == pytest.approx(-inwards, abs=1e-12) and off[1, DISK, 1] == pytest.approx(
        inwards, abs=1e-12
    )
    assert np.all(off[:, :7] == 0.0) and np.all(off[..., 2] == 0.0)
    assert np.all(off[0, :, 1] == 0.0) and np.all(off[1, :, 0] == 0.0)


def test_tails_glints_and_a_twisted_camera():
    view = draw_views(np.random.default_rng(1))[0]
    pixels = np.zeros((5, len(MARKERS), 2)) + view.centre_px
    pixels[..., 0] += 3.0 * np.arange(5)[:, None]
    late = trailed(pixels, 800.0, ViewErrors(comet_s=1e-4)) - pixels
    assert late[:, :7] == pytest.approx(0.0) and late[:, 7:, 0] == pytest.approx(-0.24)
    points = np.zeros((2, len(MARKERS), 3))
    points[0, 10], points[1, 10] = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]  # N4 from N2
    errors = ViewErrors(glint_px=0.8, glint_rad=0.0, lamp_rad=np.pi / 2, glint_camera=1)
    lit = glinted(pixels[:2], points, 1, errors) - pixels[:2]
    assert lit[0, 7:] == pytest.approx(np.tile([0.0, 0.8], (5, 1))) and lit[1] == pytest.approx(0.0)
    assert np.array_equal(glinted(pixels[:2], points, 0, errors), pixels[:2])
    time = TIMES[:5]
    turn = twist_rad(time, HOST, ViewErrors(twisted_rad=4e-3))
    pull = np.array([host_pose(t, HOST)[2][0] for t in time])
    assert turn == pytest.approx(4e-3 * pull / 78.5, abs=1e-12)
    off = twisted(pixels, turn, view) - pixels
    away = 3.0 * np.arange(5)[:, None]
    assert off[..., 1] == pytest.approx(np.broadcast_to(away * np.sin(turn)[:, None], off.shape[:2]))


def test_a_camera_swings_after_each_impact_and_dies_out():
    errors = ViewErrors(shaken_px=0.4, shaken_hz=30.0)
    time = np.array([0.05, 0.11, 0.12, 0.3])
    off = shake_px(time, np.array([0.1, 0.115]), np.array([[2.0, 5.0], [-1.0, 0.0]]), errors)

    def one(late):
        return np.exp(-late / 0.04) * np.sin(60.0 * np.pi * late)

    expected = [0.0, 0.8 * one(0.01), 0.8 * one(0.02) - 0.4 * one(0.005), 0.8 * one(0.2) - 0.4 * one(0.185)]
    assert off == pytest.approx(expected, abs=1e-12) and abs(off[-1]) < 0.01


def test_a_tripod_swings_with_the_drive():
    errors = ViewErrors(tripod_px=0.8, tripod_rad=0.6, tripod_s=0.004)
    swing = -0.0164 * DRIVE**2 / 78.5 * 0.8 * np.sin(DRIVE * (TIMES - 0.004) + 2.0)
    expected = swing[:, None] * [np.cos(0.6), np.sin(0.6)]
    assert tripod_px(TIMES, HOST, errors) == pytest.approx(expected, abs=1e-9)
    assert np.abs(swing).max() == pytest.approx(0.8, rel=0.01)
    assert np.all(tripod_px(TIMES, STILL, errors) == 0.0)


def test_a_tripod_moves_all_markers_of_its_camera_alike():
    off = (film("unknown_shaking_tripod", 1.0)[0] - film("none", 1.0)[0]).dropna().loc["VW1"]
    assert off.groupby("frame").std().max().max() < 1e-9 and off["u_px"].std() > 0.05


def test_a_coded_film_draws_markers_to_the_middles_of_its_blocks():
    pixels = np.array([[[800.0, 802.0], [804.5, 806.0]]])
    off = blocked(pixels, ViewErrors(blocked_px=0.8)) - pixels
    assert off == pytest.approx(-0.8 * np.array([[[0.0, 1.0], [np.sin(np.pi * 1.125), -1.0]]]), abs=1e-9)
    many = np.linspace(800.0, 816.0, 400)[None, :, None] * np.ones(2)
    assert np.all(np.diff(blocked(many, ViewErrors(blocked_px=1.0)), axis=1) > 0.0)  # no marker overtakes another
