"""What a results folder holds for the report: its tables, the calibration, and what can be computed at once
from them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.law_map import ErrorMap, error_map
from analysis.motion.bodies import INERTIA_OF_A_DISK
from analysis.motion.host_circle import host_circle
from analysis.motion.rotation import rotation
from analysis.thesis.impacts import method_of, smoothed_acceleration
from analysis.thesis.parameters import tangential_error, thesis_identification, usable
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.tables import read_provenance, read_table

TABLES = (
    "tracks",
    "points",
    "motion",
    "host_circle",
    "walls",
    "rotation",
    "flights",
    "impacts",
    "identification",
    "checks",
    "thesis_impacts",
    "accelerometers",
    "accelerations",
    "calibration_views",
    "lens_field",
    "lens_terms",
    "calibration_parameters",
    "calibration_lens",
    "calibration_spline",
    "calibration_corners",
    "calibration_boards",
    "calibration_image",
    "calibration_plane",
    "calibration_world",
    "calibration_next",
)


@dataclass
class Results:
    """One recording's results.

    ``tables`` holds those that exist; ``unreadable`` says what was wrong with others.  ``frames`` are grey
    images per camera, handed in by whoever can read them; ``notes`` are the identification's.
    """

    folder: Path
    recording: Recording
    tables: Mapping[str, pd.DataFrame]
    calibration: dict[str, Any] | None = None
    unreadable: Mapping[str, str] = field(default_factory=dict)
    frames: Mapping[str, NDArray[Any]] | None = None
    notes: tuple[str, ...] = ()

    def get(self, name: str) -> pd.DataFrame | None:
        """The table, None where there is none or it has no row."""
        table = self.tables.get(name)
        return table if table is not None and len(table) else None

    @cached_property
    def circles(self) -> pd.DataFrame | None:
        """The table, or computed from ``points`` where the stage did not write it."""
        stored, points = self.get("host_circle"), self.get("points")
        if stored is not None or points is None or len(self.markers("host")) < 3:
            return stored
        return host_circle(points, self.recording)

    @cached_property
    def rotation(self) -> pd.DataFrame | None:
        """The table, or computed from ``points`` where the stage did not write it; None without three NES markers."""
        stored, points, motion = self.get("rotation"), self.get("points"), self.get("motion")
        if stored is not None or points is None or motion is None or len(self.markers("nes")) < 3:
            return stored
        try:
            return rotation(points, motion, self.recording)
        except InputError:  # markers on one line: the section says that there is no triplet
            return None

    @cached_property
    def smooth(self) -> pd.DataFrame:
        """The thesis' smoothed acceleration of each frame (:func:`analysis.thesis.impacts.smoothed_acceleration`)."""
        return smoothed_acceleration(self.tables["motion"], method_of(self.recording))

    @property
    def thesis(self) -> pd.DataFrame | None:
        """The table of the thesis' impacts, as stage "analyse" wrote it."""
        return self.tables.get("thesis_impacts")

    @cached_property
    def thesis_parameters(self) -> pd.DataFrame | None:
        """Parameters by the thesis' method; None without its impacts."""
        if self.thesis is None:
            return None
        return thesis_identification(self.thesis, self.inertia_factor, method_of(self.recording).impacts)

    @cached_property
    def thesis_grid(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]] | None:
        """Mean capped J_t over (wall friction, tangential restitution) of the usable impacts; None without
        any.
        """
        if self.thesis is None:
            return None
        chosen = usable(self.thesis, method_of(self.recording).impacts)
        chosen = chosen[np.isfinite(chosen["tangential_speed_after_m_per_s"])]
        if not len(chosen):
            return None
        mu, beta = np.linspace(0, 0.4, 81), np.linspace(-1, 1, 81)
        eps = float(chosen["restitution"].mean())
        return mu, beta, np.minimum(tangential_error(chosen, mu, beta, eps, self.inertia_factor), 1.0).mean(0)

    @cached_property
    def joint_map(self) -> ErrorMap | None:
        """Joint likelihood of the impacts; None without a restitution."""
        impacts = self.get("impacts")
        eps = self.parameter("restitution")[0]
        if impacts is None or not np.isfinite(eps):
            return None
        return error_map(impacts, eps, self.inertia_factor)

    @cached_property
    def close_map(self) -> ErrorMap | None:
        """The joint map again on ever finer grids around its 90 % region, until it fills a fair part."""
        close, here = None, self.joint_map
        for _ in range(5):
            grids = None if here is None else here.close_up()
            if grids is None:
                break
            restitution = self.parameter("restitution")[0]
            close = here = error_map(self.tables["impacts"], restitution, self.inertia_factor, *grids)
        return close

    @property
    def inertia_factor(self) -> float:
        """q of the disk's moment of inertia q m R^2; that of a full disk where it is not given."""
        nes = self.recording.settings.bodies.nes
        return float(nes.inertia_factor) if nes is not None and nes.inertia_factor is not None else INERTIA_OF_A_DISK

    def markers(self, body: str) -> tuple[str, ...]:
        """Names of a body's markers."""
        found = self.recording.bodies.get(body)
        return tuple(found.markers or ()) if found is not None else ()

    def parameter(self, name: str) -> tuple[float, float, float, float]:
        """(value, sd, low, high) of an identified parameter, NaN where there is none."""
        table = self.get("identification")
        if table is None:
            return (np.nan,) * 4
        row = table[table["parameter"] == name]
        if not len(row):
            return (np.nan,) * 4
        value, sd, low, high = row.iloc[0][["value", "sd", "low", "high"]].astype(float)
        return value, sd, low, high

    def spans_s(self, *kinds: str) -> list[tuple[float, float]]:
        """Start and end of the segments of these kinds ("flight", "contact", ...) as the identification found
        them.
        """
        flights = self.get("flights")
        if flights is None:
            return []
        chosen = flights[flights["kind"].isin(kinds)]
        return list(zip(chosen["start_s"].astype(float), chosen["end_s"].astype(float), strict=True))

    @property
    def time_shares(self) -> dict[str, float]:
        """Share of the segmented time by kind of segment."""
        flights = self.get("flights")
        if flights is None:
            return {}
        length = (flights["end_s"] - flights["start_s"]).groupby(flights["kind"]).sum()
        return {str(kind): float(share) for kind, share in (length / length.sum()).items()}


