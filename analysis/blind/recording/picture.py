"""What moves, stretches or delays a camera's whole picture."""

from dataclasses import dataclass

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.plant.host import HOST_M_PER_S2, host_pose
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.tracker import clicked_off_px
from analysis.blind.recording.views import DISK, WINDOW_PX, View

SHAKE_DECAY_S = 0.04  # of a tripod on the bench: gone before the next impact but one
BUTTON_S = 0.3  # in which a camera whose button was pressed comes to rest: a quarter of a run
HAZE_PX = 250.0  # between two crests of haze in a picture: 5 cm over the rig, where warm air rises in billows
COLD_RUNS = 3.0  # after which a camera has warmed by two thirds
REFOCUS_PX = 300.0  # from the picture's middle to where a lens is off by what its causes say: the ring's radius


@dataclass(frozen=True)
class Shaking:
    """How the first camera moves (frames,): `shake_px` along u, `twist_rad` about its axis, `tripod_px` (frames, 2)
    along u and v (None: not at all); its picture is too large by the share `zoom`, and that of the second camera
    lies off along v by `second_px`; either lies off by `first_off_px` or `second_off_px` (u, v), if at all, and the
    first by `nudged_px` (frames, 2).  Of the trackers: the share `hops_from` of the run from which on the second one's
    takes two markers for each other, how far off either camera's markers were clicked, `clicked_px` (camera,
    marker, 2), and the run's own chances of markers that wander off and that are lost, if any."""

    shake_px: np.ndarray | float = 0.0
    twist_rad: np.ndarray | None = None
    tripod_px: np.ndarray | None = None
    zoom: float = 0.0
    second_px: float = 0.0
    first_off_px: Floats | None = None
    second_off_px: Floats | None = None
    nudged_px: Floats | None = None
    hops_from: float | None = None
    clicked_px: Floats | None = None
    wander_draw: int | None = None
    bridged_draw: int | None = None


STEADY = Shaking()


def shaking_of(time_s: Floats, lines: Floats, impact_s: Floats, kicks: Floats, run: int, errors: ViewErrors) -> Shaking:
    """At `time_s` (n,) of `run`, by the Host's `lines` and the disk's `kicks` (k, 2) at `impact_s`."""
    turned = twist_rad(time_s, lines, errors) if errors.twisted_rad else None
    bump = bump_rad(run, errors)
    if bump != 0.0:
        turned = bump + (np.zeros(len(time_s)) if turned is None else turned)
    swayed = tripod_px(time_s, lines, errors) if errors.tripod_px else None
    sunk = errors.head_px[run] if errors.head_px else 0.0  # a tripod's head that sinks from run to run
    return Shaking(
        shake_px(time_s, impact_s, kicks, errors),
        turned,
        swayed,
        cold_zoom(run, errors),
        sunk,
        warm_off_px(run, errors) if errors.warm_px else None,
        jogged_off_px(errors) if errors.jogged_px and run >= errors.jogged_from else None,
        nudged_off_px(len(time_s), run, errors) if errors.nudged_px else None,
        errors.hopped[run] if errors.hopped_s else None,
        clicked_off_px(run, errors) if errors.clicked_px else None,
        errors.wander_draw[run] if errors.wander_px else None,
        errors.bridged_draw[run] if errors.bridged else None,
    )


def shake_px(time_s: np.ndarray, impact_s: np.ndarray, kicks: np.ndarray, errors: ViewErrors) -> np.ndarray:
    """How far the first camera's picture is off along u (n,) at `time_s` (n,): it swings after each impact, by the
    disk's change of velocity along x, `kicks` (k, 2) at `impact_s` (k,)."""
    off = np.zeros(len(time_s))
    if errors.shaken_px == 0.0:
        return off
    for instant, kick in zip(impact_s, kicks[:, 0], strict=True):
        late = np.maximum(time_s - instant, 0.0)
        off += kick * np.exp(-late / SHAKE_DECAY_S) * np.sin(2.0 * np.pi * errors.shaken_hz * late)
    return errors.shaken_px * off


