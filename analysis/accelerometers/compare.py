"""The Host's motion as accelerometers and cameras saw it (thesis, Tables 17 and 19): one row per channel, and both
over time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.accelerometers.record import Record
from analysis.accelerometers.synchronise import Clock, Integrated, SlowPart, synchronise
from analysis.motion.host_fit import fit_host_motion, spectral_peak
from analysis.motion.host_path import AXES, HostMotion
from analysis.statistics.robust import smooth_noise
from ovines.recording_schema.accelerometers import Channel

Array = NDArray[np.float64]
HARMONICS = 3  # of the main line, fitted to both
MOST_BESIDE = 0.5  # of a displacement's power beside its main line and overtones
LINE_STEPS = 4  # of Gauss and Newton for a line's frequency
UNKNOWN_SD = 1e-5  # m or rad, of a motion without sds and without noise: what cameras usually reach
# A Host that turns by more bends a sensor's direction by so much of what it reads.
MOST_TURNED_RAD = 0.01
# A sensor that differs from the cameras by more than this share, and surely, is worth a word: data sheets say 5 %.
GAIN_OFF, SURE = 0.05, 4.0
NO_RECORD = (
    "accelerometers: no offset makes the record follow the Host (is it this run's, and are direction and time_s "
    "right?): not compared"
)
TURNED = "accelerometers: the record follows the Host turned round: correct the direction of its channels"


@dataclass(frozen=True, eq=False)
class Compared:
    """Tables ``accelerometers`` and ``accelerations`` (None where the record could not be synchronised), and notes."""

    channels: pd.DataFrame | None
    accelerations: pd.DataFrame | None
    notes: tuple[str, ...]


def compare_accelerometers(motion: pd.DataFrame, record: Record, asked_hz: float | None) -> Compared:
    """``record`` beside the Host of table ``motion``; ``asked_hz``: the drive's nominal frequency, where known."""
    notes = [
        f"accelerometers: {channel.column!r} repeats its extreme: the sensor or the card was beyond its range"
        for channel, clipped in zip(record.settings.channels, record.clipped, strict=True)
        if clipped
    ]
    place, sd = _host_columns(motion)
    chosen = [c for c, one in enumerate(record.settings.channels) if not one.axis[2] or np.isfinite(place[:, 2]).any()]
    if not chosen:
        notes.append("accelerometers: they point along z, and the Host's z was not measured: nothing to compare")
        return Compared(None, None, tuple(notes))
    channels = [record.settings.channels[c] for c in chosen]
    directions = np.array([_direction(channel, place[:, 3]) for channel in channels])
    needed = np.abs(directions).max(0) > 0
    seen = np.isfinite(place[:, :3][:, needed]).all(1)
    notes += _turning(channels, place[:, 3])
    time_s = motion["time_s"].to_numpy(float)[seen]
    if len(time_s) < 16:
        notes.append("accelerometers: the Host was seen in fewer than 16 frames: nothing to synchronise by")
        return Compared(None, None, tuple(notes))
    host = fit_host_motion(time_s, place[seen], sd[seen], asked_hz, zero_s=float(time_s.mean()))
    if not host.moves:
        notes.append("accelerometers: the Host stands still: nothing to synchronise by")
        return Compared(None, None, tuple(notes))
    along = np.nan_to_num(place[seen][:, :3]) @ directions.T
    period_s = 1.0 / (host.frequency_hz or spectral_peak(time_s, place[seen]))
    accelerations = record.acceleration_m_per_s2[:, chosen]
    start_s = record.settings.start_s or 0.0
    integrated = Integrated(record.time_s, accelerations)
    clock = synchronise(time_s, along, integrated, period_s, start_s)
    if clock is None or clock.gain[np.argmax(clock.share)] < 0:
        notes.append(NO_RECORD if clock is None else TURNED)
        return Compared(None, None, tuple(notes))
    if clock.others_s:
        nearest = min(clock.others_s, key=lambda one: abs(one - clock.offset_s))
        notes.append(
            f"accelerometers: {len(clock.others_s)} further offsets fit as well, the nearest {nearest:.6g} s for "
            f"{clock.offset_s:.6g} s: the drive repeats itself. Say about when the record starts (start_s), or record "
            f"the drive's start"
        )
    half = 0.5 * float(np.median(np.diff(time_s)))  # the means over a frame's interval lie within both, too
    whole = (time_s - half >= time_s[0]) & (time_s + half <= time_s[-1])
    whole &= (clock.record_time_s(time_s - half) >= integrated.first_s) & (
        clock.record_time_s(time_s + half) <= integrated.last_s
    )
    frames = motion["frame"].to_numpy()[seen][whole]
    table = _Frames(time_s[whole], along[whole], host, directions, clock, integrated, period_s)
    for channel, gain, gain_sd in zip(channels, clock.gain, clock.gain_sd, strict=True):
        if abs(gain - 1) > max(GAIN_OFF, SURE * gain_sd):
            notes.append(
                f"accelerometers: {channel.column!r} reads {100 * (1 / gain - 1):+.1f} % beside the "
                f"cameras: its sensitivity, its direction, or the cameras' scale"
            )
    rows = [_row(channel, c, table) for c, channel in enumerate(channels)]
    return Compared(pd.DataFrame(rows), table.over_time(channels, frames), tuple(notes))


