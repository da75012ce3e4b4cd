"""Impacts too close for flights between them: a bounce sequence simulated through."""
