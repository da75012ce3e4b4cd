"""The next test by hand: of an effect, of what has no name, and of nothing."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.cause import (
    BENT,
    BESIDE,
    BY_BOARDS,
    CLOCKS,
    EACH_BLOW,
    EACH_RUN,
    EXCHANGED,
    HELD_BY_MORE,
    IN_PICTURE,
    NONE_TESTED,
    OWN_WAY,
    SEEN_HOST,
    THAN_STATED,
    TILTING_HOST,
)
from ovines.core.effects import EFFECTS
from ovines.core.effects.effect import Words

# A wall that is elsewhere than stated is no effect: the simulator takes the radius that it is given.
STATED_RADIUS = Words(
    "Stated radius of the wall",
    "the wall is nearer or farther than recording.toml says",
    "Measure the wall's inner width and the disk's diameter with calipers, and write them into recording.toml.",
)
#: where something lies, by its stage
PLACES = {
    "measurement": "the measurement",
    "flight": "free flight",
    "impact": "the impacts",
    "geometry": "the shape of wall or disk",
    "drive": "the drive",
}
NONE_TEST = (
    "Nothing to separate. To see smaller effects: longer runs, a higher level (faster impacts), or launches with "
    "spin; the table of "
    "detectable sizes says what would have been seen."
)
UNTIL_DONE = "Until that is done, its law corrects these recordings (`ovines diagnose --law`)."
FILM_BOARDS = (
    "The structure goes with {goes_with}. Film the boards once more, with the camera as it is, and diagnose with that "
    "calibration: nothing of it is left then. "
)


@dataclass(frozen=True, kw_only=True)
class Rule:
    """The test by hand for structure that goes with what ``equals``, ``begins``, ``ends`` and ``holds`` some words, in
    every respect that is given; ``by_hand`` says ``{goes_with}`` and ``{place}``."""

    equals: str | None = None
    begins: str = ""
    ends: str | tuple[str, ...] = ""
    holds: str = ""
    by_hand: str

    def is_for(self, goes_with: str) -> bool:
        """Whether this is a test for what goes with that."""
        return (
            self.equals in (None, goes_with)
            and goes_with.startswith(self.begins)
            and goes_with.endswith(self.ends)
            and self.holds in goes_with
        )


#: what a structure goes with and the test for it: the first that is for it; the last is for all
RULES = (
    Rule(
        equals=EACH_RUN,
        by_hand="The structure lies in {place}, and each run has its own, in no order. Note what is done between runs "
        "(wiping, touching, taking apart, warming up). Record one setting twice with nothing done in between, then "
        "twice with one of these: what makes the difference is its cause.",
    ),
    Rule(
        begins=IN_PICTURE,
        ends=BENT,
        by_hand=FILM_BOARDS + "The field that was learnt has taken it out as far as markers tell: not what shifts, "
        "tilts or scales all of them, so do not trust a tilt, a scale or a window found here.",
    ),
    Rule(begins=IN_PICTURE, by_hand=FILM_BOARDS + UNTIL_DONE),
    Rule(
        equals=EACH_BLOW,
        by_hand="The wall's friction is another one at each blow. Clean wall and rim, record a run at once and one "
        "after a hundred blows, and diagnose both: what dirt does comes back, what the surfaces do stays.",
    ),
    Rule(
        equals=HELD_BY_MORE,
        by_hand="The wall holds by more than it slips with. Pull the disk along the wall by a thread with a spring "
        "balance: the force at which it starts, over the one at which it goes on, is the share found. Do not use the "
        "wall friction until that is in the model: it lies between the two.",
    ),
    Rule(
        begins=EXCHANGED,
        by_hand="Two markers have each other's name: {goes_with}. Their views meet only with the names exchanged. "
        "Exchange them in tracks.parquet for these frames, or track again with `ovines track`, and diagnose once more: "
        "nothing of it is left then. Motion and impacts are measured without these markers there.",
    ),
    Rule(
        begins=OWN_WAY,
        by_hand="Every marker is seen behind where it is on its own way, as by a tracker that follows late. Track the "
        "frames again with `ovines track`, or without smoothing and prediction, and diagnose once more: nothing of it "
        "is left then. " + UNTIL_DONE,
    ),
    Rule(
        begins=BESIDE,
        by_hand="Places at blows hold something of the frames beside them: the tracks were smoothed, or the tracker "
        "goes on from the frames before. Track the frames again with `ovines track`, or bring tracks that nothing has "
        "smoothed, and diagnose once more: nothing of it is left then. " + UNTIL_DONE,
    ),
    Rule(
        ends=CLOCKS,
        by_hand="The frames' times are wrong. What is wrong goes with {goes_with}. Compare the files' times and frame "
        "numbers with the cameras' own counters or time stamps: a step of a frame is one that was skipped, a time that "
        "alternates or swings comes from the trigger. With true times in the tracks nothing of it is left. "
        + UNTIL_DONE,
    ),
    Rule(
        ends=SEEN_HOST,
        by_hand="All markers of the Host are seen beside where the wall tells that it is. What is wrong goes with "
        "{goes_with}. Press against the plate or the posts that carry them and look what gives: pads, tape, a screw. "
        "Glue the markers to the ring itself, or fix their plate, and diagnose once more: nothing of it is left then. "
        + UNTIL_DONE,
    ),
    Rule(
        ends=TILTING_HOST,
        by_hand="The structure goes with {goes_with}. They rise on one side and sink on the other. "
        "Put a finger on each edge of their plate while the shaker runs, and a marker on the shaker's own table, low "
        "beside the ring: if that tilts alike, the table nods, and guides or a lower mass mend it; if not, the plate's "
        "spacers give. " + UNTIL_DONE,
    ),
    Rule(
        holds=THAN_STATED,
        by_hand="The structure is {goes_with}. Measure where the markers lie on the body, and how high (a calliper, a "
        "scan), and write that into layout_m: nothing of it is left then. The markers' places are learnt from the "
        "recordings, so motion and impacts hardly depend on it.",
    ),
    Rule(
        begins=BY_BOARDS,
        by_hand="The structure goes with {goes_with}. Measure the board's squares along both sides and lay a straight "
        "edge on it. Calibrate on one that is true, and diagnose with that calibration: nothing of it is left then. "
        + UNTIL_DONE,
    ),
    Rule(
        begins=NONE_TESTED,
        holds="one after the other",
        by_hand="Some flights that follow on each other miss by more than their noise. Look into the recordings at "
        "these times (figure of the flights): a knock against the table, a cable, a marker that was covered. Record "
        "the series once more without it.",
    ),
    Rule(
        begins=NONE_TESTED,
        by_hand="The structure lies in {place} and goes with nothing that was tested. Turn Host, ring or disk by 90 "
        "degrees, one at a time, and repeat the diagnosis: what turns with one of them lies on it.",
    ),
    Rule(
        by_hand="The structure lies in {place} and goes with {goes_with}. Change that alone in two recordings (twice "
        "as much, half as much; or turn Host, ring or disk by 90 degrees) and repeat the diagnosis: what follows the "
        "change is its cause.",
    ),
)


def words_of(effect: str) -> Words | None:
    """How a cause is spoken of; None of a name that nobody has words for."""
    if effect == "stated_radius":
        return STATED_RADIUS
    return EFFECTS[effect].words if effect in EFFECTS else None


def test_by_hand(effect: str) -> str:
    """The test that shows a cause apart from everything else."""
    words = words_of(effect)
    assert words is not None, f"{effect}: a cause is an effect of the library"
    return words.by_hand


def unknown_test(stage: str, goes_with: str) -> str:
    """The next test where structure has no name: change what it goes with, keep the rest."""
    rule = next(rule for rule in RULES if rule.is_for(goes_with))
    return rule.by_hand.format(goes_with=goes_with, place=PLACES[stage])
