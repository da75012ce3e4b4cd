"""Worker processes: what they may cost, the end of one whose parent ended, other machines."""
