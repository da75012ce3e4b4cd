"""ovines: from dual-camera recordings of a vibro-impact rig to motion, parameters and the sim-to-real gap."""

__version__ = "0.1.0"
