"""What is known of frames, and what they say of cameras and clocks: rows of a regression."""
