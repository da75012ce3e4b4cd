"""The choice of a formula among many candidates."""
