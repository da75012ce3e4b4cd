"""Marks for a blind trial: every figure that is claimed for the diagnosis, each with its interval."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from analysis.blind.causes.named import CAUSES
from analysis.blind.scoring.intervals import Figure, mean, proportion
from analysis.blind.scoring.parameters import missed_above_limit, parameter_checks

# With a nominal model that has no friction at all, naming either or both is right.
EITHER = {"floor_friction": ("floor_friction", "spin_coupling")}
LARGE = 0.7  # severities from here on are called large; 1 is what an experimenter would notice
NOISES = ("white", "ar1", "warp")


@dataclass(frozen=True)
class Row:
    """One case: what was true, what was answered."""

    case: str
    kind: str
    group: str  # of `group_of`
    sizes: dict[str, float]  # severity of each cause
    noise: str
    wall: str
    drive: str
    runs: int
    verdict: str
    named: tuple[str, ...]
    equivalent: tuple[str, ...]
    stage: str | None
    first_right: bool  # the (stronger) named cause is one of the true ones
    in_set: bool
    all_named: bool  # every listed cause named
    extra: tuple[str, ...]  # named, not true, and not said to be equivalent to a true one
    left_told: bool  # the verdict says that something is left, in the stage of an unlisted cause
    stage_right: bool
    law: bool  # a law was written
    shrinkage: float | None
    seconds: float | None
    probabilities: dict[str, float]
    parameters: tuple[dict[str, Any], ...]
    missed_above_limit: bool | None

    @property
    def size(self) -> float:
        """The largest severity; 1 where there is no cause."""
        return max(self.sizes.values(), default=1.0)

    @property
    def answered(self) -> str:
        """The answer in a word: the cause named first, none or unknown."""
        return self.named[0] if self.named else self.verdict

    @property
    def right(self) -> bool:
        """All there is to say was said, and nothing else: every listed cause and no other named, and whether something
        is left."""
        unlisted = self.group in ("unknown", "beside")
        told = self.left_told if unlisted else self.verdict != "unknown"
        return told and not self.extra and (self.all_named or self.group in ("none", "unknown"))


def group_of(truth: dict[str, Any]) -> str:
    """none; listed, pair or triple by the number of listed causes; unknown; beside: a listed and an unlisted one."""
    causes = [] if truth["effect"] == "none" else truth["effect"].split("+")
    listed = [c for c in causes if CAUSES[c].listed]
    if len(listed) < len(causes):
        return "beside" if listed else "unknown"
    return ("none", "listed", "pair", "triple")[min(len(causes), 3)]


def mark(truth: dict[str, Any], answer: dict[str, Any], seconds: float | None = None) -> Row:
    """Compare one `diagnosis.json` with the truth of its case."""
    named = tuple(answer.get("effects") or ())
    equivalent = tuple(answer.get("equivalent") or ()) if named else ()
    right = [EITHER.get(name, (name,)) for name in truth["effects"]]
    true = {name for names in right for name in names}
    told = set(named) | set(equivalent)
    stage = answer.get("stage")
    causes = [] if truth["effect"] == "none" else truth["effect"].split("+")
    unlisted = {CAUSES[c].stage for c in causes if not CAUSES[c].listed}
    left = {entry["stage"] for entry in answer.get("left") or ()} | ({stage} if not named else set())
    # A cause that these data cannot tell from a true one, and that is said to be so, is no error.
    extra = tuple(n for n in named if n not in true) if not (set(equivalent) & true) or len(named) > len(right) else ()
    return Row(
        case=truth["case"],
        kind=truth["effect"],
        group=group_of(truth),
        sizes=truth["sizes"],
        noise=truth["noise"],
        wall=truth["world"]["wall"],
        drive=truth["world"]["drive"],
        runs=truth["runs"],
        verdict=answer["verdict"],
        named=named,
        equivalent=equivalent,
        stage=stage,
        first_right=bool(named) and any(named[0] in names for names in right),
        in_set=bool(right) and bool(told & set(right[0])),
        all_named=bool(right) and all(set(n) & set(named) for n in right),
        extra=extra,
        left_told=answer["verdict"] == "unknown" and bool(unlisted & left),
        stage_right=stage in truth["stages"] if truth["stages"] else stage is None,
        law=bool(answer.get("laws")),
        shrinkage=(answer.get("gap") or {}).get("shrinkage"),
        seconds=seconds,
        probabilities={name: float(p) for name, p in (answer.get("probabilities") or {}).items()},
        parameters=tuple(parameter_checks(truth, answer)),
        missed_above_limit=missed_above_limit(truth, answer) if truth["effects"] else None,
    )


def figures_of(rows: list[Row], rng: np.random.Generator) -> list[Figure]:
    """All figures of the trial. The oracle (true cause, true parameters) shrinks the gap to the noise
    floor: 1."""
    by = {g: [r for r in rows if r.group == g] for g in ("none", "listed", "pair", "triple", "unknown", "beside")}
    listed, none = by["listed"], by["none"]
    large, small = [r for r in listed if r.size >= LARGE], [r for r in listed if r.size < LARGE]
    left = by["unknown"] + by["beside"]
    found = [r for r in listed if r.first_right]
    return [
        proportion("right in every point", [r.right for r in rows]),
        proportion("cause named first, large size", [r.first_right for r in large], 0.97),
        proportion("cause named first, small size", [r.first_right for r in small], 0.97),
        proportion("truth in the set", [r.in_set for r in listed], 0.97),
        mean("causes in the set", [len(r.equivalent) for r in listed if r.equivalent], rng, 1.5, at_most=True),
        proportion("stage", [r.stage_right for r in listed], 0.97),
        proportion("a further cause named beside the true one", [bool(r.extra) for r in listed]),
        proportion("false alarms", [r.verdict != "none" for r in none], 0.03, at_most=True),
        *(
            proportion(f"false alarms, {n} noise", [r.verdict != "none" for r in none if r.noise == n], 0.03, True)
            for n in NOISES
        ),
        proportion("two causes: both named", [r.all_named for r in by["pair"]], 0.95),
        proportion("two causes: nothing else said", [r.right for r in by["pair"] if r.all_named]),
        proportion("three causes: all named", [r.all_named for r in by["triple"]], 0.80),
        proportion("three causes: nothing else said", [r.right for r in by["triple"] if r.all_named]),
        proportion("unlisted cause: answered unknown", [r.verdict == "unknown" for r in by["unknown"]], 0.95),
        proportion("unlisted cause: in the right stage", [r.left_told for r in by["unknown"]]),
        proportion("unlisted cause: given a listed name", [r.verdict == "effect" for r in by["unknown"]]),
        proportion("listed beside unlisted: the listed one named", [r.all_named for r in by["beside"]]),
        proportion("listed beside unlisted: the rest told, in the right stage", [r.left_told for r in by["beside"]]),
        proportion("listed beside unlisted: both", [r.all_named and r.left_told for r in by["beside"]], 0.8),
        proportion("unlisted cause: a law written", [r.law for r in left]),
        proportion("a law where there is nothing unlisted", [r.law for r in rows if r not in left], 0.05, at_most=True),
        _coverage([c["inside"] for r in rows for c in r.parameters if c["cause"] in r.named]),
        proportion("causes found with an interval for their size", [bool(r.parameters) for r in found]),
        proportion(
            "missed though above the stated limit of detection",
            [r.missed_above_limit for r in listed if r.missed_above_limit is not None],
        ),
        mean("shrinkage, one cause (oracle: 1)", _shrunk(found), rng, 0.95),
        mean("shrinkage, several listed causes (oracle: 1)", _shrunk(by["pair"] + by["triple"]), rng),
        mean("seconds per series", [r.seconds for r in rows if r.seconds is not None], rng, 60.0, at_most=True),
    ]


def oracle_figure(shares: list[float], rng: np.random.Generator) -> Figure:
    """What the named effects close of what an oracle closes, of cases whose causes all lie in the flights."""
    return mean("flights: closed of what an oracle closes", shares, rng, 0.95)


def _shrunk(rows: list[Row]) -> list[float]:
    return [r.shrinkage for r in rows if r.shrinkage is not None]


def _coverage(checks: list[bool]) -> Figure:
    figure = proportion("90 % intervals holding the true size", checks)
    if figure.value is None:
        return figure
    return Figure(**asdict(figure) | {"goal": "0.85 to 0.95", "met": 0.85 <= figure.value <= 0.95})


def per_cause(rows: list[Row], answers: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """One entry per cause: how often it was answered rightly when large and when small, alone and beside others, what
    it was taken for, its intervals, and the smallest detectable size that the answers to series without effect state.

    A listed cause is answered rightly when it is named, an unlisted one when something is said to be left in its stage.
    """
    out = []
    for cause in sorted({name for r in rows for name in r.sizes}):
        mine = [r for r in rows if cause in r.sizes]
        right = {
            r.case: bool(set(EITHER.get(cause, (cause,))) & set(r.named)) if CAUSES[cause].listed else r.left_told
            for r in mine
        }
        sizes = {
            "large": [r for r in mine if r.sizes[cause] >= LARGE],
            "small": [r for r in mine if r.sizes[cause] < LARGE],
        }
        alone = [r for r in mine if len(r.sizes) == 1]
        limits = [
            limit["size"]
            for r in rows
            if r.group == "none" and r.verdict == "none"
            for name, limit in (answers[r.case].get("detectable") or {}).items()
            if name == cause and limit.get("size") is not None
        ]
        checks = [c["inside"] for r in mine for c in r.parameters if c["cause"] == cause and right[r.case]]
        shrunk = _shrunk([r for r in alone if right[r.case]])
        out.append(
            {
                "cause": cause,
                "found": {name: [sum(right[r.case] for r in some), len(some)] for name, some in sizes.items() if some},
                "alone": [sum(right[r.case] for r in alone), len(alone)],
                "answered": sorted(r.answered for r in alone if not right[r.case]),
                "shrinkage": float(np.mean(shrunk)) if shrunk else None,
                "coverage": [int(np.sum(checks)), len(checks)],
                "detectable": float(np.median(limits)) if limits else None,
            }
        )
    return out
