"""The ladder: measurement corrected, nominal model refitted, effects added one after the other, probes for what is left.

Nominal -> recalibrated -> + effect -> + second effect; at each rung every candidate is judged on held-out runs, by how far
it exceeds what is negligible, and by whether it holds in most runs.  What probes still find afterwards is structure without a name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flight_model import GRAVITY_M_PER_S2, INDEX
from analysis.gap import impact_stage
from analysis.gap.correct import correct
from analysis.gap.flight_stage import FlightFit, FlightModel, Gain, fit, gains, nominal_model, solve_named
from analysis.gap.flight_terms import NEGLIGIBLE_M_PER_S2, terms
from analysis.gap.ground import ground_motion
from analysis.gap.impact_stage import ImpactFit, ImpactGain, fit_impacts
from analysis.gap.measurement import NEGLIGIBLE as MEASUREMENT_NEGLIGIBLE
from analysis.gap.measurement import Finding, MeasurementTests
from analysis.gap.series import Series
from ovines.recording import Recording

Array = NDArray[np.float64]

# Acceptance, set on series of analysis.blind and of the practice set (results tuned there are called that): a term must hold in
# most runs and stand clear of the scatter between them, not only of the noise.
SIGNIFICANCE, IMPROVED, GAIN = 5.0, 0.7, 50.0
IMPACT_GAIN = 25.0
# A probe overrides a named effect of the same residual when it explains more by this much (fall of -2 log L).
OVERRIDES = 10.0
# ... and structure left over beside an accepted effect makes the answer "unknown" when it is this share of the effect's own size.
LEFT_OVER = 0.25
CENTRE_NEGLIGIBLE_M = 1.0e-4
MASS_CENTRE_NEGLIGIBLE_M = 5e-5
CONTACT_TIME_NEGLIGIBLE_S = 6e-5
ELLIPTICITY_NEGLIGIBLE = 7e-4


@dataclass(frozen=True, eq=False)
class Cause:
    """One accepted effect: where it lies, parameters (value, sd), how many times its negligible size it is, its gain."""

    effect: str
    stage: str
    parameters: dict[str, tuple[float, float]]
    strength: float
    gain: float
    coordinate: str
    phase: str


@dataclass(frozen=True, eq=False)
class Structure:
    """Something no effect of the library explains: where it lies and what it goes with."""

    stage: str
    phase: str
    coordinate: str
    goes_with: str
    strength: float
    gain: float


@dataclass(frozen=True, eq=False)
class Ladder:
    """Everything the verdict, the figures and the predictions are made of."""

    series: Series
    measurement: MeasurementTests
    findings: tuple[Finding, ...]
    nominal: FlightFit
    flight: FlightFit
    flight_gains: tuple[Gain, ...]
    flight_probes: tuple[Gain, ...]
    impacts_nominal: ImpactFit | None
    impacts: ImpactFit | None
    impact_gains: tuple[ImpactGain, ...]
    impact_probes: tuple[ImpactGain, ...]
    restitution_terms: tuple[str, ...]
    ellipse: bool
    finite: bool
    causes: tuple[Cause, ...]
    structure: tuple[Structure, ...]
    notes: tuple[str, ...] = field(default_factory=tuple)


def climb(series: Series, withheld: frozenset[str] = frozenset()) -> Ladder:
    """The whole diagnosis of a series, without its report.

    ``withheld``: effects taken out of the library for a trial; their data must then come back as structure without a name.
    """
    corrected, findings, tests = correct(series, withheld)
    recording = corrected.recordings[0]
    causes = [_measured(f) for f in findings]
    structure = [*ground_motion(series), *_withheld_measurement(tests, withheld)]
    effects = list(recording.model.effects) if recording.model else ["floor_friction", "spin_coupling"]
    nominal, flight, flight_causes, flight_gains, probes = _flights(corrected, effects, withheld)
    structure += _flight_structure(probes, flight_causes, flight)
    impacts_nominal = impacts = None
    impact_gains: list[ImpactGain] = []
    impact_probes: list[ImpactGain] = []
    restitution: list[str] = [e for e in effects if e in ("speed_dependent_restitution", "direction_dependent_restitution")]
    ellipse, finite = "wall_ellipticity" in effects, "finite_contact_time" in effects
    impact_causes: list[Cause] = []
    base = fit_impacts(flight.fits, ellipse=ellipse, finite=finite)
    if len(base.data) >= 8:
        impacts_nominal = base
        ellipse, finite, shape, base, gained = _shape(flight, base, ellipse, finite, withheld)
        impact_causes += shape
        impact_gains += gained
        laws, restitution, gained, impact_probes, left = _laws(base, restitution, finite, withheld)
        impact_causes += laws
        impact_gains += gained
        structure += left
        distance_probes = [g for g in impact_stage.distance_gains(flight.fits, base, ellipse, finite, withheld) if not g.named]
        impact_probes += distance_probes
        structure += _distance_structure(distance_probes, base, shape)
        impacts = base
        structure += _unexplained_scatter(base, restitution, structure)
    structure += _unexplained_misfit(flight, structure)
    known = set(effects)
    centres = _centres(corrected, flight, impacts)
    structure += [Structure(c.stage, c.phase, c.coordinate, "a constant offset of a centre", c.strength, c.gain) for c in centres
                  if c.effect in withheld]
    causes += [c for c in (*flight_causes, *impact_causes, *centres) if c.effect not in known | withheld]
    return Ladder(corrected, tests, tuple(findings), nominal, flight, tuple(flight_gains), tuple(probes), impacts_nominal, impacts,
                  tuple(impact_gains), tuple(impact_probes), tuple(restitution), ellipse, finite,
                  tuple(sorted(causes, key=lambda c: -c.strength)), tuple(sorted(structure, key=lambda s: -s.strength)))


def _measured(finding: Finding) -> Cause:
    return Cause(finding.effect, "measurement", finding.parameters, finding.size / MEASUREMENT_NEGLIGIBLE[finding.effect],
                 finding.significance**2, "all", "all")


def _withheld_measurement(tests: MeasurementTests, withheld: frozenset[str]) -> list[Structure]:
    return [Structure("measurement", "all", "all", "a residual between the two cameras, of the Host or of lengths", f.size / MEASUREMENT_NEGLIGIBLE[f.effect],
                      f.significance**2) for f in tests.findings.values() if f.found and f.effect in withheld]


# --- flights -------------------------------------------------------------------------------------------------------------

def _accepted(gain: Gain) -> bool:
    return (gain.gain > GAIN and gain.held_out > GAIN / 2 and gain.significance > SIGNIFICANCE and gain.improved >= IMPROVED
            and gain.acceleration_m_per_s2 > NEGLIGIBLE_M_PER_S2)


def _flights(series: Series, effects: Sequence[str], withheld: frozenset[str]):
    """Nominal fit, then friction and its coupling if they are missing, then the terms by forward selection (two at most)."""
    runs = series.runs
    base = nominal = fit(runs, nominal_model(effects))
    causes: list[Cause] = []
    for name, missing in (("floor_friction", "floor_friction" not in effects and "spin_coupling" not in effects),
                          ("spin_coupling", "floor_friction" in effects and "spin_coupling" not in effects)):
        if not missing or name in withheld:
            continue
        # How far friction is coupled to the spin is an unknown of its own: 0 plain Coulomb, 1 a uniformly loaded disk.
        trial = fit(runs, _with_free(nominal_model([*effects, "floor_friction", "spin_coupling"]), (*base.model.free, "coupling")), rounds=4)
        friction = trial.model.parameters[INDEX["friction"]]
        gain = base.misfit - trial.misfit
        if gain > GAIN and friction * GRAVITY_M_PER_S2 > 3 * NEGLIGIBLE_M_PER_S2:
            causes.append(_friction_cause(name, trial, gain, base))
            base = trial
    named_terms, probe_terms = terms(withheld)
    every = gains(base, named_terms)
    first = every
    probes = gains(base, probe_terms)
    for _ in range(2):
        candidates = [g for g in (_measure_load(g, base, series) for g in every) if _accepted(g)]
        if not candidates or (causes and len(causes) >= 2):
            break
        best = max(candidates, key=lambda g: g.held_out)
        rivals = [p for p in probes if _accepted(p)]
        if rivals and max(p.held_out for p in rivals) > 1.15 * best.held_out + OVERRIDES:
            break
        trial = fit(runs, _with_free(base.model, best.term.columns))
        causes.append(_term_cause(best, trial, base, series))
        base = trial
        every, probes = gains(base, named_terms), gains(base, probe_terms)
    return nominal, base, causes, first, probes


def _with_free(model: FlightModel, names: Sequence[str]) -> FlightModel:
    return replace(model, free=tuple(dict.fromkeys((*model.free, *names))))


def _measure_load(gain: Gain, base: FlightFit, series: Series) -> Gain:
    """The load's term counts by the acceleration that the Host's measured z'' makes it give."""
    if gain.term.name != "vertical_motion" or not len(gain.estimate):
        return gain
    friction = base.model.parameters[INDEX["friction"]]
    rms = np.sqrt(np.mean([np.mean(r.data.host.at(r.data.time_s, 2)[:, 2] ** 2) for r in series.runs]))
    return replace(gain, acceleration_m_per_s2=float(abs(gain.estimate[0]) * friction * rms))


def _sd(fit_: FlightFit, name: str) -> float:
    """Standard deviation of a shared parameter: the larger of the fit's own and the jackknife over runs (lens and model errors scatter there)."""
    at = list(fit_.columns).index(name)
    own = float(np.sqrt(fit_.covariance[at, at] * max(1.0, fit_.misfit / max(fit_.count, 1))))
    runs = len(fit_.evidence)
    if runs < 4:
        return own
    left_out = np.array([solve_named([e for j, e in enumerate(fit_.evidence) if j != i], fit_.columns)[0][at] for i in range(runs)])
    return max(own, float(np.sqrt((runs - 1) / runs * np.sum((left_out - left_out.mean()) ** 2))))