def _host_columns(motion: pd.DataFrame) -> tuple[Array, Array]:
    """Place (N, 4) of the Host, x, y, z in m and angle in rad, NaN where unseen, and its sd
    (where none is given, what third differences show)."""
    names = [f"host_{axis}_rad" if axis == "angle" else f"host_{axis}_m" for axis in AXES]
    sds = [f"{stem}_sd_{unit}" for stem, _, unit in (name.rpartition("_") for name in names)]
    unknown = pd.Series(np.nan, motion.index)
    place, sd = (np.stack([motion.get(n, unknown).to_numpy(float) for n in them], -1) for them in (names, sds))
    noise = np.array([smooth_noise(column) for column in place.T])
    return place, np.where(np.isfinite(sd), sd, np.where(noise > 0, noise, UNKNOWN_SD))


def _direction(channel: Channel, angle_rad: Array) -> Array:
    """Where the sensor points in the world, by the Host's mean angle."""
    x, y, z = channel.axis
    known = angle_rad[np.isfinite(angle_rad)]
    if channel.body == "table" or not len(known):
        return np.array([x, y, z])
    angle = float(np.angle(np.mean(np.exp(1j * known))))
    return np.array([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z])


def _turning(channels: list[Channel], angle_rad: Array) -> list[str]:
    known = angle_rad[np.isfinite(angle_rad)]
    turned = float(np.std(known)) if len(known) else 0.0
    if turned > MOST_TURNED_RAD and any(channel.body == "host" for channel in channels):
        return [
            f"accelerometers: the Host turns by {turned:.2g} rad (sd): a sensor on it points elsewhere by so much, "
            f"which the comparison leaves out"
        ]
    return []


@dataclass(frozen=True, eq=False)
class _Frames:
    """What both saw at the cameras' frames (N,) within the record: ``along_m`` (N, channels) by the cameras."""

    time_s: Array
    along_m: Array
    host: HostMotion
    directions: Array
    clock: Clock
    record: Integrated
    period_s: float

    def moved_m(self) -> Array:
        """(N, channels) displacement by the record, in the cameras' clock."""
        return np.asarray(self.clock.scale**2 * self.record.displacement(self.clock.record_time_s(self.time_s)))

    def means_m_per_s2(self) -> tuple[Array, Array]:
        """(N, channels) acceleration by the record and by the cameras, each its mean over a frame's interval: what a
        record of any rate and a path between frames have in common."""
        half = 0.5 * float(np.median(np.diff(self.time_s)))
        ends = (self.time_s - half, self.time_s + half)
        before, after = (self.record.velocity(self.clock.record_time_s(end)) * self.clock.scale for end in ends)
        slow, fast = (self.host.at(end, 1)[:, :3] @ self.directions.T for end in ends)
        own, seen = (after - before) / (2 * half), (fast - slow) / (2 * half)
        return own - own.mean(0), seen - seen.mean(0)

    def over_time(self, channels: list[Channel], frames: NDArray[np.int64]) -> pd.DataFrame:
        """Table ``accelerations``."""
        own, seen = self.means_m_per_s2()
        slow = SlowPart(self.time_s, self.period_s)
        moved, along = slow.without(self.moved_m()), slow.without(self.along_m)
        parts = [
            pd.DataFrame(
                {
                    "channel": channel.column,
                    "frame": frames,
                    "time_s": self.time_s,
                    "record_m_per_s2": own[:, c],
                    "cameras_m_per_s2": seen[:, c],
                    "record_m": moved[:, c],
                    "cameras_m": along[:, c],
                }
            )
            for c, channel in enumerate(channels)
        ]
        return pd.concat(parts, ignore_index=True)


