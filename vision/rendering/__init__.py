"""Camera frames and board views of the rig with known truth."""
