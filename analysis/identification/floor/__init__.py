"""Floor and flights of all runs together: what they share, what they are off by, and the law of the floor."""
