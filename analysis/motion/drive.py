"""The drive as it was measured against what the shaker was asked for: frequency, level, direction, further lines,
start-up, sweeps, jumps.

A finding is no fault of an identification, which follows any measured path; it says that the drive was not the one
asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtr

from analysis.motion.host_path import HostMotion
from analysis.motion.rig_frame import RigFrame
from ovines.recording_schema import Excitation
from ovines.robust import spread

Array = NDArray[np.float64]

GRAVITY_M_PER_S2 = 9.81
# Found: less likely by chance than this, and larger than what is negligible.
BY_CHANCE = 1e-4
#: per kind of finding, the size that matters to nobody (unit: that of the finding)
NEGLIGIBLE = {
    "frequency": 0.01,  # a shaker keeps its frequency to 1e-4; a wrong frame rate shifts it, too
    "level": 0.3,  # what a shaker was asked for is nominal
    "direction": 0.02,
    "crosswise": 0.1,
    "line": 2e-3,
    "no line": 0.05,
    "start-up": 0.1,
    "jump": 12.0,
    "rest": 3.0,
}
# How well a shaker keeps its level and its direction from run to run.
LEVEL_SD, DIRECTION_SD = 0.05, 5e-3
# Frames on either side of a jump, through which a parabola is drawn.
JUMP_FRAMES = 6
# A line's amplitude is that of this part of the run at its begin, against the rest.
BEGINNING = 0.15


@dataclass(frozen=True)
class DriveFinding:
    """One comparison of the drive of a run (``run``: its number) with what it was asked to be.

    ``kind`` of :data:`NEGLIGIBLE`; ``size`` in ``unit`` with its ``sd``; ``p`` by chance, were there nothing;
    ``at``: where on its axis (Hz of a line, s of a jump; None), ``words`` a sentence for an experimenter, ``found``:
    more than chance and more than negligible.
    """

    kind: str
    run: int
    size: float
    sd: float
    unit: str
    p: float
    words: str
    at: float | None = None

    @property
    def found(self) -> bool:
        """Whether it is more than chance and more than negligible."""
        return self.p < BY_CHANCE and abs(self.size) > NEGLIGIBLE[self.kind]


def drive_findings(
    hosts: Sequence[tuple[Array, HostMotion]], asked: Sequence[Excitation | None], frame: RigFrame
) -> list[DriveFinding]:
    """Every comparison of the measured drives with those asked for; those with :attr:`DriveFinding.found` matter.

    Parameters
    ----------
    hosts : per run its frames' times (N,) s and the Host's motion, in the rig's ``frame`` and units:
        ``[(run.data.time_s, run.data.host) for run in runs]``
    asked : per run ``recording.excitation``, None where nothing was asked
    frame : the rig's frame; sizes, frequencies and times that are reported are the world's

    A diagnosis issues stage "drive" with the findings found: "line", "no line", "start-up", "jump" and "rest" whatever
    was asked, "frequency", "level" and "crosswise" against what was.  A "frequency" that is off alike in all runs is
    as well a wrong frame rate (``frame_rate_error``), a "level" off alike a wrong length scale; "rest" is a motion of
    the Host that no line explains, as a recoil leaves it (``host_recoil``, ``host_ringing``, ``host_sway``).
    """
    found: list[DriveFinding] = []
    for number, ((time_s, host), want) in enumerate(zip(hosts, asked, strict=True)):
        if not len(time_s):
            continue
        found += _against_asked(number, host, want, frame)
        found += _lines(number, host, frame)
        found += _beside_lines(number, time_s, host, frame)
        step = _jump(number, time_s, host, frame)
        found += [step] if step else []
    return found + _directions(hosts)


def _two_sided(size: float, sd: float) -> float:
    return float(2 * ndtr(-abs(size) / sd)) if sd > 0 else float(size == 0)


def _against_asked(number: int, host: HostMotion, want: Excitation | None, frame: RigFrame) -> list[DriveFinding]:
    if want is None or want.axis == "z":
        return []
    if not host.omega_rad_per_s:
        words = "The Host stands still, a drive was asked for."
        return [] if host.moves else [DriveFinding("frequency", number, -1.0, 0.0, "1", 0.0, words, 0.0)]
    hz = host.frequency_hz * frame.factor("frequency_hz")
    hz_sd = host.omega_sd_rad_per_s / (2 * np.pi) * frame.factor("frequency_hz")
    off, off_sd = hz / want.frequency_hz - 1, max(hz_sd / want.frequency_hz, 1e-4)
    words = f"The Host moves at {hz:.5g} Hz, {want.frequency_hz:.5g} Hz were asked for."
    rows = [DriveFinding("frequency", number, off, off_sd, "1", _two_sided(off, off_sd), words, hz)]
    if want.acceleration_g is not None:
        times = host.zero_s + np.linspace(0, 2 * np.pi / host.omega_rad_per_s, 64)
        level = np.linalg.norm(host.at(times, 2)[:, :2], axis=1).max() * frame.factor("m_per_s2") / GRAVITY_M_PER_S2
        ratio = float(level / want.acceleration_g) - 1
        words = f"The Host is accelerated by {level:.3g} g at most, {want.acceleration_g:.3g} g were asked for."
        rows.append(DriveFinding("level", number, ratio, LEVEL_SD, "1", _two_sided(ratio, LEVEL_SD), words))
    return rows


def _lines(number: int, host: HostMotion, frame: RigFrame) -> list[DriveFinding]:
    """Lines beside the main one, by their amplitude over the main one's (over the metre without)."""
    rows: list[DriveFinding] = []
    for k, omega in enumerate(host.lines_rad_per_s):
        pair = host.line_coefficients[:2, 2 * k : 2 * k + 2]
        places = host.harmonics.shape[1] + 2 * k + np.arange(2)
        size = float(np.hypot(*pair.T).max())
        axis = int(np.argmax(np.hypot(*pair.T)))
        sd = (
            float(np.sqrt(np.trace(host.line_covariance[axis][np.ix_(places, places)]) / 2))
            if host.line_covariance is not None
            else 0.0
        )
        per = host.amplitude_m or 1.0
        chance = float(chdtrc(2, (size / sd) ** 2)) * max(len(host.residual), 1) if sd > 0 else 0.0
        hz = float(omega) / (2 * np.pi) * frame.factor("frequency_hz")
        words = f"Beside the drive the Host moves at {hz:.4g} Hz, by {1e6 * size * frame.factor('size_m'):.3g} um."
        rows.append(DriveFinding("line", number, size / per, sd / per, "1", min(chance, 1.0), words, hz))
    return rows