def tripod_px(time_s: Floats, lines: Floats, errors: ViewErrors) -> Floats:
    """How far the first camera's picture is moved (n, 2) at `time_s` (n,): the shaker shakes the room's floor, and with
    it a tripod.

    By `tripod_px` along `tripod_rad` in the picture, times the Host's acceleration along the shaker's axis (of its
    `lines` (m, 7)), `tripod_s` before, over `HOST_M_PER_S2`: under a sine an oscillation of the drive's frequency.
    """
    pull = np.array([host_pose(t - errors.tripod_s, lines)[2][0] for t in time_s]) / HOST_M_PER_S2
    along = np.array([np.cos(errors.tripod_rad), np.sin(errors.tripod_rad)])
    return errors.tripod_px * pull[:, None] * along


def bump_rad(run: int, errors: ViewErrors) -> float:
    """How far the first camera is turned about its axis in `run` by somebody who has bumped its tripod before run
    `bumped_from`, after the calibration."""
    return errors.bumped_rad if run >= errors.bumped_from else 0.0


def cold_zoom(run: int, errors: ViewErrors) -> float:
    """Share by which the first camera's picture is too large in `run` (from 0): it was calibrated warm, and comes to
    that from run to run, by `cold_zoom` exp(-run / `COLD_RUNS`)."""
    return float(errors.cold_zoom * np.exp(-run / COLD_RUNS))


def warm_off_px(run: int, errors: ViewErrors) -> Floats:
    """How far the first camera's picture lies off (u, v) in `run` (from 0): it was calibrated when it had long been on,
    and warms up again from run to run, by `warm_px` exp(-run / `COLD_RUNS`) along `warm_rad`."""
    size = errors.warm_px * np.exp(-run / COLD_RUNS)
    return size * np.array([np.cos(errors.warm_rad), np.sin(errors.warm_rad)])


def nudged_off_px(frames: int, run: int, errors: ViewErrors) -> Floats:
    """How far the first camera's picture lies off (frames, 2) that somebody nudges in each run, and sets right after
    it: by `nudged_px` along `nudged_rad`, from the share `nudged_share` of `run` on."""
    size = np.where(np.arange(frames) >= errors.nudged_share[run] * frames, errors.nudged_px, 0.0)
    return size[:, None] * np.array([np.cos(errors.nudged_rad), np.sin(errors.nudged_rad)])


def jogged_off_px(errors: ViewErrors) -> Floats:
    """How far the second camera's picture lies off (u, v) since somebody has knocked against it."""
    return errors.jogged_px * np.array([np.cos(errors.jogged_rad), np.sin(errors.jogged_rad)])


