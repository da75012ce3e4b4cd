"""The bodies followed through all cameras, frame by frame."""
