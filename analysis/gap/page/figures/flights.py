"""Flights: the acceleration that a model still lacks, piece by piece of flight, against whatever it may go with."""

from __future__ import annotations

import numpy as np

from analysis.gap.ladder import Ladder
from analysis.gap.page.figures.panels import Panel
from analysis.gap.selection.flights.missing_acceleration import (
    CIRCULAR,
    LONG,
    SHORT,
    missing_acceleration,
    residual_frames,
)
from ovines.core.effects import EFFECTS

# What shows a term without a name; effects say it themselves.  (component, covariate): columns of
# :func:`analysis.gap.selection.flights.missing_acceleration.missing_acceleration`.
VIEWS: dict[str, tuple[tuple[str, str], ...]] = {
    "pull towards the Host's centre": (("outwards", "radius"), ("swirl", "radius")),
    "pull towards the room's origin": (("x", "x in the room"), ("y", "y in the room")),
    "pull growing with the cube of the radius": (("outwards", "radius"), ("swirl", "radius")),
    "pull of constant strength towards the centre": (("outwards", "radius"), ("swirl", "radius")),
    "swirl about the Host's centre": (("swirl", "radius"), ("outwards", "radius")),
    "saddle-shaped force in the Host": (("x", "x in the Host"), ("y", "y in the Host")),
    "saddle-shaped force in the room": (("x", "x in the room"), ("y", "y in the room")),
    "force across the path with the spin (omega x v)": (
        ("across the path", "spin times speed"),
        ("across the path", "spin of the disk"),
    ),
    "force across the path": (("across the path", "speed"), ("across the path", "spin of the disk")),
    "decay of the spin": (("spin", "spin of the disk"), ("spin", "time in the run")),
    "constant torque": (("spin", "time in the run"), ("spin", "spin of the disk")),
    "friction that follows the radius": (("along sliding", "radius"), ("along sliding", "sliding speed")),
    "friction that follows the place in the Host": (
        ("along sliding", "x in the Host"),
        ("along sliding", "y in the Host"),
    ),
    "friction that follows the place in the room": (
        ("along sliding", "x in the room"),
        ("along sliding", "y in the room"),
    ),
    "friction that follows the sliding speed": (
        ("along sliding", "sliding speed"),
        ("along sliding", "time in the run"),
    ),
    "friction that follows the direction of sliding": (
        ("along sliding", "direction of sliding"),
        ("along sliding", "sliding speed"),
    ),
    "friction that follows the drive's phase": (("along sliding", "drive phase"), ("x", "drive phase")),
    "friction that follows the time since the impact before": (
        ("along sliding", "time since the impact before"),
        ("along sliding", "sliding speed"),
    ),
    "pull near the wall": (("outwards", "radius"), ("swirl", "radius")),
    "drag against the Host": (("along sliding", "sliding speed"), ("along the path", "speed")),
    "force with the drive's phase": (("x", "drive phase"), ("y", "drive phase")),
}
OTHERS = (
    ("along sliding", "sliding speed"),
    ("along sliding", "time in the run"),
    ("outwards", "radius"),
    ("x", "drive phase"),
    ("across the path", "spin times speed"),
    ("spin", "spin of the disk"),
    ("x", "x in the room"),
    ("y", "y in the room"),
)
UNITS = {
    "sliding speed": "m/s",
    "speed": "m/s",
    "time in the run": "s",
    "radius": "mm",
    "drive phase": "°",
    "spin of the disk": "rad/s",
    "spin times speed": "m/s²",
    "x in the room": "mm",
    "y in the room": "mm",
    "x in the Host": "mm",
    "y in the Host": "mm",
    "direction of sliding": "°",
    "vertical acceleration of the Host": "m/s²",
    "run": "number",
    "rim over sliding speed": "1",
    "time since the impact before": "ms",
}
QUICK = ("drive phase", "vertical acceleration of the Host", "time since the impact before")


def flight_views(name: str) -> tuple[tuple[str, str], ...]:
    """Components and covariates for a finding's name, then what a sceptic would look at besides; six at most."""
    own = EFFECTS[name].views if name in EFFECTS else VIEWS.get(name, ())
    return tuple(dict.fromkeys((*own, *OTHERS)))[:6]


def flight_panels(ladder: Ladder, name: str) -> list[Panel]:
    """Panels for a finding: acceleration that the flights ask for beyond the model, recalibrated and with the
    effect.
    """
    runs = ladder.series.runs
    after = residual_frames(runs, ladder.flights.fitted)
    before = after if ladder.flights.nominal is ladder.flights.fitted else residual_frames(runs, ladder.flights.nominal)
    tables = {
        frames: (missing_acceleration(before, frames), missing_acceleration(after, frames)) for frames in (LONG, SHORT)
    }
    panels = []
    for component, covariate in flight_views(name):
        a, b = tables[SHORT if covariate in QUICK else LONG]
        if min(len(a), len(b)) < 5 or a[component].notna().sum() < 5 or not np.ptp(a[covariate].dropna()) > 1e-9:
            continue
        unit = "rad/s²" if component == "spin" else "m/s²"
        panels.append(
            Panel(
                a[covariate].to_numpy(),
                a[component].to_numpy(),
                b[covariate].to_numpy(),
                b[component].to_numpy(),
                f"{covariate} ({UNITS[covariate]})",
                f"{component} ({unit})",
                covariate in CIRCULAR,
            )
        )
    return panels
