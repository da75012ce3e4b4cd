"""Accelerometers beside the cameras: their record read, synchronised by the Host's motion, and compared with it."""
