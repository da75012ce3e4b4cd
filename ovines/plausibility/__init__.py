"""What of a recording cannot be, or is doubtful, told before it is processed."""
