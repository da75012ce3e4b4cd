"""Files of other programs, read into the tables and cameras of the chain; nothing is guessed that can be asked for."""
