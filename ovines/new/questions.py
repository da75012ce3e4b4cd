"""`ovines new` at a terminal: each option that was left out is asked for, with the thesis' rig as the answer to
Enter.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any

from ovines.errors import InputError
from ovines.new.recording import Rig

NONE = "none"


@dataclass(frozen=True)
class Question:
    """One field of ``Rig``: what is asked, and how an answer is read (a ``ValueError`` asks again)."""

    field: str
    text: str
    read: Callable[[str], Any]


def _sensor(answer: str) -> tuple[int, int]:
    width, height = answer.lower().replace("x", " ").replace(",", " ").split()
    return int(width), int(height)


QUESTIONS = (
    Question("cameras", "Names of the cameras", lambda answer: tuple(answer.replace(",", " ").split())),
    Question("sensor_px", "Sensor of the cameras, width x height in pixels", _sensor),
    Question("rate_hz", "Frames per second", float),
    Question("images", "Ending of the images (png, tif ...) or of one video file per camera (avi, mp4 ...)", str),
    Question("calibration", "A solved calibration.json (none: solved from images of a board)", str),
    Question("board", "Board of the calibration images (a name of calibration_boards/, or a TOML file)", str),
    Question("host_radius_mm", "Inner radius of the Host in mm", float),
    Question("nes_radius_mm", "Radius of the NES in mm", float),
    Question("nes_mass_g", "Mass of the NES in g", float),
    Question("frequency_hz", "Frequency that the shaker is asked for, in Hz (none: not written)", float),
    Question("acceleration_g", "Acceleration that the shaker is asked for, in g (none: not written)", float),
)


@dataclass(frozen=True)
class Terminal:
    """``read_line(prompt)`` gives one answer (`input`), ``say(line)`` shows one (`print`)."""

    read_line: Callable[[str], str] = input
    say: Callable[[str], None] = print


def ask(rig: Rig, given: Collection[str], check: Callable[[Rig], None], terminal: Terminal) -> Rig:
    """The rig after every question whose field is not ``given``; an empty answer takes what stands in brackets.

    ``check(rig)`` raises ``InputError`` where no recording.toml may hold the answer: it is said, and the question asked
    again. ``rig`` passes ``check`` before: no answer could mend what was ``given``.
    """
    for question in QUESTIONS:
        if question.field in given or (question.field == "board" and rig.calibration is not None):
            continue
        if question.field == "acceleration_g" and rig.frequency_hz is None:
            continue
        while (answered := _answered(rig, question, given, check, terminal)) is None:
            pass
        rig = answered
    return rig


def _answered(
    rig: Rig, question: Question, given: Collection[str], check: Callable[[Rig], None], terminal: Terminal
) -> Rig | None:
    """The rig with one more answer; None when the answer was no good, which has been said."""
    usual = getattr(rig, question.field)
    answer = terminal.read_line(f"{question.text} [{_shown(usual)}]: ").strip()
    if not answer:
        return rig
    try:
        optional = getattr(Rig(), question.field) is None
        answered: dict[str, Any] = {
            question.field: None if optional and answer.lower() == NONE else question.read(answer)
        }
    except ValueError:
        terminal.say(f"  {answer!r} cannot be read; an example: {_shown(usual)}")
        return None
    rig = replace(rig, **answered)
    if question.field == "host_radius_mm" and "nes_radius_mm" not in given:
        rig = replace(
            rig, nes_radius_mm=min(rig.nes_radius_mm, 0.2 * rig.host_radius_mm)
        )  # asked for next: must fit meanwhile
    try:
        check(rig)
    except InputError as error:
        terminal.say(f"  {error.found}; expected {error.expected}")
        return None
    return rig


def _shown(value: Any) -> str:
    if value is None:
        return NONE
    if isinstance(value, tuple):
        return (" x " if isinstance(value[0], int) else " ").join(map(str, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
