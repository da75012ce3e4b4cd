"""What a missing law of the impacts, and a missing shape of the wall or the disk, may look like."""
