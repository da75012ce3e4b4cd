"""Camera frames to markers in 3-D: calibration, detection, tracking, triangulation."""
