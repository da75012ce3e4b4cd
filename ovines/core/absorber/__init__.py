"""What a NES is for: the energy that it takes from its Host, the Host's response with it, and its best numbers."""
