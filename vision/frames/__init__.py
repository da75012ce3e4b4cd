"""Recordings as streams of pictures, each with its time; frames that were dropped."""
