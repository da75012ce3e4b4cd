"""The Host beside its drive: what it does after impacts and with the ground, before and after what was found."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLUE, GREY, RED, label, legend, new_figure
from analysis.gap.drive.findings import DriveSteps
from analysis.gap.drive.measured_path import MeasuredPath

Array = NDArray[np.float64]
# Seconds of a run that are shown: some swings, each seen.
SHOWN_S = 0.5


def drive_figure(drive: DriveSteps) -> Figure | None:
    """The run in which the Host leaves its drive most, along the axis on which it does, and the spectrum of all runs;
    None where no Host follows a drive."""
    if not drive.paths:
        return None
    before = [path.beside_drive(path.place) for path in drive.paths]
    model = [drive.places(k) for k in range(len(drive.paths))]
    after = [path.beside_drive(path.place - one) for path, one in zip(drive.paths, model, strict=True)]
    worst = int(np.argmax([np.std(one - rest) or np.std(one) for one, rest in zip(before, after, strict=True)]))
    path, axis = drive.paths[worst], int(np.argmax(np.std(before[worst], axis=0)))
    figure, axes = new_figure(1, 2, height_in=2.9, gap_in=(0.7, 0.3))
    ax = axes[0, 0]
    shown = path.time_s < path.time_s[0] + SHOWN_S
    t = 1e3 * (path.time_s[shown] - path.time_s[0])
    ax.plot(t, 1e6 * before[worst][shown, axis], ".", ms=2.5, color=GREY, label="measured")
    found = bool(drive.swings or drive.lines)
    if found:
        ax.plot(t, 1e6 * path.beside_drive(model[worst])[shown, axis], color=BLUE, lw=1.2, label="found")
    hits = 1e3 * (drive.pushes[path.run].normal.time_s - path.time_s[0])
    for hit in hits[(hits > 0) & (hits < t[-1])]:
        ax.axvline(hit, color=RED, lw=0.5, alpha=0.5)
    label(ax, "time from the run's start (ms)", f"Host's {'xy'[axis]} beside its drive (µm)")
    legend(ax)
    ax = axes[0, 1]
    for values, colour, name in ((before, RED if found else BLUE, "measured"), (after, BLUE, "without what was found")):
        if name == "measured" or found:
            hz, size = _spectrum(drive.paths, values)
            ax.semilogx(hz, 1e6 * size, color=colour, lw=1.0, label=name)
    label(ax, "frequency (Hz)", "amplitude (µm, RMS over runs)")
    legend(ax)
    return figure


def _spectrum(paths: tuple[MeasuredPath, ...], values: list[Array]) -> tuple[Array, Array]:
    """Frequencies (Hz) and amplitudes (m, RMS over runs and axes) on a grid of the longest run."""
    longest = max(float(np.ptp(path.time_s)) for path in paths)
    period = float(np.median(np.diff(paths[0].time_s)))
    hz = np.arange(1.0, 0.5 * longest / period) / longest
    power = np.zeros(len(hz))
    for path, one in zip(paths, values, strict=True):
        window = np.hanning(len(path.time_s))[:, None]
        even = np.arange(path.time_s[0], path.time_s[-1], period)
        for axis in range(2):
            signal = np.interp(even, path.time_s, one[:, axis] * window[:, 0])
            size = np.abs(np.fft.rfft(signal)) * 2 / (0.5 * len(even))
            power += np.interp(hz, np.fft.rfftfreq(len(even), period), size) ** 2
    return hz, np.asarray(np.sqrt(power / (2 * len(paths))))