def read_results(folder: Path, recording: Recording, frames: Mapping[str, NDArray[Any]] | None = None) -> Results:
    """Read whatever tables stand in ``folder``; one that cannot be read is named in ``unreadable`` and left
    out.

    A table that the recording itself brought (``tracks.parquet``, ``points.parquet``, ``motion.parquet`` in
    its folder) serves where the results hold none.
    """
    tables, unreadable = {}, {}
    for name in TABLES:
        path = next(
            (p for p in (folder / f"{name}.parquet", recording.folder / f"{name}.parquet") if p.is_file()),
            None,
        )
        if path is not None:
            try:
                tables[name] = read_table(path, name)
            except InputError as error:
                unreadable[name] = f"found {error.found}, expected {error.expected}"
    notes = identification_notes(folder / "identification.parquet")
    return Results(folder, recording, tables, _read_calibration(folder, recording), unreadable, frames, notes)


def identification_notes(path: Path) -> tuple[str, ...]:
    """What the identification said in words when it wrote its table: where data and model disagree, what is not
    determined.
    """
    provenance = read_provenance(path) if path.is_file() else None
    return tuple(str(note) for note in (provenance or {}).get("notes", ()))


def _read_calibration(folder: Path, recording: Recording) -> dict[str, Any] | None:
    candidates = [folder / "calibration.json"]
    if recording.calibration_file is not None:
        candidates.append(recording.calibration_file)
    for path in candidates:
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(content, dict) and isinstance(content.get("cameras"), list):
            return content
    return None
