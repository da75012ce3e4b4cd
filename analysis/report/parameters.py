"""The identified parameters by name: symbol, unit, words, and how well they are determined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.report.numbers import MISSING, interval, value_with_sd


@dataclass(frozen=True)
class Quantity:
    """What a parameter is called in a report; ``scale`` takes the stored SI value to ``unit``."""

    title: str
    symbol: str
    unit: str = ""
    scale: float = 1.0


QUANTITIES = {
    "restitution": Quantity("Restitution", "ε"),
    "restitution_scatter": Quantity("Scatter of the restitution", "σ(ε)"),
    "restitution_speed_slope_s_per_m": Quantity("Change of the restitution with normal speed", "dε/dv", "s/m"),
    "wall_friction": Quantity("Wall friction", "μ_c"),
    "tangential_restitution": Quantity("Tangential restitution", "β₀"),
    "floor_friction": Quantity("Floor friction", "μ_s"),
    "contact_radius_m": Quantity("Contact radius", "R_c", "mm", 1e3),
    "wall_turn_rad": Quantity("Wall turned against its layout", "", "mrad", 1e3),
    "cylinder_contact_radius_m": Quantity("Cylinder's contact radius", "", "mm", 1e3),
    "cylinder_centre_x_m": Quantity("Cylinder off the Host's centre, x", "", "µm", 1e6),
    "cylinder_centre_y_m": Quantity("Cylinder off the Host's centre, y", "", "µm", 1e6),
    "wall_centre_x_m": Quantity("Wall centre off its layout, x", "", "µm", 1e6),
    "wall_centre_y_m": Quantity("Wall centre off its layout, y", "", "µm", 1e6),
    "disk_centre_x_m": Quantity("Disk's middle off its centre of mass, x", "", "µm", 1e6),
    "disk_centre_y_m": Quantity("Disk's middle off its centre of mass, y", "", "µm", 1e6),
    "drive_frequency_hz": Quantity("Drive frequency", "f", "Hz"),
}
PRINCIPAL = ("restitution", "wall_friction", "tangential_restitution", "floor_friction")
_UNITS = (
    ("_m_per_s2", "m/s²"),
    ("_rad_per_s", "rad/s"),
    ("_m_per_s", "m/s"),
    ("_s_per_m", "s/m"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
)


def quantity(name: str) -> Quantity:
    """The known quantity, or one made of the name itself."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    if name.endswith("_contact_distance_m"):
        return Quantity(name.removesuffix("_m").replace("_", " ").capitalize(), "", "mm", 1e3)
    for suffix, unit in _UNITS:
        if name.endswith(suffix):
            return Quantity(name[: -len(suffix)].replace("_", " ").capitalize(), "", unit)
    return Quantity(name.replace("_", " ").capitalize(), "")


def state(row: pd.Series) -> str:
    """ "value" (determined), "bound" (an end of its interval only), or "open" (the data say nothing)."""
    if np.isfinite(row["value"]):
        return "value"
    return "bound" if np.isfinite(row["low"]) or np.isfinite(row["high"]) else "open"


def as_text(row: pd.Series) -> str:
    """The value with sd, a bound, or "not determined"."""
    what = quantity(row["parameter"])
    kind = state(row)
    if kind == "value":
        return value_with_sd(what.scale * row["value"], what.scale * row["sd"], what.unit)
    if kind == "bound":
        return interval(what.scale * row["low"], what.scale * row["high"], what.unit) + " (bound)"
    return "not determined"


def statement(row: pd.Series) -> str:
    """``Restitution ε = 0.732 ± 0.006``, or with a colon where there is only a bound or nothing."""
    what = quantity(row["parameter"])
    return f"{what.title} {what.symbol}{' =' if state(row) == 'value' else ':'} {as_text(row)}".replace("  ", " ")


def parameter_rows(identification: pd.DataFrame, thesis: pd.DataFrame | None) -> list[tuple[str, ...]]:
    """Rows for the table: quantity, symbol, value ± sd, 90 % interval, impacts, the thesis' value (±
    scatter).
    """
    order = {name: n for n, name in enumerate(PRINCIPAL)}
    table = identification.assign(rank=[order.get(name, len(order)) for name in identification["parameter"]])
    theirs = {} if thesis is None else {row["parameter"]: row for _, row in thesis.iterrows()}
    rows: list[tuple[str, ...]] = []
    for _, row in table.sort_values("rank", kind="stable").iterrows():
        what = quantity(row["parameter"])
        other = theirs.get(row["parameter"])
        rows.append(
            (
                what.title,
                what.symbol,
                as_text(row),
                interval(what.scale * row["low"], what.scale * row["high"], what.unit),
                MISSING if pd.isna(row["n_impacts"]) else str(int(row["n_impacts"])),
                MISSING
                if other is None
                else value_with_sd(what.scale * other["value"], what.scale * other["sd"], what.unit),
            )
        )
    return rows


def paragraph(identification: pd.DataFrame) -> str:
    """One paragraph in words: what was determined and how surely, what is only bounded, what the data leave
    open.
    """
    sentences = []
    for name in PRINCIPAL:
        chosen = identification[identification["parameter"] == name]
        if not len(chosen):
            continue
        row = chosen.iloc[0]
        what, kind = quantity(name), state(row)
        impacts = (
            ""
            if pd.isna(row["n_impacts"])
            else f" from {int(row['n_impacts'])} impact{'' if row['n_impacts'] == 1 else 's'}"
        )
        if kind == "value":
            relative = abs(row["sd"] / row["value"]) if row["value"] else np.nan
            surely = (
                ""
                if not np.isfinite(relative)
                else " to better than 1 %"
                if relative < 0.01
                else f" to about {100 * relative:.0f} %"
                if relative < 0.5
                else ", poorly"
            )
            sentences.append(f"{what.title} {what.symbol} = {as_text(row)} is determined{surely}{impacts}.")
        elif kind == "bound":
            sentences.append(
                f"{what.title} {what.symbol} is only bounded, "
                f"{interval(row['low'], row['high'], what.unit)}{impacts}: "
                f"{_WHY.get(name, 'the data do not close the interval')}."
            )
        else:
            sentences.append(
                f"{what.title} {what.symbol} is not determined by this recording: "
                f"{_WHY.get(name, 'nothing in it depends on it enough')}."
            )
    return " ".join(sentences)


_WHY = {
    "wall_friction": "an impact informs it only where the NES slides along the wall, at oblique incidence",
    "tangential_restitution": "an impact informs it only where the NES sticks to the wall, at steep incidence",
    "restitution": "it takes impacts fast enough to stand out of the noise",
    "floor_friction": "it takes flights long enough for the floor to brake the NES",
}
