"""The sections of recording.toml (docs/reference/recording-toml.md); what is wrong in one of them is said here."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from ovines.io.toml_input import Section
from ovines.recording_schema.accelerometers import Accelerometers
from ovines.recording_schema.words import (
    Coordinate,
    Length,
    Mass,
    Name,
    NotNegative,
    Offset,
    PathText,
    Pixels,
    Point3,
    Positive,
)


class Time(Section):
    """``[time]``: frame rate, and the file of trigger times where one was recorded."""

    frame_rate_hz: Positive | None = None
    """Nominal frame rate; may be left out where ``trigger`` or a table brings the times. Example: `800.0`."""
    trigger: PathText | None = None
    """File of measured times, ``frame,time_s``; it wins over ``frame_rate_hz``. Example: `"trigger.csv"`."""


class CameraSettings(Section):
    """One ``[[cameras]]`` entry; without a window the whole sensor was read."""

    name: Name
    """What tables and pages call the camera. Example: `"VW1"`."""
    frames: PathText | None = None
    """Its pictures (a glob) or one video file; left out where a table is the entry. ``{camera}`` stands for the name.
    Example: `"VW1/*.png"`.
    """
    sensor_size_px: tuple[Pixels, Pixels]
    """Width and height of the whole sensor. Example: `[4096, 3072]`."""
    window_offset_px: tuple[Offset, Offset] = (0, 0)
    """Top-left corner of the window that was kept, on the sensor. Example: `[0, 1192]`."""
    window_size_px: tuple[Pixels, Pixels] | None = None
    """Width and height of the window; left out: from its corner to the sensor's end. Example: `[4096, 688]`."""
    exposure_s: Positive | None = None
    """How long the shutter is open; with it the arc run through meanwhile is taken out. Example: `400e-6`."""
    readout_s: Annotated[float, Field(ge=-1.0, le=1.0)] | None = None
    """Rolling shutter: time from the first row of the window being read to the last (below 0: upwards); 0: all rows at
    once. Left out: taken out where moving bodies surely show it. Example: `0.012`.
    """

    @model_validator(mode="after")
    def _window_on_sensor(self) -> CameraSettings:
        for axis, offset, size, sensor in zip(
            ("width", "height"), self.window_offset_px, self.window_px, self.sensor_size_px, strict=True
        ):
            if offset + size > sensor:
                raise ValueError(
                    f"window of {self.name} ends at {offset + size} px of a sensor {axis} of {sensor} px"
                    " | window_offset_px + window_size_px within sensor_size_px | window_offset_px"
                )
        return self

    @property
    def window_px(self) -> tuple[int, int]:
        """Width and height of the images."""
        if self.window_size_px is not None:
            return self.window_size_px
        return (
            self.sensor_size_px[0] - self.window_offset_px[0],
            self.sensor_size_px[1] - self.window_offset_px[1],
        )


class Calibration(Section):
    """Either a solved calibration, or the board images to solve it from."""

    file: PathText | None = None
    """A solved calibration, in place of the other three keys. Example: `"../calibration.json"`."""
    board: PathText | None = None
    """A name of ``calibration_boards/``, or a path to a board's TOML. Example: `"charuco_5x7_8mm"`."""
    intrinsic: PathText | None = None
    """Pictures of the tilted board, of the whole sensor unless they have the window's size.
    Example: `"calibration/{camera}/intrinsic/*.png"`.
    """
    extrinsic: PathText | None = None
    """One view of the board lying on the sliding plane: the world. Example: `"calibration/{camera}/extrinsic.png"`."""
    board_height_m: Annotated[float, Field(ge=-1.0, le=1.0)] | None = None
    """How far the board's printed surface lies above the sliding plane in the extrinsic view: its thickness, or what it
    was laid on. Left out: 0. Example: `0.003`.
    """
    simultaneous: bool | None = None
    """Whether intrinsic pictures of one name (but for the camera's), or frames of one number, were taken at the same
    instant: they then tie the cameras to each other. Left out: where they agree. Example: `true`.
    """

    @model_validator(mode="after")
    def _one_of_two(self) -> Calibration:
        images = {"board": self.board, "intrinsic": self.intrinsic, "extrinsic": self.extrinsic}
        given = [key for key, value in images.items() if value is not None]
        if self.file is not None:
            given += [key for key in ("board_height_m", "simultaneous") if getattr(self, key) is not None]
        if self.file is not None and given:
            raise ValueError(f"'file' and {', '.join(given)} | either 'file' or board, intrinsic and extrinsic")
        if self.file is None and len(given) < 3:
            missing = [key for key in images if key not in given]
            raise ValueError(f"no {', '.join(missing)} | either 'file' or all of board, intrinsic and extrinsic")
        return self


