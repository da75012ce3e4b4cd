"""The places of a state's numbers: where the disk is, how it moves, and what it, its floor and its wall remember."""

X, Y, VX, VY = 0, 1, 2, 3  # centre of mass (m, m/s), in the room
ANGLE, SPIN = 4, 5  # rad, every turn counted; rad/s
IMPACT_S = 6  # time of the last impact; -1 before any
STRETCH = 7  # of the tangential spring of a contact that lasts (m)
WAY = 8  # slid over the floor so far (m)
HARDEST = 9  # approach of the hardest impact so far (m/s)
LAG_X, LAG_Y = 10, 11  # friction that follows its law late (m/s^2)
AZIMUTH = 12  # of the last impact, seen from the Host's centre (rad)
COUNT = 13  # of impacts so far
NORMAL = 14  # direction of the wall's outward normal in the last impact (rad)
APPROACH = 15  # of the last impact (m/s)
TIRED = 16  # of a liner after the last impact: squared approaches, each as it is left (m^2/s^2)
SLEEVE = 17  # speed of a turning sleeve's surface after the last impact (m/s)
PRINT_X, PRINT_Y = 18, 19  # a mat's print of the disk, in the Host (m)
WAY_BEFORE = 20  # slid before the last impact (m)
CORE = 21  # spin of a loose core (rad/s)
OILED = 22  # what the disk carries of a drop of oil, 0 to 1
SLIPPED = 23  # the last impact's slip (m/s)
STRUCK = 24  # and where on the disk's rim it was (rad)
CHARGE = 25  # what a disk holds of the charge that it can, 0 to 1
NOD_X, NOD_Y = 26, 27  # of a wall as heavy as the disk after the last impact: how far it has swung (m) ...
NOD_VX, NOD_VY = 28, 29  # ... and how fast it swings (m/s)
AGED = 30  # what the contacts under the disk have of the strength that they can, 0 to 1
STATES = 31
