"""What a calibration is worth: lens by held-out views, two halves compared, uncertainty over image and plane."""
