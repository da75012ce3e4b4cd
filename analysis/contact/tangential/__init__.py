"""The tangential law of an impact: what fits it, for a contact of an instant and for one that lasts."""
