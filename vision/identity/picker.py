"""A matplotlib window in which markers are named by clicking, in one frame of each camera.

Left click: the chosen marker is here (the disc nearest to the click).  Right click: this disc has no name.  The list
beside the pictures chooses a marker; keys: up and down the same, u undo, c clear, Enter save, Escape leave without
saving.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import Event, KeyEvent, MouseButton, MouseEvent
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.identity.naming_session import Naming
from vision.markers.row import U, V

Array = NDArray[np.float64]
SNAP_PX, REACH_PX = 25.0, 25.0  # from a click to the disc that it means, and to the name that it removes
# Okabe and Ito's colours, as in every figure of the application.
COLOURS = {"nes": "#56B4E9", "host": "#D55E00", "ground": "#009E73"}
CHOSEN = "#F0E442"
OUTWARDS_PT = 24.0  # distance of a name from its disc
# Heights at which the marker may lie, for the line in the other camera: parts of that camera's own height.
HEIGHTS = np.linspace(-0.005, 0.045, 40)
CENTRAL = 0.3  # of the farthest named disc's distance from their middle, within which a disc has no direction outwards


@dataclass(frozen=True, eq=False)
class Frame:
    """What the window shows of a camera: picture (h, w), discs (n, 2) in window pixels, calibration and window."""

    camera: Camera
    offset_px: tuple[int, int]
    image: NDArray[Any]
    discs: Array


class PickWindow:
    """The window on a figure; ``saved``: whether it was left by saving."""

    def __init__(self, figure: Figure, frames: Sequence[Frame], naming: Naming, body_of: Mapping[str, str]) -> None:
        self.figure, self.frames, self.naming, self.body_of = figure, list(frames), naming, body_of
        self.saved = False
        self.done = False
        figure.set_facecolor("white")
        widths = [frame.image.shape[1] for frame in frames]
        grid = figure.add_gridspec(
            1,
            len(frames) + 1,
            width_ratios=[*widths, 0.22 * sum(widths)],
            left=0.01,
            right=0.99,
            bottom=0.12,
            top=0.93,
            wspace=0.03,
        )
        self.pictures = [figure.add_subplot(grid[0, i]) for i in range(len(frames))]
        self.list = figure.add_subplot(grid[0, len(frames)])
        self.prompt = figure.text(0.01, 0.035, "", fontsize=10)
        self._drawn: list[Any] = []
        for ax, frame in zip(self.pictures, self.frames, strict=True):
            self._picture(ax, frame)
        self.list.set(xlim=(0, 1), ylim=(len(naming.markers) - 0.5, -0.5), xticks=[], yticks=[])
        for side in self.list.spines.values():
            side.set_visible(False)
        figure.canvas.mpl_connect("button_press_event", self._click)
        figure.canvas.mpl_connect("key_press_event", self._key)
        self.draw()

    def _picture(self, ax: Axes, frame: Frame) -> None:
        low, high = np.percentile(frame.image[::4, ::4], (0.5, 99.8))
        ax.imshow(frame.image, cmap="gray", vmin=low, vmax=high, interpolation="nearest")
        ax.plot(frame.discs[:, 0], frame.discs[:, 1], "o", mfc="none", mec="white", ms=9, mew=0.8, alpha=0.6)
        ax.set(xticks=[], yticks=[], xlim=(-0.5, frame.image.shape[1] - 0.5), ylim=(frame.image.shape[0] - 0.5, -0.5))
        ax.set_title(frame.camera.name, fontsize=10, loc="left", parse_math=False)

    def _click(self, event: Event) -> None:
        if not isinstance(event, MouseEvent) or event.xdata is None or event.ydata is None or self._navigating():
            return
        if event.inaxes is self.list:
            self.naming.choose(self.naming.markers[int(np.clip(round(event.ydata), 0, len(self.naming.markers) - 1))])
        elif event.inaxes in self.pictures:
            frame = self.frames[self.pictures.index(event.inaxes)]
            place = (float(event.xdata), float(event.ydata))
            if event.button == MouseButton.LEFT:
                self.naming.put(frame.camera.name, snapped(place, frame.discs))
            elif event.button == MouseButton.RIGHT:
                self.naming.remove(frame.camera.name, place, REACH_PX)
        self.draw()

    def _navigating(self) -> bool:
        """Whether a zoom or pan of the toolbar takes the clicks."""
        toolbar = getattr(self.figure.canvas, "toolbar", None)
        return bool(toolbar is not None and getattr(toolbar, "mode", ""))

    def _key(self, event: Event) -> None:
        if not isinstance(event, KeyEvent):
            return
        actions = {
            "up": lambda: self.naming.step(-1),
            "down": lambda: self.naming.step(1),
            "u": self.naming.undo,
            "c": self.naming.clear,
        }
        if event.key in actions:
            actions[event.key]()
            self.draw()
        elif event.key == "enter" and not self.naming.missing:
            self.saved = True
            self._leave()
        elif event.key == "escape":
            self._leave()

    def _leave(self) -> None:
        self.done = True
        if self.figure.canvas.manager is not None:
            import matplotlib.pyplot as plt

            plt.close(self.figure)  # pyplot must know: it would close the window once more when the program ends

    def draw(self) -> None:
        """Draw names, list and what to do next anew."""
        for artist in self._drawn:
            artist.remove()
        self._drawn = []
        for ax, frame in zip(self.pictures, self.frames, strict=True):
            self._names(ax, frame)
            self._where_it_may_be(ax, frame)
        for row, marker in enumerate(self.naming.markers):
            seen = [camera for camera in self.naming.cameras if (camera, marker) in self.naming.places]
            current = marker == self.naming.current
            text = f"{marker}   " + (", ".join(seen) if seen else "-")
            box = {"facecolor": CHOSEN, "edgecolor": "none", "pad": 2.5} if current else None
            colour = COLOURS.get(self.body_of.get(marker, ""), "#222222")
            self._drawn.append(self.list.plot(0.03, row, "o", color=colour, ms=7, clip_on=False)[0])
            self._drawn.append(self.list.text(0.12, row, text, va="center", fontsize=9, bbox=box, parse_math=False))
        self.prompt.set_text(self._prompt_text())
        self.figure.canvas.draw_idle()

    def _prompt_text(self) -> str:
        keys = "right click: remove   up/down: choose   u: undo   c: clear   Esc: leave"
        missing = self.naming.missing
        if not missing:
            return f"All named. Check them, then Enter saves.      {keys}"
        cameras = [camera for camera, marker in missing if marker == self.naming.current]
        where = " and ".join(cameras) if cameras else "anywhere, to move it"
        return f"Click {self.naming.current} in {where} ({len(missing)} left).      {keys}"

    def _names(self, ax: Axes, frame: Frame) -> None:
        """Rings on the named discs; their names stand outside their body, so that no other disc is covered."""
        own = {marker: place for (camera, marker), place in self.naming.places.items() if camera == frame.camera.name}
        for marker, place in own.items():
            body = self.body_of.get(marker, "")
            colour = CHOSEN if marker == self.naming.current else COLOURS.get(body, "white")
            self._drawn += ax.plot(*place, "o", mfc="none", mec=colour, ms=11, mew=1.8)
            fellows = np.array([at for other, at in own.items() if self.body_of.get(other, "") == body])
            across, down = OUTWARDS_PT * _outwards(np.asarray(place), fellows)
            at = ax.transData.transform(place) + np.array([across, -down]) * self.figure.dpi / 72
            if not ax.bbox.x0 < at[0] < ax.bbox.x1:
                across = -across
            if not ax.bbox.y0 < at[1] < ax.bbox.y1:
                down = -down
            self._drawn.append(
                ax.annotate(
                    marker,
                    place,
                    (across, -down),
                    textcoords="offset points",
                    ha="center",
                    va="center",
                    color="white",
                    fontsize=8,
                    parse_math=False,
                    arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.8},
                    bbox={"facecolor": "#222222", "edgecolor": colour, "alpha": 0.8, "pad": 1.5},
                )
            )

    def _where_it_may_be(self, ax: Axes, frame: Frame) -> None:
        """The line on which the chosen marker must lie in this camera, where another camera has it already."""
        marker = self.naming.current
        if (frame.camera.name, marker) in self.naming.places:
            return
        for other in self.frames:
            place = self.naming.places.get((other.camera.name, marker))
            if place is not None:
                ray, centre_m = other.camera.rays(np.asarray(place, float) + other.offset_px), other.camera.centre_m
                points_m = centre_m + ((HEIGHTS - 1.0) * centre_m[2] / ray[2])[:, None] * ray
                line = frame.camera.project(points_m) - frame.offset_px
                self._drawn += ax.plot(line[:, 0], line[:, 1], "-", color=CHOSEN, lw=1.2, scalex=False, scaley=False)


def _outwards(place: Array, fellows: Array) -> Array:
    """Unit vector (2,) from the middle of a body's named discs (n, 2) to one of them; for the one in the middle, the
    widest gap between the others.
    """
    away = fellows - fellows.mean(0)
    own = place - fellows.mean(0)
    reach = np.hypot(*away.T)
    if np.hypot(*own) > CENTRAL * max(reach.max(), 1.0):
        return own / np.hypot(*own)
    others = np.sort(np.arctan2(*away[reach > CENTRAL * reach.max()].T[::-1])) if reach.max() > 0 else np.empty(0)
    if not len(others):
        return np.array([1.0, 0.0])
    gaps = np.diff(np.append(others, others[0] + 2 * np.pi))
    widest = others[int(np.argmax(gaps))] + 0.5 * gaps.max()
    return np.array([np.cos(widest), np.sin(widest)])


def snapped(place: tuple[float, float], discs: Array) -> tuple[float, float]:
    """The centre of the nearest disc (n, 2) within reach, else the place itself."""
    if not len(discs):
        return place
    away = np.hypot(discs[:, 0] - place[0], discs[:, 1] - place[1])
    nearest = int(np.argmin(away))
    return (float(discs[nearest, 0]), float(discs[nearest, 1])) if away[nearest] <= SNAP_PX else place


def centres(fits: Array) -> Array:
    """(n, 2) places of fits (n, 20) of `find_discs`."""
    return fits[:, [U, V]]
