"""A round marker's centre to the limit of the noise, and discs found in a picture."""
