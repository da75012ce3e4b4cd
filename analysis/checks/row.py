"""A row of the table ``checks``, and the words that its checks share."""

from __future__ import annotations

from typing import NamedTuple

PRINCIPAL = ("restitution", "wall_friction", "tangential_restitution", "floor_friction")
LAW = "restitution,wall_friction,tangential_restitution"
ALL = ",".join(PRINCIPAL)
COLUMNS = ("check", "value", "limit", "state", "found", "parameters", "do")
DIAGNOSE = "Run `ovines diagnose` on the series: it looks for the cause"


class Row(NamedTuple):
    """``check``: what is held against what; ``value`` against its ``limit``; ``state`` "holds", "fails", "open" (cannot
    be decided); what was ``found`` in words; ``parameters`` not to use (comma between them) and what to ``do``, both
    only where it fails.
    """

    check: str
    value: float
    limit: float
    state: str
    found: str
    parameters: str
    do: str


def figure(value: float) -> str:
    """Two digits, without a power of ten where a reader would not write one."""
    return f"{value:.0f}" if 100 <= abs(value) < 1e6 else f"{value:.2g}"


def row(
    check: str, value: float, limit: float, holds: bool | None, found: str, parameters: str = "", do: str = ""
) -> Row:
    """A check that ``holds``, fails, or (None) cannot be decided."""
    if holds is None:
        return Row(check, value, limit, "open", found, "", "")
    return (
        Row(check, value, limit, "holds", found, "", "")
        if holds
        else Row(check, value, limit, "fails", found, parameters, do)
    )
