"""What a written law is made of: the quantities that it may follow, and functions of them; what it acts on stands in
:mod:`ovines.core.laws.targets`, which of these quantities it may follow there in :mod:`ovines.core.laws.allowed`.

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
#: cylinder in the middle (1) or at the wall (0), the spin (rad/s) that the contact before gave the disk (of a
#: measurement only), from BLOW_SLIPS on the tangential speeds (m/s) of the last impacts, the disk's angle (rad) as the
#: run began, and its speed against the Host (m/s) after the contact before
(
    VX, VY, UX, UY, X, Y, HX, HY, CONTACT_RADIUS, ANGLE, SPIN, TIME, PHASE, SINCE, RUN, APPROACH, SLIP, FX, FY, FT,
    CLOCK, SHARE, WALL_SPEED, PASSING, LAST_X, LAST_Y, LAST_APPROACH, HOST_AX, HOST_AY,
    SPIN_LEFT, LAST_ANGLE, LAST_SLIP, BLOW_TIMES,
) = range(33)  # fmt: skip
#: so many impacts are remembered
MOST_BLOWS = 20
BLOW_SPEEDS = BLOW_TIMES + MOST_BLOWS
BLOW_WAYS = BLOW_SPEEDS + MOST_BLOWS
BLOW_SIDES = BLOW_WAYS + MOST_BLOWS
BLOWS = BLOW_SIDES + MOST_BLOWS
AT_CYLINDER = BLOWS + 1
LAST_SPUN = AT_CYLINDER + 1
BLOW_SLIPS = LAST_SPUN + 1
START_ANGLE = BLOW_SLIPS + MOST_BLOWS
LAST_LEFT = START_ANGLE + 1
#: radius of the disk (m), and what it remembers of its way over the floor: from WAY on the way slid since the run's
#: start (m), the mean direction of the way just slid, x and y, as it fades with the way within each of TRAILS lengths,
#: and the way just slid (m) as it fades with the time within each of LATELIES times; then the way slid at the contact
#: before (0 before the first; less than 0 where it is not known), the disk's place at the contact before that (m; 0, 0
#: where none is known), and the length (m) and the time (s) in which those lengths and times are counted
TRAILS, LATELIES = 7, 8
DISK_RADIUS = LAST_LEFT + 1
WAY = DISK_RADIUS + 1
MEMORY_SIZE = 1 + 2 * TRAILS + LATELIES
WAY_BEFORE = WAY + MEMORY_SIZE
BEFORE_X, BEFORE_Y = WAY_BEFORE + 1, WAY_BEFORE + 2
MEMORY_M, MEMORY_S = BEFORE_Y + 1, BEFORE_Y + 2
#: before an impact: acceleration of the Host (m/s^2) along the wall's outward normal, and that one's direction (rad) in
#: the room
WALL_ACCELERATION, NORMAL = MEMORY_S + 1, MEMORY_S + 2
KNOWN_SIZE = NORMAL + 1
#: a time since the impact before that is long enough to be forgotten (s)
LONG_AGO_S = 1e6


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
    def in_words(self) -> str:
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
                f"squared normal speeds of the last {MOST_BLOWS} impacts, added up as they fade with the time since",
            ),
            ("blows", "1", "N", False, "", "number of impacts that the run has had"),
            (
                "swing",
                "m/s",
                "S",
                False,
                "swinging",
                f"what the last {MOST_BLOWS} impacts set swinging, by their normal speeds: how far it has gone, from "
                "rest, out to where the disk is",
            ),
            (
                "swing_rate",
                "m/s",
                "S'",
                False,
                "swinging",
                f"what the last {MOST_BLOWS} impacts set swinging, by their normal speeds: how fast it goes out to "
                "where the disk is",
            ),
            (
                "ovalling",
                "m/s",
                "O",
                False,
                "swinging",
                f"what the last {MOST_BLOWS} impacts make oval, by their normal speeds, as it swings back and fades: "
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
                f"what the last {MOST_BLOWS} impacts make wider all around, by their normal speeds, as it swings "
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
                "turned_since",
                "rad",
                r"\psi-\psi_c",
                False,
                "",
                "angle by which the disk has turned since the contact before, every turn counted",
            ),
            ("last_left", "m/s", "u_c", False, "", "speed against the Host after the contact before"),
            (
                "ovalling_rate",
                "m/s",
                "O'",
                False,
                "swinging",
                f"what the last {MOST_BLOWS} impacts make oval, by their normal speeds: how fast it goes out to where "
                "the disk is",
            ),
            (
                "twist",
                "m/s",
                r"\Theta",
                False,
                "swinging",
                f"what the last {MOST_BLOWS} impacts set swinging about the Host's centre, by their tangential speeds: "
                "how far it has gone, from rest",
            ),
            ("twist_rate", "m/s", r"\Theta'", False, "swinging", "the same: how fast it goes"),
            (
                "recent_rubbing",
                "m^2/s^2",
                "W",
                False,
                "fading",
                f"normal times tangential speed, in either sense, of the last {MOST_BLOWS} impacts, added up as they "
                "fade with the time since",
            ),
            (
                "turned",
                "rad",
                r"\Psi",
                False,
                "",
                "angle by which the disk has turned since the run began, every turn counted",
            ),
            (
                "nes_place_along",
                "m",
                r"s_{\varphi}",
                False,
                "angle",
                "place of the NES in the room, from the middle of the Host's path in the run, along a direction; of "
                "measurements only",
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
            (
                "last_azimuth",
                "rad",
                r"\theta_c",
                True,
                "angle",
                "direction of the contact before from the Host's centre, in the room",
            ),
            (
                "wall_acceleration",
                "m/s^2",
                "a_n",
                False,
                "",
                "acceleration of the Host along the wall's outward normal before the impact",
            ),
            (
                "normal_direction",
                "rad",
                r"\theta_n",
                True,
                "angle",
                "direction of the wall's outward normal where the disk strikes, in the room",
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
ALONG = (
    *("velocity_along", "sliding_along", "host_acceleration_along", "host_velocity_along", "host_place_along"),
    "nes_place_along",
)
#: angles between things, which no turn of the world changes
BETWEEN_THINGS = (
    *("phase", "clock", "body_angle", "contact_turn", "heading", "sliding_heading", "rim_turn"),
    *("struck_rim", "sliding_from_blow", "rim_angle"),
)
#: what knows the contact before: nil without one
OF_LAST_CONTACT = (
    *("from_contact", "contact_turn", "last_approach", "since_by_blow", "rim_turn", "last_slip"),
    *("last_spun", "struck_rim", "turned_since", "last_left", "sliding_from_blow", "off_path", "last_azimuth"),
)
#: what adds up the impacts before: without one, nothing
OF_BLOWS = (
    *("recent_blows", "blows", "swing", "swing_rate", "ovalling"),
    *("breathing", "breathing_rate", "blows_here", "rim_blows_here"),
    *("ovalling_rate", "twist", "twist_rate", "recent_rubbing"),
)
#: what remembers the way over the floor
OF_WAY = ("way_since", "off_path", "way", "trail_along", "trail_across", "way_lately")
#: own offset and direction of what is a place along a line, in the Host or the room
LINES = ("line", "room_line")
TURN = 2 * math.pi
