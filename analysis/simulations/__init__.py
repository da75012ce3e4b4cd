"""Figures of simulations: one run, a sweep, the shaker's limits."""