def _beside_lines(number: int, time_s: Array, host: HostMotion, frame: RigFrame) -> list[DriveFinding]:
    """What no line explains: a drive without a line, one that starts, or a rest of another kind."""
    at = time_s - host.zero_s
    rows: list[DriveFinding] = []
    paths = [(axis, one) for axis, one in enumerate(host.smooth[:2]) if one is not None]
    if not paths:
        return rows
    axis, path = max(paths, key=lambda pair: float(np.std(pair[1].at(at))))
    left = path.at(at)
    size = float(np.std(left))
    sd = float(np.sqrt(np.mean(path.covariance(at)[:, 0, 0])))
    # Its size against the noise, that the spectrum has shown beyond chance already.
    chance = float(chdtrc(4, min((size / max(sd, 1e-300)) ** 2, 1e4) * 4))
    if not host.omega_rad_per_s and _moved_m(at, host) > 0:
        share = size / _moved_m(at, host)
        words = (
            f"No line explains the drive: a sweep or a random drive ({1e3 * size * frame.factor('size_m'):.3g} mm rms)."
        )
        rows.append(DriveFinding("no line", number, share, sd / _moved_m(at, host), "1", chance, words))
        return rows
    start = _start_up(at, host, left, axis)
    if start is not None:
        words = f"The drive starts or stops during the recording: its level changes by {100 * start:.3g} %."
        rows.append(DriveFinding("start-up", number, start, sd / host.amplitude_m, "1", chance, words))
    words = (
        f"Beside the drive's lines the Host moves by {1e6 * size * frame.factor('size_m'):.3g} um rms "
        f"(noise of a frame {1e6 * path.sd * frame.factor('size_m'):.3g} um)."
    )
    rows.append(DriveFinding("rest", number, size / max(sd, 1e-300), 1.0, "sd", chance, words))
    return rows


def _moved_m(at: Array, host: HostMotion) -> float:
    return float(np.sqrt(np.sum(np.var(host.at(at + host.zero_s)[:, :2], axis=0))))


def _start_up(at: Array, host: HostMotion, left: Array, axis: int) -> float | None:
    """Change of the main line's amplitude from the begin of a run to its rest, over the whole; None without such a
    change."""
    if not host.omega_rad_per_s or not host.amplitude_m:
        return None
    cos, sin = host.harmonics[axis, 1:3]
    size = float(np.hypot(cos, sin))
    if not size:
        return None
    phase = np.exp(-1j * host.omega_rad_per_s * at)
    line = (cos * np.cos(host.omega_rad_per_s * at) + sin * np.sin(host.omega_rad_per_s * at)) + left
    share = int(max(BEGINNING * len(at), 2 * np.pi / host.omega_rad_per_s / max(np.median(np.diff(at)), 1e-300)))
    if 2 * share > len(at):
        return None
    # Whole periods of a demodulated line are free of its double frequency.
    levels = [
        2 * abs(np.mean((line * phase)[part])) for part in (slice(0, share), slice(share, -share), slice(-share, None))
    ]
    change = max((abs(levels[0] - levels[1]), abs(levels[2] - levels[1]))) / size
    return float(change) if change > NEGLIGIBLE["start-up"] else None


@dataclass(frozen=True)
class Jump:
    """A step of the Host's place after frame ``frame``: ``size`` (m) and in ``sds``."""

    frame: int
    size: float
    sds: float


