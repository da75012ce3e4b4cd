"""What a series has as a whole: the joint identification of its runs, and the page over all of them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ovines.chain import code_digest, parameters_of, stage, stored_state
from ovines.errors import InputError
from ovines.pages import remove_figures
from ovines.provenance import provenance, sha256_of
from ovines.recording import Recording
from ovines.tables import read_table, write_table

JOINT = "identification.parquet"


def write_series_results(
    out: Path, recordings: Sequence[Recording], name: str, only: str | None, force: bool, figures: bool
) -> tuple[dict[str, str], list[str]]:
    """Bring ``out/identification.parquet`` up to date and write ``out/report.html``; what ran, and the notes.

    ``recordings`` are those whose results stand in ``out / name of their folder``.  Call it under the lock of ``out``.
    """
    stages: dict[str, str] = {}
    notes: list[str] = []
    if only != "report":
        stages["identify"], notes = _identify_together(out, recordings, force)
    if only != "identify":
        from analysis.report.series_report import write_series_report

        if not figures:
            remove_figures(out)
        write_series_report(out, recordings, name, figures)
        stages["report"] = "run"
    return stages, notes


def _identify_together(out: Path, recordings: Sequence[Recording], force: bool) -> tuple[str, list[str]]:
    """The joint table, where its runs are of one rig; a reason in the notes, and no table, where they are not."""
    path = out / JOINT
    motions = {one.folder.name: out / one.folder.name / "motion.parquet" for one in recordings}
    state = _state(motions, recordings)
    old = stored_state(path) if path.is_file() else None
    if not force and old is not None and old.get("key") == state["key"]:
        return "up to date", []
    path.unlink(missing_ok=True)
    (out / "report.html").unlink(missing_ok=True)
    strange = _not_one_rig(recordings)
    if strange:
        return "not possible", [f"no joint identification: {strange}"]
    from analysis.identify import identify_series

    try:
        joint, runs = identify_series([read_table(one, "motion") for one in motions.values()], recordings)
    except InputError as error:
        return "not possible", [f"no joint identification: {error.found}"]
    notes = list(runs[0].notes) if runs else []
    write_table(joint, "identification", path, {**state, "notes": notes})
    return "run", notes


def _state(motions: dict[str, Path], recordings: Sequence[Recording]) -> dict[str, Any]:
    one = stage("identify")
    depends = provenance(
        "identify",
        {recording.folder.name: parameters_of(one, recording) for recording in recordings},
        {name: sha256_of(path) for name, path in motions.items()},
    )
    depends["code"] = code_digest(one.sources)
    text = json.dumps(depends, sort_keys=True)
    return {**depends, "key": hashlib.sha256(text.encode()).hexdigest()}


def _not_one_rig(recordings: Sequence[Recording]) -> str | None:
    """What differs between recordings that a joint fit takes for the same disk in the same ring; None: nothing."""
    first = recordings[0]
    for other in recordings[1:]:
        for body, key in (("host", "inner_radius_m"), ("host", "polygon_m"), ("nes", "radius_m"), ("nes", "inertia_factor")):
            values = [getattr(one.bodies.get(body), key, None) for one in (first, other)]
            if values[0] != values[1]:
                return f"{body} {key} of {other.folder.name} differs from that of {first.folder.name}"
    return None
