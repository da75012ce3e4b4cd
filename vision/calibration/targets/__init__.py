"""Calibration targets: boards and grids, how they are printed, found in pictures, and judged."""
