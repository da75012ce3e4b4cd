"""gap.html and its figures."""
