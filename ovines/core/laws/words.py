"""What a written law is made of: what it acts on, the quantities that it may follow, and functions of them.

Every quantity is an invariant of the rig - a speed, a distance, an angle between things - so that a formula keeps its
form when the world is turned; what has a direction in the room carries an angle of its own.  Names here are those of
``law-1.toml``; the codes are those of compiled code (:mod:`ovines.core.laws.kernel`, `quantities`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: what a row of a packed law holds: target, its place or angle (2), coefficient, number of factors
TARGET, TARGET_X, TARGET_Y, COEFFICIENT, FACTORS, FIRST = range(6)
#: what a factor holds, from FIRST on: quantity, its place or angle (2), function, order, scale
QUANTITY, QUANTITY_X, QUANTITY_Y, FUNCTION, ORDER, SCALE = range(6)
FACTOR_SIZE, MOST_FACTORS = 6, 3
ROW_SIZE = FIRST + FACTOR_SIZE * MOST_FACTORS

#: what is known of the disk when a law is asked, by place in its vector: velocity in the room (m/s), velocity against
#: the floor under it (m/s), place in the room (m), place from the Host's centre (m), contact radius (m), angle (rad),
#: spin (rad/s), time from the run's start (s), phase of the drive (rad), time since the impact before (s), number of
#: the run, normal and tangential speed before an impact (m/s), acceleration (m/s^2) and angular acceleration (rad/s^2)
#: that the floor's friction gives, the run's time at the drive's frequency (rad), share of the run that has gone (of a
#: measurement only), speeds before an impact (m/s) of the wall outwards along its normal, and of the disk's centre
#: along the wall, place of the disk at the contact before from the Host's centre (m; 0, 0 where none is known), its
#: normal speed before that (m/s), acceleration of the Host (m/s^2), spin that an impact's impulse leaves (rad/s; of
#: impacts only), angle of the disk (rad) and tangential speed of the contact point (m/s) at the contact before; from
#: BLOW_TIMES on the times from the run's start (s) of the last impacts, the latest first, from BLOW_SPEEDS on their
#: normal speeds (m/s; 0 where there was none), from BLOW_WAYS on the directions (rad) in which they pushed the Host,
#: from BLOW_SIDES on the same seen from the disk, how many impacts the run has had, whether an impact is at a
#: cylinder in the middle (1) or at the wall (0), and the spin (rad/s) that the contact before gave the disk (of a
#: measurement only)
(
    VX, VY, UX, UY, X, Y, HX, HY, CONTACT_RADIUS, ANGLE, SPIN, TIME, PHASE, SINCE, RUN, APPROACH, SLIP, FX, FY, FT,
    CLOCK, SHARE, WALL_SPEED, PASSING, LAST_X, LAST_Y, LAST_APPROACH, HOST_AX, HOST_AY,
    SPIN_LEFT, LAST_ANGLE, LAST_SLIP, BLOW_TIMES,
) = range(33)  # fmt: skip
#: so many impacts are remembered, for what they leave where they struck; what fades or swings forgets all but so many
MOST_BLOWS, FADING_BLOWS = 20, 6
BLOW_SPEEDS = BLOW_TIMES + MOST_BLOWS
BLOW_WAYS = BLOW_SPEEDS + MOST_BLOWS
BLOW_SIDES = BLOW_WAYS + MOST_BLOWS
BLOWS = BLOW_SIDES + MOST_BLOWS
AT_CYLINDER = BLOWS + 1
LAST_SPUN = AT_CYLINDER + 1
#: radius of the disk (m), and what it remembers of its way over the floor: from WAY on the way slid since the run's
#: start (m), the mean direction of the way just slid, x and y, as it fades with the way within each of TRAILS lengths,
#: and the way just slid (m) as it fades with the time within each of LATELIES times; then the way slid at the contact
#: before (0 before the first; less than 0 where it is not known), the disk's angle (rad) as the run began, its place at
#: the contact before that (m; 0, 0 where none is known), and the length (m) and the time (s) in which those lengths and
#: times are counted
TRAILS, LATELIES = 7, 8
DISK_RADIUS = LAST_SPUN + 1
WAY = DISK_RADIUS + 1
MEMORY_SIZE = 1 + 2 * TRAILS + LATELIES
WAY_BEFORE = WAY + MEMORY_SIZE
START_ANGLE, BEFORE_X, BEFORE_Y = WAY_BEFORE + 1, WAY_BEFORE + 2, WAY_BEFORE + 3
MEMORY_M, MEMORY_S = BEFORE_Y + 1, BEFORE_Y + 2
KNOWN_SIZE = MEMORY_S + 1
#: a time since the impact before that is long enough to be forgotten (s)
LONG_AGO_S = 1e6


@dataclass(frozen=True)
class Target:
    """What a term acts on: ``unit`` of what it adds, LaTeX of the direction or the quantity, what a place or angle of
    its own means (none, "angle", "axis" of a mirror, "body": angle seen from the disk, "room" or "host" place,
    "wind": a velocity in the room, number of a "camera", with the axis of a mirror ("camera_axis") or a direction
    ("camera_angle") in its picture, number of a "marker" and its direction in the room, or seen from the disk:
    "body_marker"), and the stage."""

    code: int
    unit: str
    symbol: str
    own: str
    stage: str
    meaning: str


TARGETS: dict[str, Target] = {
    name: Target(code, unit, symbol, own, stage, meaning)
    for code, (name, unit, symbol, own, stage, meaning) in enumerate(
        (
            ("fixed_direction", "m/s^2", r"\vec e_{\varphi}", "angle", "flight", "a fixed direction in the room"),
            ("outwards", "m/s^2", r"\hat r", "", "flight", "away from the Host's centre"),
            ("swirl", "m/s^2", r"\hat z\times\hat r", "", "flight", "about the Host's centre"),
            ("along_velocity", "m/s^2", r"\hat v", "", "flight", "along the velocity in the room"),
            ("across_velocity", "m/s^2", r"\hat z\times\hat v", "", "flight", "to the left of the velocity"),
            ("mirrored_velocity", "m/s^2", r"M_{\varphi}\hat v", "axis", "flight", "the velocity, mirrored"),
            ("along_sliding", "m/s^2", r"\hat u", "", "flight", "along the velocity against the floor"),
            ("across_sliding", "m/s^2", r"\hat z\times\hat u", "", "flight", "to the left of that"),
            ("mirrored_radius", "m/s^2", r"M_{\varphi}\hat r", "axis", "flight", "the radius' direction, mirrored"),
            ("from_place_in_room", "m/s^2", r"\hat d", "room", "flight", "away from a place of the room"),
            ("from_place_in_host", "m/s^2", r"\hat d_H", "host", "flight", "away from a place of the Host"),
            ("floor_friction", "1", r"\vec a_\mu", "", "flight", "the floor's friction, as a share of it"),
            (
                "mirrored_floor_friction", "1", r"M_{\varphi}\vec a_\mu", "axis", "flight",
                "the floor's friction, mirrored, as a share of it",
            ),
            ("along_body", "m/s^2", r"\vec e_{\psi}", "body", "flight", "a direction that turns with the disk"),
            ("spin", "rad/s^2", r"\hat z", "", "flight", "the disk's spin"),
            (
                "from_last_contact", "m/s^2", r"\hat d_c", "", "flight",
                "away from the place of the contact before",
            ),
            ("along_host_velocity", "m/s^2", r"\hat w", "", "flight", "along the velocity of the floor under the disk"),
            ("along_host_acceleration", "m/s^2", r"\hat a_H", "", "flight", "along the acceleration of the Host"),
            (
                "polar_floor_friction", "1", r"M_{\hat r}\vec a_\mu", "", "flight",
                "the floor's friction, mirrored at the radius' direction, as a share of it",
            ),
            (
                "floor_lever", "1/m", r"\hat z\dot\omega_\ell", "body", "flight",
                "the spin by the floor's friction, acting on the disk along a direction of it from the mass centre",
            ),
            ("floor_torque", "1", r"\hat z\dot\omega_\mu", "", "flight", "a share of the floor's torque"),
            (
                "along_airspeed", "m/s^2", r"\hat v_a", "wind", "flight",
                "along the velocity in the room against air that moves there by a wind of its own",
            ),
            ("restitution", "1", r"\varepsilon", "", "impact", "the normal restitution"),
            ("wall_friction", "1", r"\mu_w", "", "impact", "the wall's friction coefficient"),
            ("tangential_restitution", "1", r"\beta_0", "", "impact", "the tangential restitution"),
            ("spin_kept", "1", r"\omega'/\omega", "", "impact", "the share of the spin that an impact leaves"),
            ("spin_added", "rad/s", r"\omega'", "", "impact", "the spin after an impact"),
            ("contact_radius", "m", r"R_c", "", "geometry", "the radius at which the disk's centre meets the wall"),
            ("picture_u", "px", r"u", "camera", "measurement", "the place of a camera's picture along u"),
            ("picture_v", "px", r"v", "camera", "measurement", "the place of a camera's picture along v"),
            (
                "picture_zoom", "1", r"z", "camera", "measurement",
                "the size of a camera's picture about its principal point, as a share",
            ),
            (
                "picture_turn", "rad", r"\rho", "camera", "measurement",
                "the turn of a camera's picture about its principal point, from u to v",
            ),
            (
                "picture_stretch", "1", r"\vec e_{\varphi}", "camera_axis", "measurement",
                "the share by which a camera's picture is longer along a direction of it and shorter across",
            ),
            (
                "picture_radial", "1/px^2", r"k", "camera", "measurement",
                "the share by which a camera's picture is larger, by the square of the distance from its principal "
                "point",
            ),
            (
                "picture_decentring", "1/px", r"\vec e_{\varphi}", "camera_angle", "measurement",
                "the decentring of a camera's lens along a direction of its picture (Brown)",
            ),
            (
                "camera_delay", "s", r"\tau_c", "camera", "measurement",
                "how much later than the other a camera sees what it says it sees",
            ),
            ("clock_delay", "s", r"\tau", "", "measurement", "how much later than they say all cameras see"),
            (
                "host_marker", "m", r"\vec e_{\varphi}", "marker", "measurement",
                "the place of a marker on the Host, along a direction in the room",
            ),
            (
                "nes_marker", "m", r"\vec e_{\psi}", "body_marker", "measurement",
                "the place of a marker on the NES, along a direction that turns with it",
            ),
            (
                "nes_picture_u", "px", r"u", "camera", "measurement",
                "the place of the NES in a camera's picture along u",
            ),
            (
                "nes_picture_v", "px", r"v", "camera", "measurement",
                "the place of the NES in a camera's picture along v",
            ),
            (
                "nes_place", "m", r"\vec e_{\varphi}", "angle", "measurement",
                "the place where the NES is seen, along a direction in the room",
            ),
            (
                "nes_place_outwards", "m", r"\hat r", "", "measurement",
                "the place where the NES is seen, away from the Host's centre",
            ),
            (
                "nes_card", "m", r"\vec e_{\psi}", "body", "measurement",
                "the place of all markers of the NES on it, along a direction that turns with it",
            ),
            ("nes_card_turn", "rad", r"\psi_m", "", "measurement", "the turn of all markers of the NES on it"),
        )
    )
}  # fmt: skip


@dataclass(frozen=True)
class Quantity:
    """What a factor follows: unit, LaTeX, whether its ends meet, and what its place or angle means."""

    code: int
    unit: str
    symbol: str
    circular: bool
    own: str
    meaning: str

    @property
    def told(self) -> str:
        """What it is, without which laws may follow it."""
        return self.meaning.partition(";")[0]


QUANTITIES: dict[str, Quantity] = {
    name: Quantity(code, unit, symbol, circular, own, meaning)
    for code, (name, unit, symbol, circular, own, meaning) in enumerate(
        (
            ("speed", "m/s", "v", False, "", "speed in the room"),
            ("sliding_speed", "m/s", "u", False, "", "speed against the floor"),
            ("radius", "m", "r", False, "", "distance from the Host's centre"),
            ("gap", "m", "g", False, "", "distance to a round wall"),
            ("spin", "rad/s", r"\omega", False, "", "spin of the disk"),
            ("time", "s", "t", False, "", "time from the run's start"),
            ("phase", "rad", r"\phi", True, "angle", "phase of the drive's sine"),
            ("since", "s", r"t_i", False, "", "time since the impact before"),
            ("azimuth", "rad", r"\theta", True, "angle", "direction from the Host's centre, in the room"),
            ("run", "1", "n", False, "", "number of the run, from 0"),
            ("distance_in_room", "m", "d", False, "room", "distance from a place of the room"),
            ("distance_in_host", "m", "d_H", False, "host", "distance from a place of the Host"),
            ("along_host", "m", "s", False, "line", "place from the Host's centre along a direction"),
            ("velocity_along", "m/s", r"v_{\varphi}", False, "angle", "velocity in the room along a direction"),
            ("approach", "m/s", "v_n", False, "", "normal speed before the impact"),
            ("slip", "m/s", "v_t", False, "", "tangential speed of the contact point before the impact"),
            ("body_angle", "rad", r"\theta-\psi", True, "angle", "direction of the contact seen from the disk"),
            ("clock", "rad", r"\omega_d t", True, "angle", "the run's time at the drive's frequency"),
            ("share", "1", r"\sigma", False, "", "share of the run that has gone; of measurements only"),
            ("angle", "rad", r"\psi", True, "angle", "angle of the disk in the room"),
            ("wall_speed", "m/s", "w_n", False, "", "speed of the wall along its outward normal before the impact"),
            ("passing", "m/s", "v_p", False, "", "speed of the disk's centre along the wall before the impact"),
            ("incidence", "rad", r"\alpha", False, "", "angle of the contact point's velocity from the wall's normal"),
            ("sliding_along", "m/s", r"u_{\varphi}", False, "angle", "velocity against the floor along a direction"),
            ("radial_speed", "m/s", r"u_r", False, "", "speed away from the Host's centre, against the floor"),
            ("circling_speed", "m/s", r"u_\theta", False, "", "speed about the Host's centre, against the floor"),
            ("host_speed", "m/s", "w", False, "", "speed of the floor under the disk"),
            ("host_acceleration", "m/s^2", "a_H", False, "", "size of the Host's acceleration"),
            ("from_contact", "m", "d_c", False, "", "distance from the place of the contact before"),
            (
                "contact_turn",
                "rad",
                r"\Delta\theta",
                True,
                "",
                "direction from the Host's centre, from that of the contact before on",
            ),
            ("last_approach", "m/s", "v_c", False, "", "normal speed before the impact before"),
            (
                "spin_left",
                "rad/s",
                r"\omega_j",
                False,
                "",
                "spin that the impulse of an impact leaves; of the spin's laws only",
            ),
            ("sliding_direction", "rad", r"\delta", True, "angle", "direction of the velocity against the floor"),
            (
                "host_acceleration_along",
                "m/s^2",
                r"a_{\varphi}",
                False,
                "angle",
                "acceleration of the Host along a direction",
            ),
            (
                "host_acceleration_outwards",
                "m/s^2",
                r"a_r",
                False,
                "",
                "acceleration of the Host away from its centre, where the disk is",
            ),
            (
                "host_velocity_along",
                "m/s",
                r"w_{\varphi}",
                False,
                "angle",
                "velocity of the floor under the disk along a direction",
            ),
            (
                "since_by_blow",
                "s^2/m",
                r"\tau_i",
                False,
                "",
                "time since the impact before over the normal speed before that",
            ),
            ("heading", "rad", r"\chi", True, "angle", "direction of the velocity in the room, seen from the disk"),
            (
                "sliding_heading",
                "rad",
                r"\chi_u",
                True,
                "angle",
                "direction of the velocity against the floor, seen from the disk",
            ),
            (
                "turning_azimuth",
                "rad",
                r"\theta_t",
                True,
                "turning",
                "direction from the Host's centre, seen from what goes round it from the run's start on",
            ),
            (
                "rim_turn",
                "rad",
                r"\Delta(\theta-\psi)",
                True,
                "",
                "direction of the contact seen from the disk, from that of the contact before on",
            ),
            (
                "last_slip",
                "m/s",
                "v_{t,c}",
                False,
                "",
                "tangential speed of the contact point before the impact before",
            ),
            (
                "recent_blows",
                "m^2/s^2",
                "B",
                False,
                "fading",
                f"squared normal speeds of the last {FADING_BLOWS} impacts, added up as they fade with the time since",
            ),
            ("blows", "1", "N", False, "", "number of impacts that the run has had"),
            (
                "swing",
                "m/s",
                "S",
                False,
                "swinging",
                f"what the last {FADING_BLOWS} impacts set swinging, by their normal speeds: how far it has gone, from "
                "rest, out to where the disk is",
            ),
            (
                "swing_rate",
                "m/s",
                "S'",
                False,
                "swinging",
                f"what the last {FADING_BLOWS} impacts set swinging, by their normal speeds: how fast it goes out to "
                "where the disk is",
            ),
            (
                "ovalling",
                "m/s",
                "O",
                False,
                "swinging",
                f"what the last {FADING_BLOWS} impacts make oval, by their normal speeds, as it swings back and fades: "
                "how far it has gone out to where the disk is",
            ),
            (
                "place_along_sliding",
                "m^2/s",
                r"\vec d_H\cdot\vec u",
                False,
                "host",
                "way from a place of the Host times the velocity against the floor along it",
            ),
            ("at_cylinder", "1", "C", False, "", "1 at a cylinder in the middle, 0 at the wall"),
            ("airspeed", "m/s", "v_a", False, "wind", "speed in the room against air that moves there"),
            (
                "host_place_along",
                "m",
                r"s_{H,\varphi}",
                False,
                "angle",
                "place of the Host from the middle of its run's path along a direction; of measurements only",
            ),
            ("along_room", "m", r"s_0", False, "room_line", "place in the room along a direction"),
            (
                "host_acceleration_around",
                "m/s^2",
                r"a_\theta",
                False,
                "",
                "acceleration of the Host about its centre, where the disk is",
            ),
            (
                "breathing",
                "m/s",
                "P",
                False,
                "swinging",
                f"what the last {FADING_BLOWS} impacts make wider all around, by their normal speeds, as it swings "
                "back and fades: how far it has gone",
            ),
            ("breathing_rate", "m/s", "P'", False, "swinging", "the same: how fast it goes"),
            (
                "blows_here",
                "m/s",
                "D",
                False,
                "spreading",
                f"normal speeds of the last {MOST_BLOWS} impacts, added up, each the less the farther from here along "
                "the wall it was, and the longer ago",
            ),
            (
                "rim_blows_here",
                "m/s",
                "D'",
                False,
                "spreading",
                "the same along the rim, of impacts seen from the disk",
            ),
            (
                "last_spun",
                "rad/s",
                r"\Delta\omega_c",
                False,
                "",
                "spin that the impact before gave; of measurements only",
            ),
            (
                "struck_rim",
                "rad",
                r"\theta_c-\psi_c",
                True,
                "angle",
                "direction of the contact before seen from the disk, as it was then; of measurements only",
            ),
            (
                "sliding_from_blow",
                "rad",
                r"\delta_c",
                True,
                "",
                "direction of the velocity against the floor, from that in which the impact before pushed the Host",
            ),
            (
                "off_path",
                "m",
                r"d_\perp",
                False,
                "",
                "distance from the line between the two contacts before, to the left of the flight between them",
            ),
            ("way_since", "m", "s_i", False, "", "way slid over the floor since the impact before, or the run's start"),
            ("way", "m", "s_f", False, "", "way slid over the floor since the run's start"),
            ("turned", "rad", r"\Delta\psi", False, "", "angle by which the disk has turned since the run's start"),
            (
                "trail_along",
                "1",
                r"\bar e_\parallel",
                False,
                "trailing",
                "mean direction of the way just slid, as it fades with the way: its part along the way now",
            ),
            (
                "trail_across",
                "1",
                r"\bar e_\perp",
                False,
                "trailing",
                "mean direction of the way just slid, as it fades with the way: its part to the left of the way now",
            ),
            (
                "way_lately",
                "m",
                r"\bar s",
                False,
                "fading",
                "way slid over the floor, added up as it fades with the time since",
            ),
            (
                "rim_angle",
                "rad",
                r"\alpha",
                True,
                "",
                "angle whose tangent is the speed of the rim by its spin over the speed against the floor",
            ),
        )
    )
}

#: name -> (code, does it keep the quantity's unit to the power of the order)
FUNCTIONS: dict[str, tuple[int, bool]] = {
    "power": (0, True),
    "absolute_power": (1, True),
    "cosine": (2, False),
    "sine": (3, False),
    "exponential": (4, False),
    "gaussian": (5, False),
    "below": (6, False),
    "sign": (7, False),
    "pulses": (8, False),
    "gates": (9, False),
    "above": (10, True),
    "tanh": (11, False),
    "decay": (12, False),
    "rational": (13, False),
    "within": (14, False),
    "sawtooth": (15, False),
    "rising": (16, False),
    "beyond": (17, False),
}
#: functions of a width, in their order's place, about every multiple of a period
TRAINS = ("pulses", "gates")
#: velocities, accelerations and places along a direction of their own
ALONG = ("velocity_along", "sliding_along", "host_acceleration_along", "host_velocity_along", "host_place_along")
#: angles between things, which no turn of the world changes
BETWEEN_THINGS = (
    *("phase", "clock", "body_angle", "contact_turn", "heading", "sliding_heading", "rim_turn"),
    *("struck_rim", "sliding_from_blow", "rim_angle"),
)
#: what knows the contact before: nil without one
OF_LAST_CONTACT = (
    *("from_contact", "contact_turn", "last_approach", "since_by_blow", "rim_turn", "last_slip"),
    *("last_spun", "struck_rim", "sliding_from_blow", "off_path"),
)
#: what adds up the impacts before: without one, nothing
OF_BLOWS = (
    *("recent_blows", "blows", "swing", "swing_rate", "ovalling"),
    *("breathing", "breathing_rate", "blows_here", "rim_blows_here"),
)
#: what remembers the way over the floor, and what only laws of the flights may follow
OF_WAY = ("way_since", "off_path", "way", "turned", "trail_along", "trail_across", "way_lately")
OF_FLIGHTS_ONLY = (*OF_WAY, "sliding_from_blow", "rim_angle")
#: what a law of the measurement may follow: what is known of a frame whatever it shows
OF_FRAMES = (
    *("time", "share", "run", "phase", "clock"),
    *("host_acceleration_along", "host_velocity_along", "host_place_along"),
    *("since", "last_approach", "last_slip", "last_spun", "blows"),
)
#: what one of a marker may follow beside: what its body is known to do
OF_MARKERS = ("spin", "angle", "speed", "heading", "struck_rim")
#: what one of the NES in a picture may follow beside, and its targets
OF_NES_PICTURE, NES_PICTURE = ("angle", "spin", "speed", "velocity_along"), ("nes_picture_u", "nes_picture_v")
#: what one of the place where the NES is seen may follow beside, and its targets
OF_NES_PLACE, NES_PLACE = ("gap", "radius", "along_host", "distance_in_host"), ("nes_place", "nes_place_outwards")
#: what one of the markers' card on the NES may follow beside, and its targets
OF_NES_CARD, NES_CARD = ("spin", "angle", "struck_rim"), ("nes_card", "nes_card_turn")
#: what a camera's delay may follow beside: where and how fast the disk and the Host go, for what a camera sees may tell
#: it how long to expose
OF_CAMERA_DELAY = (
    *("along_host", "radius", "gap", "distance_in_host", "azimuth", "speed", "velocity_along", "spin"),
    "host_speed",
)
#: what nothing but a law of the measurement may follow: it is not known while a run goes on
OF_MEASUREMENTS_ONLY = ("share", "host_place_along", "last_spun", "struck_rim")
#: own offset and direction of what is a place along a line, in the Host or the room
LINES = ("line", "room_line")
#: what a target's own number and direction are: of a marker, of a camera, of these what has a direction
MARKERS = ("marker", "body_marker")
CAMERAS = ("camera", "camera_axis", "camera_angle")
DIRECTED = (*MARKERS, *CAMERAS[1:])
TURN = 2 * math.pi
