"""What has become of cameras since, or by, their calibration, given by its form and a few numbers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ovines.camera.bends import CHANGES, DECENTRING, PERIODS_RAD, RADIAL, SKEW, STRETCH, TURN, ZOOM
from ovines.camera.boards import BOARD_BOW, BOARD_STRETCH, BOARDS

Array = NDArray[np.float64]
WORDS = {
    ZOOM: "it is larger or smaller", TURN: "it is turned", STRETCH: "it is longer one way than the other",
    RADIAL: "its radial distortion: a lens that was focused anew", DECENTRING: "a lens that sits off its axis",
    SKEW: "it is skewed: its columns lean",
    BOARD_STRETCH: "a print that is longer one way than the other", BOARD_BOW: "a plate that was bowed",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class PictureChange:
    """The picture of ``camera`` is off by ``value`` of what ``target`` names, along ``direction_rad`` where it has one;
    or those of all cameras, by boards that were not true (``camera`` is empty), a bow about ``place_m``.

    ``sd``, ``direction_sd_rad``, ``place_sd_m``; ``size_px`` RMS over where markers went; ``log_odds``: natural
    logarithm of how much likelier the recordings are with it than with smooth fields alone; squares that all changes
    of a series take off each run (R,) beside a smooth field, as it asks for itself: ``before``, and what is left of
    them by changes learnt from the other runs: ``after``."""

    camera: str
    target: str
    value: float
    sd: float
    direction_rad: float = 0.0
    direction_sd_rad: float = 0.0
    size_px: float = 0.0
    log_odds: float = 0.0
    before: Array = field(default_factory=lambda: np.zeros(0))
    after: Array = field(default_factory=lambda: np.zeros(0))
    place_m: tuple[float, float] = (0.0, 0.0)
    place_sd_m: tuple[float, float] = (0.0, 0.0)

    @property
    def words(self) -> str:
        """What has happened, for people."""
        return WORDS[self.target]

    @property
    def where(self) -> str:
        """The camera, or the boards that all cameras were calibrated on."""
        return self.camera or "the calibration boards"

    @property
    def own_numbers(self) -> dict[str, tuple[float, float]]:
        """What the target has beside its size, with sds: a direction, a place, or nothing."""
        if self.target == BOARD_BOW:
            return {f"{axis}_m": (self.place_m[k], self.place_sd_m[k]) for k, axis in enumerate("xy")}
        if self.target in PERIODS_RAD or self.target == BOARD_STRETCH:
            return {"direction_rad": (self.direction_rad, self.direction_sd_rad)}
        return {}


def number_tried(cameras: int) -> int:
    """How many forms are tried for a pair of cameras."""
    return len(CHANGES) * cameras + len(BOARDS)
