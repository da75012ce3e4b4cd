"""The equation of motion of a flight: its parameters, the acceleration, and derivatives by all that it holds."""