def skewed(pixels: Floats, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a camera whose picture leans: u is more by `skewed` times v from its middle."""
    if errors.skewed == 0.0:
        return pixels
    out = pixels.copy()
    out[..., 0] += errors.skewed * (pixels[..., 1] - view.centre_px[1])
    return out


def keystoned(pixels: Floats, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a camera whose sensor is not square to its lens: the picture grows along
    `keystone_rad`, by `keystone_px` s r, s the place along that and r from the picture's middle in units of
    `REFOCUS_PX`."""
    if errors.keystone_px == 0.0:
        return pixels
    away = (pixels - view.centre_px) / REFOCUS_PX
    along = away @ np.array([np.cos(errors.keystone_rad), np.sin(errors.keystone_rad)])
    return pixels + errors.keystone_px * along[..., None] * away


def twist_rad(time_s: np.ndarray, lines: Floats, errors: ViewErrors) -> np.ndarray:
    """How far the first camera is turned about its axis (n,) at `time_s` (n,).

    It hangs on the shaker's own frame, which takes the drive's reaction: by the Host's acceleration along the
    shaker's axis, of its `lines` (m, 7), `twisted_rad` at `HOST_M_PER_S2`.
    """
    if errors.twisted_rad == 0.0:
        return np.zeros(len(time_s))
    pull = np.array([host_pose(t, lines)[2][0] for t in time_s])
    return errors.twisted_rad * pull / HOST_M_PER_S2


def twisted(pixels: np.ndarray, turn_rad: np.ndarray, view: View) -> np.ndarray:
    """Pixels (frames, markers, 2) of a camera turned about its axis by `turn_rad` (frames,)."""
    c, s = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
    u, v = np.moveaxis(pixels - view.centre_px, -1, 0)
    return np.stack([c * u - s * v, s * u + c * v], axis=-1) + view.centre_px


def by_the_first_camera(
    pixels: np.ndarray, time_s: np.ndarray, view: View, shaking: Shaking, errors: ViewErrors
) -> np.ndarray:
    """Pixels (frames, markers, 2) of a camera that shakes, sways along u and whose zoom swings, at `time_s`
    (frames,)."""
    if shaking.twist_rad is not None:
        pixels = twisted(pixels, shaking.twist_rad, view)
    if shaking.tripod_px is not None:
        pixels = pixels + shaking.tripod_px[:, None]
    if shaking.first_off_px is not None:
        pixels = pixels + shaking.first_off_px
    if shaking.nudged_px is not None:
        pixels = pixels + shaking.nudged_px[:, None]
    pixels = followed(decentred(refocused(pixels, view, errors), view, errors), view, errors)
    pixels = released(pixels, time_s, errors)
    pixels[..., 0] += np.reshape(shaking.shake_px, (-1, 1))
    pixels[..., 0] += errors.wobble_px * np.sin(2 * np.pi * errors.wobble_hz * time_s)[:, None]
    # With a focal length that is not quite the lens' own all of the picture is too large, or too small.
    swing = errors.focal + shaking.zoom + errors.zoom_swing * np.sin(2 * np.pi * errors.zoom_swing_hz * time_s)
    return pixels + (pixels - view.centre_px) * swing[:, None, None]


def released(pixels: Floats, time_s: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) at `time_s` (frames,) of a camera whose button somebody has pressed, and which swings
    on its tripod as the run begins: by `button_px` exp(-t / `BUTTON_S`) cos(2 pi `button_hz` t) along `button_rad` of
    the picture, t the time in the run."""
    if errors.button_px == 0.0:
        return pixels
    passed = np.maximum(time_s, 0.0)
    swing = errors.button_px * np.exp(-passed / BUTTON_S) * np.cos(2.0 * np.pi * errors.button_hz * passed)
    return pixels + swing[:, None, None] * np.array([np.cos(errors.button_rad), np.sin(errors.button_rad)])


def refocused(pixels: Floats, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a camera that was focused anew after its calibration: its lens then bends the
    picture's edge outwards, by `refocused_px` (r / `REFOCUS_PX`)^3, r from the picture's middle."""
    if errors.refocused_px == 0.0:
        return pixels
    away = (pixels - view.centre_px) / REFOCUS_PX
    return pixels + errors.refocused_px * np.sum(away**2, axis=-1, keepdims=True) * away


def fitted(pixels: Floats, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a camera whose lens was fitted without its fifth order: they lie farther out by
    `fifth_px` (r / `REFOCUS_PX`)^5, r from the picture's middle."""
    if errors.fifth_px == 0.0:
        return pixels
    away = (pixels - view.centre_px) / REFOCUS_PX
    return pixels + errors.fifth_px * np.sum(away**2, axis=-1, keepdims=True) ** 2 * away


def decentred(pixels: Floats, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a camera whose lens was knocked after its calibration and sits off its axis, along
    d of the picture (`knocked_rad`).

    Brown's decentring: by `knocked_px` (r^2 d + 2 (d r) r), r in units of `REFOCUS_PX` from the picture's middle.
    """
    if errors.knocked_px == 0.0:
        return pixels
    away, along = (
        (pixels - view.centre_px) / REFOCUS_PX,
        np.array([np.cos(errors.knocked_rad), np.sin(errors.knocked_rad)]),
    )
    square = np.sum(away**2, axis=-1, keepdims=True)
    return pixels + errors.knocked_px * (square * along + 2.0 * (away @ along)[..., None] * away)


def followed(pixels: Floats, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a camera that steadies its picture and takes the disk for a hand that shakes: the
    whole picture goes after it, by the share `followed` of the way from its middle to that of the disk's markers."""
    if errors.followed == 0.0:
        return pixels
    return pixels - errors.followed * (pixels[:, DISK].mean(axis=1, keepdims=True) - view.centre_px)


def by_the_second_camera(pixels: np.ndarray, view: View, errors: ViewErrors, shaking: Shaking = STEADY) -> np.ndarray:
    """Pixels (frames, markers, 2) of a camera that is turned, or turns, about its axis, creeps along u and zooms in
    within a run, that lies off along v, and that has lost a frame."""
    frames = len(pixels)
    pixels = fitted(pixels, view, errors)
    if errors.rolled_rad != 0.0:  # somebody has turned it in its clamp after the calibration
        pixels = twisted(pixels, np.full(frames, errors.rolled_rad), view)
    if errors.sagging_rad != 0.0:  # an arm that gives in the lamps' heat, and is set right before the next run
        pixels = twisted(pixels, errors.sagging_rad * np.linspace(-1.0, 1.0, frames), view)
    pixels = keystoned(skewed(pixels, view, errors), view, errors)
    if shaking.second_off_px is not None:
        pixels = pixels + shaking.second_off_px
    pixels[..., 1] += shaking.second_px
    pixels[..., 0] += errors.creep_px * np.linspace(0.0, 1.0, frames)[:, None]
    grown = errors.zoom * np.linspace(0.0, 1.0, frames)
    pixels = pixels + (pixels - view.centre_px) * grown[:, None, None]
    if errors.lost_frame_share > 0.0:
        late = np.arange(frames) >= errors.lost_frame_share * frames
        pixels = np.where(late[:, None, None], np.roll(pixels, -1, axis=0), pixels)[: frames - 1]
    return pixels


def hazed(pixels: Floats, time_s: Floats, index: int, view: View, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of camera `index` at `time_s` (frames,) through warm air that rises from a lamp.

    Its billows bend the light to and fro along their way: by `haze_px` sin(2 pi s / `HAZE_PX` - `haze_rad_per_s` t +
    `haze_phase_rad`) along `haze_rad` of the picture, s a marker's place along that from its middle, t the time in the
    run.
    """
    if errors.haze_px == 0.0 or errors.haze_camera != index:
        return pixels
    along = np.array([np.cos(errors.haze_rad), np.sin(errors.haze_rad)])
    place = (pixels - view.centre_px) @ along
    phase = 2.0 * np.pi * place / HAZE_PX - errors.haze_rad_per_s * time_s[:, None] + errors.haze_phase_rad
    return pixels + errors.haze_px * np.sin(phase)[..., None] * along


def read_out(pixels: np.ndarray, view: View, frame_rate_hz: float, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of a picture that is too tall, whose rows are read one after the other, or whose
    frames have the even rows and the odd ones in turn."""
    if errors.stretched != 0.0:
        pixels[..., 1] += errors.stretched * (pixels[..., 1] - view.centre_px[1])
    if errors.interlaced_px != 0.0:
        pixels[..., 1] += errors.interlaced_px * (1.0 - 2.0 * (np.arange(len(pixels)) % 2))[:, None]
    if errors.shutter_s > 0.0:
        late_s = errors.shutter_s * (pixels[..., 1:] - view.window_offset_px[1]) / WINDOW_PX[1]
        pixels = pixels + np.gradient(pixels, axis=0) * frame_rate_hz * late_s
    return pixels


def stuttered(pixels: np.ndarray, share: float) -> np.ndarray:
    """Pixels (frames, markers, 2) of a camera of whose frames a share show the one before once more; a generator of its
    own leaves all other chances as they are."""
    frames = len(pixels)
    repeats = np.random.default_rng(frames).random(frames) < share
    repeats[0] = False
    return pixels[np.maximum.accumulate(np.where(repeats, 0, np.arange(frames)))]


def unfocused(pixels: Floats, view: View, errors: ViewErrors, rng: np.random.Generator) -> Floats:
    """Pixels (frames, markers, 2) of a lens that is sharp in the picture's middle only: markers scatter by
    `unfocused_px` r / `REFOCUS_PX`, r from there; by a generator beside `rng`, which leaves its own chances as they
    are."""
    if errors.unfocused_px == 0.0:
        return pixels
    (beside,) = rng.spawn(1)
    away = np.linalg.norm(pixels - view.centre_px, axis=-1, keepdims=True) / REFOCUS_PX
    return pixels + errors.unfocused_px * away * beside.standard_normal(pixels.shape)
