"""Figures of where runs end up: sections, bifurcations, branches of orbits, exponents, basins, what a design takes."""