def _friction_cause(name: str, trial: FlightFit, gain: float, base: FlightFit) -> Cause:
    friction = float(trial.model.parameters[INDEX["friction"]])
    parameters = {"coefficient": (friction, _sd(trial, "friction"))} if name == "floor_friction" else {
        "coupling": (float(trial.model.parameters[INDEX["coupling"]]), _sd(trial, "coupling"))}
    size = friction * GRAVITY_M_PER_S2 * (1.0 if name == "floor_friction" else 0.3 * abs(float(trial.model.parameters[INDEX["coupling"]])))
    return Cause(name, "flight", parameters, size / NEGLIGIBLE_M_PER_S2, gain, "x", "free flight")


def _term_cause(gain: Gain, trial: FlightFit, base: FlightFit, series: Series) -> Cause:
    p, name = trial.model.parameters, gain.term.name
    if name == "table_tilt":
        ax, ay = p[INDEX["tilt_x"]], p[INDEX["tilt_y"]]
        size = float(np.hypot(ax, ay))
        sd = float(np.hypot(ax * _sd(trial, "tilt_x"), ay * _sd(trial, "tilt_y")) / max(size, 1e-9))
        parameters = {"tilt_rad": (size / GRAVITY_M_PER_S2, sd / GRAVITY_M_PER_S2),
                      "direction_rad": (float(np.arctan2(ay, ax)), float(np.hypot(_sd(trial, "tilt_x"), _sd(trial, "tilt_y")) / max(size, 1e-9)))}
    elif name == "vertical_motion":
        amplitude = np.array([np.hypot(r.data.host.harmonics[2, 1], r.data.host.harmonics[2, 2]) if r.data.host.harmonics.shape[1] > 2
                              else 0.0 for r in series.runs])
        load = p[INDEX["load"]]
        sd = np.hypot(_sd(trial, "load") * amplitude.mean() / max(abs(load), 0.1),
                      np.std(amplitude) / np.sqrt(max(len(amplitude), 1)) + 1e-6)
        parameters = {"amplitude_m": (float(amplitude.mean()), float(sd))}
    elif name == "friction_drift":
        parameters = {"relative_per_s": (float(p[INDEX["drift"]]), _sd(trial, "drift")),
                      "relative_per_run": (float(trial.model.drift_per_run), _sd(trial, "drift_run"))}
    else:
        column, parameter = {"viscous_drag": ("viscous", "rate_per_s"), "air_drag": ("air", "rate_per_m")}[name]
        parameters = {parameter: (float(p[INDEX[column]]), _sd(trial, column))}
    return Cause(name, "flight", parameters, gain.acceleration_m_per_s2 / NEGLIGIBLE_M_PER_S2, gain.gain,
                 _main_coordinate(gain), "free flight")


