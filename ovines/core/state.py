"""Places of the numbers of a state and of a place, as the engine's arrays have them.

A state vector begins with the NES (its centre of mass; `ovines.core.system.parameters` says what follows), and so does
its rate; from HOST on the Host's six stand in the same order.  A place has where the geometric centre of the NES is and
how it moves, the Host's pose and motion, and how far the geometric centre is off the centre of mass.
"""

X, Y, VX, VY, ANGLE, SPIN = range(6)  # m, m/s, rad, rad/s; the first four of a place, too
#: of a place
HOST_X, HOST_Y, HOST_ANGLE, HOST_VX, HOST_VY, HOST_SPIN, OFF_X, OFF_Y = range(4, 12)