def _row(channel: Channel, c: int, table: _Frames) -> dict[str, object]:
    """Row of table ``accelerometers``."""
    clock, gain, gain_sd = table.clock, float(table.clock.gain[c]), float(table.clock.gain_sd[c])
    own, seen = (both[:, c] for both in table.means_m_per_s2())
    slow = SlowPart(table.time_s, table.period_s)
    moved, along = slow.without(table.moved_m()[:, c]), slow.without(table.along_m[:, c])
    stated = channel.sensitivity_mv_per_g
    first = min(clock.others_s, key=lambda one: abs(one - clock.offset_s)) if clock.others_s else np.nan
    row: dict[str, object] = {
        "channel": channel.column,
        "body": channel.body,
        **{f"direction_{axis}": float(part) for axis, part in zip("xyz", table.directions[c], strict=True)},
        "offset_s": clock.offset_s,
        "offset_sd_s": clock.offset_sd_s,
        "time_scale": clock.scale,
        "time_scale_sd": clock.scale_sd,
        "middle_sd_s": clock.middle_sd_s,
        "other_offset_s": first,
        "gain": gain,
        "gain_sd": gain_sd,
        "stated_sensitivity_mv_per_g": np.nan if stated is None else stated,
        "sensitivity_mv_per_g": np.nan if stated is None else stated / gain,
        "sensitivity_sd_mv_per_g": np.nan if stated is None else stated * gain_sd / gain**2,
        "share": float(clock.share[c]),
        "error_m_per_s2": float(np.sqrt(np.mean((own - seen) ** 2))),
        "error_with_gain_m_per_s2": float(np.sqrt(np.mean((gain * own - seen) ** 2))),
        "error_m": float(np.sqrt(np.mean((moved - along) ** 2))),
        "error_with_gain_m": float(np.sqrt(np.mean((gain * moved - along) ** 2))),
        "frames": len(table.time_s),
    }
    lines = [_line(slow, one, 1.0 / table.period_s) for one in (moved, along)]
    for by, line, scale in zip(("record", "cameras"), lines, (clock.scale, 1.0), strict=True):
        row[f"{by}_frequency_hz"] = line.frequency_hz * scale  # each in its own clock
        row[f"{by}_amplitude_m_per_s2"] = line.acceleration_m_per_s2
    row["phase_rad"] = float(np.angle(np.exp(1j * (lines[0].phase_rad - lines[1].phase_rad))))
    return row


@dataclass(frozen=True)
class Line:
    """The main line of a displacement: NaN where there is none."""

    frequency_hz: float = np.nan
    acceleration_m_per_s2: float = np.nan
    phase_rad: float = np.nan


def _line(slow: SlowPart, displacement_m: Array, near_hz: float) -> Line:
    """Frequency, amplitude of the acceleration and phase in the run's middle, with overtones beside it, of a
    displacement (N,) that has lost its ``slow`` part."""
    since, omega = slow.time_s - slow.time_s.mean(), 2 * np.pi * near_hz
    slope = np.zeros_like(since)
    line = Line()
    for _ in range(LINE_STEPS):
        waves = [f(n * omega * since) for n in range(1, HARMONICS + 1) for f in (np.cos, np.sin)]
        design = slow.without(np.stack([*waves, slope], -1))
        found = np.linalg.lstsq(design, displacement_m, rcond=1e-12)[0]
        cosine, sine = float(found[0]), float(found[1])
        omega = float(np.clip(omega + found[-1], 0.9 * omega, 1.1 * omega))
        line = Line(omega / (2 * np.pi), omega**2 * float(np.hypot(cosine, sine)), float(np.arctan2(-sine, cosine)))
        if np.sum((displacement_m - design @ found) ** 2) > MOST_BESIDE * np.sum(displacement_m**2):
            return Line()  # a sweep, a random drive
        slope = since * (sine * np.cos(omega * since) - cosine * np.sin(omega * since))
    return line
