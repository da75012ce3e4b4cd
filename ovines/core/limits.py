"""What no rig, shaker, Host or disk leaves, by far: inside it no square, product or quotient overflows or vanishes."""

from __future__ import annotations

LENGTHS_M = (1e-9, 1e6)
MASSES_KG = (1e-12, 1e36)  # a disk of 1e30 kg stands for a wall that nothing moves
INERTIA_FACTORS = (1e-3, 1e3)  # 0.5 a disk, 1 a ring; below: a body that turns without inertia
MOST_M_PER_S, MOST_RAD_PER_S, MOST_M_PER_S2 = 1e6, 1e9, 1e10
MOST_RAD = 1e9  # beyond it an angle is no longer known to 1e-7 rad
MOST_STIFFNESS = 1e18  # N/m, N m/rad; of dampers too
MOST_FRICTION = 1e12  # 1e9 stands for a wall that never slips
SLOWEST_M_PER_S = 1e-12
FREQUENCIES_HZ, MOST_G = (1e-3, 1e9), 1e9
MOST_S, MOST_RATE_HZ = 1e12, 1e15
