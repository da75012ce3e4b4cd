"""Laws of cameras and clocks, found in frames."""
