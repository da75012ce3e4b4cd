"""Results and calibrations in the formats of other programs: text, MATLAB, motion capture, NetCDF, LaTeX."""
