"""Series: many recordings, one lens field, one identification and one diagnosis for all."""
