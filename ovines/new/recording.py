"""The text of a new recording.toml, with a comment on every line that a user may want to change."""

from __future__ import annotations

import json
from dataclasses import dataclass

MM, GRAM = 1e-3, 1e-3


@dataclass(frozen=True)
class Rig:
    """What the options of `ovines new` say; the defaults are the rig of the thesis."""

    cameras: tuple[str, ...] = ("VW1", "VW2")
    sensor_px: tuple[int, ...] = (4096, 3072)
    rate_hz: float = 800.0
    images: str = "png"
    calibration: str | None = None
    board: str = "charuco_5x7_8mm"
    host_radius_mm: float = 50.0
    nes_radius_mm: float = 10.0
    nes_mass_g: float = 24.6
    frequency_hz: float | None = None
    acceleration_g: float | None = None
    prototype: str | None = None
    frames: str | None = None
    intrinsic: str | None = None
    extrinsic: str | None = None

    @property
    def of_board_alone(self) -> bool:
        """Whether it only calibrates: board images were named, and no frames."""
        return self.intrinsic is not None and self.frames is None


# The thesis' prototypes: OVINES1 is pushed by hand, OVINES3 alone has markers on the ground; drives of Tables 18, 20.
PROTOTYPES = {
    "OVINES1": Rig(prototype="OVINES1"),
    "OVINES2": Rig(prototype="OVINES2", frequency_hz=11.0, acceleration_g=9.0),
    "OVINES3": Rig(prototype="OVINES3", frequency_hz=11.0, acceleration_g=8.0),
}
WITHOUT_GROUND = ("OVINES1", "OVINES2")


VIDEOS = ("avi", "mp4", "mov", "mkv")


def recording_text(rig: Rig, name: str) -> str:
    """TOML text; every string is quoted as JSON, which TOML reads alike."""
    ending = rig.images.lstrip(".*")
    filmed = ending.lower() in VIDEOS
    lines = [
        "# A recording of ovines. SI units; paths start at this file's folder. docs/how-to/record.md explains each "
        "line.",
        "format = 1",
        f"name = {_quoted(name)}",
        "",
    ]
    if not rig.of_board_alone:
        lines += [
            "[time]",
            f"frame_rate_hz = {rig.rate_hz!r}",
            '# trigger = "trigger.csv"              # frame,time_s as measured; wins over frame_rate_hz',
            "",
        ]
    for camera in rig.cameras:
        frames = rig.frames or (f"{camera}.{ending}" if filmed else f"{camera}/*.{ending}")
        lines += [
            "[[cameras]]",
            f"name = {_quoted(camera)}",
            *([] if rig.of_board_alone else [f"frames = {_quoted(frames)}"]),
            f"sensor_size_px = [{rig.sensor_px[0]}, {rig.sensor_px[1]}]",
            "# window_offset_px = [0, 1192]          # <- top-left corner of the part of the sensor that was kept",
            "# window_size_px = [4096, 688]          # <- and its size; left out: the whole sensor",
            "# exposure_s = 800e-6",
            "# readout_s = 0.012                     # rolling shutter: from the first row read to the last",
            "",
        ]
    lines += ["[calibration]"]
    if rig.calibration is not None:
        lines += [f"file = {_quoted(rig.calibration)}"]
    else:
        intrinsic, extrinsic = (
            _quoted(given or f"calibration/{{camera}}/{stem}.{ending}")
            for given, stem in (
                (rig.intrinsic, "intrinsic" if filmed else "intrinsic/*"),
                (rig.extrinsic, "extrinsic"),
            )
        )
        lines += [
            f"board = {_quoted(rig.board)}             # <- a name of calibration_boards/, or a board's TOML file",
            f"intrinsic = {intrinsic}   # the board tilted and turned, 10 views or more",
            f"extrinsic = {extrinsic}     # one view of the board in the world position",
            '# file = "../calibration.json"         # instead of the three: a calibration that is solved',
        ]
    if rig.of_board_alone:
        return "\n".join(lines) + "\n"
    ground = [
        "[bodies.ground]                        # markers at rest; leave the section out when there are none",
        'markers = ["G1", "G2", "G3"]',
        "",
    ]
    lines += [
        "",
        *(() if rig.prototype in WITHOUT_GROUND else ground),
        "[bodies.host]",
        'markers = ["H1", "H2", "H3", "H4"]',
        f"inner_radius_m = {rig.host_radius_mm * MM:.6g}",
        "# polygon_m = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]   # instead: flat walls",
        "# layout_m = [[0.0464, 0.0187, 0.01], ...]   # <- x, y, z of each marker in the Host's frame",
        "",
        "[bodies.nes]",
        'markers = ["N1", "N2", "N3", "N4", "N5"]',
        'centre_marker = "N1"                   # <- the marker at the disk\'s centre, if there is one',
        f"radius_m = {rig.nes_radius_mm * MM:.6g}",
        f"mass_kg = {rig.nes_mass_g * GRAM:.6g}",
        "inertia_factor = 0.5                   # q of I = q m R^2: 0.5 is a full disk",
        "# layout_m = [[0.0, 0.0, 0.01], ...]   # <- without it, name the markers with `ovines pick`",
        "",
        *_excitation(rig),
        *_log(rig),
        "# [accelerometers]                     # a record beside the cameras; compared with the Host's motion",
        '# file = "accelerometers.csv"          # time_s and a column per channel',
        "# [[accelerometers.channels]]",
        '# column = "channel 2"',
        '# direction = "x"',
        '# unit = "V"',
        "# sensitivity_mv_per_g = 10.4",
        "",
        "[model]                                # what the simulator already contains",
        'effects = ["floor_friction", "spin_coupling"]',
        "# restitution = 0.72                   # known parameters; the others are identified",
        "# wall_friction = 0.13",
        "# tangential_restitution = 0.49",
        "# floor_friction = 0.2",
    ]
    return "\n".join(lines) + "\n"


def _log(rig: Rig) -> list[str]:
    """The log sheet's lines, to be filled in."""
    known = rig.prototype is not None
    return [
        f"{'' if known else '# '}[log]                                # the test's log sheet; shown in reports",
        '# date = "2026-05-18"',
        f"prototype = {_quoted(str(rig.prototype))}" if known else '# prototype = "OVINES3"',
        '# nes_type = "steel washer"',
        "# temperature_deg_c = 23.5",
        '# remarks = "no accelerometer data"',
        "",
    ]


def _excitation(rig: Rig) -> list[str]:
    if rig.frequency_hz is None:
        return ["# [excitation]                         # what the shaker was asked for", "# frequency_hz = 11.0", ""]
    lines = ["[excitation]", f"frequency_hz = {rig.frequency_hz!r}"]
    if rig.acceleration_g is not None:
        lines += [f"acceleration_g = {rig.acceleration_g!r}"]
    return [*lines, 'axis = "x"', ""]


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
