"""``[accelerometers]``: a record of accelerations beside the cameras."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from ovines.io.toml_input import Section
from ovines.recording_schema.words import Name, PathText, Point3, Positive

STANDARD_GRAVITY_M_PER_S2 = 9.80665  # by which sensors are calibrated
VOLTS = {"V": 1.0, "mV": 1e-3}
ACCELERATIONS = {"m/s^2": 1.0, "g": STANDARD_GRAVITY_M_PER_S2}
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Channel(Section):
    """``[[accelerometers.channels]]``: one column of the record, and where its sensor sits."""

    column: Name
    """The column's name in the file. Example: `"channel 2"`."""
    direction: Literal["x", "y", "z", "-x", "-y", "-z"] | Point3
    """Where the sensor points: an axis, or x, y, z of the direction; of the Host's own frame for a sensor on the Host,
    of the world for one on the table. Example: `"x"`.
    """
    body: Literal["host", "table"] = "host"
    """What it is fixed to; a table moves as the Host that it carries. Example: `"table"`."""
    unit: Literal["m/s^2", "g", "V", "mV"] = "m/s^2"
    """Unit of the column. Example: `"V"`."""
    sensitivity_mv_per_g: Positive | None = None
    """What the sensor gives for 9.80665 m/s²; for columns in V or mV. Example: `10.4`."""

    @model_validator(mode="after")
    def _a_sensor(self) -> Channel:
        if (self.unit in VOLTS) != (self.sensitivity_mv_per_g is not None):
            have = "no" if self.sensitivity_mv_per_g is None else "a"
            raise ValueError(
                f"column {self.column!r} in {self.unit} with {have} sensitivity | sensitivity_mv_per_g for columns in "
                f"V or mV, and for those only | unit"
            )
        if not np.linalg.norm(self.axis) > 0:
            raise ValueError("a direction of no length | x, y, z of the sensor's direction | direction")
        return self

    @property
    def axis(self) -> Point3:
        """The direction as a unit vector; (0, 0, 0) where it has no length."""
        if isinstance(self.direction, str):
            sign = -1.0 if self.direction.startswith("-") else 1.0
            x, y, z = AXES[self.direction[-1]]
            return (sign * x, sign * y, sign * z)
        length = float(np.linalg.norm(self.direction)) or 1.0
        return (self.direction[0] / length, self.direction[1] / length, self.direction[2] / length)

    @property
    def m_per_s2_per_unit(self) -> float:
        """m/s² for 1 of the column."""
        if self.sensitivity_mv_per_g is None:
            return ACCELERATIONS[self.unit]
        return VOLTS[self.unit] / (1e-3 * self.sensitivity_mv_per_g) * STANDARD_GRAVITY_M_PER_S2


class Accelerometers(Section):
    """``[accelerometers]``: a record of the Host's or the table's acceleration, with a clock of its own; it is
    synchronised by the Host's motion and compared with it.
    """

    file: PathText
    """CSV with a header or Parquet: ``time_s`` (or ``rate_hz`` below) and a column per channel.
    Example: `"accelerometers.csv"`.
    """
    rate_hz: Positive | None = None
    """Samples per second, where the file has no ``time_s``. Example: `10000.0`."""
    start_s: Annotated[float, Field(ge=-1e9, le=1e9)] | None = None
    """The cameras' time at the record's time 0, as far as known: tells which period of a steady drive is meant. Left
    out: 0. Example: `-0.2`.
    """
    channels: Annotated[tuple[Channel, ...], Field(min_length=1, max_length=16)]

    @model_validator(mode="after")
    def _differ(self) -> Accelerometers:
        names = [channel.column for channel in self.channels]
        if len(set(names)) < len(names):
            again = next(i for i, name in enumerate(names) if name in names[:i])
            raise ValueError(f"columns {', '.join(names)} | each column once | channels.{again}.column")
        return self
