"""Impacts where two flights meet, the wall they show, and the law of contact."""
