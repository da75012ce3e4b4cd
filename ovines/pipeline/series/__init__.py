"""Series: many recordings, one lens field and one identification for all, the diagnosis, and runs that settle it."""
