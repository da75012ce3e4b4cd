"""What two cameras would have recorded of a plant, written as a series."""
