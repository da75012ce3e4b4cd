"""The blind trial with the diagnosis: answers, effects withheld, runs that settle a case, and the score."""
