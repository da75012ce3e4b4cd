"""What the lens model leaves over, learnt from the recordings themselves: a smooth field per camera."""
