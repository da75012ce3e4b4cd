"""Discs are found whatever their brightness, under a lamp from one side; what is no disc is left alone."""

import cv2
import numpy as np
import pytest

from vision.markers.detect import find_discs
from vision.markers.row import radius_px


def scene(shapes, size=(300, 500), background=100.0, noise=2.0, light=0.0, seed=0):
    """Shapes drawn eight times larger and averaged."""
    big = np.full((size[0] * 8, size[1] * 8), background, np.float32)
    for kind, u, v, r, grey in shapes:
        at = (int((u + 0.5) * 8), int((v + 0.5) * 8))
        if kind == "disc":
            cv2.circle(big, at, int(r * 8), grey, -1)
        elif kind == "square":
            cv2.rectangle(
                big, (at[0] - int(r * 8), at[1] - int(r * 8)), (at[0] + int(r * 8), at[1] + int(r * 8)), grey, -1
            )
        elif kind == "bar":
            cv2.rectangle(
                big, (at[0] - int(r * 8), at[1] - int(r * 2)), (at[0] + int(r * 8), at[1] + int(r * 2)), grey, -1
            )
        elif kind == "half":
            cv2.ellipse(big, at, (int(r * 8), int(r * 8)), 0, 0, 180, grey, -1)
    small = cv2.GaussianBlur(cv2.resize(big, size[::-1], interpolation=cv2.INTER_AREA), (0, 0), 0.8)
    small *= 1 + light * (np.arange(size[1]) / size[1] - 0.5)
    return np.clip(np.rint(small + np.random.default_rng(seed).normal(0, noise, size)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("grey", "light", "noise"), [(20, 0, 2), (220, 0, 2), (20, 1.2, 2), (140, 0.0, 3), (30, 0.8, 6)]
)
def test_every_disc_is_found_dark_or_bright_under_uneven_light(grey, light, noise):
    truth = [
        (60, 50, 4),
        (150, 80, 8),
        (260, 60, 13),
        (380, 90, 20),
        (80, 200, 6),
        (200, 220, 10),
        (330, 210, 25),
        (450, 240, 5),
    ]
    found = find_discs(scene([("disc", *disc, grey) for disc in truth], light=light, noise=noise))
    assert len(found) == len(truth)
    for u, v, r in truth:
        k = np.argmin(np.hypot(found[:, 0] - u, found[:, 1] - v))
        assert np.hypot(found[k, 0] - u, found[k, 1] - v) < 0.25 and radius_px(found[k]) == pytest.approx(r, abs=0.4)


def test_squares_bars_and_half_discs_are_no_discs():
    shapes = [
        ("square", 60, 60, 9, 20),
        ("bar", 160, 60, 14, 20),
        ("half", 260, 60, 12, 20),
        ("square", 80, 200, 6, 220),
        ("half", 300, 200, 9, 220),
    ]
    assert len(find_discs(scene([*shapes, ("disc", 420, 150, 9, 20)]))) == 1


def test_noise_alone_and_an_empty_picture_have_none():
    assert len(find_discs(scene([], noise=8))) == 0
    assert len(find_discs(np.full((100, 100), 77, np.uint8))) == 0


def test_a_region_gives_whole_picture_pixels_and_only_what_is_inside():
    picture = scene([("disc", 100, 100, 8, 20), ("disc", 400, 100, 8, 20)])
    found = find_discs(picture, (350, 50, 460, 160))
    assert len(found) == 1 and abs(found[0, 0] - 400) < 0.1
    assert len(find_discs(picture, (600, 0, 700, 50))) == 0


def test_a_search_for_discs_as_seen_before_finds_those_only():
    discs = [(80, 60, 9, 200), (200, 70, 9, 210), (140, 140, 9, 190), (260, 150, 20, 205), (60, 160, 9, 10)]
    picture = scene([("disc", *disc) for disc in discs], noise=2)
    everything = find_discs(picture)
    known = everything[np.hypot(everything[:, 0] - 80, everything[:, 1] - 60) < 2]
    again = find_discs(picture, like=known)
    assert len(everything) == 5 and len(known) == 1
    assert sorted(again[:, 0].round(-1)) == [80, 140, 200]  # neither the larger one nor the dark one
    for fit in again:  # to the same place as the full search
        assert np.hypot(everything[:, 0] - fit[0], everything[:, 1] - fit[1]).min() < 0.01


def test_discs_as_seen_before_are_found_in_16_bit():
    picture = scene([("disc", 80, 60, 9, 200), ("disc", 200, 90, 9, 190)], noise=2).astype(np.uint16) * 200 + 900
    everything = find_discs(picture)
    assert len(find_discs(picture, like=everything[:1])) == len(everything) == 2
