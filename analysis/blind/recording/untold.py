"""What the causes of `causes.untold` do to the pictures and to their times."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.recording.views import ViewErrors

SHOCK_M_PER_S = 1.0  # change of the disk's velocity in a blow after which a trigger is late by `shocked_s`
SHOCK_S = 0.04  # in which it recovers: most of a flight
BLOCK_PX = 8.0  # side of the blocks that a film is coded in
CARD_S = 0.03  # in which a card on soft glue comes to rest on its disk


def shocked_s(time_s: Floats, impact_s: Floats, kicks: Floats, errors: ViewErrors) -> Floats:
    """How late the second camera is (n,) at `time_s` (n,): each blow shakes its trigger's worn relay, which then closes
    late and recovers.

    By `shocked_s` (|kick| / `SHOCK_M_PER_S`) exp(-since / `SHOCK_S`), of the last blow before: of those at `impact_s`
    (k,) with the disk's changes of velocity `kicks` (k, 2).
    """
    late = np.zeros(len(time_s))
    if errors.shocked_s == 0.0:
        return late
    for instant, kick in zip(impact_s, np.hypot(*kicks.T), strict=True):
        since = np.maximum(time_s - instant, 0.0)
        late = np.where(time_s >= instant, kick * np.exp(-since / SHOCK_S), late)
    return errors.shocked_s / SHOCK_M_PER_S * late


def blocked(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a film that was coded in blocks, too coarsely: in both cameras all markers are
    drawn to the middles of their blocks, by `blocked_px` sin(2 pi pixel / `BLOCK_PX`) along each side."""
    if errors.blocked_px == 0.0:
        return pixels
    return pixels - errors.blocked_px * np.sin(2.0 * np.pi * pixels / BLOCK_PX)


def carded(nes: Floats, time_s: Floats, blows: Floats, errors: ViewErrors) -> Floats:
    """Poses (n, 4: x, y, z, angle) of the card with the disk's markers, at `time_s` (n,), where those of the disk are
    `nes`: on its soft glue it stays back in a blow that changes the spin, and swings about the disk's middle.

    By -`card_s` times the change of spin exp(-since / `CARD_S`) sin(2 pi `card_hz` since), the sum over the blows
    before; `blows` (k, 2): their times and changes of spin (rad/s).
    """
    if errors.card_s == 0.0:
        return nes
    out = nes.copy()
    for instant, change in blows:
        since = np.maximum(time_s - instant, 0.0)
        swing = np.exp(-since / CARD_S) * np.sin(2.0 * np.pi * errors.card_hz * since)
        out[:, 3] -= errors.card_s * change * swing
    return out
