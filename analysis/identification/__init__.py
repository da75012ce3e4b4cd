"""The rig's parameters with intervals: floor, flights, wall and contact law of its runs together."""
