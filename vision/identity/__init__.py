"""Which disc is which marker: layouts matched, names by geometry and by hand."""
