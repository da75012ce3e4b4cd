"""Places of the numbers of a state, a place and a motion, as the engine's arrays have them.

A state vector begins with the NES (its centre of mass; `ovines.core.system.parameters` says what follows), and so does
its rate; from HOST on the Host's six stand in the same order.  A place has where the geometric centre of the NES is and
how it moves, the Host's pose and motion, and how far the geometric centre is off the centre of mass.  A motion of the
Host, or of the ground under it, has places, rates and second rates, each along x, along y and in rotation.
"""

X, Y, VX, VY, ANGLE, SPIN = range(6)  # m, m/s, rad, rad/s; the first four of a place, too
#: of a place
HOST_X, HOST_Y, HOST_ANGLE, HOST_VX, HOST_VY, HOST_SPIN, OFF_X, OFF_Y = range(4, 12)
#: of a motion
BASE_X, BASE_Y, BASE_ANGLE, BASE_VX, BASE_VY, BASE_SPIN, BASE_AX, BASE_AY, BASE_SPIN_RATE = range(9)
N_BASE = 9
#: first of its rates and of its second rates, and how its first six stand in a state
RATES, SECOND_RATES = BASE_VX, BASE_AX
BASE_IN_STATE = [BASE_X, BASE_Y, BASE_VX, BASE_VY, BASE_ANGLE, BASE_SPIN]
#: after it: the first of three places and of three rates from which a sprung Host's free motion starts
FREE_PLACES, FREE_RATES = N_BASE, N_BASE + 3
