"""What may be wrong with a plant: causes by what they act on, their sizes, and which were written together."""
