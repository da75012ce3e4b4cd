"""Where the markers are in the room: glued with errors, slipped, on a tab, on a card, with play, flung; and found where
the bodies blur."""

from dataclasses import dataclass, replace

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.plant.host import HOST_M_PER_S2, host_pose
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.views import DISK, GROUND_M, HOST, HOST_M, NES_M

FLUNG_RAD_PER_S = 40.0  # spin at which a loose sticker stands out half the way
RISEN_S = 0.05  # in which a disk that a blow has lifted comes down again: a flight
PLAY_RAD_PER_S = 2.0  # change of spin in a blow that throws a card with play to three quarters of it
BOARD_M = 0.05  # from the world's origin to where a bowed board is off by what its cause says: at the Host's markers
TOUCH_M_PER_S = 0.3  # approach of an impact that is a mere touch and moves no sticker
SHEARED_S = 0.015  # in which glue that a blow has sheared comes back by two thirds: a part of a flight
CARD_S = 0.03  # in which a card on soft glue comes to rest on its disk


@dataclass(frozen=True)
class Poses:
    """What one camera sees, frame by frame: `nes` (n, 4) middle x, y, z, angle; `host` (n, 4) x, y,
    rotation, z."""

    nes: np.ndarray
    host: np.ndarray


@dataclass(frozen=True)
class Marks:
    """Where the markers really sit: design layouts and placement errors, in each body's frame (n, 3)."""

    host_m: np.ndarray
    nes_m: np.ndarray


def draw_marks(centre_offset_m: tuple[float, float], rng: np.random.Generator, placement_sd_m: float = 3e-5) -> Marks:
    """Markers glued with 0.03 mm; the centre marker is where it should be, but for its own offset."""
    host, nes = HOST_M.copy(), NES_M.copy()
    host[:, :2] += rng.normal(0.0, placement_sd_m, (4, 2))
    nes[1:, :2] += rng.normal(0.0, placement_sd_m, (4, 2))
    nes[0, :2] += centre_offset_m
    return Marks(host, nes)


def _turned(layout_m: np.ndarray, angle_rad: np.ndarray, centre_m: np.ndarray) -> np.ndarray:
    cosine, sine = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    x, y = layout_m[:, 0], layout_m[:, 1]
    return np.stack(
        [
            centre_m[:, :1] + cosine * x - sine * y,
            centre_m[:, 1:2] + sine * x + cosine * y,
            np.broadcast_to(centre_m[:, 2:3] + layout_m[:, 2], (len(angle_rad), len(layout_m))),
        ],
        axis=-1,
    )


def world_points(
    nes: np.ndarray, host: np.ndarray, marks: Marks, errors: ViewErrors, bent_m: np.ndarray | float = 0.0
) -> np.ndarray:
    """Points (frames, 12, 3) in the calibration's world. `nes` (n, 4): middle x, y, z and angle; `host` (n,
    4): x, y, rotation, z; `bent_m` (n, 2): how far the Host's marker on a tab is off."""
    frames = len(nes)
    ground = np.broadcast_to(GROUND_M, (frames, 3, 3))
    host_points = _turned(marks.host_m, host[:, 2], host[:, [0, 1, 3]])
    host_points[:, errors.tab_marker, :2] += bent_m
    layout = leaning(marks.nes_m, errors)
    nes_points = _turned(layout, nes[:, 3], nes[:, :3])
    if errors.slipped_m != (0.0, 0.0):
        elsewhere = layout.copy()
        elsewhere[2, :2] += errors.slipped_m
        later = np.arange(frames) >= frames // 2
        nes_points[later] = _turned(elsewhere, nes[:, 3], nes[:, :3])[later]
    points = np.concatenate([ground, host_points, nes_points], axis=1)
    a, b = errors.plane_rad
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return errors.scale * points @ (about_y @ about_x).T