def _main_coordinate(gain: Gain) -> str:
    if gain.term.name == "table_tilt":
        return "x" if abs(gain.estimate[0]) >= abs(gain.estimate[1]) else "y"
    return "x"


def _flight_structure(probes: Sequence[Gain], causes: Sequence[Cause], base: FlightFit) -> list[Structure]:
    strongest = max((c.strength for c in causes), default=0.0)
    out = []
    for probe in probes:
        strength = probe.acceleration_m_per_s2 / NEGLIGIBLE_M_PER_S2
        if probe.term.name in ("decay of the spin", "constant torque"):
            # Judged by what they do to the rim: R alpha, which the position does not feel at all.
            strength *= 1.0
        if _accepted(probe) and strength > LEFT_OVER * strongest:
            coordinate = "angle" if probe.term.columns[0] in ("spin_decay", "spin_drive") else "x"
            out.append(Structure("flight", "free flight", coordinate, probe.term.name, strength, probe.gain))
    return out


# --- impacts -------------------------------------------------------------------------------------------------------------

def _shape(flight: FlightFit, base: ImpactFit, ellipse: bool, finite: bool, withheld: frozenset[str]):
    """Ellipticity and finite contact, whichever explains more first; then the other on top."""
    causes: list[Cause] = []
    first: list[ImpactGain] = []
    for _ in range(2):
        found = [g for g in impact_stage.distance_gains(flight.fits, base, ellipse, finite, withheld) if g.named]
        first = first or found
        accepted = [g for g in found if _shape_accepted(g, base)]
        if not accepted:
            break
        best = max(accepted, key=lambda g: g.gain)
        ellipse, finite = ellipse or best.name == "wall_ellipticity", finite or best.name == "finite_contact_time"
        base = fit_impacts(flight.fits, ellipse=ellipse, finite=finite)
        causes.append(_shape_cause(best, base))
    return ellipse, finite, causes, base, first


