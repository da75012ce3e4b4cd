"""What a series has as a whole: the joint identification of its runs, and the page over all of them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.io.provenance import provenance, sha256_of
from ovines.pipeline.code import code_digest
from ovines.pipeline.ownership import refuse_theirs
from ovines.pipeline.pages import remove_figures
from ovines.pipeline.stages import parameters_of, stage, stored_state
from ovines.recording import Recording
from ovines.tables import read_table, write_table

JOINT = "identification.parquet"
# A joint sd this much above the best run's is no rounding.
WIDER = 1.05
PAGE = "report.html"


def write_series_results(
    out: Path, recordings: Sequence[Recording], name: str, only: str | None, force: bool, figures: bool
) -> tuple[dict[str, str], list[str]]:
    """Bring ``out/identification.parquet`` up to date and write ``out/report.html``; what ran, and the notes.

    ``recordings`` are those whose results stand in ``out / name of their folder``.  Call it under the lock of ``out``.
    """
    stages: dict[str, str] = {}
    notes: list[str] = []
    refuse_theirs(out, [JOINT, PAGE], figures)
    if only != "report":
        stages["identify"], notes = _identify_together(out, recordings, force)
    if only != "identify":
        from analysis.report.pages.series_report import write_series_report

        if not figures:
            remove_figures(out)
        write_series_report(out, recordings, name, figures)
        stages["report"] = "run"
    return stages, notes


def _identify_together(out: Path, recordings: Sequence[Recording], force: bool) -> tuple[str, list[str]]:
    """The joint table, where its runs are of one rig; a reason in the notes, and no table, where they are not."""
    path = out / JOINT
    alone = {one.entry() == "impacts" for one in recordings}
    table = "impacts" if alone == {True} else "motion"
    motions = {one.folder.name: out / one.folder.name / f"{table}.parquet" for one in recordings}
    if len(alone) > 1:
        path.unlink(missing_ok=True)
        return "not possible", ["no joint identification: some recordings bring impacts alone, others motion"]
    state = _state(motions, recordings)
    old = stored_state(path) if path.is_file() else None
    if not force and old is not None and old.get("key") == state["key"]:
        return "up to date", []
    path.unlink(missing_ok=True)
    (out / PAGE).unlink(missing_ok=True)
    strange = _not_one_rig(recordings)
    if strange:
        return "not possible", [f"no joint identification: {strange}"]
    from analysis.identification.given_impacts import identify_impacts
    from analysis.identify import identify_series

    tables = [read_table(one, table) for one in motions.values()]
    try:
        if table == "impacts":
            found = identify_impacts(tables, recordings)
            joint, notes = found.identification, list(found.notes)
        else:
            joint, runs = identify_series(tables, recordings)
            notes = list(runs[0].notes) if runs else []
    except InputError as error:
        return "not possible", [f"no joint identification: {error.found}"]
    notes += wider_than_one(joint, {one.folder.name: out / one.folder.name / JOINT for one in recordings})
    write_table(joint, "identification", path, {**state, "notes": notes})
    return "run", notes


def wider_than_one(joint: pd.DataFrame, single: dict[str, Path]) -> list[str]:
    """A note per principal parameter of which one run alone (``single``: its table by the run's name) says to know more
    than all runs together.
    """
    from analysis.checks.series import LESS_SURE
    from analysis.report.parameters import PRINCIPAL, quantity

    tables = {
        name: read_table(path, "identification").set_index("parameter")
        for name, path in single.items()
        if path.is_file()
    }
    together, notes = joint.set_index("parameter"), []
    for parameter in PRINCIPAL:
        sds = {name: float(table.loc[parameter, "sd"]) for name, table in tables.items() if parameter in table.index}
        sds = {name: sd for name, sd in sds.items() if np.isfinite(sd)}
        sd = float(together.loc[parameter, "sd"]) if parameter in together.index else float("nan")
        surest = min(sds, key=lambda name: sds[name], default=None)
        if surest is not None and not sd <= WIDER * sds[surest]:
            sd_text = f"sd {sd:.2g}" if np.isfinite(sd) else "not determined"
            notes.append(
                f"{quantity(parameter).title} from all runs ({sd_text}) {LESS_SURE} {surest} alone (sd "
                f"{sds[surest]:.2g}): the runs disagree by more "
                "than their sds, or what one run explains another does not. Trust the joint interval; `ovines "
                "diagnose` looks for the reason."
            )
    return notes


def _state(motions: dict[str, Path], recordings: Sequence[Recording]) -> dict[str, Any]:
    one = stage("identify")
    depends = provenance(
        "identify",
        {recording.folder.name: parameters_of(one, recording) for recording in recordings},
        {name: sha256_of(path) for name, path in motions.items()},
    )
    depends["code"] = code_digest(one.name)
    text = json.dumps(depends, sort_keys=True)
    return {**depends, "key": hashlib.sha256(text.encode()).hexdigest()}


def _not_one_rig(recordings: Sequence[Recording]) -> str | None:
    """What differs between recordings that a joint fit takes for the same disk in the same ring; None: nothing."""
    first = recordings[0]
    for other in recordings[1:]:
        for body, key in (
            ("host", "inner_radius_m"),
            ("host", "polygon_m"),
            ("nes", "radius_m"),
            ("nes", "inertia_factor"),
        ):
            values = [getattr(one.bodies.get(body), key, None) for one in (first, other)]
            if values[0] != values[1]:
                return f"{body} {key} of {other.folder.name} differs from that of {first.folder.name}"
    return None
