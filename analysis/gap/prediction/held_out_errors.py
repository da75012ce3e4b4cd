"""How far: errors of the four steps and the predictions behind them, all on runs held out of the fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.flights.cutting.runs import Run
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.prediction import predict
from analysis.gap.prediction.one_impact_ahead import through_impacts
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.model import FlightModel
from analysis.gap.selection.impacts.floor import impact_floor
from ovines.core.effects import EFFECTS, is_law
from ovines.core.laws.terms import WrittenLaw, rows_of
from ovines.recording_schema import Nominal

Array = NDArray[np.float64]
Errors4 = dict[str, predict.Errors | None]
Hit = tuple[Array, Array, NDArray[np.int64]]
STEPS = ("as_given", "recalibrated", "with_effect", "noise_floor")


def held_out_errors(
    ladder: Ladder, causes: tuple[Cause, ...], laws: Sequence[WrittenLaw] = ()
) -> tuple[Errors4, pd.DataFrame]:
    """Errors of the four steps (None where the model as given says too little) and the table ``predictions``; ``laws``
    that were written for what is left, in the rig's frame, are no noise."""
    runs = ladder.series.runs
    model = ladder.series.recordings[0].model
    stated = dict(ladder.flights.nominal.model.stated)
    starts_s = [run.data.start_s for run in runs]
    given = predict.given_model(model.effects, model.floor_friction, stated, starts_s) if model else None
    nominal = held_out_paths(runs, ladder.flights.nominal)
    paths: dict[str, list[Array] | None] = {
        "as_given": _given_paths(runs, given, ladder) if given is not None else None,
        "recalibrated": nominal,
        "with_effect": held_out_paths(runs, ladder.flights.named)
        if ladder.flights.named is not ladder.flights.nominal
        else nominal,
        "noise_floor": [predict.free_paths(run, ladder.flights.fitted.noise.correlation) for run in runs],
    }
    hits = _hits(ladder, model, laws) if ladder.impacts.fitted is not None else {}
    errors: Errors4 = {}
    for name in STEPS:
        path, hit = paths[name], hits.get(name)
        errors[name] = None if path is None else predict.errors_of(runs, path, *(hit or (None, None, None)))
    if (floor := errors["noise_floor"]) is not None:
        errors["noise_floor"] = floor.never_above([one for one in errors.values() if one is not None])
    del paths["noise_floor"]
    if (
        causes
        and causes[0].stage in ("impact", "geometry")
        and ladder.impacts.fitted is not None
        and causes[0].effect != "centre_marker_offset"
    ):
        before, after = ladder.both_impacts()
        paths = {
            "as_given": None,
            "recalibrated": through_impacts(
                runs, ladder.flights.fitted.fits, before, (), finite=False, held=ladder.flights.nominal.fits[0].run.law
            ),
            "with_effect": through_impacts(
                runs,
                ladder.flights.fitted.fits,
                after,
                ladder.impacts.restitution_terms,
                finite=ladder.impacts.shape.finite,
                held=np.vstack([ladder.flights.fitted.fits[0].run.law, _laws_by_name(causes)]),
            ),
        }
    return errors, predict.table(runs, paths, ladder.series.frame)


def _laws_by_name(causes: tuple[Cause, ...]) -> Array:
    """Packed rows of those that are laws of the impacts; laws of the flights are held by these."""
    named = [cause for cause in causes if cause.stage == "impact" and is_law(cause.effect)]
    sized = [(EFFECTS[one.effect], {name: value for name, (value, _) in one.parameters.items()}) for one in named]
    return rows_of([term for effect, values in sized for term in effect.law(effect.nearest(values)).terms])


def _hits(ladder: Ladder, model: Nominal | None, laws: Sequence[WrittenLaw]) -> dict[str, Hit]:
    """Errors one impact ahead of each step, with the run of each impact."""
    before, after = ladder.both_impacts()
    named = [name for name in (model.effects if model else ()) if name in RESTITUTION_EFFECTS]
    floor = impact_floor(after, ladder.impacts.restitution_terms, ladder.flights.fitted.fits, laws)
    out = {
        "recalibrated": (*predict.predicted_impacts(before, named), before.data.at.run),
        "with_effect": (*predict.predicted_impacts(after, ladder.impacts.restitution_terms), after.data.at.run),
        "noise_floor": (*floor, after.data.at.run),
    }
    if (
        model
        and model.restitution is not None
        and model.wall_friction is not None
        and model.tangential_restitution is not None
    ):
        law = predict.stated_tangential(model)
        restitution = predict.stated_restitution(before.data, model, ladder.series.frame)
        out["as_given"] = (*predict.predicted_impacts(before, (), restitution, law), before.data.at.run)
    return out


def held_out_paths(runs: Sequence[Run], fitted: FlightFit) -> list[Array]:
    """Path (N, 3) of each run by what the other runs tell, its flights' own states fitted."""
    models = predict.held_out_models(fitted)
    return [predict.flight_paths(run, fits) for run, fits in zip(runs, predict.flights_of(runs, models), strict=True)]


def _given_paths(runs: Sequence[Run], given: FlightModel, ladder: Ladder) -> list[Array]:
    model = replace(given, origin_m=ladder.flights.nominal.model.origin_m)
    return [
        predict.flight_paths(run, fits)
        for run, fits in zip(runs, predict.flights_of(runs, [model] * len(runs)), strict=True)
    ]
