"""A recording that has not been made: the rig in another setting, simulated with the effects and laws as found."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.comparison.simulated_rig import moved, simulated_wall
from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run, cut
from analysis.flights.equation.parameters import INDEX, LAW
from analysis.flights.fit import FlightFits, fit_flights
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.model import run_places
from analysis.motion.host_path import HostMotion
from analysis.walls.wall import Wall
from ovines.core import FloorFriction, Host, ImpactLaw, Nes, Scenario, SimulationResult, simulate
from ovines.core.effects import EFFECTS
from ovines.core.laws.terms import MOST_TERMS, WrittenLaw, rows_of

Array = NDArray[np.float64]
# Where the impacts are too few to give the contact law: what steel on steel usually shows.
USUAL_LAW = ImpactLaw(0.7, 0.2, 0.4)


@dataclass(frozen=True)
class Setting:
    """How a recording is made: level and frequency of the drive against today's, or a Host at rest and a disk launched
    by hand.
    """

    words: str
    level: float = 1.0
    frequency: float = 1.0
    launch: tuple[float, float] | None = None


AS_RECORDED = "the drive as recorded"
SETTINGS = (
    Setting(AS_RECORDED),
    Setting("half the level", level=0.5),
    Setting("1.5 times the level", level=1.5),
    Setting("0.7 times the frequency at the same level", frequency=0.7),
    Setting("1.4 times the frequency at the same level", frequency=1.4),
    Setting("the Host at rest and the disk launched at 0.5 m/s without spin", launch=(0.5, 0.0)),
    Setting("the Host at rest and the disk launched at 2 m/s without spin", launch=(2.0, 0.0)),
    Setting("the Host at rest and the disk launched at 0.5 m/s with 100 rad/s", launch=(0.5, 100.0)),
    Setting("the Host at rest and the disk launched at 2 m/s with 100 rad/s", launch=(2.0, 100.0)),
)


def acts(law: WrittenLaw) -> bool:
    """Whether the simulator takes a law: of the wall, one of the azimuth alone.  What moves a wall in another way does
    so by parts of a millimetre, which hardly changes where it is met: its law is asked of the impacts without it."""
    return law.stage != "geometry" or quantities_of(law) == {"azimuth"}


def quantities_of(law: WrittenLaw) -> set[str]:
    """What a law follows."""
    return {factor.quantity for term in law.terms for factor in term.factors}


@dataclass(frozen=True, eq=False)
class Rig:
    """The rig as found: a series' ``ladder``, the ``flights`` whose friction, states and noise are simulated, the named
    ``causes`` that the simulator has, and the ``laws`` found, in the rig's frame."""

    ladder: Ladder
    flights: FlightFit
    causes: tuple[Cause, ...]
    laws: tuple[WrittenLaw, ...] = ()

    @cached_property
    def like(self) -> RunData:
        """The run of median length, whose frames, sds and disk simulated recordings have."""
        runs = sorted(self.ladder.series.runs, key=lambda r: len(r.data.time_s))
        return runs[len(runs) // 2].data

    @cached_property
    def wall(self) -> Wall:
        """As identified, or as stated."""
        fitted = self.ladder.impacts.fitted
        return fitted.wall.wall if fitted is not None else self.like.wall

    @cached_property
    def held(self) -> Array:
        """What flights know of the laws: those that the measured ones hold, then those of the flights that were found;
        packed (T, ROW_SIZE)."""
        found = [term for law in self.laws if law.stage == "flight" for term in law.terms]
        return np.vstack([self.like.law, rows_of(found)]) if found else self.like.law

    @cached_property
    def acting(self) -> tuple[WrittenLaw, ...]:
        """The laws that are simulated: those that the nominal model holds, and those found that the simulator takes."""
        stated = [self.ladder.series.frame.law(law) for law in self.ladder.series.laws]
        return (*stated, *(law for law in self.laws if acts(law)))


@dataclass(frozen=True, eq=False)
class Recorded:
    """A simulated recording that starts at ``start_s`` of the Host's motion ``host``."""

    host: HostMotion
    start_s: float
    result: SimulationResult

    def run(self, rig: Rig) -> Run:
        """As the fit of flights sees it, with the sds of measured runs (no noise is drawn: only sds are asked for)."""
        like = rig.like
        time_s = self.result.time_s + self.start_s
        n = len(time_s)
        seen = np.column_stack([self.result.motion[f"nes_{q}"] for q in ("x_m", "y_m", "angle_rad")])
        sd, sd_angle = float(np.median(like.xy_sd_m)), float(np.median(like.angle_sd_rad))
        made = RunData(
            "next test",
            time_s,
            seen[:, :2],
            seen[:, 2],
            np.full(n, sd),
            np.full(n, sd_angle),
            self.host,
            like.contact_radius_m,
            like.radius_m,
            like.inertia_factor,
            like.wall,
            law=rig.held,
        )
        host = np.column_stack([self.host.at(time_s), np.full((n, 4), sd)])
        return cut(made, host, np.arange(n), rig.wall)


def fitted(rig: Rig, recorded: Recorded) -> FlightFits:
    """The flights of a simulated recording, fitted with the parameters and laws that it was simulated with."""
    run, model = recorded.run(rig), rig.flights.model
    p = model.parameters.copy()
    p[LAW : LAW + MOST_TERMS] = 0.0
    p[LAW : LAW + len(rig.held)] = 1.0
    model = replace(model, parameters=p, drift_per_run=0.0)
    return fit_flights(run.data, run.flights, model.of_run(run_places([run.data])[0]), model.shared())


class Start(NamedTuple):
    """Where a simulated recording begins: with the flight ``flight`` of a measured run."""

    fits: FlightFits
    flight: int


def starts(flights: FlightFit, most: int) -> list[Start]:
    """First flights of all runs, then second ones, up to ``most``."""
    known = [[k for k, s in enumerate(fits.states) if np.isfinite(s).all()] for fits in flights.fits]
    longest = max((len(one) for one in known), default=0)
    found = [
        Start(fits, one[turn])
        for turn in range(longest)
        for fits, one in zip(flights.fits, known, strict=True)
        if turn < len(one)
    ]
    return found[:most]


def record(rig: Rig, start: Start, setting: Setting, duration_s: float) -> Recorded:
    """Simulated from the first state of a measured flight, in the Host's frame; `ScenarioError` of a law that the
    simulator does not take in this setting: one in step with a drive, of a Host at rest."""
    fits = start.fits
    host, data = _host(fits.run.host, setting), fits.run
    start_s = float(fits.reference_s[start.flight])
    friction, coupling = (float(rig.flights.model.parameters[INDEX[n]]) for n in ("friction", "coupling"))
    values = {c.effect: _within_bounds(c) for c in rig.causes}
    # Vertical motion is among the measured harmonics; where it is no cause their z is noise.
    wall = moved(Host(**simulated_wall(rig.wall, data.radius_m)), host, start_s, duration_s)
    if values.pop("vertical_motion", None) is None:
        wall = replace(wall, drive=tuple(h for h in wall.drive if h.axis != "z"))
    scenario = Scenario(
        "next test",
        Nes(data.radius_m, 1.0, data.inertia_factor),
        wall,
        _law(rig.ladder),
        duration_s,
        FloorFriction(friction, "farkas" if coupling > 0.5 else "coulomb") if friction > 0 else None,
        initial_nes=_start(start, host, setting),
        sample_rate_hz=float(1 / np.median(np.diff(data.time_s))),
        effects=values,
        laws=rig.acting,
    )
    return Recorded(host, start_s, simulate(scenario))


def _within_bounds(cause: Cause) -> dict[str, float]:
    """An estimate may stray over the edge of what can be; the simulator may not.  A recording of its own has no drift
    from run to run.
    """
    bounds = {p.name: (p.low, p.high) for p in EFFECTS[cause.effect].parameters}
    return {
        name: float(np.clip(value, *bounds[name]))
        for name, (value, _) in cause.parameters.items()
        if name != "relative_per_run"
    }


def _law(ladder: Ladder) -> ImpactLaw:
    law = ladder.impacts.fitted.law if ladder.impacts.fitted is not None else None
    if law is None or not np.isfinite([law.restitution, law.wall_friction, law.tangential_restitution]).all():
        return USUAL_LAW
    return ImpactLaw(
        float(np.clip(law.restitution, 0, 1)),
        max(law.wall_friction, 0.0),
        float(np.clip(law.tangential_restitution, -1, 1)),
    )


def _host(host: HostMotion, setting: Setting) -> HostMotion:
    """The Host's lines in a setting: the same acceleration at another frequency asks for another amplitude; at rest
    only means are left.  What no line explains (a sweep, a recoil) is not asked of the shaker.
    """
    if setting.launch is not None:
        return HostMotion(host.harmonics[:, :1], 0.0, 0.0, host.residual_sd, 0.0, host.residual[:0])
    size = setting.level / setting.frequency**2
    harmonics = host.harmonics.copy()
    harmonics[:, 1:] *= size
    return HostMotion(
        harmonics,
        setting.frequency * host.omega_rad_per_s,
        host.omega_sd_rad_per_s,
        host.residual_sd,
        host.phase_rad,
        host.residual[:0],
        lines_rad_per_s=setting.frequency * host.lines_rad_per_s,
        line_coefficients=size * host.line_coefficients,
    )


def _start(start: Start, host: HostMotion, setting: Setting) -> tuple[float, ...]:
    """x, y, vx, vy, angle, spin: the measured state against the Host, well inside the wall; or launched by hand from
    the Host's centre (or beside its cylinder), in the direction in which the disk was seen to fly."""
    fits, start_s = start.fits, float(start.fits.reference_s[start.flight])
    x, y, angle, vx, vy, spin = fits.states[start.flight]
    place = np.array([x, y]) - fits.run.host.at(np.array([start_s]))[0, :2]
    place *= _share_inside(fits.run.wall, place, float(fits.run.host.at(np.array([start_s]))[0, 3]))
    if setting.launch is not None:
        speed, spin = setting.launch
        along = np.array([vx, vy]) / max(float(np.hypot(vx, vy)), 1e-9)
        cylinder = fits.run.wall.cylinder
        # From the middle of what a cylinder leaves free, else from the Host's.
        place = along * (0.0 if cylinder is None else 0.5 * (cylinder.radius_m + fits.run.wall.size_m))
        vx, vy = speed * along
    cx, cy = host.at(np.array([start_s]))[0, :2] + place
    return float(cx), float(cy), float(vx), float(vy), float(angle), float(spin)


def _share_inside(wall: Wall, place: Array, host_angle_rad: float) -> float:
    """By which share of its way from the Host's centre a place is well inside the wall: 1 where it is."""
    far = max(float(np.hypot(*place)), 1e-9)
    reach = far - float(wall.outline_gap(place[None], np.array([host_angle_rad]))[0])
    return min(1.0, 0.9 * reach / far)
