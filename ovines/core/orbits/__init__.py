"""Where runs end up: Lyapunov exponents, Poincare sections, periodic orbits, basins of attraction."""
