"""Foreign text and cells read with reasons, and what their user declares: unit, axes, what zeros mean."""
