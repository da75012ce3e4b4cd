"""Where a series' rig stands, how large it is, when its clock starts: what no answer may depend on.

The plant runs in the rig's own frame, in the usual rig's units.  A larger or smaller rig is the same motion in other
units: under equal gravity lengths by ``scale``, times and speeds by its root, accelerations and pixels as they are
(Froude's similarity).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.blind.plant.compiled import Floats

DRIVE_HZ, FRAME_RATE_HZ = 11.0, 800.0  # of the usual rig
DRIVES_HZ, FRAME_RATES_HZ = (9.0, 13.0), (400.0, 800.0, 1600.0)  # of others, in its units
SCALES = (0.3, 5.0)
USUAL_SHARE = 0.4  # of the series that are of the usual rig
FARTHEST_M, LATEST_S, LAST_FRAME = 2.0, 1e5, 1_000_000
WALLS: dict[str, dict[str, float]] = {  # in the plant's numbers
    "round": {},
    "triangle": {"wall_sides": 3.0, "wall_turn_rad": 0.5},
    "square": {"wall_sides": 4.0, "wall_turn_rad": 0.3},
    "cylinder": {"obstacle_m": 0.018},
}
# Powers of the scale by the end of a name; the first end that fits counts.
POWERS = (
    ("_m_per_s2", 0.0),
    ("_per_s2", -1.0),
    ("_rad_per_s", -0.5),
    ("_m_per_s", 0.5),
    ("_s2_per_m", 0.0),
    ("_s_per_m", -0.5),
    ("_s_per_m2", -1.5),
    ("_per_s", -0.5),
    ("_per_m", -1.0),
    ("_hz", -0.5),
    ("_kg", 3.0),
    ("_m", 1.0),
    ("_s", 0.5),
)


@dataclass(frozen=True)
class Place:
    """The defaults are the usual rig at the world's origin.

    ``rig_at_m``, ``turned_rad``: world = turn(rig) + rig_at_m; ``start_s``, ``first_frame``: of each run, none where
    empty; ``drive_hz`` and ``frame_rate_hz`` in the usual rig's units;
    ``wall`` and ``drive``: which kinds of them.
    """

    rig_at_m: tuple[float, float] = (0.0, 0.0)
    turned_rad: float = 0.0
    start_s: tuple[float, ...] = ()
    first_frame: tuple[int, ...] = ()
    scale: float = 1.0
    drive_hz: float = DRIVE_HZ
    frame_rate_hz: float = FRAME_RATE_HZ
    wall: str = "round"  # of WALLS
    drive: str = "sine"  # of `recording.drive`

    @property
    def slower(self) -> float:
        """What times of the usual rig are multiplied by."""
        return math.sqrt(self.scale)

    def in_units(self, name: str, value: Any) -> Any:
        """A number of the usual rig (or several) in this rig's units; the end of its name tells which."""
        if isinstance(value, (tuple, list)):
            return type(value)(self.in_units(name, one) for one in value)
        power = next((power for end, power in POWERS if name.endswith(end)), 0.0)
        return value if power == 0.0 or self.scale == 1.0 else float(value * self.scale**power)

    def world_parameters(self, cause: str, parameters: dict[str, float]) -> dict[str, float]:
        """True parameters of a cause as an answer states them: this rig's units, directions in the world."""
        out = {name: self.in_units(name, value) for name, value in parameters.items()}
        if cause in TURNING and "direction_rad" in out:
            out["direction_rad"] = math.remainder(out["direction_rad"] + self.turned_rad, 2 * math.pi)
        if cause == "plane_tilt":  # a small turn about a horizontal axis is a vector
            x, y = out["x_rad"], out["y_rad"]
            c, s = math.cos(self.turned_rad), math.sin(self.turned_rad)
            out |= {"x_rad": c * x - s * y, "y_rad": s * x + c * y}
        return out

    def cameras(self, calibration: dict[str, Any]) -> dict[str, Any]:
        """``calibration`` of cameras around the usual rig at the origin, as of the same cameras around this one."""
        c, s = math.cos(self.turned_rad), math.sin(self.turned_rad)
        turn, at = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([*self.rig_at_m, 0.0])
        placed = []
        for camera in calibration["cameras"]:
            rotation = np.array(camera["rotation"]) @ turn.T
            translation = self.scale * np.array(camera["translation_m"]) - rotation @ at
            placed.append({**camera, "rotation": rotation.tolist(), "translation_m": translation.tolist()})
        return {**calibration, "cameras": placed}

    def states(self, states: dict[str, Floats]) -> dict[str, Floats]:
        """What really happened (``Series.states``) in this rig's units; the rig's frame and the runs' own clocks
        stay.
        """
        long, slow = self.scale, self.slower
        units = {
            "state": [long, long, slow, slow, 1.0, 1 / slow, 1.0],
            "imp": [slow, slow, slow],
            "held": [slow, slow],
            "H": None,
        }
        out = {}
        for key, values in states.items():
            unit = units[key.rstrip("0123456789")]
            if unit is None:  # the rows of the plant's `host_pose`; about z an amplitude is an angle
                out[key] = values * np.array([1.0, long, 1 / slow, 1.0, slow, 1 / slow, 1 / slow**2])
                out[key][:, 1] = values[:, 1] * np.where(values[:, 0] == 2, 1.0, long)
            else:
                out[key] = values * np.array(unit)
        return out

    def truth(self) -> dict[str, Any]:
        """What a truth says of it."""
        return {
            "rig_at_m": list(self.rig_at_m),
            "turned_rad": self.turned_rad,
            "start_s": list(self.start_s),
            "first_frame": list(self.first_frame),
            "scale": self.scale,
            "drive_hz": self.in_units("_hz", self.drive_hz),
            "frame_rate_hz": self.in_units("_hz", self.frame_rate_hz),
            "wall": self.wall,
            "drive": self.drive,
            "note": "states are in the rig's frame, their times from each run's first frame: world = turn(rig) + "
            "rig_at_m",
        }


