"""ovines: from dual-camera recordings of a vibro-impact rig to motion, parameters and the sim-to-real gap."""

import os

__version__ = "0.1.0"

# numba dresses every message of its type inference in colours, which nobody sees: a fortieth of the time of compiling.
# It asks once, while it is loaded, so that this stands before anything of ours loads it.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
