"""A calibrated camera: its model, points that several of them see, its file."""

from ovines.camera.calibration_file import MOST_SIDE_PX, calibration_json, read_calibration, write_calibration
from ovines.camera.model import LENS_TERMS, Camera, with_fields
from ovines.camera.triangulation import Triangulated, baseline, epipolar_residual_px, midpoints, triangulate_points

__all__ = [
    "LENS_TERMS",
    "MOST_SIDE_PX",
    "Camera",
    "Triangulated",
    "baseline",
    "calibration_json",
    "epipolar_residual_px",
    "midpoints",
    "read_calibration",
    "triangulate_points",
    "with_fields",
    "write_calibration",
]
