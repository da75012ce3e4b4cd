"""Candidates as columns of a linear problem, each run predicted by the others."""
