"""Flights between impacts: where they end, the model fitted to each, noise and unknown force."""
