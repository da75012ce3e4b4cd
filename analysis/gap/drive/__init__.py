"""The drive: asked against measured, and what impacts and the ground do to the Host."""
