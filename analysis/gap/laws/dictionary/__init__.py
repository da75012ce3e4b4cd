"""What a missing law may look like: candidates for flights, the floor, impacts and the wall."""
