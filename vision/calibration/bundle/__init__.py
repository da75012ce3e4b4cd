"""Bundle adjustment of cameras and board poses: unknowns, equations, descent, and what the noise is."""
