"""Figures of the page: panels of residuals, of drive, flights and impacts, of what was measured, and of paths."""
