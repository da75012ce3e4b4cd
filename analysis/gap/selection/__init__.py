"""Causes in flights and impacts: candidates, forward selection on held-out runs, what chance gains."""