def on_the_board(points_m: Floats, errors: ViewErrors) -> Floats:
    """Points (frames, markers, 3) as a board measures them whose print or whose plate is not true.

    Its printer has stretched it along one direction: places along `board_rad` are too large by `board_stretch`.
    It is bowed: places are too far from the world's origin by the share `board_bow` (r / `BOARD_M`)^2.
    """
    if errors.board_stretch == 0.0 and errors.board_bow == 0.0:
        return points_m
    out, place = points_m.copy(), points_m[..., :2]
    along = np.array([np.cos(errors.board_rad), np.sin(errors.board_rad)])
    out[..., :2] += errors.board_stretch * (place @ along)[..., None] * along
    out[..., :2] += errors.board_bow * np.sum((place / BOARD_M) ** 2, axis=-1, keepdims=True) * place
    return out


def leaning(nes_m: Floats, errors: ViewErrors) -> Floats:
    """The disk's markers (n, 3, in the disk) on a card that was not pressed on evenly: each stands higher by
    `card_lean_rad` times its place along `card_rad`; and all on a thick one, higher by `raised_m`."""
    if errors.card_lean_rad == 0.0 and errors.raised_m == 0.0:
        return nes_m
    out = nes_m.copy()
    out[:, 2] += errors.card_lean_rad * nes_m[:, :2] @ np.array([np.cos(errors.card_rad), np.sin(errors.card_rad)])
    out[:, 2] += errors.raised_m
    return out


def papered(marks: Marks, run: int, errors: ViewErrors) -> Marks:
    """The markers in `run` where the Host's are printed on one sheet of paper, which swells in damp air: farther from
    its middle by the share `paper`, the run's own."""
    if not errors.paper:
        return marks
    wider = np.array([1.0 + errors.paper[run], 1.0 + errors.paper[run], 1.0])
    return replace(marks, host_m=marks.host_m * wider)


def printed(marks: Marks, errors: ViewErrors) -> Marks:
    """The markers of a printer that stretches its sheets along their feed, which lies along x of disk and Host: x is
    larger by the share `print_stretch`; and the disk's own as printed in another size, farther from its middle by the
    share `print_scale`."""
    if errors.print_stretch == 0.0 and errors.print_scale == 0.0:
        return marks
    longer, larger = 1.0 + errors.print_stretch, 1.0 + errors.print_scale
    host_m, nes_m = np.array([longer, 1.0, 1.0]), np.array([longer * larger, larger, 1.0])
    return Marks(marks.host_m * host_m, marks.nes_m * nes_m)


def padded(points_m: Floats, time_s: Floats, lines: Floats, errors: ViewErrors) -> Floats:
    """Points (frames, markers, 3) at `time_s` (frames,) where the Host's markers are on soft pads and all stay back, by
    the acceleration of its `lines` (m, 7): `pads_m` at `HOST_M_PER_S2`."""
    if errors.pads_m == 0.0:
        return points_m
    out, pull = points_m.copy(), np.array([host_pose(t, lines)[2][:2] for t in time_s])
    out[:, HOST, :2] -= errors.pads_m * pull[:, None] / HOST_M_PER_S2
    return out


def pitched(points_m: Floats, host: Floats, time_s: Floats, lines: Floats, errors: ViewErrors) -> Floats:
    """Points (frames, markers, 3) at `time_s` (frames,) where the Host's top plate pitches on its soft spacers, and the
    floor below it does not: its markers rise by `pitched_rad` times their place along x from its middle (x, y of `host`
    (frames, 4)), at `HOST_M_PER_S2` of its acceleration along x, of its `lines` (m, 7)."""
    if errors.pitched_rad == 0.0:
        return points_m
    out, pull = points_m.copy(), np.array([host_pose(t, lines)[2][0] for t in time_s]) / HOST_M_PER_S2
    out[:, HOST, 2] += errors.pitched_rad * pull[:, None] * (points_m[:, HOST, 0] - host[:, :1])
    return out


def lifted(nes: Floats, time_s: Floats, errors: ViewErrors) -> Floats:
    """Poses (n, 4: x, y, z, angle) of a card with the disk's markers, at `time_s` (n,), where those of the disk are
    `nes`: it comes off its glue in the course of each run and is pressed on before the next, higher by `peeled_m` times
    the share of the run that has passed."""
    if errors.peeled_m == 0.0:
        return nes
    out = nes.copy()
    out[:, 2] += errors.peeled_m * np.clip(time_s / time_s[-1], 0.0, 1.0)
    return out


