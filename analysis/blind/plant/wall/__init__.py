"""What the wall does: where it is, how it gives a blow back, what a blow leaves behind."""
