"""Simulations as the commands run them: their cost, many at once, results as tables."""
