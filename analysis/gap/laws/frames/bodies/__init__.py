"""What bodies do that cameras and clocks do not: markers on them, the disk's card and picture, trackers."""
