"""Causes in the measurement: clocks, windows, scale, plane, fixed markers, rigid bodies."""
