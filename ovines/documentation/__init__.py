"""Pages of docs made from the code."""
