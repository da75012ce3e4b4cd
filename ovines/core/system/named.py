"""Every test of the thesis' Part I, and its perspectives, as a scenario with a name."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ovines.core.system.model import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, Suspension
from ovines.core.system.shaker import amplitude_of

DOWN = (0.0, -9.81)


@dataclass(frozen=True)
class NamedScenario:
    """A scenario, what it shows, and where the thesis has it."""

    name: str
    meaning: str
    make: Callable[[], Scenario]


FIXED_10 = Host(radius_m=10.0)
HEAVY_10 = Host(radius_m=10.0, motion="free", mass_kg=1e9, inertia_factor=1.0)
SMOOTH, LOSSY, ROUGH = ImpactLaw(1.0, 0.0, 0.0), ImpactLaw(0.9, 0.0, 0.0), ImpactLaw(0.9, 0.4, 0.7)
REST = (0.0,) * 6


def _heavy(name: str, law: ImpactLaw, nes: tuple[float, ...], duration_s: float, host: Host = HEAVY_10) -> Scenario:
    """Tables 2-11: R_N = 1 m, R_H = 10 m, M_N = 1 kg, M_H = 1e9 kg, gravity along -y."""
    return Scenario(
        name, Nes(1.0, 1.0), host, law, duration_s, initial_nes=nes, gravity_m_per_s2=DOWN, sample_rate_hz=100.0
    )


def _exits() -> Scenario:
    return Scenario(
        "table-12", Nes(0.01, 0.1), HEAVY_10, ImpactLaw(0.9, 0.8, 1.0), 5.0,
        initial_nes=(-2.0, -6.0, 300.0, 200.1, 0.0, 0.0), gravity_m_per_s2=DOWN, sample_rate_hz=1000.0,
    )  # fmt: skip


def _coulomb_stop() -> Scenario:
    """v0 = sqrt(10) m/s, mu = 0.5, g = 10 m/s^2: 1 m (Eq. 26), in a Host too large to matter."""
    friction = FloorFriction(0.5, "coulomb", "ground", 1e-4, 10.0)
    return Scenario("coulomb-stop", Nes(0.1, 1.0), Host(radius_m=10.0), LOSSY, 1.0, friction,
                    (0.0, 0.0, math.sqrt(10.0), 0.0, 0.0, 0.0), sample_rate_hz=1000.0)  # fmt: skip


def _rabinowicz() -> Scenario:
    """Eq. 32-35: a block of 20 kg on a spring of 10 N/m, dragged by a belt at 0.5 m/s, mu = 0.5, v_d = 5 cm/s.

    The block is the sprung Host; the belt is a NES so heavy (1e9 kg) that nothing slows it, whose load on the Host's
    floor is the block's 20 kg times 9.81 m/s^2.
    """
    host = Host(100.0, motion="sprung", mass_kg=20.0, suspension=Suspension((10.0, 10.0, 10.0), (0.0, 0.0, 0.0)))
    friction = FloorFriction(0.5, "coulomb", "host", 0.05, 20.0 * 9.81 / 1e9)
    return Scenario("rabinowicz", Nes(1.0, 1e9), host, SMOOTH, 60.0, friction, (0.0, 0.0, 0.5, 0.0, 0.0, 0.0),
                    (0.0, 0.0, 0.5, 0.0, 0.0, 0.0), sample_rate_hz=20.0)  # fmt: skip


def _farkas_stop() -> Scenario:
    """Eq. 80-84 with mu g = 10 m/s^2, v0 = 1 m/s, R = 1 m (gamma = 0.1), Omega_0 = 1/T_0 (an erratum): omega(0) = 10
    rad/s.
    """
    friction = FloorFriction(1.0, "farkas", "ground", 1e-4, 10.0)
    return Scenario(
        "farkas-stop",
        Nes(1.0, 1.0),
        Host(radius_m=10.0),
        LOSSY,
        1.2,
        friction,
        (0.0, 0.0, 1.0, 0.0, 0.0, 10.0),
        sample_rate_hz=1000.0,
    )


def _table_13() -> Scenario:
    """Base excitation (the thesis leaves equations and phases open); omega = 1 rad/s, so tau is the time in s.

    k = 1 N/m, c = 2 xi = 0.04 N s/m, the same for rotation; q_N = 1 as printed, though no disk has it.
    """
    excitation = (Harmonic("y", 0.005, 1.0 / (2.0 * math.pi), 0.0),)
    host = Host(1.0, motion="sprung", mass_kg=1.0, suspension=Suspension((1.0,) * 3, (0.04,) * 3, excitation))
    away = 0.99 * 0.8 * math.sqrt(0.5)
    return Scenario("table-13", Nes(0.2, 0.2, 1.0), host, ImpactLaw(0.97, 0.0, 0.5), 2000.0,
                    initial_nes=(away, -away, 0.0, 0.0, 0.0, 0.0), sample_rate_hz=10.0)  # fmt: skip


def _shaken(name: str, wall_friction: float, floor: float) -> Scenario:
    """Tables 14-15: the Host's y = A (cos - 1), A = -1.85 cm, the only harmonic that starts at rest at 0 (an erratum).

    As a sum of sines: a constant (frequency 0) and a sine of phase -pi/2.  The other sign would take the wall away from
    the disk, and case 1 would never touch it.  The disk lies on the Host's floor; v_d = 1 mm/s, not given in the
    thesis.
    """
    amplitude = amplitude_of(9.0, 11.0)
    drive = (Harmonic("y", amplitude, 0.0, math.pi / 2), Harmonic("y", amplitude, 11.0, -math.pi / 2))
    away = 0.98 * 0.08 * math.sqrt(0.5)
    return Scenario(
        name, Nes(0.02, 0.003), Host(0.1, motion="driven", drive=drive), ImpactLaw(1.0, wall_friction, 1.0), 1.0,
        FloorFriction(floor), (away, -away, 0.0, 0.0, 0.0, 0.0), sample_rate_hz=800.0,
    )  # fmt: skip


def _rig(name: str, **host: Any) -> Scenario:
    """The experiments' rig (OVINES3) with the thesis' identified values: 9 g at 11 Hz."""
    drive = (Harmonic("x", amplitude_of(9.0, 11.0), 11.0),)
    return Scenario(
        name, Nes(0.01, 0.0246), Host(motion="driven", drive=drive, **host), ImpactLaw(0.72, 0.129, 0.494), 1.0,
        FloorFriction(0.2), (0.03, -0.01, 0.1, 0.0, 0.0, 0.0),
    )  # fmt: skip


def _impact_oscillator() -> Scenario:
    """x'' + x = cos(2.2 t) before a stop at 0, restitution 0.8 (Budd and Dux, Phil. Trans. R. Soc. A 347, 365 (1994)).

    The mass is the sprung Host; the stop is a NES so heavy (1e30 kg) that nothing moves it, at the Host's left wall.
    """
    ground = (Harmonic("x", 1.0, 2.2 / (2.0 * math.pi), math.pi / 2),)
    host = Host(51.0, motion="sprung", mass_kg=1.0, suspension=Suspension((1.0,) * 3, (0.0,) * 3, ground))
    return Scenario("impact-oscillator", Nes(1.0, 1e30), host, ImpactLaw(0.8, 0.0, 0.0), 500.0,
                    initial_nes=(-50.0, 0.0, 0.0, 0.0, 0.0, 0.0), initial_host=(-1.9, 0.0, 0.3, 0.0, 0.0, 0.0),
                    sample_rate_hz=20.0)  # fmt: skip


def _sprung_host() -> Scenario:
    """A Host of 1 kg on springs of 5 Hz, 1 % of critical damping, over a ground of 2 mm; a disk of 50 g.

    Clearance 60 mm; it starts 30 mm out of rest.  Not in the thesis: made to show what a NES takes.
    """
    rate = 2.0 * math.pi * 5.0
    springs = Suspension((rate**2, rate**2, 1.0), (0.02 * rate, 0.02 * rate, 0.01), (Harmonic("x", 0.002, 5.0),))
    return Scenario("sprung-host", Nes(0.01, 0.05), Host(0.04, motion="sprung", mass_kg=1.0, suspension=springs),
                    ImpactLaw(0.7, 0.1, 0.5), 10.0, initial_nes=(0.012, 0.004, 0.0, 0.0, 0.0, 0.0),
                    initial_host=(0.03, 0.0, 0.0, 0.0, 0.0, 0.0), sample_rate_hz=200.0)  # fmt: skip


def _bouncing_ball() -> Scenario:
    """A ball on a table that shakes at 10 Hz with 3 g, restitution 0.85 (Holmes, J. Sound Vib. 84, 173 (1982))."""
    box = ((-5.0, 0.0), (5.0, 0.0), (5.0, 10.0), (-5.0, 10.0))
    shaking = (Harmonic("y", amplitude_of(3.0, 10.0), 10.0),)
    return Scenario("bouncing-ball", Nes(0.01, 0.01), Host(polygon_m=box, motion="driven", drive=shaking),
                    ImpactLaw(0.85, 0.0, 0.0), 60.0, initial_nes=(0.0, 0.05, 0.0, 0.0, 0.0, 0.0),
                    gravity_m_per_s2=DOWN, sample_rate_hz=200.0)  # fmt: skip


TRIANGLE = ((-0.07, -0.05), (0.07, -0.05), (0.0, 0.08))

_ALL = (
    NamedScenario("table-2", "Dropped from the centre, elastic: rises to its height for ever.",
                  lambda: _heavy("table-2", SMOOTH, REST, 20.0)),
    NamedScenario("table-3", "Dropped, restitution 0.9, fixed Host: heights fall by 0.81 per rebound, then it rests.",
                  lambda: _heavy("table-3", LOSSY, REST, 40.0, host=FIXED_10)),
    NamedScenario("table-4-positive", "Spinning drop: leaves to the left after the first rebound.",
                  lambda: _heavy("table-4-positive", ImpactLaw(0.8, 0.2, 0.5), (0, 0, 0, 0, 0, 5.0), 20.0)),
    NamedScenario("table-4-negative", "Its mirror image.",
                  lambda: _heavy("table-4-negative", ImpactLaw(0.8, 0.2, 0.5), (0, 0, 0, 0, 0, -5.0), 20.0)),
    NamedScenario("table-5", "Energy conserved at restitution 1.", lambda: _heavy("table-5", SMOOTH, REST, 60.0)),
    NamedScenario("table-6", "Energy lost in steps at restitution 0.9.",
                  lambda: _heavy("table-6", LOSSY, REST, 40.0)),
    NamedScenario("table-7", "Extreme speed along y (1200 m/s; the missing zero of the state put back).",
                  lambda: _heavy("table-7", ROUGH, (0, 0, 0, 1200.0, 0, 0), 5.0)),
    NamedScenario("table-8", "Extreme speed along x (2000 m/s).",
                  lambda: _heavy("table-8", ROUGH, (0, 0, 2000.0, 0, 0, 0), 5.0)),
    NamedScenario("table-9", "Fast and spinning, from the right.",
                  lambda: _heavy("table-9", ROUGH, (2.0, 0, 150.0, -200.0, 0, 200.0), 5.0)),
    NamedScenario("table-10", "Its mirror image, from the left.",
                  lambda: _heavy("table-10", ROUGH, (-2.0, 0, -150.0, -200.0, 0, -200.0), 5.0)),
    NamedScenario("table-11", "Launched along the wall, 1 cm from it, at 1000 m/s.",
                  lambda: _heavy("table-11", ImpactLaw(0.9, 0.9, -0.5), (0, 9.0 - 1e-2, 1000.0, 0, 0, 0), 5.0)),
    NamedScenario("table-12", "The case that left the container in the thesis: nearly tangential contacts.", _exits),
    NamedScenario("coulomb-stop", "Sliding stop under Coulomb friction: v^2/(2 mu g) = 1 m.", _coulomb_stop),
    NamedScenario("rabinowicz", "A block on a spring, dragged by a belt: sticks, then oscillates.", _rabinowicz),
    NamedScenario("farkas-stop", "Sliding and spinning stop at the same instant (Farkas).", _farkas_stop),
    NamedScenario("table-13", "Host on springs and dampers over a shaken ground.", _table_13),
    NamedScenario("table-15-case-1", "Shaken Host, rough wall, hardly any floor friction.",
                  lambda: _shaken("table-15-case-1", 1e9, 1e-9)),
    NamedScenario("table-15-case-2", "Shaken Host with wall and floor friction 0.5.",
                  lambda: _shaken("table-15-case-2", 0.5, 0.5)),
    NamedScenario("rig", "The experiments' rig at 9 g and 11 Hz with the identified parameters.",
                  lambda: _rig("rig", radius_m=0.05)),
    NamedScenario("obstacle", "The rig with a fixed cylinder of 1 cm at the Host's centre (Fig. 65).",
                  lambda: _rig("obstacle", radius_m=0.05, obstacle_radius_m=0.01)),
    NamedScenario("triangle", "The rig with a triangular Host.", lambda: _rig("triangle", polygon_m=TRIANGLE)),
    NamedScenario("impact-oscillator", "A mass on a spring before a rigid stop, in one dimension.", _impact_oscillator),
    NamedScenario("sprung-host", "A Host on springs over a shaken ground, with a disk that takes its energy.",
                  _sprung_host),
    NamedScenario("bouncing-ball", "A ball on a shaking table, in one dimension.", _bouncing_ball),
)  # fmt: skip

NAMED: dict[str, NamedScenario] = {entry.name: entry for entry in _ALL}


def named_scenario(name: str, **changes: Any) -> Scenario:
    """The scenario called ``name`` (:data:`NAMED`), with fields replaced."""
    return replace(NAMED[name].make(), **changes)
