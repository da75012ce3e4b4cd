"""The flight model's parameters: one vector, whose entries compiled code takes by name (``p[P.FRICTION]``).

A zero switches its term off.  The place of a parameter in the vector is that in :data:`PARAMETERS` and stands nowhere
else: one may be inserted anywhere.
"""

from __future__ import annotations

from ovines.core.laws import terms, words

#: name -> (unit, what it is) of what differs from flight to flight, and is no unknown
GIVEN: dict[str, tuple[str, str]] = {
    "impact_before_s": ("s", "time of the impact before"),
    "contact_before_x": ("m", "place of the disk at the contact before, from the Host's centre"),
    "contact_before_y": ("m", "the same along y"),
    "approach_before": ("m/s", "normal speed before that contact"),
    "angle_before_rad": ("rad", "angle of the disk at that contact"),
    "slip_before": ("m/s", "tangential speed of the contact point before that contact"),
    "left_before": ("m/s", "speed against the Host after that contact"),
    **{f"blow_{i + 1}_s": ("s", "time of an impact before, the latest first") for i in range(words.MOST_BLOWS)},
    **{f"blow_{i + 1}": ("m/s", "normal speed before that impact") for i in range(words.MOST_BLOWS)},
    **{f"blow_{i + 1}_rad": ("rad", "direction in which it pushed the Host") for i in range(words.MOST_BLOWS)},
    **{f"blow_{i + 1}_side_rad": ("rad", "the same seen from the disk") for i in range(words.MOST_BLOWS)},
    **{f"blow_{i + 1}_slip": ("m/s", "tangential speed before that impact") for i in range(words.MOST_BLOWS)},
    "blows": ("1", "number of impacts of the run before"),
    "way_before": ("m", "way slid over the floor from the run's start to the contact before"),
    "two_before_x": ("m", "place of the disk at the contact before that, from the Host's centre"),
    "two_before_y": ("m", "the same along y"),
}
#: name -> (unit, what it adds to the acceleration); the order is that of the parameter vector
PARAMETERS: dict[str, tuple[str, str]] = {
    "friction": ("1", "floor friction coefficient mu_s"),
    "coupling": ("1", "0 plain Coulomb friction, 1 Farkas' coupling of sliding and spinning"),
    "viscous": ("1/s", "-c v, v against the room"),
    "air": ("1/m", "-c |v| v, v against the room"),
    "tilt_x": ("m/s^2", "constant acceleration along x"),
    "tilt_y": ("m/s^2", "constant acceleration along y"),
    "load": ("1", "share of the Host's measured z'' that acts on the floor load"),
    "drift": ("1/s", "relative change of mu_s per second"),
    # Probes: structure outside the library is found through them, never named by them.
    "centre_host": ("1/s^2", "-k (r - r_Host)"),
    "centre_room": ("1/s^2", "-k r"),
    "curl_host": ("1/s^2", "k z x (r - r_Host)"),
    "saddle_host": ("1/s^2", "k (x, -y) from the Host's centre"),
    "skew_host": ("1/s^2", "k (y, x) from the Host's centre"),
    "saddle_room": ("1/s^2", "k (x, -y) in the room"),
    "skew_room": ("1/s^2", "k (y, x) in the room"),
    "magnus": ("1", "k omega z x v"),
    "gyro": ("1/s", "k z x v"),
    "spin_decay": ("1/s", "-k omega on the spin"),
    "spin_drive": ("rad/s^2", "constant angular acceleration"),
    "friction_radius": ("1", "relative change of mu_s with the distance from the Host's centre over R_c"),
    "friction_x": ("1", "relative change of mu_s with x from the Host's centre over R_c"),
    "friction_y": ("1", "relative change of mu_s with y from the Host's centre over R_c"),
    "friction_room_x": ("1", "relative change of mu_s with x in the room over R_c"),
    "friction_speed": ("s/m", "relative change of mu_s with the sliding speed"),
    "friction_axis": ("1", "friction larger along x than along y by this share"),
    "friction_skew": ("1", "friction larger along x = y than across it by this share"),
    "friction_cos": ("1", "relative change of mu_s with cos(drive phase)"),
    "friction_sin": ("1", "relative change of mu_s with sin(drive phase)"),
    "host_drag": ("1/s", "-c (v - v_Host)"),
    "force_cos_x": ("m/s^2", "cos(drive phase) along x"),
    "force_sin_x": ("m/s^2", "sin(drive phase) along x"),
    "force_cos_y": ("m/s^2", "cos(drive phase) along y"),
    "force_sin_y": ("m/s^2", "sin(drive phase) along y"),
    "radial_cubic": ("1/s^2", "-k (|r - r_Host|/R_c)^2 (r - r_Host)"),
    "radial_unit": ("m/s^2", "-k (r - r_Host)/|r - r_Host|"),
    "wall_pull": (
        "m/s^2",
        "-k (|r - r_Host|/R_c)^8 along the radius: felt in the last few millimetres before the wall",
    ),
    "friction_since": ("1", "relative change of mu_s that dies out within 15 ms of the impact before"),
    **{
        name: ("1", "times the term of that number of the written law that the run holds")
        for name in (f"law_{i + 1}" for i in range(terms.MOST_TERMS))
    },
    **GIVEN,
}
#: name -> place in the parameter vector
INDEX = {name: i for i, name in enumerate(PARAMETERS)}

