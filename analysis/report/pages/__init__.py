"""The reports: of one recording, of a calibration, of a comparison, of a series."""
