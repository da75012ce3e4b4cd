"""One file per format: markers, motion, impacts, known points, triggers, cameras."""
