"""Boards to cameras: corners, lens, poses, their uncertainty, and what to do better."""