def jump(time_s: Array, host: HostMotion) -> Jump | None:
    """The largest step of the Host's place from one frame to the next, in robust sds of what parabolas through the
    frames on either side of any other instant differ by; None of too few frames.  Nothing is said across frames that
    are missing."""
    if len(host.residual) != len(time_s) or len(time_s) < 4 * JUMP_FRAMES:
        return None
    places = host.at(time_s)[:, :2] + host.residual[:, :2]
    at = np.round((time_s - time_s[0]) / np.median(np.diff(time_s))).astype(int)
    best: Jump | None = None
    for column in places.T:
        values = np.full(at[-1] + 1, np.nan)
        values[at] = column
        clean = _without_single_errors(values)
        step = _extrapolated(clean[::-1])[::-1][1:] - _extrapolated(clean)[:-1]
        seen = np.isfinite(step)
        scale = spread(step[seen]) if seen.sum() > JUMP_FRAMES else 0.0
        if scale <= 0:
            continue
        k = int(np.nanargmax(np.abs(step)))
        size = float(abs(step[k]))
        if best is None or size / scale > best.sds:
            # Between frames k and k + 1 of the clock lies the frame that was filmed last.
            best = Jump(int(np.searchsorted(at, k, side="right")) - 1, size, size / scale)
    return best


def _jump(number: int, time_s: Array, host: HostMotion, frame: RigFrame) -> DriveFinding | None:
    one = jump(time_s, host)
    if one is None:
        return None
    middle_s = float(0.5 * (time_s[one.frame] + time_s[one.frame + 1]))
    at = middle_s * frame.factor("time_s") + frame.middle_s[number]
    size_um = 1e6 * one.size * frame.factor("size_m")
    words = f"At {at:.4g} s the Host jumps by {size_um:.3g} um from one frame to the next."
    # Parabolas' differences have longer tails than noise.
    chance = min(float(2 * ndtr(-one.sds / 2)) * len(time_s), 1.0)
    return DriveFinding("jump", number, one.sds, 1.0, "sd", chance, words, at)


def _without_single_errors(values: Array) -> Array:
    """``values`` with frames that neither their median neighbour nor the cubic through their neighbours explains left
    out."""
    off = np.full(len(values), np.nan)
    off[2:-2] = values[2:-2] - (4 * (values[1:-3] + values[3:-1]) - values[:-4] - values[4:]) / 6
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, constant_values=np.nan), 5)
    ordered, known = np.sort(windows, axis=1), np.isfinite(windows).sum(1)[:, None]  # what is not known comes last
    middle = [np.take_along_axis(ordered, np.maximum(known + of, 0) // 2, 1)[:, 0] for of in (-1, 0)]
    beside = values - 0.5 * (middle[0] + middle[1])  # medians of what is known
    wrong = (np.abs(off) > 10 * spread(off)) & (np.abs(beside) > 0.5 * np.abs(off))
    return np.where(wrong, np.nan, values)


def _extrapolated(values: Array) -> Array:
    """Parabola through the :data:`JUMP_FRAMES` values up to each, half a frame beyond it (NaN where one is missing)."""
    at = np.arange(1 - JUMP_FRAMES, 1)
    rows = np.vander(at, 3, increasing=True).astype(float)
    weights = np.array([1.0, 0.5, 0.25]) @ np.linalg.pinv(rows)
    out = np.full(len(values), np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(values, JUMP_FRAMES)
    out[JUMP_FRAMES - 1 :] = windows @ weights
    return out


def _directions(hosts: Sequence[tuple[Array, HostMotion]]) -> list[DriveFinding]:
    """How far each run's drive points beside the others', and how far it moves across its own direction."""
    found, lines = [], []
    for number, (_, host) in enumerate(hosts):
        if not host.omega_rad_per_s:
            continue
        phasor = host.harmonics[:2, 1] + 1j * host.harmonics[:2, 2]
        long, short = np.linalg.svd(np.stack([phasor.real, phasor.imag], -1))[1]
        crosswise = float(short / long) if long > 0 else 0.0
        words = f"Across its direction the Host moves by {100 * crosswise:.3g} % of the drive."
        found.append(
            DriveFinding("crosswise", number, crosswise, LEVEL_SD / 5, "1", _two_sided(crosswise, LEVEL_SD / 5), words)
        )
        tensor = np.real(np.outer(phasor, phasor.conj()))
        lines.append((number, 0.5 * np.arctan2(2 * tensor[0, 1], tensor[0, 0] - tensor[1, 1])))
    if len(lines) > 1:
        middle = 0.5 * np.angle(np.median([np.exp(2j * turn) for _, turn in lines]))
        for number, turn in lines:
            off = float(0.5 * np.angle(np.exp(2j * (turn - middle))))
            words = f"The drive points {np.degrees(off):.3g} degrees beside the other runs'."
            found.append(
                DriveFinding("direction", number, off, DIRECTION_SD, "rad", _two_sided(off, DIRECTION_SD), words)
            )
    return found
