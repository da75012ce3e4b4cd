"""What of a recording cannot be, or is doubtful, reported before it is processed."""
