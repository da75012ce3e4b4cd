"""Points' uncertainty from the calibration: against cameras drawn from its covariance."""

from dataclasses import replace

import cv2
import numpy as np
import pandas as pd

from ovines.camera import triangulate_points
from ovines.tables import checked
from vision.calibration.uncertainty import PARAMETERS, covariance_of, covariance_table, with_calibration_sd
from vision.rendering.recording import thesis_setup

SD = np.array([8.0, 8.0, 5.0, 5.0, 5e-3, 2e-2, 2e-4, 2e-4, *np.zeros(8), 4e-4, 4e-4, 2e-4, 2e-4, 2e-4, 1e-3])


def drawn(camera, change):
    fx, fy, cx, cy = change[:4]
    turn = np.asarray(cv2.Rodrigues(change[16:19])[0], float)
    return replace(
        camera,
        matrix=camera.matrix + np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 0]]),
        distortion=camera.distortion + change[4:9],
        rotation=turn @ camera.rotation,
        translation_m=camera.translation_m + change[19:],
    )


def test_sd_is_that_of_points_from_cameras_drawn_from_the_covariance():
    rng = np.random.default_rng(0)
    cameras = thesis_setup(rng).cameras
    mixed = np.eye(44) + 0.3 * rng.standard_normal((44, 44))  # what the parameters have in common counts as well
    covariance = np.outer(*[np.tile(SD, 2)] * 2) * (mixed @ mixed.T) / 4
    labels = [(camera.name, name) for camera in cameras for name in PARAMETERS]
    covariance[8], covariance[:, 8] = np.nan, np.nan  # k3 of the first camera was held
    table = checked(covariance_table(covariance, labels), "calibration_covariance")
    known = covariance_of(table, cameras)
    assert np.allclose(known, np.nan_to_num(covariance), rtol=1e-5, atol=1e-8)
    truth = np.column_stack([rng.uniform(-0.05, 0.08, (6, 2)), rng.uniform(0.0, 0.02, 6)])
    uv = [camera.project(truth) for camera in cameras]
    points = pd.DataFrame(truth, columns=["x_m", "y_m", "z_m"])
    sd = with_calibration_sd(points, cameras, table)[[f"{axis}_calibration_sd_m" for axis in "xyz"]].to_numpy()
    draws = rng.multivariate_normal(np.zeros(44), known, 600, method="eigh")
    moved = np.stack(
        [
            triangulate_points(
                [drawn(c, d) for c, d in zip(cameras, np.split(draw, 2), strict=True)], uv, [np.ones(6)] * 2
            ).points_m
            for draw in draws
        ]
    )
    assert np.allclose(moved.std(0), sd, rtol=0.12)  # 600 draws: an sd scatters by 3 %
    assert sd.max() > 1e-4