# How well markers are glued where recording.toml does not say: within 0.05 mm.
PLACEMENT_SD_M = 5e-5


class Body(Section):
    """What is common to ground, Host and NES: markers and where they were placed."""

    markers: tuple[Name, ...] = ()
    """Names of the markers on the body. Example: `["N1", "N2", "N3"]`."""
    layout_m: tuple[Point3, ...] | None = None
    """Where each marker was placed, x, y, z in the body's own frame, in the order of ``markers``.
    Example: `[[0.0, 0.0, 0.01], [0.0061, 0.0003, 0.01]]`.
    """
    layout_sd_m: Annotated[float, Field(ge=1e-9, le=1.0)] | None = None  # from an atom's size to a metre
    """How well the markers were placed (standard deviation). Example: `3e-5`."""

    @model_validator(mode="after")
    def _markers_fit(self) -> Body:
        if len(set(self.markers)) < len(self.markers):
            raise ValueError(f"markers {', '.join(self.markers)} | each marker once | markers")
        if self.layout_m is not None and len(self.layout_m) != len(self.markers):
            raise ValueError(
                f"{len(self.layout_m)} positions in layout_m | one for each of {len(self.markers)} markers | layout_m"
            )
        if self.layout_m is not None and len(set(self.layout_m)) < len(self.layout_m):
            place = next(one for one in self.layout_m if self.layout_m.count(one) > 1)
            raise ValueError(
                f"{list(place)} stands for more than one marker in layout_m | each marker at a place of its own | "
                f"layout_m"
            )
        return self


class Ground(Body):
    """``[bodies.ground]``: markers that stand still in the world."""

    pass


class Host(Body):
    """Circular (``inner_radius_m``) or polygonal (``polygon_m``, counter-clockwise) inner wall."""

    inner_radius_m: Length | None = None
    """Radius of the round wall; either this or ``polygon_m``. Example: `0.05`."""
    polygon_m: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=3, max_length=1000)] | None = None
    """Corners of flat walls, counter-clockwise, in the Host's frame.
    Example: `[[-0.05, -0.05], [0.05, -0.05], [0.0, 0.06]]`.
    """
    obstacle_radius_m: Length | None = None
    """Radius of a cylinder fixed at the Host's centre. Example: `0.01`."""

    @model_validator(mode="after")
    def _wall(self) -> Host:
        if (self.inner_radius_m is None) == (self.polygon_m is None):
            given = "neither inner_radius_m nor polygon_m" if self.polygon_m is None else "inner_radius_m and polygon_m"
            raise ValueError(f"{given} | one of the two")
        if self.polygon_m is not None:
            corners = zip(self.polygon_m, (*self.polygon_m[1:], self.polygon_m[0]), strict=True)
            if sum(a[0] * b[1] - a[1] * b[0] for a, b in corners) <= 0:
                raise ValueError("polygon_m runs clockwise or has no area | corners counter-clockwise | polygon_m")
        if self.inner_radius_m and self.obstacle_radius_m and self.obstacle_radius_m >= self.inner_radius_m:
            raise ValueError(
                "obstacle_radius_m reaches the wall | an obstacle smaller than inner_radius_m | obstacle_radius_m"
            )
        return self


