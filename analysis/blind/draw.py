"""What a trial's cases are: causes, sizes, noise, walls, drives and numbers of runs, drawn at random."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.blind.causes.groups import GROUPS
from analysis.blind.causes.named import CAUSES, may_stand_together
from analysis.blind.series import NOISE_KINDS
from ovines.errors import InputError

# Of a trial whose kinds are not said: how many causes a series has, and whether some are in nobody's list.
SHARES = {"none": 0.22, "listed": 0.28, "pair": 0.16, "triple": 0.1, "unknown": 0.04, "latest": 0.08, "beside": 0.12}
# Groups that are drawn from only where they are among the kinds, the later first.
ASKED_FOR = (
    "thinkable",
    "imaginable",
    "envisaged",
    "conjectured",
    "surmised",
    "presumed",
    "probable",
    "supposed",
    "expected",
    "likely",
    "borrowed",
    "foreseen",
    "witnessed",
    "refereed",
    "suspected",
    "reported",
    "overlooked",
    "plausible",
    "untold",
    "unexpected",
    "unsuspected",
    "undreamt",
    "unimagined",
    "unforeseen",
    "newest",
)
MADE_OF = {  # the pool that each of a series' causes is drawn from
    "none": (),
    "listed": ("listed",),
    "pair": ("listed", "listed"),
    "triple": ("listed", "listed", "listed"),
    "unknown": ("unknown",),
    "later": ("later",),
    "latest": ("latest",),
    **{group: (group,) for group in reversed(ASKED_FOR)},
    "beside": ("listed", "any unknown"),
}
POOLS = {
    **GROUPS,
    "listed": GROUPS["listed"] + GROUPS["further"],
    "unknown": GROUPS["unlisted"] + GROUPS["later"],
    "any unknown": GROUPS["unlisted"] + GROUPS["later"] + GROUPS["latest"],
}
SEVERITIES = (0.3, 1.2)  # 1: what an experimenter would notice
WALL_SHARES = {"round": 0.76, "triangle": 0.06, "square": 0.06, "cylinder": 0.12}
DRIVE_SHARES = {"sine": 0.65, "start_up": 0.07, "two_axes": 0.07, "two_lines": 0.07, "chirp": 0.07, "random": 0.07}
FULL_RUNS_SHARE, FEWEST_RUNS = 0.6, 3  # of the cases have as many runs as asked for; the others any number from three


@dataclass(frozen=True)
class Case:
    """One case of a trial; ``sizes``: one for each of ``causes``."""

    causes: tuple[str, ...]
    sizes: tuple[float, ...]
    noise: str
    runs: int
    wall: str = "round"
    drive: str = "sine"

    @property
    def kind(self) -> str:
        """ "none", or the causes joined by +."""
        return "+".join(self.causes) or "none"


def _dealt(shares: dict[str, float], count: int, rng: np.random.Generator) -> list[str]:
    """``count`` names, each as often as its share says to within one, in random order."""
    cumulated = np.round(np.concatenate([[0.0], np.cumsum(list(shares.values()))]) * count / sum(shares.values()))
    names = [name for name, n in zip(shares, np.diff(cumulated).astype(int), strict=True) for _ in range(n)]
    return [names[i] for i in rng.permutation(count)]


class _Decks:
    """Causes of each pool in turn: every one once before any twice."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.left: dict[str, list[str]] = {pool: [] for pool in POOLS}

    def draw(self, pool: str) -> str:
        """The next one of ``pool``."""
        if not self.left[pool]:
            self.left[pool] = [POOLS[pool][i] for i in self.rng.permutation(len(POOLS[pool]))]
        return self.left[pool].pop()

    def together(self, pools: tuple[str, ...], wall: str, drive: str) -> tuple[str, ...]:
        """One of each pool, which may stand together on that rig; those that may not go back under the deck,
        and a new deck under them, so that others come up."""
        while True:
            causes = tuple(self.draw(pool) for pool in pools)
            if may_stand_together(causes, wall, drive):
                return causes
            for pool, cause in zip(pools, causes, strict=True):
                fresh = [POOLS[pool][i] for i in self.rng.permutation(len(POOLS[pool]))]
                self.left[pool] = [*fresh, cause, *self.left[pool]]


def _pools(group: str, kinds: tuple[str, ...]) -> tuple[str, ...]:
    """What the causes of ``group`` are drawn from: beside a listed one stands one of the latest group that is asked
    for."""
    beside = next((pool for pool in ASKED_FOR if pool in kinds), "any unknown")
    return tuple(beside if pool == "any unknown" else pool for pool in MADE_OF[group])


def _refuse_strange(kinds: tuple[str, ...]) -> None:
    strange = [kind for kind in kinds if kind not in MADE_OF and not set(kind.split("+")) <= set(CAUSES)]
    if strange:
        raise InputError(
            f"kinds {', '.join(strange)}",
            f"{', '.join(MADE_OF)}, a cause's name, or several joined by +",
            f"choose among {', '.join(sorted(CAUSES))}",
        )


def draw_cases(
    count: int,
    rng: np.random.Generator,
    kinds: tuple[str, ...] = (),
    sizes: tuple[float, ...] = (),
    runs: int = 12,
) -> list[Case]:
    """``count`` cases in random order.

    Without ``kinds`` in the shares of ``SHARES``; with them as evenly as whole numbers allow.  ``sizes``: severities
    that take turns; without them they are drawn anew for every cause, evenly in their logarithm over ``SEVERITIES``.
    Walls, drives and numbers of runs are dealt in their shares, but for causes asked for by name: those are of a round
    wall, a sine and ``runs`` runs.  With groups of ``ASKED_FOR`` among the kinds the unlisted part of ``beside`` is one
    of the first of them that is, from the same deck: none comes twice before all have come.
    Noise kinds take turns within a kind of case.
    """
    _refuse_strange(kinds)
    groups = _dealt(dict.fromkeys(kinds, 1.0) if kinds else SHARES, count, rng)
    walls, drives = _dealt(WALL_SHARES, count, rng), _dealt(DRIVE_SHARES, count, rng)
    decks, turns = _Decks(rng), dict.fromkeys(groups, 0)
    first = int(rng.integers(len(NOISE_KINDS)))
    cases = []
    for group, wall, drive in zip(groups, walls, drives, strict=True):
        if group in MADE_OF:
            causes = decks.together(_pools(group, kinds), wall, drive)
        else:
            causes, wall, drive = tuple(group.split("+")), "round", "sine"
        turn, turns[group] = turns[group], turns[group] + 1
        drawn = np.exp(rng.uniform(np.log(SEVERITIES[0]), np.log(SEVERITIES[1]), len(causes)))
        severity = tuple(sizes[turn % len(sizes)] for _ in causes) if sizes else tuple(map(float, drawn))
        fewer = group in MADE_OF and rng.random() > FULL_RUNS_SHARE
        shots = int(rng.integers(min(FEWEST_RUNS, runs), runs + 1)) if fewer else runs
        noise = NOISE_KINDS[(first + (turn // len(sizes) if sizes else turn)) % len(NOISE_KINDS)]
        cases.append(Case(causes, severity, noise, shots, wall, drive))
    return cases
