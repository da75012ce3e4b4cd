"""Places of every number in the compiled engine's parameter vectors.

The engine takes plain arrays, so that one compiled signature serves every scenario and an ensemble is one
array of rows.  Names here are the only way in; :mod:`ovines.core.packing` fills them.
"""

from ovines.core.laws.words import MEMORY_SIZE, MOST_BLOWS

# float vector
(
    RADIUS, MASS, INERTIA, CONTACT_RADIUS, OBSTACLE_RADIUS, INVERSE_HOST_MASS, INVERSE_HOST_INERTIA,
    GRAVITY_X, GRAVITY_Y, FLOOR_FRICTION, FLOOR_LOAD, REGULARISATION, COUPLING, VISCOUS_DRAG, AIR_DRAG,
    DRIFT_PER_S, RESTITUTION, WALL_FRICTION, TANGENTIAL_RESTITUTION, RESTITUTION_FAST, RESTITUTION_SPEED,
    RESTITUTION_SWING, RESTITUTION_DIRECTION, CONTACT_DURATION, ELLIPTICITY, ELLIPSE_DIRECTION,
    WALL_X, WALL_Y, MASS_X, MASS_Y, STIFFNESS_X, STIFFNESS_Y, STIFFNESS_R, DAMPING_X, DAMPING_Y, DAMPING_R,
    DURATION, TOLERANCE, HOST_ACCELERATION, HOST_SPIN, HOST_SPIN_RATE, LENGTH, SPEED, MAX_STEP,
    RESTITUTION_PER_S, RESTITUTION_OF_RUN, LOBES, WALL_SHAPE, WALL_DEPTH, ROCKING, ROCKING_S,
    LAST_IMPACT, LAST_X, LAST_Y, LAST_APPROACH, BEGINS_WITH, DRIVE_RATE, DRIVE_PHASE, RUN_NUMBER,
    LAST_ANGLE, LAST_SLIP, BLOWS, START_ANGLE, LAST_LEFT, BLOW_TIMES,
) = range(65)  # fmt: skip
#: from BLOW_TIMES on times, normal speeds, directions, in the room and seen from the disk, and tangential speeds of the
#: last impacts, as written laws know them; then the way, and the lobes
BLOW_SPEEDS = BLOW_TIMES + MOST_BLOWS
BLOW_WAYS = BLOW_SPEEDS + MOST_BLOWS
BLOW_SIDES = BLOW_WAYS + MOST_BLOWS
BLOW_SLIPS = BLOW_SIDES + MOST_BLOWS
#: length and time of the ladders of what the disk remembers of its way over the floor (0: no law asks), when and where
#: it was remembered last (from the Host's centre) and the Host's angle then, from WAY on what is remembered, the way at
#: the last contact and the disk's place at the contact before the last
MEMORY_M = BLOW_SLIPS + MOST_BLOWS
(MEMORY_S, WAY_TIME, WAY_X, WAY_Y, WAY_HOST, WAY) = range(MEMORY_M + 1, MEMORY_M + 7)
(WAY_BEFORE, BEFORE_X, BEFORE_Y, LOBE_TABLE) = range(WAY + MEMORY_SIZE, WAY + MEMORY_SIZE + 4)
#: from LOBE_TABLE on: amplitude (over the contact radius), order and direction (rad) of each of LOBES lobes
MOST_LOBES = 40
N_FLOATS = LOBE_TABLE + 3 * MOST_LOBES

# int vector
(HOST_KIND, CLOSED_FORM, N_WALLS, WALL_TURNS, ON_GROUND, MAX_IMPACTS, STATE_SIZE, HAS_TABLE, OFF_CENTRE, PLAIN,
 FLOOR_TURNS, EXTENDED) = range(12)  # fmt: skip
N_INTS = 12

FIXED, FREE, DRIVEN, SPRUNG = range(4)  # host kinds
FLIGHT, SLIDE, ROLL, CORNER = range(4)  # modes of motion; CORNER rests on two walls at once

# state vector: NES (x, y, vx, vy, angle, spin) of its centre of mass, seven energies, Host (same six)
ENERGIES = 6
# J: lost along the wall's normal (restitution) and tangent (friction), on the floor by sliding and by spinning, to drag
# and to dampers; done by driver or ground
(LOST_NORMAL, LOST_TANGENT, LOST_SLIDING, LOST_SPINNING, LOST_DRAG, LOST_DAMPING, WORK) = range(6, 13)
HOST = 13
N_STATE = 19

# rows of the work array: twelve stages of a step, then what functions leave for the next one
TRIAL, SCRATCH, PLACE, SPARE = 12, 13, 14, 15
N_WORK = 19  # and three for a step of a disk

# walls: the round wall, the obstacle, then the polygon's edges
ROUND, OBSTACLE, EDGES = 0, 1, 2
PAIR = 1000  # two walls in one number: first + PAIR * second

# columns of a drive's rows: axis (x, y, rotation, z), amplitude (m, rad), angular frequency (rad/s), phase (rad)
AXIS, AMPLITUDE, OMEGA, PHASE = range(4)

# columns of the impact record
(TIME, AZIMUTH, NORMAL_BEFORE, NORMAL_AFTER, TANGENTIAL_BEFORE, TANGENTIAL_AFTER, SPIN_BEFORE, SPIN_AFTER,
 STUCK, WALL, LOST, LOST_ALONG, WORKED, NORMAL) = range(14)  # fmt: skip
N_IMPACT = 14
