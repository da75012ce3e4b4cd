"""Names for a body without `layout_m` where nobody named its markers: what the first frame's geometry suggests.

No picture says which of several look-alike discs is called N1; but the names of a body without a layout are the
reader's own, so that the order of `vision.identity.geometric_names` serves as well as any and stays the same through
the recording.
"""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from ovines.camera import Camera
from ovines.recording import Recording
from vision.frames.sources import Source, stream
from vision.identity.geometric_names import as_rows, pair_discs, suggest_names
from vision.identity.layouts import rig_radius
from vision.markers.detect import find_discs


def names_by_geometry(
    recording: Recording, cameras: Sequence[Camera], sources: Sequence[Source]
) -> tuple[pd.DataFrame | None, list[str]]:
    """Names of the first frame (columns camera, marker, u_px, v_px) of the moving bodies without a layout, and a note
    on them.

    None where every moving body has its layout, where a camera lacks its first picture, or where the discs found do not
    show a body: the names must then come from `--names`.
    """
    bodies = [
        name for name, body in recording.bodies.items() if name != "ground" and body.markers and body.layout_m is None
    ]
    if not bodies:
        return None, []
    images = next((pictures for _, pictures in stream(list(sources), [], 1)), [])
    images, cameras = images[:2], cameras[:2]  # further cameras find what these two have named
    if len(images) != 2 or any(image is None for image in images):
        return None, []
    discs = [find_discs(image) for image in images if image is not None]
    offsets = [recording.camera(camera.name).window_offset_px for camera in cameras]
    pairs = pair_discs(cameras, offsets, discs, rig_radius(recording, cameras))
    found = suggest_names(pairs, recording)
    wanted = [marker for name in bodies for marker in recording.bodies[name].markers]
    if not all(marker in found for marker in wanted):
        return None, []
    rows = as_rows({marker: found[marker] for marker in wanted}, pairs, [camera.name for camera in cameras], discs)
    note = (
        f"the markers of {' and '.join(bodies)} have no layout_m and no names: named by the first frame's geometry, a "
        f"centre marker first, the others "
        "clockwise from above beginning left (-x); if they should bear other names, run `ovines pick`"
    )
    return pd.DataFrame(rows, columns=["camera", "marker", "u_px", "v_px"]), [note]
