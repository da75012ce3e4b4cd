"""A short film of the motion for talks: the rig from above beside its time curves, measured and simulated
together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from analysis.figures.style import BLACK, FONT_PT, GREY, HOST_COLOUR, MM, NES_COLOUR, ORANGE, label
from analysis.figures.trajectory import column
from ovines.errors import InputError
from ovines.io.atomic_write import written_whole
from ovines.recording import Recording

Array = NDArray[np.float64]
SIZE_IN, DPI = (8.0, 4.0), 100
TRAIL_S = 0.06


@dataclass(frozen=True)
class Film:
    """What to show: from ``start_s`` to ``end_s``, ``slower`` times slower than it was, at ``rate_hz``
    pictures per second.
    """

    start_s: float = float("-inf")
    end_s: float = float("inf")
    slower: float = 20.0
    rate_hz: float = 20.0
    most_pictures: int = 400


def animate(
    motion: pd.DataFrame,
    recording: Recording,
    path: Path,
    film: Film = Film(),
    simulation: pd.DataFrame | None = None,
) -> int:
    """Write a .gif or .mp4 of ``motion`` (and ``simulation`` beside it, table ``simulation``) and return its
    number of pictures.

    Frames in which the NES was not seen show the Host alone.  A film of more than ``most_pictures`` is
    refused: it would be too large for a talk.
    """
    if path.suffix not in (".gif", ".mp4"):
        raise InputError(f"a film named {path.name}", "a name that ends in .gif or .mp4", "change --out")
    clock = motion["time_s"].to_numpy(float)
    if not len(clock):
        raise InputError("a motion without a row", "frames to show", "run `ovines run` again")
    start_s, end_s = max(film.start_s, clock[0]), min(film.end_s, clock[-1])
    times = np.arange(start_s, end_s, 1 / (film.rate_hz * film.slower))
    if not 2 <= len(times) <= film.most_pictures:
        raise InputError(
            f"{max(len(times), 0)} pictures from {start_s:g} s to {end_s:g} s",
            f"2 to {film.most_pictures}",
            "change --start, --end or --slower",
        )
    pictures = _pictures(motion, simulation, recording, times)
    (_write_gif if path.suffix == ".gif" else _write_mp4)(pictures, path, film.rate_hz)
    return len(times)


def _pictures(
    motion: pd.DataFrame, simulation: pd.DataFrame | None, recording: Recording, times: Array
) -> Iterator[NDArray[np.uint8]]:
    """RGB pictures (height, width, 3), one per time."""
    figure = Figure(figsize=SIZE_IN, dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    rig = figure.add_axes((0.08, 0.13, 0.41, 0.82))
    curves = [figure.add_axes((0.6, y, 0.38, 0.36)) for y in (0.57, 0.13)]
    _dress(rig, curves, motion, simulation, times)
    actors = [_Actor(rig, motion, recording, NES_COLOUR, True)]
    if simulation is not None:
        actors.append(_Actor(rig, simulation, recording, ORANGE, False))
    cursors = [ax.axvline(times[0], color=BLACK, lw=1, animated=True) for ax in curves]
    clock = rig.text(0.02, 0.98, "", transform=rig.transAxes, va="top", fontsize=FONT_PT, animated=True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for time_s in times:
        canvas.restore_region(background)
        clock.set_text(f"{1e3 * time_s:.0f} ms")
        for cursor in cursors:
            cursor.set_xdata([time_s, time_s])
        for ax, artist in [(rig, a) for actor in actors for a in actor.at(time_s)] + [
            (rig, clock),
            *zip(curves, cursors, strict=True),
        ]:
            ax.draw_artist(artist)
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _dress(rig: Axes, curves: list[Axes], motion: pd.DataFrame, simulation: pd.DataFrame | None, times: Array) -> None:
    for ax, axis in zip(curves, "xy", strict=True):
        for table, colour, name in ((motion, NES_COLOUR, "NES"), (simulation, ORANGE, "simulated")):
            if table is not None:
                style = (0, (3, 3)) if table is simulation else "-"
                ax.plot(
                    table["time_s"], MM * column(table, f"nes_{axis}_m"), color=colour, ls=style, lw=1.3, label=name
                )
        ax.plot(motion["time_s"], MM * column(motion, f"host_{axis}_m"), color=HOST_COLOUR, lw=0.9, label="Host")
        ax.set_xlim(times[0], times[-1])
        label(ax, "time (s)" if axis == "y" else "", f"{axis} (mm)")
    curves[0].legend(fontsize=FONT_PT - 2, frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1, 0.98))
    for ax in (rig, *curves):
        ax.tick_params(labelsize=FONT_PT - 1)
        ax.spines[["top", "right"]].set_visible(False)
    rig.set_aspect("equal")
    label(rig, "x (mm)", "y (mm)")


class _Actor:
    """One motion as artists that move: the Host's wall, the disk with a radius drawn on it, the trail of its
    centre.
    """

    def __init__(self, rig: Axes, table: pd.DataFrame, recording: Recording, colour: str, with_host: bool) -> None:
        host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
        self._clock = table["time_s"].to_numpy(float)
        self._values = {
            name: column(table, name)
            for name in ("nes_x_m", "nes_y_m", "nes_angle_rad", "host_x_m", "host_y_m", "host_angle_rad")
        }
        self._radius_mm = MM * (nes.radius_m if nes is not None else 0.0)
        self._corners = None if host is None or host.polygon_m is None else MM * np.asarray(host.polygon_m, float)
        self._wall: Circle | Polygon | None = None
        self._cylinder: Circle | None = None
        if with_host and host is not None:
            reach = MM * (host.inner_radius_m or 0.0) if self._corners is None else float(np.abs(self._corners).max())
            self._wall = Circle((0, 0), reach) if self._corners is None else Polygon(self._corners)
            self._wall.set(fill=False, edgecolor=HOST_COLOUR, linewidth=2, animated=True)
            rig.add_patch(self._wall)
            if host.obstacle_radius_m:
                radius = MM * host.obstacle_radius_m
                self._cylinder = Circle((0, 0), radius, fc=HOST_COLOUR, lw=0, alpha=0.3, animated=True)
                rig.add_patch(self._cylinder)
        else:
            reach = self._radius_mm
        self._disk = Circle((0, 0), self._radius_mm, fc=colour, ec=BLACK, lw=0.8, alpha=0.55, animated=True)
        if not with_host:  # simulated: a dashed ring, so that the measured disk stays in sight below it
            self._disk.set(facecolor="none", edgecolor=colour, linewidth=2.2, linestyle=(0, (3, 3)), alpha=1.0)
        rig.add_patch(self._disk)
        (self._mark,) = rig.plot([], [], color=BLACK if with_host else colour, lw=1.4, animated=True)
        (self._trail,) = rig.plot([], [], color=colour, ls="-" if with_host else (0, (3, 3)), lw=1.0, animated=True)
        if with_host:
            rig.add_patch(Circle((0, 0), 0.3, color=GREY, lw=0))
            for axis, limits in (("x", rig.set_xlim), ("y", rig.set_ylim)):
                middle = MM * self._values[f"host_{axis}_m"]
                middle = middle[np.isfinite(middle)]
                low, high = (middle.min(), middle.max()) if len(middle) else (0.0, 0.0)
                limits(low - 1.05 * reach, high + 1.05 * reach)

    def at(self, time_s: float) -> list[Artist]:
        """Artists to draw at ``time_s``; those that were not seen then are left out."""
        now = {name: _nearby(self._clock, values, time_s) for name, values in self._values.items()}
        shown: list[Artist] = []
        if self._wall is not None and np.isfinite(now["host_x_m"] + now["host_y_m"]):
            middle, turn = (
                MM * np.array([now["host_x_m"], now["host_y_m"]]),
                np.nan_to_num(now["host_angle_rad"]),
            )
            if isinstance(self._wall, Circle):
                self._wall.center = (middle[0], middle[1])
            elif self._corners is not None:
                rotate = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
                self._wall.set_xy(self._corners @ rotate + middle)
            shown.append(self._wall)
            if self._cylinder is not None:
                self._cylinder.center = (middle[0], middle[1])
                shown.append(self._cylinder)
        recent = (self._clock <= time_s) & (self._clock > time_s - TRAIL_S)
        self._trail.set_data(MM * self._values["nes_x_m"][recent], MM * self._values["nes_y_m"][recent])
        shown.append(self._trail)
        if np.isfinite(now["nes_x_m"] + now["nes_y_m"]):
            x, y, turn = MM * now["nes_x_m"], MM * now["nes_y_m"], now["nes_angle_rad"]
            self._disk.center = (x, y)
            shown.append(self._disk)
            if np.isfinite(turn):
                self._mark.set_data([x, x + self._radius_mm * np.cos(turn)], [y, y + self._radius_mm * np.sin(turn)])
                shown.append(self._mark)
        return shown


def _nearby(clock: Array, values: Array, time_s: float) -> float:
    """Interpolated between the two frames around ``time_s``; NaN where either is missing."""
    after = int(np.clip(np.searchsorted(clock, time_s), 1, len(clock) - 1))
    share = (time_s - clock[after - 1]) / (clock[after] - clock[after - 1])
    return float((1 - share) * values[after - 1] + share * values[after])


def _write_gif(pictures: Iterator[NDArray[np.uint8]], path: Path, rate_hz: float) -> None:
    from PIL import Image

    first, *rest = [
        Image.fromarray(picture).quantize(64, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        for picture in pictures
    ]
    with written_whole(path) as temporary:
        first.save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=rest,
            duration=round(1000 / rate_hz),
            loop=0,
            optimize=False,
            comment=b"ovines film",  # whose it is: ovines.pipeline.ownership
        )


def _write_mp4(pictures: Iterator[NDArray[np.uint8]], path: Path, rate_hz: float) -> None:
    import cv2

    with written_whole(path) as temporary:
        film = temporary.with_suffix(".film.mp4")  # the writer chooses the container by the name's end
        try:
            writer = cv2.VideoWriter(
                str(film),
                cv2.VideoWriter.fourcc(*"mp4v"),
                rate_hz,
                (int(SIZE_IN[0] * DPI), int(SIZE_IN[1] * DPI)),
            )
            if not writer.isOpened():
                raise InputError("an OpenCV that cannot write MP4 here", "one with its video back end", "write a .gif")
            for picture in pictures:
                writer.write(np.ascontiguousarray(picture[..., ::-1]))
            writer.release()
            with open(film, "ab") as handle:  # an empty box, which players pass over, says whose it is
                handle.write(b"\0\0\0\x0efreeovines")
            film.replace(temporary)
        finally:
            film.unlink(missing_ok=True)