class Nes(Body):
    """``[bodies.nes]``: the disk, its markers, radius, mass and inertia factor (J = factor m R^2)."""

    centre_marker: Name | None = None
    """The marker at the disk's centre, if there is one. Example: `"N1"`."""
    radius_m: Length
    """Radius of the disk. Example: `0.01`."""
    mass_kg: Mass | None = None
    """Its mass. Example: `0.0246`."""
    inertia_factor: Annotated[float, Field(ge=1e-3, le=1)] | None = None  # below: a body that turns without inertia
    """q of its inertia I = q m R²; 0.5 is a full disk. Example: `0.5`."""

    @model_validator(mode="after")
    def _centre(self) -> Nes:
        if self.centre_marker is not None and self.centre_marker not in self.markers:
            raise ValueError(
                f"centre_marker {self.centre_marker!r} | one of the markers {', '.join(self.markers)} | centre_marker"
            )
        return self


class Bodies(Section):
    """``[bodies]``: what the markers sit on; each marker belongs to one body."""

    ground: Ground | None = None
    host: Host | None = None
    nes: Nes | None = None

    @model_validator(mode="after")
    def _together(self) -> Bodies:
        seen: dict[str, str] = {}
        for body in ("ground", "host", "nes"):
            for marker in getattr(getattr(self, body), "markers", ()):
                if marker in seen:
                    raise ValueError(
                        f"marker {marker!r} is on {seen[marker]} and on {body} | each marker on one body | "
                        f"{body}.markers"
                    )
                seen[marker] = body
        if self.host and self.nes and self.host.inner_radius_m:
            free_m = self.host.inner_radius_m - (self.host.obstacle_radius_m or 0)
            taken_m = self.nes.radius_m * (2 if self.host.obstacle_radius_m else 1)
            if taken_m >= free_m:
                raise ValueError(
                    f"nes radius_m {self.nes.radius_m} has no room | an NES that fits inside the Host | nes.radius_m"
                )
        return self


class Excitation(Section):
    """``[excitation]``: the drive's frequency (Hz), level (g) and axis."""

    frequency_hz: Positive
    """Frequency of the drive. Example: `11.0`."""
    acceleration_g: Positive | None = None
    """Largest acceleration of the drive, in units of 9.81 m/s². Example: `8.0`."""
    axis: Literal["x", "y", "z"] | None = None
    """Direction of the drive; nominal, the measured one counts. Example: `"x"`."""


class Nominal(Section):
    """``[model]``: what the nominal simulator contains, and its parameters as far as known."""

    effects: tuple[Name, ...] = ()
    """Effects that the simulator already contains ([names](effects.md)).
    Example: `["floor_friction", "spin_coupling"]`.
    """
    restitution: Annotated[float, Field(ge=0, le=1)] | None = None
    """Normal speed after an impact over the one before; left out: identified. Example: `0.72`."""
    wall_friction: NotNegative | None = None
    """Coulomb's coefficient at the wall; left out: identified. Example: `0.13`."""
    tangential_restitution: Annotated[float, Field(ge=-1, le=1)] | None = None
    """Of an impact whose contact sticks; left out: identified. Example: `0.49`."""
    floor_friction: NotNegative | None = None
    """Coefficient of the Host's floor; left out: identified. Example: `0.2`."""
    effect_parameters: dict[Name, dict[Name, float]] = Field(default_factory=dict)
    """Tables `[model.effect_parameters.NAME]`: sizes of effects that `effects` names, which are then held
    ([names and sizes](effects.md)); a named effect without sizes is fitted.
    Example: `{table_tilt = {tilt_rad = 0.0188, direction_rad = -0.59}}`.
    """

    laws: tuple[str, ...] = ()
    """Files of written laws that the simulator contains, from this file on ([law.toml](law-toml.md)); held by
    `identify`, `compare` and `diagnose`. Example: `["law-1.toml"]`.
    """

    @model_validator(mode="after")
    def _sizes_of_effects(self) -> Nominal:
        for name in self.effect_parameters:
            if name not in self.effects:
                raise ValueError(
                    f"sizes of {name}, which [model] effects does not name | {name} in effects"
                    f" | effect_parameters.{name}"
                )
        return self


