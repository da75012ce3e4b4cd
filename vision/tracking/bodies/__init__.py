"""Bodies as a camera's tracker holds them: poses in the plane, arrays, and where they can be in the next frame."""
