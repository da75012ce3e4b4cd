"""Commands around a recording before it runs: its file, boards, names, other programs' files, the plan of a day."""
