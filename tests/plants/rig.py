"""A rig drawn at random: its size, drive, law, cameras' noise, and where on the bench it stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from tests.plants.kernel import GRAVITY_M_PER_S2, Physics
from tests.plants.laws import LAWS, Law

REACH_M, DISK_SHARE = (0.02, 0.25), (0.15, 0.3)
DRIVE_HZ, LEVEL_G, AMPLITUDE_SHARE = (4.0, 25.0), (3.0, 12.0), (0.25, 0.6)
FRAME_RATE_HZ, FRAMES_PER_FLIGHT = (100.0, 5000.0), (8.0, 100.0)
FARTHEST_M, LATEST_S, LAST_FRAME = 2.0, 1e4, 1_000_000
NOISE_SHARE = (3e-5, 4e-4)  # sd of the disk's place over the reach: some 0.01 to 0.2 px of a ring that fills a window
NOISES = ("white", "ar1", "lens")
# Steps per drive period, and per time in which friction turns a slip of the smoothing speed: Runge-Kutta stays stable
# to 2.7.
STEPS_PER_PERIOD, STEPS_PER_TURN = 2000.0, 4.0
SMOOTHING_SHARE = 2e-4  # of the Host's top speed


@dataclass(frozen=True)
class Spec:
    """What of a rig is chosen instead of drawn.

    ``law`` of flight (:data:`laws.LAWS`); ``noise`` one of :data:`NOISES` or None to draw; ``physics`` overrides fields
    of :class:`kernel.Physics`, ``reach_m`` and the rest the ring, the drive and the film; ``at_origin`` leaves world
    and clock alone; ``still``: the Host stands, and the disk comes to rest in it;
    ``drive`` one of :data:`recording.DRIVES`.
    """

    law: str = "ours"
    noise: str | None = None
    reach_m: float | None = None
    frames_per_flight: float | None = None
    noise_share: float | None = None
    periods: float = 8.0
    most_frames: int = 1600
    with_angle: bool = True
    with_sd: bool = True
    at_origin: bool = False
    still: bool = False
    drive: str = "harmonic"
    physics: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class Rig:
    """One rig.  ``place`` (x, y, turn): where the rig's frame lies in the world; ``gust`` (RMS, correlation time)."""

    spec: Spec
    law: Law
    physics: Physics
    drive_hz: float
    level_g: float
    vertical_g: float
    gust: tuple[float, float]
    mass_kg: float
    noise: str
    correlation: float
    lens: np.ndarray
    sd_m: float
    frames_per_flight: float
    place: tuple[float, float, float]
    drawn: Mapping[str, float]

    @property
    def amplitude_m(self) -> float:
        return self.level_g * GRAVITY_M_PER_S2 / (2 * np.pi * self.drive_hz) ** 2

    @property
    def top_speed_m_per_s(self) -> float:
        return self.amplitude_m * 2 * np.pi * self.drive_hz


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _drive(reach_m: float, rng: np.random.Generator) -> tuple[float, float]:
    """Frequency and level such that the Host moves by a fair share of the reach and the disk hits."""
    while True:
        level_g, share = _log_uniform(rng, *LEVEL_G), rng.uniform(*AMPLITUDE_SHARE)
        hz = float(np.sqrt(level_g * GRAVITY_M_PER_S2 / (share * reach_m)) / (2 * np.pi))
        if DRIVE_HZ[0] <= hz <= DRIVE_HZ[1]:
            return hz, level_g


def draw_rig(spec: Spec, rng: np.random.Generator) -> Rig:
    """A rig that follows ``spec``."""
    law = LAWS[spec.law]
    reach = spec.reach_m or _log_uniform(rng, *REACH_M)
    hz, level_g = _drive(reach, rng)
    speed = level_g * GRAVITY_M_PER_S2 / (2 * np.pi * hz)
    friction = rng.uniform(0.08, 0.3)
    drawn = law.draw(rng, speed, friction * GRAVITY_M_PER_S2, reach)
    smoothing = SMOOTHING_SHARE * speed
    hardest = friction * (1 + drawn.get("static_share", 0) + drawn.get("patch_share", 0) + drawn.get("memory_share", 0))
    step = min(1 / (STEPS_PER_PERIOD * hz), smoothing / (hardest * GRAVITY_M_PER_S2) / STEPS_PER_TURN)
    fields = dict.fromkeys(Physics._fields, 0.0)
    fields |= {
        "reach_m": reach, "radius_m": reach * rng.uniform(*DISK_SHARE), "inertia_factor": rng.uniform(0.4, 0.8),
        "restitution": rng.uniform(0.55, 0.85), "restitution_scatter": rng.uniform(0.005, 0.03),
        "wall_friction": rng.uniform(0.08, 0.25), "tangential_restitution": rng.uniform(0.2, 0.7),
        "friction": friction, "coupling": 1.0, "smoothing_m_per_s": smoothing, "step_s": step,
    }  # fmt: skip
    fields |= {name: value for name, value in drawn.items() if name in fields}
    fields |= dict(spec.physics)
    place = (0.0, 0.0, 0.0)
    if not spec.at_origin:
        far, azimuth = FARTHEST_M * np.sqrt(rng.random()), rng.uniform(0, 2 * np.pi)
        place = (float(far * np.cos(azimuth)), float(far * np.sin(azimuth)), float(rng.uniform(0, 2 * np.pi)))
    noise = spec.noise or str(rng.choice(NOISES, p=[0.5, 0.25, 0.25]))
    sd_m = reach * (spec.noise_share or _log_uniform(rng, *NOISE_SHARE))
    return Rig(
        spec,
        law,
        Physics(**fields),
        hz,
        level_g,
        drawn.get("vertical_g", 0.0),
        (drawn.get("gust_m_per_s2", 0.0), drawn.get("gust_s", 0.05)),
        0.0246 * (reach / 0.04) ** 3,
        noise,
        float(rng.uniform(0.3, 0.9)) if noise == "ar1" else 0.0,
        _lens(rng) * sd_m * rng.uniform(0.5, 3.0) * (noise == "lens"),
        sd_m,
        spec.frames_per_flight or _log_uniform(rng, *FRAMES_PER_FLIGHT),
        place,
        MappingProxyType(drawn),
    )


def _lens(rng: np.random.Generator) -> np.ndarray:
    """What a calibration leaves over: coefficients (2, 9) of a smooth field over the rig, about 1 in size where the
    bodies go.
    """
    return rng.normal(size=(2, 9)) / np.sqrt(5.0)