FRICTION = INDEX["friction"]
COUPLING = INDEX["coupling"]
VISCOUS = INDEX["viscous"]
AIR = INDEX["air"]
TILT_X = INDEX["tilt_x"]
TILT_Y = INDEX["tilt_y"]
LOAD = INDEX["load"]
DRIFT = INDEX["drift"]
CENTRE_HOST = INDEX["centre_host"]
CENTRE_ROOM = INDEX["centre_room"]
CURL_HOST = INDEX["curl_host"]
SADDLE_HOST = INDEX["saddle_host"]
SKEW_HOST = INDEX["skew_host"]
SADDLE_ROOM = INDEX["saddle_room"]
SKEW_ROOM = INDEX["skew_room"]
MAGNUS = INDEX["magnus"]
GYRO = INDEX["gyro"]
SPIN_DECAY = INDEX["spin_decay"]
SPIN_DRIVE = INDEX["spin_drive"]
FRICTION_RADIUS = INDEX["friction_radius"]
FRICTION_X = INDEX["friction_x"]
FRICTION_Y = INDEX["friction_y"]
FRICTION_ROOM_X = INDEX["friction_room_x"]
FRICTION_SPEED = INDEX["friction_speed"]
FRICTION_AXIS = INDEX["friction_axis"]
FRICTION_SKEW = INDEX["friction_skew"]
FRICTION_COS = INDEX["friction_cos"]
FRICTION_SIN = INDEX["friction_sin"]
HOST_DRAG = INDEX["host_drag"]
FORCE_COS_X = INDEX["force_cos_x"]
FORCE_SIN_X = INDEX["force_sin_x"]
FORCE_COS_Y = INDEX["force_cos_y"]
FORCE_SIN_Y = INDEX["force_sin_y"]
RADIAL_CUBIC = INDEX["radial_cubic"]
RADIAL_UNIT = INDEX["radial_unit"]
WALL_PULL = INDEX["wall_pull"]
#: the terms of a run's written law, in their order
LAW_TERMS = tuple(f"law_{i + 1}" for i in range(terms.MOST_TERMS))
LAW = INDEX["law_1"]
FRICTION_SINCE = INDEX["friction_since"]
FRICTION, IMPACT_BEFORE_S = INDEX["friction"], INDEX["impact_before_s"]
CONTACT_BEFORE_X, CONTACT_BEFORE_Y = INDEX["contact_before_x"], INDEX["contact_before_y"]
APPROACH_BEFORE = INDEX["approach_before"]
ANGLE_BEFORE_RAD, SLIP_BEFORE, LEFT_BEFORE = INDEX["angle_before_rad"], INDEX["slip_before"], INDEX["left_before"]
CONTACT_BEFORE = [CONTACT_BEFORE_X, CONTACT_BEFORE_Y, APPROACH_BEFORE, ANGLE_BEFORE_RAD, SLIP_BEFORE, LEFT_BEFORE]
BLOW_TIMES, BLOW_SPEEDS, BLOW_WAYS = INDEX["blow_1_s"], INDEX["blow_1"], INDEX["blow_1_rad"]
BLOW_SIDES, BLOW_SLIPS = INDEX["blow_1_side_rad"], INDEX["blow_1_slip"]
BLOWS = INDEX["blows"]
WAY_BEFORE, TWO_BEFORE_X, TWO_BEFORE_Y = INDEX["way_before"], INDEX["two_before_x"], INDEX["two_before_y"]
