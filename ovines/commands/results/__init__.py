"""Commands that show results, and hand them to other programs."""
