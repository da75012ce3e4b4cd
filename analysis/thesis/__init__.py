"""The thesis' own method, kept beside ours for comparison."""
