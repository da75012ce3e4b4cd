"""`ovines new`: a recording.toml from options or questions."""
