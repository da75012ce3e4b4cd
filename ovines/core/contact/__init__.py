"""The disk at the wall: the next collision, and motion along the wall."""
