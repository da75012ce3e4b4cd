"""Every candidate for what a camera or a clock may do - shift, zoom, turn or delay times functions of time, of the
share of a run, of the run, of the drive's phase, of the Host's motion and of the blow before - and for where a marker
may go on its body: besides, with what its body does.

What is constant is not here: a window's place and a camera's delay are effects of the library, a picture that is bent
in all frames alike is found by the lens fields (:mod:`analysis.gap.laws.frames.changed_pictures`)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.frames.bodies.markers import TARGETS, MarkerRows
from analysis.gap.laws.frames.delay import TARGET as DELAY
from analysis.gap.laws.frames.delay import delay_candidates
from analysis.gap.laws.frames.evidence.rows import FrameRows, Key, size_of
from analysis.gap.laws.frames.forms.by_run import shifts_by_run
from analysis.gap.laws.frames.forms.followed import (
    after_blows,
    settled,
    struck_rim,
    times,
    with_disk,
    with_host,
    with_spin,
)
from analysis.gap.laws.frames.forms.making import followed
from analysis.gap.laws.frames.forms.rates import best_rates
from analysis.gap.laws.frames.forms.steps import best_steps
from ovines.core.laws.targets import PICTURE
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
WORDS = {
    "picture_u": "picture along u", "picture_v": "picture along v", "picture_zoom": "zoom", "picture_turn": "turn",
    "camera_delay": "delay of a camera", "clock_delay": "delay of all cameras",
    "nes_picture_u": "picture of the NES along u", "nes_picture_v": "picture of the NES along v",
    "host_marker": "marker on the Host", "nes_marker": "marker on the NES",
}  # fmt: skip


def frame_candidates(rows: FrameRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for the targets that the rows answer."""
    known = rows.known
    out: list[Candidate] = []
    for key in rows.units:
        make = partial(_term, key)
        out += settled(WORDS[key[0]], make, known)
        out += after_blows(WORDS[key[0]], make, known, counted=key[0] in PICTURE)
        if key[0] == DELAY:
            out += delay_candidates(known, key[1])
        if key[0] in PICTURE:  # what hangs on the shaker's frame is shaken by its reaction, whatever the drive
            out += with_host(WORDS[key[0]], make, known)
            out += with_disk(WORDS[key[0]], make, known)
    for camera in sorted({key[1] for key in rows.units if key[0] == "picture_u"}):
        out += shifts_by_run(known, camera)
    units = {WORDS[key[0]]: (partial(_term, key), unit[:, None]) for key, unit in rows.units.items()}
    steps = best_steps({word: make for word, (make, _) in units.items()}, rows, rng)
    return [*out, *steps, *best_rates(units, rows, rng)]


def disk_candidates(rows: FrameRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for what a view does to the disk alone: what goes with its angle as it turns, its spin, its
    velocity, the blow before, and what swings in time."""
    keys = tuple(rows.units)

    def make(*factors: Factor) -> tuple[Term, ...]:
        return tuple(term for key in keys for term in _term(key, *factors))

    follows = partial(followed, "picture of the NES", make)
    out = [follows(f"with its angle, order {order:g}", *waves("angle", order)) for order in (1.0, 2.0)]
    out += [follows("with its spin", Factor("spin")), follows("with its speed", Factor("speed"))]
    out.append(follows("with its velocity", *ways("velocity_along")))
    units = {WORDS[key[0]]: (partial(_term, key), unit[:, None]) for key, unit in rows.units.items()}
    out += after_blows("picture of the NES", make, rows.known)
    return [*out, *best_rates(units, rows, rng)]


def marker_candidates(rows: MarkerRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for a marker that moves on its body: what a camera may follow, and what its body does."""
    make, word = partial(_both_ways, rows.key), WORDS[rows.key[0]]
    follows = partial(followed, word, make)
    out = [*settled(word, make, rows.known), *after_blows(word, make, rows.known)]
    if rows.key[0] == TARGETS["nes"]:
        out += with_spin(word, make, rows.known)
        out += [follows(f"with the angle, order {order:g}", *waves("angle", order)) for order in (1.0, 2.0)]
        for power in (1.0, 2.0):
            blown = times(waves("heading"), Factor("speed", order=power))
            out.append(follows(f"by the air, speed to the power {power:g}", *blown))
        out += struck_rim(word, make)
    else:
        out += with_host(word, make, rows.known)
    return [*out, *best_steps({word: make}, rows, rng), *best_rates({word: (make, rows.unit)}, rows, rng)]


def _term(key: Key, *factors: Factor) -> tuple[Term, ...]:
    return (Term(key[0], 1.0, factors, x=float(key[1])),)


def _both_ways(key: Key, *factors: Factor) -> tuple[Term, ...]:
    """Of a marker along two directions."""
    return tuple(Term(key[0], 1.0, factors, float(key[1]), way_rad) for way_rad in (0.0, QUARTER))


def moved_rms(rows: FrameRows, terms: Sequence[Term], coefficients: Array) -> dict[Key, float]:
    """RMS over all frames of what the terms do to each target of a camera."""
    size = size_of(terms, rows.known)
    out: dict[Key, float] = {}
    for key in rows.units:
        own = [j for j, term in enumerate(terms) if (term.target, int(term.x)) == key]
        if own:
            given = size[:, own] @ coefficients[own]
            out[key] = float(np.std(given))
    return out
