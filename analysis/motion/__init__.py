"""Points to the motion of Host and NES, in the rig's own frame."""