HOME = Place()
# Causes whose direction_rad is one of the world; centres and offsets are stated in the frames of the Host and of the
# disk.
TURNING = ("table_tilt", "direction_dependent_restitution", "wall_ellipticity", "wall_lobes", "host_sway")


def draw_place(rng: np.random.Generator, runs: int, other_rigs: bool = True) -> Place:
    """Anywhere within two metres, turned to any angle, clocks and frame numbers from anywhere; the usual rig or
    another.
    """
    far, azimuth = FARTHEST_M * math.sqrt(rng.random()), rng.uniform(0.0, 2 * math.pi)
    at = (float(far * math.cos(azimuth)), float(far * math.sin(azimuth)))
    turned = float(rng.uniform(-math.pi, math.pi))
    starts = tuple(float(t) for t in rng.uniform(0.0, LATEST_S, runs))
    frames = tuple(int(k) for k in rng.integers(0, LAST_FRAME, runs))
    if not other_rigs or rng.random() < USUAL_SHARE:
        return Place(at, turned, starts, frames)
    scale = float(np.exp(rng.uniform(*np.log(SCALES))))
    return Place(at, turned, starts, frames, scale, float(rng.uniform(*DRIVES_HZ)), float(rng.choice(FRAME_RATES_HZ)))


def on_the_films_clock(states: dict[str, Floats], place: Place) -> dict[str, Floats]:
    """``Series.states`` with impacts and contacts at the times of their runs' tables."""
    out = dict(states)
    for number, start_s in enumerate(place.start_s, 1):
        for key, columns in (("imp", [0]), ("held", [0, 1])):
            name = f"{key}{number:02d}"
            if name in out:
                moved = out[name].copy()
                moved[:, columns] += start_s
                out[name] = moved
    return out
