"""What must hold for a result to be used, and what to do where it does not."""