class ThesisMethod(Section):
    """``[thesis_method]``: how the thesis' own way finds impacts and parameters, which pages show beside the careful
    one. What is left out is as it finds every impact above 1 m/s of a rig filmed at 800 frames per second, and none
    that is not there.
    """

    smoothing_frames: Annotated[int, Field(ge=3, le=999)] = 7
    """Window of the Savitzky-Golay filter, an odd number of frames. Example: `11`."""
    polynomial_order: Annotated[int, Field(ge=1, le=9)] = 3
    """Order of the filter's polynomials. Example: `3`."""
    minimum_distance_s: Positive = 0.008
    """Least time between two peaks of the acceleration. Example: `0.02`."""
    prominence_m_per_s2: Positive = 60.0
    """How far a peak stands out of what lies between it and a higher one. Example: `100.0`."""
    points_each_side: Annotated[int, Field(ge=3, le=999)] = 5
    """Points of the straight lines before and after an impact. Example: `4`."""
    points_left_out: Annotated[int, Field(ge=0, le=99)] = 1
    """Points next to the impact that the lines leave out. Example: `0`."""
    impacts: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """Impacts that J_n and J_t take, by their numbers in thesis_impacts.parquet; a single one gives its own map of
    J_t. Left out: those above 0.3 m/s. Example: `[3, 5, 8]`.
    """

    @model_validator(mode="after")
    def _a_filter(self) -> ThesisMethod:
        if self.smoothing_frames % 2 == 0 or self.smoothing_frames <= self.polynomial_order:
            raise ValueError(
                f"a window of {self.smoothing_frames} frames for polynomials of order {self.polynomial_order} | an odd "
                f"number above the order | smoothing_frames"
            )
        return self


class LogSheet(Section):
    """``[log]``: what the test's log sheet says; shown on pages, used by no computation."""

    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")] | None = None
    """Day of the test. Example: `"2026-05-18"`."""
    prototype: Name | None = None
    """The Host's design. Example: `"OVINES3"`."""
    nes_type: Name | None = None
    """What serves as the NES. Example: `"steel washer"`."""
    temperature_deg_c: Annotated[float, Field(gt=-273.15, lt=1000)] | None = None
    """Temperature of the Host or the room. Example: `23.5`."""
    remarks: Annotated[str, Field(max_length=1000)] | None = None
    """Anything else. Example: `"no accelerometer data"`."""

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """What was written, as title and text."""
        temperature = None if self.temperature_deg_c is None else f"{self.temperature_deg_c:g} °C"
        titled = {
            "Date": self.date,
            "Prototype": self.prototype,
            "NES": self.nes_type,
            "Temperature": temperature,
            "Remarks": self.remarks,
        }
        return [(title, text) for title, text in titled.items() if text]


class RecordingFile(Section):
    """The whole file (FORMATS ``recording.toml``)."""

    format: Literal[1]
    """Version of this format, always 1. Example: `1`."""
    name: Name | None = None
    """What pages call the recording; left out: its folder's name. Example: `"run 5"`."""
    time: Time = Time()
    cameras: Annotated[tuple[CameraSettings, ...], Field(max_length=16)] = ()
    calibration: Calibration | None = None
    bodies: Bodies = Bodies()
    excitation: Excitation | None = None
    model: Nominal | None = None
    thesis_method: ThesisMethod | None = None
    log: LogSheet | None = None
    accelerometers: Accelerometers | None = None

    @model_validator(mode="after")
    def _cameras_differ(self) -> RecordingFile:
        names = [camera.name for camera in self.cameras]
        if len(set(names)) < len(names):
            again = next(i for i, name in enumerate(names) if name in names[:i])
            raise ValueError(f"cameras {', '.join(names)} | each camera name once | cameras.{again}.name")
        return self
