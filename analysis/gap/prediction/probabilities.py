"""How likely each effect is there at more than its negligible size, and how likely something is left, each by itself.

Before the data an effect is absent with :data:`ABSENT`, else of any size from a tenth to a hundred times negligible,
every decade alike.  What the data say of its size is its estimate with the sd that noise and the runs' disagreement
give.  Effects that these data cannot tell apart share theirs as their held-out gains say, and so do an effect and a
formula in its place that nobody has listed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.prediction.detectable import Entry

# One effect in five is there before anything is measured: a bench has one or two of the library's twenty, and more
# where somebody asks.
ABSENT = 0.8
# Taken as if four in five causes that nobody listed left a p below 0.01: 0.01 to this power is 0.8.
SHAPE_LEFT = 0.05
_SIZES = np.geomspace(0.1, 100.0, 301)


def probability_of(size: float, sd: float, negligible: float) -> float:
    """Probability that an effect estimated at ``size`` with ``sd`` is larger than ``negligible`` (same unit)."""
    if not (np.isfinite(size) and np.isfinite(sd) and negligible > 0):
        return 1 - ABSENT
    sizes = np.concatenate([[0.0], _SIZES * negligible, [abs(size)]])
    prior = np.concatenate([[ABSENT], np.full(len(_SIZES), (1 - ABSENT) / len(_SIZES)), [0.0]])
    if abs(size) > sizes[-2]:
        prior[-1] = prior[-2]
    # Never surer than a hundredth of the size: the scale of effects is known no better.
    z = (abs(size) - sizes) / max(sd, 1e-2 * abs(size), 1e-300)
    log = np.where(prior > 0, -0.5 * z**2, -np.inf)
    weight = prior * np.exp(log - log.max())
    return float(weight[sizes > negligible].sum() / weight.sum())


def against(probability: float, held_out: float) -> float:
    """``probability`` once runs that an effect was not learnt from say that they are better without it: ``held_out``,
    their fall of -2 log L, is negative then; a factor of e^5 at the most."""
    weight = float(np.exp(0.5 * np.clip(held_out, -10.0, 0.0)))
    return probability * weight / (probability * weight + 1 - probability)


def probability_of_left(p: float, seen: float) -> float:
    """Probability that something is left, when chance makes what is seen look so with probability ``p``, and of what
    may be left this series shows the share ``seen`` (:mod:`analysis.gap.prediction.power`).

    Where it shows, ``p`` is beta distributed with :data:`SHAPE_LEFT` (Sellke, Bayarri and Berger 2001), else it is that
    of chance."""
    evidence = seen * SHAPE_LEFT * max(p, 1e-300) ** (SHAPE_LEFT - 1) + 1 - seen
    return float(evidence / (evidence + ABSENT / (1 - ABSENT)))


def probabilities(
    ladder: Ladder,
    causes: Sequence[Cause],
    detectable: dict[str, Entry],
    seen: float,
    by_chance: Sequence[float] = (),
) -> dict[str, float]:
    """By effect, and ``none`` and ``unknown``; ``seen``: the share of what may be left that this series shows,
    ``by_chance``: how often chance would find laws as good as those that were written for it."""
    out: dict[str, float] = {}
    unlisted, nothing = 0.0, 1.0  # a formula in the place of a name; none of the causes
    for cause in causes:
        sd = cause.strength / np.sqrt(max(cause.gain, 1.0))
        rivals = {g.term.name: g.held_out for g in ladder.flights.gains} | {
            g.name: g.gain for g in ladder.impacts.gains
        }
        whole = probability_of(cause.strength, sd, 1.0)
        best = rivals.get(cause.effect, 0.0)
        weights = {cause.effect: 1.0} | {
            r: float(np.exp(0.5 * min(rivals.get(r, best) - best, 0.0))) for r in cause.rivals
        }
        # The best of hundreds says somewhat more by chance: as likely as the name, not likelier, until it replaces it.
        other = 0.0 if cause.instead is None else float(np.exp(0.5 * min(cause.instead.more, 0.0)))
        total = sum(weights.values()) + other
        for name, weight in weights.items():
            out[name] = max(out.get(name, 0.0), whole * weight / total)
        unlisted, nothing = max(unlisted, whole * other / total), nothing * (1 - whole)
    clear = {g.term.name: (g.significance, g.held_out) for g in ladder.flights.left}
    clear |= {g.name: (g.significance, 0.0) for g in ladder.impacts.left}
    known = set(out)
    for effect, entry in detectable.items():
        if effect not in out and entry["measured"] is not None:
            size, sd = entry["measured"], entry["measured_sd"]
            runs_say, held_out = clear.get(effect, (0.0, 0.0))
            if runs_say > 0:  # its estimate scatters from run to run by more than the noise alone makes it
                sd = max(sd, abs(size) / runs_say)
            out[effect] = against(probability_of(size, sd, entry["size"]), held_out)
        elif effect not in out:
            out[effect] = probability_of(0.0, entry["size"] / 5, entry["size"])
    p = min([ladder.left_p, *by_chance])
    left = probability_of_left(p, seen)
    beside = [1 - min(probability, 1.0) for name, probability in out.items() if name not in known]
    none = float(nothing * np.prod(beside) * (1 - left))
    out |= {"unknown": max(left, unlisted), "none": none}
    return {name: float(round(p, 4)) for name, p in out.items()}
