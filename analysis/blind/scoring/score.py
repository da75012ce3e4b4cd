"""Marks for a blind trial: every figure that is claimed for the diagnosis, each with its interval."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from analysis.blind.causes.named import CAUSES
from analysis.blind.scoring.intervals import Figure, mean, proportion
from analysis.blind.scoring.parameters import missed_above_limit, parameter_checks

# FORMATS.md: with a nominal model that has no friction at all, naming either or both is right.
EITHER = {"floor_friction": ("floor_friction", "spin_coupling")}
LARGE = 1.0


@dataclass(frozen=True)
class Row:
    """One case: what was true, what was answered."""

    case: str
    kind: str
    group: str  # none, listed, pair, unknown
    size: float
    noise: str
    verdict: str
    named: tuple[str, ...]
    equivalent: tuple[str, ...]
    stage: str | None
    first_right: bool  # the (stronger) named cause is one of the true ones
    in_set: bool
    all_named: bool  # every true cause named
    stage_right: bool
    shrinkage: float | None
    seconds: float | None
    parameters: tuple[dict[str, Any], ...]
    missed_above_limit: bool | None

    @property
    def answered(self) -> str:
        """The answer in a word: the cause named first, none or unknown."""
        return self.named[0] if self.named else self.verdict


def group_of(truth: dict[str, Any]) -> str:
    """none, listed, pair or unknown."""
    causes = [] if truth["effect"] == "none" else truth["effect"].split("+")
    if not causes:
        return "none"
    if any(not CAUSES[c].listed for c in causes):
        return "unknown"
    return "pair" if len(causes) > 1 else "listed"


def mark(truth: dict[str, Any], answer: dict[str, Any], seconds: float | None = None) -> Row:
    """Compare one `diagnosis.json` with the truth of its case."""
    named = tuple(answer.get("effects") or ())
    equivalent = tuple(answer.get("equivalent") or ()) if named else ()
    right = [EITHER.get(name, (name,)) for name in truth["effects"]]
    told = set(named) | set(equivalent)
    stage = answer.get("stage")
    shrinkage = (answer.get("gap") or {}).get("shrinkage")
    return Row(
        truth["case"],
        truth["effect"],
        group_of(truth),
        truth["size"],
        truth["noise"],
        answer["verdict"],
        named,
        equivalent,
        stage,
        bool(named) and any(named[0] in names for names in right),
        bool(right) and bool(told & set(right[0])),
        bool(right) and all(set(n) & set(named) for n in right),
        stage in truth["stages"] if truth["stages"] else stage is None,
        shrinkage,
        seconds,
        tuple(parameter_checks(truth, answer)),
        missed_above_limit(truth, answer) if truth["effects"] else None,
    )


def figures_of(rows: list[Row], rng: np.random.Generator) -> list[Figure]:
    """All figures of the trial. The oracle (true cause, true parameters) shrinks the gap to the noise
    floor: 1."""
    listed = [r for r in rows if r.group == "listed"]
    large, small = [r for r in listed if r.size >= LARGE], [r for r in listed if r.size < LARGE]
    none, pairs = [r for r in rows if r.group == "none"], [r for r in rows if r.group == "pair"]
    unknown = [r for r in rows if r.group == "unknown"]
    found = [r for r in listed if r.first_right]
    checks = [check["inside"] for r in found for check in r.parameters]
    out = [
        proportion("cause named first, large size", [r.first_right for r in large], 0.95),
        proportion("cause named first, small size", [r.first_right for r in small], 0.85),
        proportion("truth in the set", [r.in_set for r in listed], 0.97),
        mean("causes in the set", [len(r.equivalent) for r in listed if r.equivalent], rng, 1.5, at_most=True),
        proportion("stage", [r.stage_right for r in listed], 0.97),
        proportion("second cause named where there is one", [len(r.named) > 1 for r in found]),
        proportion("false alarms", [r.verdict != "none" for r in none], 0.05, at_most=True),
    ]
    out += [
        proportion(
            f"false alarms, {noise} noise",
            [r.verdict != "none" for r in none if r.noise == noise],
            0.05,
            True,
        )
        for noise in ("white", "ar1", "warp")
    ]
    coverage = proportion("90 % intervals holding the true size", checks)
    if coverage.value is not None:
        coverage = Figure(**asdict(coverage) | {"goal": "0.85 to 0.95", "met": 0.85 <= coverage.value <= 0.95})
    shrunk = [r.shrinkage for r in found if r.shrinkage is not None]
    seconds = [r.seconds for r in rows if r.seconds is not None]
    return out + [
        proportion("unknown answered unknown", [r.verdict == "unknown" for r in unknown], 0.90),
        proportion(
            "missed though above the stated limit of detection",
            [r.missed_above_limit for r in listed if r.missed_above_limit is not None],
        ),
        proportion("unknown: stage", [r.stage_right for r in unknown]),
        proportion("unknown given a listed name", [r.verdict == "effect" for r in unknown]),
        proportion("both of two causes", [r.all_named for r in pairs], 0.80),
        proportion("first of two causes", [r.first_right for r in pairs]),
        coverage,
        proportion("causes found with an interval for their size", [bool(r.parameters) for r in found]),
        mean("shrinkage (oracle: 1)", shrunk, rng, 0.95),
        mean("seconds per series", seconds, rng, 60.0, at_most=True),
    ]


def per_cause(rows: list[Row], answers: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """One entry per cause: how often found at each size, shrinkage, and the smallest detectable size that
    the answers to
    series without effect state, beside the true sizes that were found and missed."""
    out = []
    for kind in sorted({r.kind for r in rows if r.group != "none"}):
        mine = [r for r in rows if r.kind == kind]
        right = {
            r.case: (
                r.verdict == "unknown" if r.group == "unknown" else r.all_named if r.group == "pair" else r.first_right
            )
            for r in mine
        }
        shrunk = [r.shrinkage for r in mine if r.first_right and r.shrinkage is not None]
        limits = [
            limit["size"]
            for r in rows
            if r.group == "none" and r.verdict == "none"
            for name, limit in (answers[r.case].get("detectable") or {}).items()
            if name == kind and limit.get("size") is not None
        ]
        checks = [c["inside"] for r in mine if r.first_right for c in r.parameters]
        out.append(
            {
                "kind": kind,
                "found": {
                    f"{size:g}": [
                        sum(right[r.case] for r in mine if r.size == size),
                        sum(r.size == size for r in mine),
                    ]
                    for size in sorted({r.size for r in mine}, reverse=True)
                },
                "answered": sorted(r.answered for r in mine if not right[r.case]),
                "shrinkage": float(np.mean(shrunk)) if shrunk else None,
                "coverage": [int(np.sum(checks)), len(checks)],
                "detectable": float(np.median(limits)) if limits else None,
            }
        )
    return out