def _contact_time(slope_s: float, restitution: float) -> float:
    """Duration of a contact from the slope of the contact distance in the approach speed: paths meet eps T/(1 + eps) v further out."""
    return slope_s * (1 + restitution) / max(restitution, 0.05)


def _shape_accepted(gain: ImpactGain, base: ImpactFit) -> bool:
    if gain.gain < IMPACT_GAIN or gain.significance < SIGNIFICANCE:
        return False
    if gain.name == "finite_contact_time":
        return _contact_time(float(gain.estimate[-1]), base.law.restitution) > CONTACT_TIME_NEGLIGIBLE_S
    e = gain.estimate[:2]
    return float(np.hypot(*e)) > ELLIPTICITY_NEGLIGIBLE


def _shape_cause(gain: ImpactGain, base: ImpactFit) -> Cause:
    if gain.name == "finite_contact_time":
        factor = _contact_time(1.0, base.law.restitution)
        duration = base.contact_slope_s * factor
        parameters = {"duration_s": (duration, base.contact_slope_sd_s * factor + 0.03 * duration)}
        return Cause(gain.name, "impact", parameters, duration / CONTACT_TIME_NEGLIGIBLE_S, gain.gain, "normal", "impact")
    c, s = base.wall.wall.ellipse
    at = [list(base.wall.terms).index(t) for t in ("ellipse_c", "ellipse_s")]
    # A lens residual of the size of the scatter left over looks like a little ellipse.
    lens = 0.5 * max(base.wall.scatter_m - 3e-6, 0.0) / base.wall.wall.contact_radius_m
    sd = float(np.hypot(np.sqrt(np.mean(np.diag(base.wall.covariance)[at])), lens))
    e = float(np.hypot(c, s))
    parameters = {"ellipticity": (e, sd), "direction_rad": (float(0.5 * np.arctan2(s, c)), 0.5 * sd / max(e, 1e-9))}
    return Cause(gain.name, "geometry", parameters, e / ELLIPTICITY_NEGLIGIBLE, gain.gain, "radius", "impact")


