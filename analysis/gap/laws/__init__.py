"""The missing law: a sparse formula for what no effect of the library explains, chosen on held-out runs."""