def slid(points_m: Floats, angle_rad: Floats, time_s: Floats, errors: ViewErrors) -> Floats:
    """Points (frames, markers, 3) where one sticker of the disk slides on its soft glue, always the same way on it, and
    is put right between the runs: by `sliding_m_per_s` (x, y in the disk, whose angle is `angle_rad`) times the time
    `time_s` in the run."""
    if errors.sliding_m_per_s == (0.0, 0.0):
        return points_m
    c, s, (x, y), out = np.cos(angle_rad), np.sin(angle_rad), errors.sliding_m_per_s, points_m.copy()
    way = np.maximum(time_s, 0.0)[:, None] * np.column_stack([c * x - s * y, s * x + c * y])
    out[:, DISK[errors.sliding_marker], :2] += way
    return out


def bent_m(time_s: np.ndarray, lines: Floats, errors: ViewErrors) -> np.ndarray:
    """How far the Host's marker on a tab stays back (n, 2) at `time_s` (n,), by the acceleration of its `lines` (m, 7):
    `tab_m` at `HOST_M_PER_S2`."""
    if errors.tab_m == 0.0:
        return np.zeros((len(time_s), 2))
    pull = np.array([host_pose(t, lines)[2][:2] for t in time_s])
    return -errors.tab_m * pull / HOST_M_PER_S2


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


def played(nes: Floats, time_s: Floats, blows: Floats, errors: ViewErrors) -> Floats:
    """Poses (n, 4: x, y, z, angle) of a card with the disk's markers that has play on its pin, at `time_s` (n,), where
    those of the disk are `nes`: a blow that changes the spin leaves it at the stop that the disk runs into.

    From the last blow before on it lies turned by -`card_play_rad` tanh(change of spin / `PLAY_RAD_PER_S`), before any
    not at all; `blows` (k, 2): their times and changes of spin (rad/s).
    """
    if errors.card_play_rad == 0.0:
        return nes
    out, side = nes.copy(), np.zeros(len(time_s))
    for instant, change in blows:
        side = np.where(time_s >= instant, -np.tanh(change / PLAY_RAD_PER_S), side)
    out[:, 3] += errors.card_play_rad * side
    return out


def misread(nes: Floats, errors: ViewErrors) -> Floats:
    """Poses (n, 4: x, y, z, angle) of the disk's markers, printed around another point than their own middle as an
    encoder's scale may be, where those of the disk are `nes`: turned by `reading_rad` sin(angle - `reading_at_rad`)."""
    if errors.reading_rad == 0.0:
        return nes
    out = nes.copy()
    out[:, 3] += errors.reading_rad * np.sin(nes[:, 3] - errors.reading_at_rad)
    return out


def risen(nes: Floats, time_s: Floats, impact_s: Floats, kicks: Floats, errors: ViewErrors) -> Floats:
    """Poses (n, 4: x, y, z, angle) of the disk's markers, at `time_s` (n,), where those of the disk on its floor are
    `nes`: a blow lifts it, and two cameras that look askew see its markers shifted, each to its own side.

    Higher by `risen_s` |kick| exp(-since / `RISEN_S`), of the last blow before: of those at `impact_s` (k,) with the
    disk's changes of velocity `kicks` (k, 2).
    """
    if errors.risen_s == 0.0:
        return nes
    out, high = nes.copy(), np.zeros(len(time_s))
    for instant, kick in zip(impact_s, np.hypot(*kicks.T), strict=True):
        since = np.maximum(time_s - instant, 0.0)
        high = np.where(time_s >= instant, kick * np.exp(-since / RISEN_S), high)
    out[:, 2] += errors.risen_s * high
    return out