def _laws(base: ImpactFit, held: Sequence[str], finite: bool, withheld: frozenset[str]):
    """Restitution's effects by forward selection, then probes in restitution, tangential and angular law."""
    names = list(held)
    causes: list[Cause] = []
    structure: list[Structure] = []
    first: list[ImpactGain] = []
    found: list[ImpactGain] = []
    for _ in range(3):
        found = impact_stage.restitution_gains(base.data, names, withheld)
        first = first or [g for g in found if g.named]
        named = [g for g in found if g.named and _law_accepted(g)]
        probes = [g for g in found if not g.named and _law_accepted(g)]
        best = max(named, key=lambda g: g.gain, default=None)
        rival = max(probes, key=lambda g: g.gain, default=None)
        if best is None or (rival is not None and rival.gain > best.gain + OVERRIDES) or len(causes) >= 2:
            break
        names.append(best.name)
        causes.append(_restitution_cause(best, base, names))
    strongest = max((c.strength for c in causes), default=0.0)
    # A contact that lasts has a tangential spring: Luding's stick or slide no longer holds, and its residuals prove nothing.
    tangential = [] if finite else impact_stage.tangential_gains(base.data, base.law)
    probes = [g for g in (*found, *tangential) if not g.named]
    for probe in probes:
        strength = probe.size / impact_stage.NEGLIGIBLE[probe.residual]
        if _law_accepted(probe) and strength > LEFT_OVER * strongest:
            coordinate = {"restitution": "normal", "sliding": "tangential", "sticking": "tangential", "angular": "spin"}[probe.residual]
            structure.append(Structure("impact", "impact", coordinate, probe.name, strength, probe.gain))
    return causes, names, first, probes, structure


def _law_accepted(gain: ImpactGain) -> bool:
    return gain.gain > IMPACT_GAIN and gain.significance > SIGNIFICANCE - 1 and gain.size > impact_stage.NEGLIGIBLE[gain.residual]


def _restitution_cause(gain: ImpactGain, base: ImpactFit, names: Sequence[str]) -> Cause:
    data = base.data
    design = impact_stage.restitution_design(data, names)
    c, covariance, _, _ = impact_stage.fit_restitution(data, design)
    sd = np.sqrt(np.diag(covariance))
    strength = gain.size / impact_stage.NEGLIGIBLE["restitution"]
    if gain.name == "speed_dependent_restitution":
        scale = impact_stage.best_speed_scale(data)
        scale_sd = impact_stage.speed_scale_sd(data, scale)
        # The fast limit moves with the scale: both ends of the scale's interval are tried.
        ends = [impact_stage.fit_restitution(data, impact_stage.restitution_columns(data.before, data.azimuth_rad, names, s))[0][0]
                for s in (max(scale - scale_sd, 0.05), scale + scale_sd)]
        fast_sd = float(np.hypot(sd[0], 0.5 * (max(ends) - min(ends))))
        parameters = {"restitution_fast": (float(c[0]), fast_sd), "speed_scale_m_per_s": (scale, scale_sd)}
    else:
        a, b = c[-2:]
        size = float(np.hypot(a, b))
        parameters = {"amplitude": (size, float(np.hypot(a * sd[-2], b * sd[-1]) / max(size, 1e-9))),
                      "direction_rad": (float(np.arctan2(b, a)), float(np.mean(sd[-2:]) / max(size, 1e-9)))}
    return Cause(gain.name, "impact", parameters, strength, gain.gain, "normal", "impact")


def _distance_structure(probes: Sequence[ImpactGain], base: ImpactFit, causes: Sequence[Cause]) -> list[Structure]:
    strongest = max((c.strength for c in causes), default=0.0)
    return [Structure("geometry", "impact", "radius", p.name, p.size / impact_stage.NEGLIGIBLE["distance"], p.gain) for p in probes
            if p.gain > 2 * IMPACT_GAIN and p.significance > SIGNIFICANCE and p.size > impact_stage.NEGLIGIBLE["distance"]
            and p.size / impact_stage.NEGLIGIBLE["distance"] > LEFT_OVER * strongest]


# Restitution scatters by up to 0.03 from impact to impact (GAP.md), contact distances by the lens residual: more has a cause.
# A lens residual of 0.05 mm over sharp markers (5 um) leaves a misfit of 2.4 (practice-05).
USUAL_SCATTER, USUAL_DISTANCE_M, USUAL_MISFIT = 0.03, 4e-5, 4.0


