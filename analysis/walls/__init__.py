"""What the disk can meet inside the Host: a ring, flat sides, a central cylinder."""
