"""What a film's coding and the tracker do to where markers are found."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import RING_M
from analysis.blind.recording.views import DISK, HOST, MARKERS

BLOCK_PX = 8.0  # side of the blocks that a film is coded in
SMOOTHED_FRAMES = 2  # to either side of a frame, that a tracker's mean is over
SEARCH_PX = 4.0  # way from frame to frame that a tracker's search window holds all of
GHOST_FRAMES = 16  # from one whole frame of a film to the next: some seven in a period of a fast drive
BRIDGED_FRAMES = 3  # of a stretch in which a marker is lost
GUESSED_M = 0.015  # from the wall, within which it hides a part of a marker: a thick ring stands as high over the disk


def blocked(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a film that was coded in blocks, too coarsely: in both cameras all markers are
    drawn to the middles of their blocks, by `blocked_px` sin(2 pi pixel / `BLOCK_PX`) along each side."""
    if errors.blocked_px == 0.0:
        return pixels
    return pixels - errors.blocked_px * np.sin(2.0 * np.pi * pixels / BLOCK_PX)


def rounded(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) as a table has them whose numbers were rounded: to whole steps of `rounded_px`."""
    if errors.rounded_px == 0.0:
        return pixels
    return np.round(pixels / errors.rounded_px) * errors.rounded_px


def smoothed(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) as a tracker finds them that smooths its tracks: a share `smoothed` of each is the
    mean over the frame and `SMOOTHED_FRAMES` to either side, its first and last frames standing for those beyond."""
    if errors.smoothed == 0.0:
        return pixels
    k = SMOOTHED_FRAMES
    wide = np.pad(pixels, ((k, k), (0, 0), (0, 0)), mode="edge")
    mean = sum(wide[i : i + len(pixels)] for i in range(2 * k + 1)) / (2 * k + 1)
    return pixels + errors.smoothed * (mean - pixels)


def clicked_off_px(run: int, errors: ViewErrors) -> Floats:
    """How far off (2, markers, 2) the markers of either camera are found in `run`, whose templates somebody has clicked
    by hand in its first frame: by `clicked_px` times a standard normal along u and along v, the run's own
    (`clicked_draw`)."""
    rng = np.random.default_rng(errors.clicked_draw[run])
    return errors.clicked_px * rng.standard_normal((2, len(MARKERS), 2))


def hopped(pixels: Floats, from_share: float, frame_rate_hz: float, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a tracker that takes two of the disk's markers, `hopped_markers`, for each other:
    from `from_share` of the run on, for `hopped_s`."""
    first = int(from_share * len(pixels))
    while_ = slice(first, first + round(errors.hopped_s * frame_rate_hz))
    one, other = (DISK[marker] for marker in errors.hopped_markers)
    out = pixels.copy()
    out[while_, one], out[while_, other] = pixels[while_, other], pixels[while_, one]
    return out


def dragged(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a tracker with a dead band: it leaves a marker where it was as long as that is no
    farther than `dead_band_px` from there, and then drags behind it as on a rod of that length."""
    if errors.dead_band_px == 0.0:
        return pixels
    out = pixels.copy()
    for frame in range(1, len(pixels)):
        away = pixels[frame] - out[frame - 1]
        far = np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), errors.dead_band_px)
        out[frame] = pixels[frame] - errors.dead_band_px / far * away
    return out


def guessed(pixels: Floats, points_m: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a tracker that goes by a marker's way where it sees little of it: those of the
    disk that the wall hides in part; `points_m` (frames, markers, 3) tells where they are.

    Found by the share `guessed` (1 - gap / `GUESSED_M`) where they would have gone on to, evenly, from where they were
    found in the two frames before; gap their way to the wall.  A blow there sends them past it.
    """
    if errors.guessed == 0.0:
        return pixels
    away = points_m[:, DISK, :2] - points_m[:, HOST, :2].mean(axis=1, keepdims=True)
    gap = RING_M - np.hypot(away[..., 0], away[..., 1])
    share = errors.guessed * np.clip(1.0 - gap / GUESSED_M, 0.0, 1.0)[..., None]
    found = pixels[:, DISK].copy()
    for frame in range(2, len(pixels)):
        goes_on = 2.0 * found[frame - 1] - found[frame - 2]
        found[frame] += share[frame] * (goes_on - found[frame])
    out = pixels.copy()
    out[:, DISK] = found
    return out


def wandered_off_px(frames: int, draw: int, errors: ViewErrors) -> Floats:
    """How far off (2, frames, markers, 2) the markers of either camera are found in a run whose templates are renewed
    in each frame: each adds a little, a standard normal along u and along v by the run's own `draw`, and the sum of
    them has a standard deviation of `wander_px` as the run ends."""
    steps = np.random.default_rng(draw).standard_normal((2, frames, len(MARKERS), 2))
    steps[:, 0] = 0.0
    return errors.wander_px / np.sqrt(frames) * np.cumsum(steps, axis=1)


def missed(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a tracker that looks for a marker around where it was in the frame before: what
    has gone farther than `SEARCH_PX` from there lies partly outside, and is found behind, by the share `missed` of what
    it has gone beyond that."""
    if errors.missed == 0.0:
        return pixels
    way = np.diff(pixels, axis=0, prepend=pixels[:1])
    far = np.linalg.norm(way, axis=-1, keepdims=True)
    return pixels - errors.missed * np.maximum(1.0 - SEARCH_PX / np.maximum(far, SEARCH_PX), 0.0) * way


def ghosted(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a film that is coded as one whole frame in `GHOST_FRAMES` and what changes after
    it: a weak ghost of the whole frame is left, and each marker is drawn back to it by the share `ghosted` of its way
    since then."""
    if errors.ghosted == 0.0:
        return pixels
    whole = np.arange(len(pixels)) // GHOST_FRAMES * GHOST_FRAMES
    return pixels - errors.ghosted * (pixels - pixels[whole])


def bridged(pixels: Floats, index: int, draw: int, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of camera `index` where the tracker loses the disk's markers now and then, and
    somebody fills in what is missing: a share `bridged` of the stretches of `BRIDGED_FRAMES` frames, for each marker by
    the run's own `draw`, lies on the straight line between the frames before and after."""
    out, stretches = pixels.copy(), (len(pixels) - 2) // BRIDGED_FRAMES
    lost = np.random.default_rng([draw, index]).random((stretches, len(DISK))) < errors.bridged
    part = (np.arange(1, BRIDGED_FRAMES + 1) / (BRIDGED_FRAMES + 1))[:, None]
    for stretch, marker in np.argwhere(lost):
        first = BRIDGED_FRAMES * stretch
        before, after = pixels[first, DISK[marker]], pixels[first + BRIDGED_FRAMES + 1, DISK[marker]]
        out[first + 1 : first + BRIDGED_FRAMES + 1, DISK[marker]] = before + part * (after - before)
    return out
