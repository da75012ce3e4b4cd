"""Least sd of a restitution under a lens residual: noise, impacts' scatter, and the residual's map known up to its
size.

    python benchmarks/identification/identify_bound.py SHARED NUMBER [NUMBER ...]

The bound of Cramer and Rao with the residual's coefficients as unknowns of known size (van Trees): polynomials of
degree 1 to 4 in the place, each coefficient of degree two and more of the sd that the flights show for degree two
(``LensResidual.amplitude_m``), friction and the markers' origin besides.  What the flights of all runs tell of them is
their information matrix; what a coefficient does to the restitution is the difference of two identifications.  The
linear terms bend no flight: their size is the prior's, as large as the others (``bound_equal``) or as a residual like
sin(u/L) has them whose degree-two terms are those seen, 2 L / R_c times as large (``bound_wave``; the plant's L is 135
to 230 pixels, 1.3 contact radii on average). One row per series: ``noise_bound`` without a lens residual, these two,
the sd given, the error, and the sd over both.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.contact.impacts import intersect, measure
from analysis.contact.law import fit_restitution, law_data
from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.equation.parameters import INDEX, PARAMETERS
from analysis.flights.evidence import columns_of
from analysis.flights.fit import ORIGIN, SHARED, fit_flights
from analysis.identification.fit import RigFit
from analysis.identification.floor.priors import ORIGIN_SD_M, WEAK_SD
from analysis.identification.lens_residual import LINEAR_SHARE
from analysis.identify import identify_series
from benchmarks.identification.identify import motions_of, restitution_bound

# Steps of the shared unknowns: a micrometre of lens residual or origin, 1e-4 of everything else.
STEP_M, STEP = 1e-6, 1e-4


def restitution_of(rig: RigFit, change: dict[str, float]) -> float:
    """Restitution of the same impacts with shared unknowns changed: flights fitted again, met, measured."""
    fits = []
    for fit in rig.floor.fits:
        parameters, shared = fit.parameters.copy(), fit.shared.copy()
        for name, step in change.items():
            if name in PARAMETERS:
                parameters[INDEX[name]] += step
            else:
                shared[SHARED.index(name) - len(PARAMETERS)] += step
        fits.append(fit_flights(fit.run, fit.flights, parameters, shared, fit, rig.floor.noise))
    junctions, first = intersect(fits), rig.runs[0].data
    seen = rig.wall.impacts.junctions
    key = {(int(r), int(f)) for r, f in zip(seen.run[rig.data.at.index], seen.flight[rig.data.at.index], strict=True)}
    used = np.array([(int(r), int(f)) in key for r, f in zip(junctions.run, junctions.flight, strict=True)])
    data = law_data(
        measure(junctions, rig.wall.wall), used, first.radius_m, first.inertia_factor, rig.balance.speed_floor_m_per_s
    )
    return float(fit_restitution(data)[0][0])


def lens_bounds(rig: RigFit, scatter: float, linear: Sequence[float]) -> list[float]:
    """Least sd of the restitution, the residual's coefficients known to ``rig.lens.amplitude_m`` before the flights
    tell more; one for each size of the linear ones, as multiples of the others'."""
    names = [SHARED[c] for c in columns_of([*rig.floor.names, *ORIGIN, *LENS_TERMS])]
    slopes = []
    for name in names:
        step = STEP_M if name in (*LENS_TERMS, *ORIGIN) else STEP
        slopes.append((restitution_of(rig, {name: step}) - restitution_of(rig, {name: -step})) / (2 * step))
    slope, information = (
        np.array(slopes),
        sum(e.take(columns_of(names))[0] for e in rig.floor.evidence) / max(rig.floor.scale, 1.0) ** 2,
    )
    bounds = []
    for times in linear:
        sizes = {
            name: max(rig.lens.amplitude_m, 1e-9) * (times if int(name[-2]) + int(name[-1]) == 1 else 1.0)
            for name in LENS_TERMS
        }
        prior_sd = np.array([{**sizes, **dict.fromkeys(ORIGIN, ORIGIN_SD_M)}.get(name, WEAK_SD) for name in names])
        # In units of the priors: friction, metres and rates differ by ten orders of magnitude.
        covariance = np.linalg.inv(information * np.outer(prior_sd, prior_sd) + np.eye(len(names))) * np.outer(
            prior_sd, prior_sd
        )
        bounds.append(float(np.sqrt(restitution_bound(rig.data, scatter) ** 2 + slope @ covariance @ slope)))
    return bounds


def row_of(shared: Path, name: str) -> dict[str, object]:
    """One practice series: bounds, sd given and error of the restitution."""
    recordings, motions = motions_of(shared / "practice" / name)
    joint, runs = identify_series(motions, recordings)
    truth = json.loads((shared / "practice_truth" / f"{name}.json").read_text())["plant"]
    found = joint.set_index("parameter").loc["restitution"]
    rig = runs[0].rig
    equal, wave = lens_bounds(rig, truth["eps_sd"], (1.0, LINEAR_SHARE))
    error, sd = float(found["value"]) - truth["eps"], float(found["sd"])
    return {
        "series": name,
        "lens_um": 1e6 * rig.lens.amplitude_m,
        "noise_bound": restitution_bound(rig.data, truth["eps_sd"]),
        "bound_equal": equal,
        "bound_wave": wave,
        "sd": sd,
        "error": error,
        "sd_over_equal": sd / equal,
        "sd_over_wave": sd / wave,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shared", type=Path)
    parser.add_argument("numbers", type=int, nargs="+")
    arguments = parser.parse_args()
    for k, number in enumerate(arguments.numbers):
        row = pd.DataFrame([row_of(arguments.shared, f"practice-{number:02d}")])
        print(row.to_string(index=False, header=k == 0, col_space=12, float_format=lambda x: f"{x:.3g}"), flush=True)


if __name__ == "__main__":
    main()
