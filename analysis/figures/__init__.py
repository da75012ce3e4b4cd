"""Figures of the report and of the documentation."""
