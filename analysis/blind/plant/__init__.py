"""The plant: a rig simulated by code that shares nothing with the simulator."""
