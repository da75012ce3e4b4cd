"""One file per command, in rooms by what it is for."""
