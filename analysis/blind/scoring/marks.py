"""One case of a blind trial: what was true, what was answered, and how right that was."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from analysis.blind.causes.named import CAUSES
from analysis.blind.scoring.parameters import missed_above_limit, parameter_checks

# With a nominal model that has no friction at all, naming either or both is right.
EITHER = {"floor_friction": ("floor_friction", "spin_coupling")}


@dataclass(frozen=True)
class Truth:
    """What was made: the causes joined by + (``kind``) and the ``group`` that they are of (`group_of`), the severity of
    each (``sizes``), and the series."""

    case: str
    kind: str
    group: str
    sizes: dict[str, float]
    noise: str
    wall: str
    drive: str
    runs: int

    @property
    def size(self) -> float:
        """The largest severity; 1 where there is no cause."""
        return max(self.sizes.values(), default=1.0)

    @property
    def unlisted(self) -> bool:
        """Whether a cause in nobody's list is there."""
        return self.group in ("unknown", "beside")


@dataclass(frozen=True)
class Answer:
    """What `diagnosis.json` says, whether a ``law`` was written, and how many ``seconds`` it took (None: not known)."""

    verdict: str
    named: tuple[str, ...]
    equivalent: tuple[str, ...]
    stage: str | None
    law: bool
    shrinkage: float | None
    probabilities: dict[str, float]
    seconds: float | None

    @property
    def word(self) -> str:
        """The answer in a word: the cause named first, none or unknown."""
        return self.named[0] if self.named else self.verdict


@dataclass(frozen=True)
class Marks:
    """How right an answer is."""

    first_right: bool  # the (stronger) named cause is one of the true ones
    in_set: bool
    all_named: bool  # every listed cause named
    extra: tuple[str, ...]  # named, not true, and not said to be equivalent to a true one
    left_found: bool  # the verdict says that something is left, in the stage of an unlisted cause
    stage_right: bool
    parameters: tuple[dict[str, Any], ...]
    missed_above_limit: bool | None


@dataclass(frozen=True)
class Row:
    """One case."""

    truth: Truth
    answer: Answer
    marks: Marks

    @property
    def right(self) -> bool:
        """All there is to say was said, and nothing else: every listed cause and no other named, and whether something
        is left."""
        rest = self.marks.left_found if self.truth.unlisted else self.answer.verdict != "unknown"
        every = self.marks.all_named or self.truth.group in ("none", "unknown")
        return rest and not self.marks.extra and every

    def flat(self) -> dict[str, Any]:
        """The case for score.json."""
        return asdict(self.truth) | asdict(self.answer) | asdict(self.marks)


def group_of(truth: dict[str, Any]) -> str:
    """none; listed, pair or triple by the number of listed causes; unknown; beside: a listed and an unlisted one."""
    causes = _causes(truth)
    listed = [c for c in causes if CAUSES[c].listed]
    if len(listed) < len(causes):
        return "beside" if listed else "unknown"
    return ("none", "listed", "pair", "triple")[min(len(causes), 3)]


def _causes(truth: dict[str, Any]) -> list[str]:
    return [] if truth["effect"] == "none" else truth["effect"].split("+")


def mark(truth: dict[str, Any], answer: dict[str, Any], seconds: float | None = None) -> Row:
    """Compare one `diagnosis.json` with the truth of its case."""
    named = tuple(answer.get("effects") or ())
    said = Answer(
        verdict=answer["verdict"],
        named=named,
        equivalent=tuple(answer.get("equivalent") or ()) if named else (),
        stage=answer.get("stage"),
        law=bool(answer.get("laws")),
        shrinkage=(answer.get("gap") or {}).get("shrinkage"),
        probabilities={name: float(p) for name, p in (answer.get("probabilities") or {}).items()},
        seconds=seconds,
    )
    was = Truth(
        case=truth["case"],
        kind=truth["effect"],
        group=group_of(truth),
        sizes=truth["sizes"],
        noise=truth["noise"],
        wall=truth["world"]["wall"],
        drive=truth["world"]["drive"],
        runs=truth["runs"],
    )
    return Row(was, said, _marks(truth, answer, said))


def _marks(truth: dict[str, Any], answer: dict[str, Any], said: Answer) -> Marks:
    named, equivalent, stage = said.named, set(said.equivalent), said.stage
    right = [EITHER.get(name, (name,)) for name in truth["effects"]]
    true = {name for names in right for name in names}
    unlisted = {CAUSES[c].stage for c in _causes(truth) if not CAUSES[c].listed}
    left = {entry["stage"] for entry in answer.get("left") or ()} | ({stage} if not named else set())
    # A cause that these data cannot tell from a true one, and that is said to be so, is no error.
    extra = tuple(n for n in named if n not in true) if not equivalent & true or len(named) > len(right) else ()
    return Marks(
        first_right=bool(named) and any(named[0] in names for names in right),
        in_set=bool(right) and bool((set(named) | equivalent) & set(right[0])),
        all_named=bool(right) and all(set(n) & set(named) for n in right),
        extra=extra,
        left_found=said.verdict == "unknown" and bool(unlisted & left),
        stage_right=stage in truth["stages"] if truth["stages"] else stage is None,
        parameters=tuple(parameter_checks(truth, answer)),
        missed_above_limit=missed_above_limit(truth, answer) if truth["effects"] else None,
    )