def sheared(nes: Floats, time_s: Floats, impact_s: Floats, kicks: Floats, errors: ViewErrors) -> Floats:
    """Poses (n, 4: x, y, z, angle) of a card with the disk's markers, at `time_s` (n,), where those of the disk are
    `nes`: a blow shears the tough glue below it, and the card stays back until that has crept back.

    By -`sheared_s` kick exp(-since / `SHEARED_S`), the sum over the blows before: those at `impact_s` (k,) with the
    disk's changes of velocity `kicks` (k, 2).
    """
    if errors.sheared_s == 0.0:
        return nes
    out = nes.copy()
    for instant, kick in zip(impact_s, kicks, strict=True):
        left = np.where(time_s >= instant, np.exp(-np.maximum(time_s - instant, 0.0) / SHEARED_S), 0.0)
        out[:, :2] -= errors.sheared_s * left[:, None] * kick
    return out


def smeared(points_m: Floats, time_s: Floats, errors: ViewErrors) -> Floats:
    """Points (frames, markers, 3) where markers are found that move while the shutter is open: their smear is fainter
    towards its head, and the longer the fainter, so that they are found behind by `smear_s2_per_m` times the square of
    their speed, along their own way in the room."""
    if errors.smear_s2_per_m == 0.0:
        return points_m
    rate, out = np.gradient(points_m[..., :2], time_s, axis=0), points_m.copy()
    out[..., :2] -= errors.smear_s2_per_m * np.hypot(rate[..., 0], rate[..., 1])[..., None] * rate
    return out


def flung(points_m: np.ndarray, angle_rad: np.ndarray, time_s: np.ndarray, errors: ViewErrors) -> np.ndarray:
    """Points (frames, markers, 3) where one sticker of the disk has come loose and is flung outwards as it spins.

    It stands off by `flung_m` w^2 / (w^2 + `FLUNG_RAD_PER_S`^2), away from the middle one; w is the rate of the disk's
    `angle_rad` (frames,) at `time_s` (frames,).
    """
    if errors.flung_m == 0.0:
        return points_m
    square, out, loose = np.gradient(angle_rad, time_s) ** 2, points_m.copy(), DISK[errors.flung_marker]
    away = points_m[:, loose, :2] - points_m[:, DISK[0], :2]
    away /= np.hypot(*away.T)[:, None]
    out[:, loose, :2] += (errors.flung_m * square / (square + FLUNG_RAD_PER_S**2))[:, None] * away
    return out


def crept(points_m: Floats, angle_rad: Floats, time_s: Floats, impacts: Floats, errors: ViewErrors) -> Floats:
    """Points (frames, markers, 3) where one sticker of the disk creeps at each blow, always the same way on it, and is
    put right between the runs.

    By `creeping_m` (x, y in the disk, whose angle is `angle_rad`) times the blows before, of the `impacts` (k, 3: time,
    normal and tangential approach) that were no mere touch.
    """
    if errors.creeping_m == (0.0, 0.0):
        return points_m
    blows = np.searchsorted(impacts[impacts[:, 1] > TOUCH_M_PER_S, 0], time_s, side="right")
    c, s, (x, y), out = np.cos(angle_rad), np.sin(angle_rad), errors.creeping_m, points_m.copy()
    way = blows[:, None] * np.column_stack([c * x - s * y, s * x + c * y])
    out[:, DISK[errors.creeping_marker], :2] += way
    return out


def blurred(poses: Poses, time_s: np.ndarray, blur_s: float, rng: np.random.Generator) -> Poses:
    """Poses as they are found where faster bodies are found less well; the same for both cameras' `rng`."""
    if blur_s == 0.0:
        return poses
    moved = []
    for pose, angle in ((poses.nes, 3), (poses.host, 2)):
        rate = np.gradient(pose, time_s, axis=0)
        speed, seen = np.hypot(rate[:, 0], rate[:, 1]), pose.copy()
        seen[:, :2] += blur_s * speed[:, None] * rng.standard_normal((len(pose), 2))
        seen[:, angle] += blur_s * rate[:, angle] * rng.standard_normal(len(pose))
        moved.append(seen)
    return Poses(*moved)
