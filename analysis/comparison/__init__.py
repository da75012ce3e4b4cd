"""The simulator's side of a recording: one flight ahead, one impact ahead, whole runs."""
