"""Written laws: formulas of what nobody listed, as the simulator and the analysis evaluate them."""
