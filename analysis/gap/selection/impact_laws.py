"""The restitution's terms by forward selection, and probes of every law of the contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import Law, LawData
from analysis.contact.restitution import fit_effects
from analysis.gap.cause import Cause, Structure
from analysis.gap.selection.impacts.gain import ImpactGain, mattering, negligible_share, negligible_size
from analysis.gap.selection.impacts.restitution import kept_gain, restitution_gains
from analysis.gap.selection.impacts.tangential import tangential_gains
from analysis.gap.selection.null_distribution import by_chance, chance_of_largest, threshold
from analysis.gap.thresholds import EQUIVALENT, IMPACT_GAIN, OVERRIDES, SIGNIFICANCE

Array = NDArray[np.float64]

# Terms of the restitution at the most.
MOST_TERMS = 6
#: coordinate that each residual of the law is one of
COORDINATES = {"restitution": "normal", "sliding": "tangential", "sticking": "tangential", "angular": "spin"}


class HasLaw(Protocol):
    """Impacts and the nominal law fitted to them, wherever they come from."""

    @property
    def data(self) -> LawData:
        """The impacts."""

    @property
    def law(self) -> Law:
        """The law."""


def select_laws(
    base: HasLaw,
    held: Sequence[str],
    finite: bool,
    withheld: frozenset[str],
    null_distribution: Array,
    surely: Sequence[str] = (),
) -> tuple[list[Cause], list[str], list[ImpactGain], list[ImpactGain], list[ImpactGain], list[Structure]]:
    """Restitution's terms, named or not, by forward selection with a look back; then probes in tangential and angular
    law.

    A probe that explains clearly more than any name stays in the model as structure, and names are judged beside it:
    they must say as much as where contacts last, for a probe has not its cause's form, and leaves a part of it.
    ``surely``: names that something else has shown already."""
    names, added = [*held, *(name for name in surely if name not in held)], dict[str, tuple[str, ...]]()
    least = threshold(null_distribution, IMPACT_GAIN)
    structure: list[ImpactGain] = []
    first: list[ImpactGain] = []
    found: list[ImpactGain] = []
    for _ in range(MOST_TERMS):
        found = restitution_gains(base.data, names, withheld, _columns(structure))
        first = first or [g for g in found if g.named]
        open_ = [
            g
            for g in found
            if g.name not in {s.name for s in structure}
            and law_accepted(g, least, base.data, finite or (g.named and bool(structure)))
        ]
        best = max((g for g in open_ if g.named), key=lambda g: g.gain, default=None)
        probe = max((g for g in open_ if not g.named), key=lambda g: g.gain, default=None)
        if best is None or (probe is not None and probe.gain > best.gain + OVERRIDES):
            if probe is None:
                break
            structure.append(probe)
            names = [
                n
                for n in names
                if n in (*held, *surely)
                or law_accepted(_kept(base, names, n, structure), least, base.data, must_say_more=True)
            ]
        else:
            names.append(best.name)
            added[best.name] = rivals_of(best, found)
    causes = [
        replace(
            _restitution_cause(_kept(base, names, name, structure), base, names, structure, finite),
            rivals=added.get(name, ()),
        )
        for name in names
        if name not in held
    ]
    # A contact that lasts has a tangential spring: Luding's stick or slide no longer holds, and its residuals prove
    # nothing.
    tangential = [] if finite else tangential_gains(base.data, base.law)
    probes = [g for g in (*found, *tangential) if not g.named]
    for residual in COORDINATES:
        accepted = [p for p in tangential if p.residual == residual and law_accepted(p, least, base.data, finite)]
        structure += sorted(accepted, key=lambda p: -p.gain)[:1]
    return (
        causes,
        names,
        first,
        [g for g in found if g.named],
        probes,
        [_law_structure(s, base.data, null_distribution, len(tangential), finite) for s in structure],
    )


def _law_structure(gain: ImpactGain, data: LawData, null_distribution: Array, tried: int, lasts: bool) -> Structure:
    chance = (
        by_chance(null_distribution, gain.gain)
        if gain.residual == "restitution"
        else chance_of_largest(gain.gain, len(gain.estimate), tried)
    )
    strength = gain.size / negligible_size(gain.residual, data, lasts)
    unit = "m/s" if gain.residual == "angular" else "1"
    return Structure(
        "impact",
        "impact",
        COORDINATES[gain.residual],
        gain.name,
        strength,
        gain.gain,
        gain.size,
        unit,
        chance,
        matters=1.0 if gain.residual == "angular" else mattering(lasts),
    )


def _columns(structure: Sequence[ImpactGain]) -> Array | None:
    columns = [s.columns for s in structure if s.columns is not None]
    return np.column_stack(columns) if columns else None


def _kept(base: HasLaw, names: Sequence[str], name: str, structure: Sequence[ImpactGain]) -> ImpactGain:
    return kept_gain(base.data, names, name, _columns(structure))


def law_accepted(gain: ImpactGain, least: float, data: LawData, must_say_more: bool) -> bool:
    """``least``: gain that chance does not reach; ``must_say_more``: where contacts last, and of a name beside a
    structure or a law, either of which leaves a part of its cause."""
    surely = gain.gain > least and gain.significance > SIGNIFICANCE - 1
    return surely and gain.size > negligible_size(gain.residual, data, must_say_more)


def _restitution_cause(
    gain: ImpactGain, base: HasLaw, names: Sequence[str], structure: Sequence[ImpactGain], lasts: bool
) -> Cause:
    parameters = fit_effects(base.data, names, {}, _columns(structure)).sizes[gain.name]
    strength = gain.size / negligible_share("restitution", lasts)
    return Cause(gain.name, "impact", parameters, strength, gain.gain, "normal", "impact", matters=mattering(lasts))


def rivals_of(best: ImpactGain, candidates: Sequence[ImpactGain]) -> tuple[str, ...]:
    """Named effects that explain the same residual as well."""
    return tuple(g.name for g in candidates if g.named and g.name != best.name and best.gain - g.gain < EQUIVALENT)
