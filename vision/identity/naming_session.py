"""Names given to discs by hand: what is named where, which marker is next, and undoing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

Place = tuple[float, float]
Row = tuple[str, str, float, float]
SAME_PX = 3.0  # two markers of one camera closer than this are one disc


class Naming:
    """Places (u, v in window pixels) by (camera, marker); markers are chosen in the order given."""

    def __init__(self, cameras: Sequence[str], markers: Sequence[str], suggested: Iterable[Row] = ()) -> None:
        self.cameras, self.markers = tuple(cameras), tuple(markers)
        self.places: dict[tuple[str, str], Place] = {
            (camera, marker): (u, v) for camera, marker, u, v in suggested if camera in cameras and marker in markers
        }
        self.current = self.markers[0]
        self._before: list[tuple[dict[tuple[str, str], Place], str]] = []
        if self.is_named(self.current):
            self.forward()

    def is_named(self, marker: str) -> bool:
        """Whether every camera has a place for it."""
        return all((camera, marker) in self.places for camera in self.cameras)

    @property
    def missing(self) -> list[tuple[str, str]]:
        """(camera, marker) that have no place yet."""
        return [
            (camera, marker)
            for marker in self.markers
            for camera in self.cameras
            if (camera, marker) not in self.places
        ]

    def put(self, camera: str, place: Place) -> None:
        """The current marker is here in this camera; whatever marker was here loses its place.  On to the next unnamed
        marker once all cameras have this one.
        """
        self._remember()
        before = self.marker_at(camera, place, SAME_PX)
        if before is not None:
            del self.places[camera, before]
        self.places[camera, self.current] = (float(place[0]), float(place[1]))
        if self.is_named(self.current):
            self.forward()

    def remove(self, camera: str, place: Place, reach_px: float) -> str | None:
        """Take the name off the nearest named place within reach, and choose that marker; its name, or None."""
        marker = self.marker_at(camera, place, reach_px)
        if marker is not None:
            self._remember()
            del self.places[camera, marker]
            self.current = marker
        return marker

    def clear(self) -> None:
        """Forget every name."""
        self._remember()
        self.places, self.current = {}, self.markers[0]

    def undo(self) -> None:
        """Take the last change back; nothing where there is none."""
        if self._before:
            self.places, self.current = self._before.pop()

    def choose(self, marker: str) -> None:
        """The marker that the next click names."""
        self.current = marker

    def step(self, by: int) -> None:
        """The marker ``by`` places on in the list, round its ends."""
        self.current = self.markers[(self.markers.index(self.current) + by) % len(self.markers)]

    def forward(self) -> None:
        """The next marker that lacks a place; stays where all are named."""
        at = self.markers.index(self.current)
        order = self.markers[at + 1 :] + self.markers[: at + 1]
        self.current = next((marker for marker in order if not self.is_named(marker)), self.current)

    def marker_at(self, camera: str, place: Place, reach_px: float) -> str | None:
        """Marker named nearest to a place in a camera, None beyond reach."""
        own = [
            (np.hypot(u - place[0], v - place[1]), marker) for (c, marker), (u, v) in self.places.items() if c == camera
        ]
        return min(own)[1] if own and min(own)[0] <= reach_px else None

    def rows(self) -> list[Row]:
        """camera, marker, u_px, v_px in the order of cameras and markers."""
        return [
            (camera, marker, *self.places[camera, marker])
            for camera in self.cameras
            for marker in self.markers
            if (camera, marker) in self.places
        ]

    def _remember(self) -> None:
        self._before.append((dict(self.places), self.current))
