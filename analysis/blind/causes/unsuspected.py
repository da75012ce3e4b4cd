"""Causes in nobody's list, a seventh group, written for a sealed trial by somebody who had read neither the diagnosis
nor its laws.  What each is and its law: the docstrings of `plant.unsuspected` and `recording.unsuspected`."""

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread


def _polished_track(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A track where the disk has mostly run: somewhat inside the wall, or half-way to it."""
    out = {"track": 0.5 * size * spread(rng), "track_m": float(rng.uniform(0.018, 0.028))}
    draft.plant.update(out)
    return out


def _wandering_shim(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A shim that falls back to its place between the runs, and wanders in each of them alike."""
    out = {
        "shim": 0.16 * size * spread(rng),
        "shim_rad": float(rng.uniform(0.0, 6.283)),
        "shim_rad_per_s": float(rng.uniform(2.0, 4.0)) * sign(rng),
    }
    draft.plant.update(out)
    return out


def _glinting_stickers(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Foil stickers of the disk, and a lamp at one side of one camera."""
    draft.view.update(
        glint_px=1.0 * size * spread(rng),
        glint_rad=float(rng.uniform(0.0, 6.283)),
        lamp_rad=float(rng.uniform(0.0, 6.283)),
        glint_camera=int(rng.integers(2)),
    )
    return {"glint_px": draft.view["glint_px"], "angle_rad": draft.view["glint_rad"]}


def _twisted_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The first camera, on the shaker's own frame."""
    draft.view["twisted_rad"] = 4.5e-3 * size * spread(rng) * sign(rng)
    return {"twisted_rad": draft.view["twisted_rad"]}


UNSUSPECTED = [
    # A floor faced on a lathe: circles around the Host's centre, which hold what slides across them.
    Cause("unknown_concentric_marks", "flight", False, changes({"rings": 0.25})),
    # A track around the centre, polished in months of use.
    Cause("unknown_polished_track", "flight", False, _polished_track),
    # Dust that the disk sweeps together and pushes along, until a blow scatters it.
    Cause("unknown_dust_bow", "flight", False, changes({"bow_m_per_s2": 0.8})),
    # A sticker that has come off at one end and stands up like a fin.
    Cause("unknown_weathervane", "flight", False, changes({"vane_rad_per_s2": 11.0}, ("vane_rad",))),
    # A weight in the washer's hole that turns in its soft glue.
    Cause("unknown_loose_core", "flight", False, changes({"core_per_s": 1.6})),
    # A carriage with play in its guide leans one way there and the other way back.
    Cause("unknown_guide_play", "flight", False, changes({"lean_m_per_s2": 0.4}, ("lean_rad",))),
    # A washer punched of rolled sheet is harder along the grain.
    Cause("unknown_rolled_sheet", "impact", False, changes({"sheet": 0.11}, ("sheet_rad",))),
    # A shim behind the ring that the drive makes wander.
    Cause("unknown_wandering_shim", "impact", False, _wandering_shim),
    # A wall of plastic that melts under a hard blow with a fast slip.
    Cause("unknown_flash_heat", "impact", False, changes({"flash": 0.6})),
    # A rim whose oil each blow wipes off, and which creeps back.
    Cause("unknown_rewetted_rim", "impact", False, changes({"creeping": 0.7})),
    # A rubber ring around the rim that hard blows flatten.
    Cause("unknown_flattened_o_ring", "impact", False, changes({"o_ring_s_per_m": 0.05})),
    # A ring made of two halves, put together askew along their joint.
    Cause("unknown_split_ring", "geometry", False, changes({"split_m": 5.5e-4}, ("split_rad",), signed=True)),
    # A ring on thick double-sided tape, which trails behind the Host's velocity.
    Cause("unknown_trailing_ring", "geometry", False, changes({"trailing_m": 3.7e-4})),
    # Bright markers on bare steel draw tails; the Host's do not.
    Cause("unknown_comet_tails", "measurement", False, seen("comet_s", 6e-5)),
    # Foil stickers that light up at one edge as the disk turns.
    Cause("unknown_glinting_stickers", "measurement", False, _glinting_stickers),
    # A camera on the shaker's own frame, which the drive's reaction twists.
    Cause("unknown_twisted_camera", "measurement", False, _twisted_camera),
]

# What the effect of each follows, in words: what a search would have to find.
FOLLOWS = {
    "unknown_concentric_marks": "the angle between the slip and the radius from the Host's centre",
    "unknown_polished_track": "the distance from the Host's centre",
    "unknown_dust_bow": "the way slid since the last blow",
    "unknown_weathervane": "the angle between the disk and its way through the room, and the square of its speed",
    "unknown_loose_core": "the spin against its mean over the last 30 ms",
    "unknown_guide_play": "the sense in which the Host moves along the drive's axis",
    "unknown_rolled_sheet": "the place on the disk's rim that is struck, twice around it",
    "unknown_wandering_shim": "the azimuth of the blow against one that goes round with the time in the run",
    "unknown_flash_heat": "the approach speed times the slip",
    "unknown_rewetted_rim": "the time since the last blow",
    "unknown_flattened_o_ring": "the approach speed times the spin",
    "unknown_split_ring": "the azimuth in the Host",
    "unknown_trailing_ring": "the Host's velocity along the contact's normal",
    "unknown_comet_tails": "the velocity of the disk's markers in the picture",
    "unknown_glinting_stickers": "the disk's angle",
    "unknown_twisted_camera": "the Host's acceleration, and the place in the picture",
}
