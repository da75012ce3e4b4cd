"""The rig's own frame: the one place that knows where the world has its origin, how it is turned, and when its clock
began.

Everything after triangulation is computed about the Host's mean place, along its measured drive, in time that counts
from the middle of a run, and is reported in the user's world.  Identification also computes in the rig's own units:
lengths such that the contact radius is :data:`CONTACT_RADIUS_M`, times such that gravity keeps its value (Froude's
similarity: times go with the root of lengths).  What is written there in metres and seconds holds for a rig of any
size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.statistics.robust import smooth_noise
from ovines.camera import Camera
from ovines.core.laws.terms import WrittenLaw

Array = NDArray[np.float64]

#: contact radius of every rig in its own units (m): that of the thesis' rig
CONTACT_RADIUS_M = 0.04
# A Host whose place varies by less than this many sds of a frame stands still: it has no direction of its own.
MOVING_SD = 10.0
BODIES = ("host", "nes")
#: times of an event, which shift with the clock's zero (a duration or an sd does not)
INSTANTS = ("time_s", "start_s", "end_s")
#: directions in the room of an event
DIRECTIONS = ("azimuth_rad", "normal_rad")


@dataclass(frozen=True, eq=False)
class RigFrame:
    """Where the rig's frame lies in the world.

    ``origin_m`` (2,): the Host's mean place; ``turn_rad``: direction of its drive; ``middle_s``: per run, the world's
    time in its middle;
    ``length``: world metres in a metre of the rig (1: lengths and times are kept).
    """

    origin_m: Array
    turn_rad: float
    middle_s: tuple[float, ...]
    length: float = 1.0

    def factor(self, name: str) -> float:
        """What a quantity in the rig's units is to be multiplied with to be one of the world; its unit is the end of
        its ``name``.
        """
        length, time = self.length, float(np.sqrt(self.length))
        size = {"m": length, "s": time, "hz": 1 / time}
        words = name.split("_")
        if "per" not in words[-2:-1]:
            return size.get(words[-1], 1.0)
        unit, power = words[-1].rstrip("0123456789"), words[-1].lstrip("abcdefghijklmnopqrstuvwxyz")
        over = words[-3] if len(words) > 2 else ""
        return size.get(over, 1.0) / size.get(unit, 1.0) ** int(power or 1)

    def motion(self, motion: pd.DataFrame, run: int = 0) -> pd.DataFrame:
        """Table ``motion`` of a run, from the world into the rig's frame."""
        table = motion.assign(time_s=(motion["time_s"] - self.middle_s[run]) / self.factor("time_s"))
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        for body in BODIES:
            for x, y, shift in (
                (f"{body}_x_m", f"{body}_y_m", self.origin_m),
                (f"{body}_vx_m_per_s", f"{body}_vy_m_per_s", np.zeros(2)),
            ):
                if x in motion and y in motion:
                    along, across = motion[x] - shift[0], motion[y] - shift[1]
                    table[x], table[y] = (
                        (c * along + s * across) / self.factor(x),
                        (c * across - s * along) / self.factor(y),
                    )
            if f"{body}_x_sd_m" in motion and f"{body}_y_sd_m" in motion:
                # One for both axes: turned sds would need the covariance between them.
                both = np.sqrt(0.5 * (motion[f"{body}_x_sd_m"] ** 2 + motion[f"{body}_y_sd_m"] ** 2))
                table[f"{body}_x_sd_m"] = table[f"{body}_y_sd_m"] = both / self.factor("sd_m")
            for name in (f"{body}_z_m", f"{body}_z_sd_m", f"{body}_vz_m_per_s", f"{body}_spin_rad_per_s"):
                if name in motion:
                    table[name] = motion[name] / self.factor(name)
            if f"{body}_angle_rad" in motion:
                table[f"{body}_angle_rad"] = motion[f"{body}_angle_rad"] - self.turn_rad
        return table

    def points(self, points: pd.DataFrame, run: int = 0) -> pd.DataFrame:
        """Table ``points`` (or ``tracks``, whose times alone are the world's) of a run, into the rig's frame."""
        table = points.assign(time_s=(points["time_s"] - self.middle_s[run]) / self.factor("time_s"))
        if "x_m" in points:
            x, y = points["x_m"] - self.origin_m[0], points["y_m"] - self.origin_m[1]
            c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
            table["x_m"], table["y_m"] = (c * x + s * y) / self.length, (c * y - s * x) / self.length
            if self.length != 1.0:
                lengths = [name for name in points if name.endswith("_m") and name not in ("x_m", "y_m")]
                table[lengths] = points[lengths] / self.length
        return table

    def camera(self, camera: Camera) -> Camera:
        """A camera that sees the rig's frame as ``camera`` sees the world."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        origin = camera.rotation @ np.append(self.origin_m, 0.0) + camera.translation_m
        return replace(camera, rotation=camera.rotation @ turn, translation_m=origin / self.length)

    def law(self, law: WrittenLaw) -> WrittenLaw:
        """A law of the world's frame in the rig's."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        x, y = self.origin_m
        moved = law.moved(-self.turn_rad, (-float(c * x + s * y), -float(c * y - s * x)))
        return moved if self.length == 1.0 else moved.in_units(self.length, self.factor("time_s"))

    def world_table(self, table: pd.DataFrame, run: int = 0) -> pd.DataFrame:
        """A table of events (``impacts``, ``flights``) of a run, from the rig's frame into the world."""
        given = table.copy()
        for name in table.columns:
            if self.factor(name) != 1.0 and len(table):
                given[name] = table[name] * self.factor(name)
            if name in INSTANTS:
                given[name] = given[name] + self.middle_s[run]
        for name in DIRECTIONS:
            if name in table and len(table):
                given[name] = np.angle(np.exp(1j * (table[name].to_numpy(float) + self.turn_rad)))
        return given

    def turned(
        self, names: Sequence[str], value: Array, covariance: Array, pairs: Sequence[tuple[str, str, int]]
    ) -> tuple[Array, Array]:
        """``value`` (P,) and ``covariance`` (P, P) of quantities ``names``, of which ``pairs`` (x, y, n) are components
        of something that turns with n times the frame: a vector's (1), an ellipse's (2)."""
        turn = np.eye(len(names))
        for x, y, times in pairs:
            if x in names and y in names:
                c, s = np.cos(times * self.turn_rad), np.sin(times * self.turn_rad)
                i, j = list(names).index(x), list(names).index(y)
                turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        return turn @ value, turn @ covariance @ turn.T

    def world_places(self, places: Array) -> Array:
        """Places and angles (N, 3: x, y, angle) of a path, from the rig's frame into the world."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        x, y, angle = places.T * np.array([[self.length], [self.length], [1.0]])
        return np.column_stack(
            [c * x - s * y + self.origin_m[0], s * x + c * y + self.origin_m[1], angle + self.turn_rad]
        )

    def within(self, inner: RigFrame) -> RigFrame:
        """The frame that leads from the world into ``inner``, whose own world is this frame (in metres and seconds)."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        x, y = inner.origin_m
        return RigFrame(
            self.origin_m + np.array([c * x - s * y, s * x + c * y]),
            self.turn_rad + inner.turn_rad,
            tuple(a + b for a, b in zip(self.middle_s, inner.middle_s, strict=True)),
            inner.length,
        )

    def world_parameters(
        self, effect: str, parameters: dict[str, tuple[float, float]]
    ) -> dict[str, tuple[float, float]]:
        """Parameters (value, sd) of an effect that have a direction in the room, from the rig's frame into the
        world.
        """
        return self._turned_parameters(effect, parameters, self.turn_rad)

    def rig_parameters(self, effect: str, parameters: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        """The same, from the world into the rig's frame."""
        return self._turned_parameters(effect, parameters, -self.turn_rad)

    def _turned_parameters(
        self, effect: str, parameters: dict[str, tuple[float, float]], turn_rad: float
    ) -> dict[str, tuple[float, float]]:
        given = dict(parameters)
        if "direction_rad" in given:
            value, sd = given["direction_rad"]
            # An ellipse is the same after half a turn.
            period = np.pi if effect == "wall_ellipticity" else 2 * np.pi
            given["direction_rad"] = (float((value + turn_rad + 0.5 * period) % period - 0.5 * period), sd)
        if effect == "plane_tilt":
            (x, x_sd), (y, y_sd) = given["x_rad"], given["y_rad"]
            c, s = np.cos(turn_rad), np.sin(turn_rad)
            given["x_rad"] = (float(c * x - s * y), float(np.hypot(c * x_sd, s * y_sd)))
            given["y_rad"] = (float(s * x + c * y), float(np.hypot(s * x_sd, c * y_sd)))
        return given


def own_units(contact_radius_m: float) -> tuple[float, float]:
    """Metres and seconds of the world in one of the rig's own."""
    length = contact_radius_m / CONTACT_RADIUS_M
    return length, float(np.sqrt(length))


def rig_frame(motions: Sequence[pd.DataFrame], contact_radius_m: float | None = None) -> RigFrame:
    """The frame that the runs of a series share, from their tables ``motion``; with the rig's own units where
    ``contact_radius_m`` is given.

    A Host that stands still has no drive: x is then the direction in which the NES' places spread most, which turns
    with the world as well.  A run without any place of the Host lies about the NES' mean place.

    Examples
    --------
    Where the middle of the drive lies in the world, and along which direction it moves the Host.

    >>> from ovines.notebook import analyse, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> from analysis.motion.rig_frame import rig_frame
    >>> frame = rig_frame([analyse(points, recording)])
    >>> f"x = {1e3 * frame.origin_m[0]:.2f} mm", f"{1e3 * frame.turn_rad:.0f} mrad"
    ('x = 0.05 mm', '10 mrad')
    """
    host, nes = (_places(motions, body) for body in BODIES)
    known = host if any(len(one) for one in host) else nes
    means = [one.mean(0) for one in known if len(one)]
    origin = np.mean(means, 0) if means else np.zeros(2)
    middles = tuple(_middle(motion["time_s"].to_numpy(float)) for motion in motions)
    length = 1.0 if contact_radius_m is None else own_units(contact_radius_m)[0]
    return RigFrame(origin, _direction(host if any(map(_moves, host)) else nes), middles, length)


def _places(motions: Sequence[pd.DataFrame], body: str) -> list[Array]:
    columns = [f"{body}_x_m", f"{body}_y_m"]
    found = [motion[columns].to_numpy(float) if set(columns) <= set(motion) else np.zeros((0, 2)) for motion in motions]
    return [one[np.isfinite(one).all(1)] for one in found]


def _middle(time_s: Array) -> float:
    return float(0.5 * (np.nanmin(time_s) + np.nanmax(time_s))) if np.isfinite(time_s).any() else 0.0


def _moves(place: Array) -> bool:
    """Whether a body moves in a run: its places (N, 2) spread by more than their noise (from third differences)."""
    if len(place) < 4:
        return False
    noise = float(np.linalg.norm([smooth_noise(column) for column in place.T]))
    return bool(np.sqrt(np.trace(np.cov(place.T))) > MOVING_SD * noise)


def _direction(places: Sequence[Array]) -> float:
    """Direction (rad, of the two that an axis has the one within a quarter turn of the world's x) along which places
    spread most.
    """
    spread = sum((np.cov(one.T) * len(one) for one in places if len(one) > 2), np.zeros((2, 2)))
    return float(0.5 * np.arctan2(2 * spread[0, 1], spread[0, 0] - spread[1, 1]))
