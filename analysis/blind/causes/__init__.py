"""What may be wrong with a plant: listed and unlisted causes, and their sizes."""
