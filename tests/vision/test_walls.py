"""Walls from images: radius and centre within their uncertainty, edges that belong to something else left out."""

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from ovines.camera import Camera
from vision.walls.rims import fit_rim

SIZE = (760, 620)


def look_at(name, centre, target, focal, size, distortion, principal):
    """A camera that looks from `centre` at `target`, u along the world's x as nearly as it can be."""
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    matrix = np.array([[focal, 0, principal[0]], [0, focal, principal[1]], [0, 0, 1.0]])
    return Camera(name, size, matrix, distortion, rotation, -rotation @ centre)


def camera_pair():
    return [
        look_at(
            name,
            1.23 * np.array([side * np.sin(0.36), 0.01, np.cos(0.36)]),
            np.zeros(3),
            6380.0,
            (4096, 3072),
            np.array([-0.05, 0.1, 2e-4, -1e-4, 0]),
            (2050.0, 1530.0),
        )
        for name, side in (("VW1", -1), ("VW2", 1))
    ]


def supersampled(camera: Camera, offset, layers, rng, noise=2.0, n=2):
    """A picture by asking each of n x n rays per pixel what it hits: layers from the top down, (z, inside(xy),
    grey).
    """
    total = np.zeros(SIZE[::-1])
    # x/z and y/z of the camera's frame are as good as cubic from one tenth pixel to the next.
    far = [np.arange(-10.0, side + 20.0, 10.0) for side in SIZE]
    bent = camera.normalise(np.stack(np.meshgrid(*far), -1) + offset)
    between = [RectBivariateSpline(far[1], far[0], bent[..., k]) for k in (0, 1)]
    for du in (np.arange(n) + 0.5) / n - 0.5:
        for dv in (np.arange(n) + 0.5) / n - 0.5:
            x, y = (one(np.arange(SIZE[1]) + dv, np.arange(SIZE[0]) + du) for one in between)
            ray = np.stack([x, y, np.ones_like(x)], -1) @ camera.rotation
            grey = np.full(x.shape, np.nan)
            for z, inside, level in layers:
                xy = camera.centre_m[:2] + ((z - camera.centre_m[2]) / ray[..., 2])[..., None] * ray[..., :2]
                grey = np.where(np.isnan(grey) & inside(xy), level, grey)
            total += grey
    return np.clip(np.rint(total / n**2 + rng.normal(0, noise, total.shape)), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(0)
    host, nes = np.array([0.002, -0.001]), np.array([0.017, 0.009])

    def away(xy, c):
        return np.hypot(xy[..., 0] - c[0], xy[..., 1] - c[1])

    layers = [(0.010, lambda xy: away(xy, nes) < 0.01, 200.0), (0.0, lambda xy: away(xy, nes) < 0.0085, 90.0)]
    layers += [(0.012, lambda xy: (away(xy, host) > 0.036) & (away(xy, host) < 0.045), 190.0)]
    layers = [layers[2], *layers[:2]]  # the ring's top hides what lies below it
    layers += [
        (0.0, lambda xy: away(xy, host) < 0.036, 140.0),
        (0.0, lambda xy: away(xy, host) < 0.046, 70.0),
        (-0.001, lambda xy: away(xy, host) < 9, 95.0),
    ]
    cameras = camera_pair()
    offsets = [tuple((camera.project(np.zeros(3)) - np.array(SIZE) / 2).astype(int)) for camera in cameras]
    images = [supersampled(camera, offset, layers, rng) for camera, offset in zip(cameras, offsets, strict=True)]
    return images, cameras, offsets, host, nes


def test_host_wall_from_its_top_rim(pair):
    images, cameras, offsets, host, _ = pair
    rim = fit_rim(images, cameras, offsets, np.array([*host + 2e-4, 0.0115]), 0.036 * 1.02)
    error = np.array([*(rim.centre_m - [*host, 0.012]), rim.radius_m - 0.036])
    assert np.all(np.abs(error) < 4 * rim.sd_m + 2e-6) and rim.sd_m[3] < 1e-5


def test_nes_rim(pair):
    images, cameras, offsets, _, nes = pair
    rim = fit_rim(images, cameras, offsets, np.array([*nes - 1e-4, 0.0101]), 0.01)
    error = np.array([*(rim.centre_m - [*nes, 0.010]), rim.radius_m - 0.010])
    assert np.all(np.abs(error) < 4 * rim.sd_m + 4e-6) and rim.sd_m[3] < 1e-5  # 4 um: the blur's pull on a 50 px circle


def test_one_camera_holds_the_height_and_nothing_there_gives_none(pair):
    images, cameras, offsets, host, _ = pair
    rim = fit_rim(images[:1], cameras[:1], offsets[:1], np.array([*host, 0.012]), 0.036)
    assert rim.radius_m == pytest.approx(0.036, abs=1e-5) and rim.centre_m[2] == 0.012
    assert (
        fit_rim([np.full_like(image, 90) for image in images], cameras, offsets, np.array([*host, 0.012]), 0.036)
        is None
    )
