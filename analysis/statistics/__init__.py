"""Estimates that a few wrong values do not move."""
