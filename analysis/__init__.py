"""From motion to parameters, reports, and what separates simulator and experiment."""
