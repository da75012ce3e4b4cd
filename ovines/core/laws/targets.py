"""What a term of a written law may act on.  Names are those of ``law-1.toml``; the codes are those of compiled code
(:mod:`ovines.core.laws.kernel`)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """What a term acts on: ``unit`` of what it adds, LaTeX of the direction or the quantity, what a place or angle of
    its own means (none, "angle", "axis" of a mirror, "body": angle seen from the disk, "room" or "host" place,
    "wind": a velocity in the room, "time" to another frame, number of a "camera", with the axis of a mirror
    ("camera_axis") or a direction ("camera_angle") in its picture, number of a "marker" and its direction in the room,
    or seen from the disk: "body_marker"), and the stage."""

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
            (
                "contact_normal", "rad", r"\alpha_n", "", "impact",
                "the turn of a blow from the wall's normal, counterclockwise",
            ),
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
            (
                "picture_skew", "1", r"u", "camera", "measurement",
                "the share of its place along v by which a camera's picture lies further along u",
            ),
            (
                "board_stretch", "1", r"(\vec e_{\varphi}\cdot\vec x)\,\vec e_{\varphi}", "angle", "measurement",
                "how far a place lies along a direction of the world: boards that are longer there add a share of it",
            ),
            (
                "board_bow", "1/m^2", r"|\vec d|^2\,\vec d", "room", "measurement",
                "how far a place lies from one of the world, times the square of that: bowed boards add a share of it",
            ),
            (
                "marker_way", "m", r"\hat v_m", "", "measurement",
                "the place of every marker of Host and NES, along its own velocity, by its own speed: a tracker that "
                "stays behind",
            ),
            (
                "host_place", "m", r"\vec e_{\varphi}", "angle", "measurement",
                "the place where the Host is seen, along a direction in the room",
            ),
            (
                "marker_neighbour", "1", r"\vec s", "time", "measurement",
                "the place of every marker of Host and NES, by a share of its step to where it is some time later or "
                "was before: tracks that were smoothed",
            ),
            (
                "host_tilt", "1", r"\vec e_{\varphi}", "angle", "measurement",
                "how much the Host's markers rise per way along a direction in the room",
            ),
        )
    )
}  # fmt: skip

#: what a target's own number and direction are: of a marker, of a camera, of these what has a direction
MARKERS = ("marker", "body_marker")
CAMERAS = ("camera", "camera_axis", "camera_angle")
DIRECTED = (*MARKERS, *CAMERAS[1:])
#: targets of a camera's whole picture, and of the NES in it
PICTURE = ("picture_u", "picture_v", "picture_zoom", "picture_turn")
NES_PICTURE = ("nes_picture_u", "nes_picture_v")
#: targets of the place where the NES is seen, and of the markers' card on it
NES_PLACE = ("nes_place", "nes_place_outwards")
NES_CARD = ("nes_card", "nes_card_turn")
#: target of the place where the Host is seen
HOST_PLACE = "host_place"
#: ... and of how its markers lean
HOST_TILT = "host_tilt"
#: every marker along its own way, and a share of every marker's way from where it is to where it is some time later or
#: was before
MARKER_WAY, MARKER_NEIGHBOUR = "marker_way", "marker_neighbour"
#: how much later than they say all cameras see
CLOCK = "clock_delay"
#: what boards made of the world that all cameras were calibrated in
BOARDS = ("board_stretch", "board_bow")
