"""Commands that hold simulator against experiment, and the sealed cases that hold the diagnosis against truth."""