def _unexplained_scatter(base: ImpactFit, restitution: Sequence[str], found: Sequence[Structure]) -> list[Structure]:
    """Scatter of the impacts beyond what is usual, where no covariate explains it."""
    if any(s.stage in ("impact", "geometry") for s in found):
        return []
    out = []
    scatter = float(impact_stage.fit_restitution(base.data, impact_stage.restitution_design(base.data, restitution))[2])
    if scatter > 1.35 * USUAL_SCATTER:
        out.append(Structure("impact", "impact", "normal", "none of the covariates tested (scatter from impact to impact)",
                             scatter / USUAL_SCATTER, 0.0))
    if base.wall.scatter_m > USUAL_DISTANCE_M:
        out.append(Structure("geometry", "impact", "radius", "none of the covariates tested (scatter of the contact distance)",
                             base.wall.scatter_m / USUAL_DISTANCE_M, 0.0))
    return out


def _unexplained_misfit(flight: FlightFit, found: Sequence[Structure]) -> list[Structure]:
    """Misfit of the flights beyond the noise, where no probe explains it."""
    excess = flight.misfit / max(flight.count, 1)
    if excess < USUAL_MISFIT or any(s.stage in ("flight", "measurement") for s in found):
        return []
    return [Structure("flight", "free flight", "x", "none of the probes tested (misfit of the flights)", excess / USUAL_MISFIT, 0.0)]


# --- centres -------------------------------------------------------------------------------------------------------------

def _centres(series: Series, flight: FlightFit, impacts: ImpactFit | None) -> list[Cause]:
    """Wall centre, mass centre and centre marker: placement up to 0.1 mm is the nominal model's, beyond it an effect."""
    out = []
    if impacts is not None:
        wall, terms = impacts.wall.wall, list(impacts.wall.terms)
        sd = np.sqrt(np.diag(impacts.wall.covariance))
        lens = float(np.hypot(2e-6, impacts.wall.scatter_m / 3))
        for effect, vector, names, limit in (("wall_centre_offset", wall.centre_m, ("centre_x", "centre_y"), CENTRE_NEGLIGIBLE_M),
                                             ("mass_centre_offset", -wall.disk_m, ("disk_x", "disk_y"), MASS_CENTRE_NEGLIGIBLE_M)):
            error = [float(np.hypot(sd[terms.index(n)], lens if effect == "mass_centre_offset" else 2.5e-5)) for n in names]
            size = float(np.hypot(*vector))
            if size > limit and size > SIGNIFICANCE * sd[terms.index(names[0])]:
                parameters = {"x_m": (float(vector[0]), error[0]), "y_m": (float(vector[1]), error[1])}
                out.append(Cause(effect, "geometry", parameters, size / limit, (size / max(error[0], 1e-9)) ** 2, "radius", "impact"))
    marker = _centre_marker(series, flight, impacts, any(c.effect == "mass_centre_offset" for c in out))
    return out + ([marker] if marker else [])


def _centre_marker(series: Series, flight: FlightFit, impacts: ImpactFit | None, off_centre: bool) -> Cause | None:
    """Centre marker against the disk's geometric centre: its place in the layout plus the layout's origin against the centre of
    mass, which the flights know; and where the two centres differ, what the impacts say of the geometric one."""
    recording: Recording = series.recordings[0]
    nes = recording.bodies.get("nes")
    marker = getattr(nes, "centre_marker", None)
    if series.layouts is None or marker is None or nes.layout_m is None or marker not in nes.markers:
        return None
    at = list(nes.markers).index(marker)
    design = np.asarray(nes.layout_m, float)[at, :2]
    offset = series.layouts["nes"][at, :2] + flight.model.origin_m - design
    if off_centre and impacts is not None:
        offset = offset - impacts.wall.wall.disk_m
    size = float(np.hypot(*offset))
    if size < CENTRE_NEGLIGIBLE_M:
        return None
    sd = 5e-6
    return Cause("centre_marker_offset", "geometry", {"x_m": (float(offset[0]), sd), "y_m": (float(offset[1]), sd)},
                 size / CENTRE_NEGLIGIBLE_M, (size / sd) ** 2, "x", "all")
