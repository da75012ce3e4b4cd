"""One run's data and where its flights end: first wall, kinks of the path, contact, pieces of a long flight."""
