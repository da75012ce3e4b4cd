"""Wall centre, mass centre, centre marker and the wall's stated lengths: placement is the nominal model's, beyond it is
an effect; so are lengths that are not what recording.toml says.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.contact.middle import MASS_CENTRE_NEGLIGIBLE
from analysis.flights.fit import ORIGIN
from analysis.gap.by_run import ByRun
from analysis.gap.cause import Cause
from analysis.gap.selection.flights.fit import FlightFit, prior_of
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.gap.series import Series
from analysis.gap.thresholds import (
    CENTRE_NEGLIGIBLE,
    PLACEMENTS,
    SIGNIFICANCE,
    STATED_SHARE,
)
from analysis.walls.outlines import DISK_TERMS, Sides, side_term
from analysis.walls.wall import Wall
from ovines.recording import Recording

Array = NDArray[np.float64]


# Of the contact radius: what fits are good to at best, what a lens residual leaves of the wall's centre, what a
# marker's place in the disk is known to (2, 25 and 5 um of 40 mm).
FIT_SHARE, LENS_SHARE, MARKER_SHARE = 5e-5, 6.25e-4, 1.25e-4


def centre_negligible_m(series: Series) -> float:
    """Up to here a wall's centre or a centre marker that is off is placement."""
    sds = [body.layout_sd_m or 0.0 for body in series.recordings[0].bodies.values()]
    return max(CENTRE_NEGLIGIBLE * series.contact_radius_m, PLACEMENTS * max(sds, default=0.0))


def is_effect(offset: Cause) -> bool:
    """More than placement, and surely there."""
    return offset.strength > 1 and offset.gain > SIGNIFICANCE**2


def centre_offsets(series: Series, flight: FlightFit, impacts: ImpactFit | None) -> list[Cause]:
    """Wall centre, mass centre, stated radius and centre marker as measured, ``gain`` being the square of the size in
    its sd of the fit alone.
    """
    out = []
    if impacts is not None:
        wall, terms = impacts.wall.wall, list(impacts.wall.terms)
        covariance = impacts.wall.covariance[: len(terms), : len(terms)]
        radius_m = series.contact_radius_m
        lens = float(np.hypot(FIT_SHARE * radius_m, impacts.wall.scatter_m / 3))
        for effect, vector, rows, limit in (
            ("wall_centre_offset", wall.centre_m, _centre_rows(wall, terms), centre_negligible_m(series)),
            ("mass_centre_offset", -wall.disk_m, _rows_of(DISK_TERMS, terms), MASS_CENTRE_NEGLIGIBLE * radius_m),
        ):
            sd = np.sqrt(np.diag(rows @ covariance @ rows.T))
            error = np.hypot(sd, lens if effect == "mass_centre_offset" else LENS_SHARE * radius_m).tolist()
            size = float(np.hypot(*vector))
            parameters = {"x_m": (float(vector[0]), error[0]), "y_m": (float(vector[1]), error[1])}
            gain = (size / max(float(sd[0]), 1e-12)) ** 2
            out.append(Cause(effect, "geometry", parameters, size / limit, gain, "radius", "impact"))
        out.append(_stated_radius(series, impacts))
    marker = _centre_marker(
        series, flight, impacts, any(c.effect == "mass_centre_offset" and is_effect(c) for c in out)
    )
    return out + ([marker] if marker else [])


def _stated_radius(series: Series, impacts: ImpactFit) -> Cause:
    """The contact radius (of flat sides their distances, of a cylinder its radius) against the stated one: that length
    which is off by most of its sds.
    """
    design = series.runs[0].data.wall
    stated, found = design.values(), impacts.wall.wall.values()
    sds = np.sqrt(np.diag(impacts.wall.covariance))
    lens = impacts.wall.scatter_m / 3
    lengths = [
        (found[term] - stated[term], float(np.hypot(sds[k], lens)))
        for k, term in enumerate(impacts.wall.terms)
        if design.is_length(term)
    ]
    off, sd = max(lengths, key=lambda one: abs(one[0]) / max(one[1], 1e-12))
    limit = STATED_SHARE * design.size_m
    # Without a layout of the markers nobody knows whether the wall is off or the unit of length.
    rivals = () if series.layouts is not None else ("length_scale_error",)
    parameters = {"radius_m": (off, sd)}
    return Cause("stated_radius", "geometry", parameters, abs(off) / limit, (off / sd) ** 2, "radius", "impact", rivals)


def _rows_of(names: Sequence[str], terms: Sequence[str]) -> Array:
    """(N, P) that picks ``names`` out of a fit's ``terms``."""
    return np.array([[float(term == name) for term in terms] for name in names])


def _centre_rows(wall: Wall, terms: Sequence[str]) -> Array:
    """(2, P) that makes the wall's centre of a fit's ``terms``."""
    if isinstance(wall.outline, Sides):
        sides = [side_term(k + 1) for k in range(len(wall.outline.names))]
        return np.asarray(wall.outline.to_centre @ _rows_of(sides, terms), float)
    return _rows_of(("centre_x", "centre_y"), terms)


def _centre_marker(series: Series, flight: FlightFit, impacts: ImpactFit | None, off_centre: bool) -> Cause | None:
    """Centre marker against the disk's geometric centre: its place in the layout plus the layout's origin against the
    centre of mass, which the flights know; and where the two centres differ, what the impacts say of the geometric one.
    """
    recording: Recording = series.recordings[0]
    nes = recording.bodies.get("nes")
    marker = getattr(nes, "centre_marker", None)
    if series.layouts is None or nes is None or marker is None or nes.layout_m is None or marker not in nes.markers:
        return None
    at = list(nes.markers).index(marker)
    design = np.asarray(nes.layout_m, float)[at, :2]
    offset = series.layouts["nes"][at, :2] + flight.model.origin_m - design
    if off_centre and impacts is not None:
        offset = offset - impacts.wall.wall.disk_m
    size = float(np.hypot(*offset))
    sd = MARKER_SHARE * series.contact_radius_m
    return Cause(
        "centre_marker_offset",
        "geometry",
        {"x_m": (float(offset[0]), sd), "y_m": (float(offset[1]), sd)},
        size / centre_negligible_m(series),
        (size / sd) ** 2,
        "x",
        "all",
        by_run=_origin_by_run(flight).moved(offset),
    )


def _origin_by_run(flight: FlightFit) -> ByRun:
    """How far the origin of the NES's markers lies from the fitted one, as each run's flights say."""
    columns, forms = list(flight.columns), flight.forms
    at, own = forms.at(columns), [columns.index(name) for name in ORIGIN]
    prior = prior_of(columns, forms.contact_radius_m)
    prior[own] = 0.0
    return ByRun.of_forms(forms.information[:, at][:, :, at] + np.diag(prior), forms.score[:, at], own)
