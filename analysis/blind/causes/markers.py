"""Unlisted causes in the markers: how they were printed, how they sit on Host and disk, and how they are tracked."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, seen, sign, spread, vector


def _leaning_card(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Towards any direction of the disk."""
    draft.view.update(card_lean_rad=0.07 * size * spread(rng), card_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"card_lean_rad": draft.view["card_lean_rad"], "angle_rad": draft.view["card_rad"]}


def _slipped_marker(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(slipped_m=vector(0.5e-3 * size * spread(rng), rng))
    return {"x_m": draft.view["slipped_m"][0], "y_m": draft.view["slipped_m"][1]}


def _bent_tab(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(tab_m=5e-4 * size * spread(rng), tab_marker=int(rng.integers(4)))
    return {"tab_m": draft.view["tab_m"], "marker": float(draft.view["tab_marker"])}


def _flung_sticker(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Any sticker but the middle one."""
    draft.view.update(flung_m=3e-4 * size * spread(rng), flung_marker=int(rng.integers(1, 5)))
    return {"flung_m": draft.view["flung_m"], "marker": float(draft.view["flung_marker"] + 1)}


def _creeping_sticker(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Any sticker but the middle one, any way on the disk."""
    draft.view.update(creeping_m=vector(1.4e-5 * size * spread(rng), rng), creeping_marker=int(rng.integers(1, 5)))
    x, y = draft.view["creeping_m"]
    return {"x_m": x, "y_m": y, "marker": float(draft.view["creeping_marker"] + 1)}


def _sliding_sticker(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Any sticker but the middle one, any way on the disk."""
    way = vector(4.6e-4 * size * spread(rng), rng)
    draft.view.update(sliding_m_per_s=way, sliding_marker=int(rng.integers(1, 5)))
    return {"x_m_per_s": way[0], "y_m_per_s": way[1], "marker": float(draft.view["sliding_marker"] + 1)}


def _stretched_print(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Too long or too short."""
    draft.view["print_stretch"] = 0.0055 * size * spread(rng) * sign(rng)
    return {"print_stretch": draft.view["print_stretch"]}


def _scaled_print(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Too large or too small."""
    draft.view["print_scale"] = 0.023 * size * spread(rng) * sign(rng)
    return {"print_scale": draft.view["print_scale"]}


def _eccentric_print(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """To any side of the disk."""
    draft.view.update(reading_rad=0.034 * size * spread(rng), reading_at_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"reading_rad": draft.view["reading_rad"], "angle_rad": draft.view["reading_at_rad"]}


def _swelling_paper(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much too small at first as too large at last."""
    most = 0.0035 * size * spread(rng)
    draft.view.update(paper=tuple((most * np.linspace(-1.0, 1.0, runs)).tolist()))
    return {"paper": most}


def _rubbery_card(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """So slow that each of its swings is in several frames."""
    draft.view.update(card_s=1.35e-3 * size * spread(rng), card_hz=float(rng.uniform(25.0, 60.0)))
    return {"card_s": draft.view["card_s"], "frequency_hz": draft.view["card_hz"]}


def _clicked_templates(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Anew in each run."""
    if size > 0.0:
        draws = tuple(int(draw) for draw in rng.integers(2**31, size=runs))
        draft.view.update(clicked_px=0.45 * size * spread(rng), clicked_draw=draws)
    return {"clicked_px": draft.view.get("clicked_px", 0.0)}


def _wandering_templates(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Anew in each run."""
    if size > 0.0:
        draws = tuple(int(draw) for draw in rng.integers(2**31, size=runs))
        draft.view.update(wander_px=0.75 * size * spread(rng), wander_draw=draws)
    return {"wander_px": draft.view.get("wander_px", 0.0)}


def _bridged_gaps(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Anew in each run, twice as many for twice the severity."""
    if size > 0.0:
        draws = tuple(int(draw) for draw in rng.integers(2**31, size=runs))
        draft.view.update(bridged=0.02 * size * spread(rng), bridged_draw=draws)
    return {"bridged": draft.view.get("bridged", 0.0)}


def _hopping_labels(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Once in each run, at a time of its own: any two but the middle one."""
    one, other = (int(marker) + 1 for marker in rng.permutation(4)[:2])
    draft.view.update(
        hopped=tuple(rng.uniform(0.2, 0.7, runs).tolist()),
        hopped_s=0.05 * size * spread(rng),
        hopped_markers=(one, other),
    )
    return {"hopped_s": draft.view["hopped_s"], "marker": float(one + 1), "other": float(other + 1)}


MARKERS = [
    Cause("unknown_slipped_marker", "measurement", _slipped_marker),
    # One of the Host's markers sits on a tab that bends as the Host is accelerated.
    Cause("unknown_bent_tab", "measurement", _bent_tab),
    # A sticker that has come loose and is flung outwards by the spin.
    Cause("unknown_flung_sticker", "measurement", _flung_sticker, follows="the square of the spin"),
    # The disk's markers are on a card, and that on soft glue.
    Cause(
        "unknown_rubbery_card",
        "measurement",
        _rubbery_card,
        follows="the time since the last blows and their changes of spin",
        short_blows=True,
    ),
    # The disk's markers are on a card that has play on its pin.
    Cause(
        "unknown_card_play",
        "measurement",
        seen("card_play_rad", 0.023),
        follows="the sense of the last blow's change of spin",
        short_blows=True,
    ),
    # A sticker of the disk whose glue gives a little in each blow.
    Cause(
        "unknown_creeping_sticker",
        "measurement",
        _creeping_sticker,
        follows="the number of blows so far, at one marker of the disk",
    ),
    # A sticker of the disk whose glue is soft, and which is put right before each run.
    Cause(
        "unknown_sliding_sticker",
        "measurement",
        _sliding_sticker,
        follows="the time in the run, at one marker of the disk",
    ),
    # Markers of disk and Host from a printer that stretches its sheets.
    Cause(
        "unknown_stretched_print",
        "measurement",
        _stretched_print,
        follows="the place of the markers along one direction of their body",
    ),
    # Markers of the disk that were printed in another size than they were drawn.
    Cause(
        "unknown_scaled_print",
        "measurement",
        _scaled_print,
        follows="the place of the disk's markers from its middle",
    ),
    # The disk's markers are on a card, and that on tough glue.
    Cause(
        "unknown_shearing_glue",
        "measurement",
        seen("sheared_s", 9e-5),
        follows="the time since the last blows and their changes of the disk's velocity, in all of its markers",
        short_blows=True,
    ),
    # A shutter that is open for long.
    Cause(
        "unknown_long_shutter",
        "measurement",
        seen("smear_s2_per_m", 2.1e-5),
        follows="the square of the speed, along the markers' own way",
    ),
    # Markers of the Host on soft pads, which stay back as it is accelerated.
    Cause(
        "unknown_padded_markers",
        "measurement",
        seen("pads_m", 2.3e-4),
        follows="the Host's acceleration, in all of its markers",
    ),
    # Markers of the disk that were printed around another point than their middle.
    Cause(
        "unknown_eccentric_print",
        "measurement",
        _eccentric_print,
        follows="the disk's angle once around, in the angle itself",
    ),
    # The disk's markers are on a thick card, and the board lay below it.
    Cause(
        "unknown_raised_card",
        "measurement",
        seen("raised_m", 3.8e-4),
        follows="which camera sees the disk's markers, to its own side, always as much",
    ),
    # The Host's markers are printed on one sheet of paper, which swells.
    Cause(
        "unknown_swelling_paper",
        "measurement",
        _swelling_paper,
        follows="the number of the run, in the way of the Host's markers from their middle",
    ),
    # The disk's markers are on a card that is not level.
    Cause(
        "unknown_leaning_card",
        "measurement",
        _leaning_card,
        follows="the disk's angle, to either camera's own side",
    ),
    # A card whose glue lets go in the course of each run.
    Cause(
        "unknown_lifting_card",
        "measurement",
        seen("peeled_m", 7e-4),
        follows="the time in the run, evenly, to either camera's own side, at the disk's markers",
    ),
    # A top plate of the Host on soft spacers, with its markers.
    Cause(
        "unknown_pitching_plate",
        "measurement",
        seen("pitched_rad", 0.014),
        follows="the Host's acceleration along x times the place of its markers, to either camera's own side",
    ),
    # A blow lifts the disk, and its markers with it: cameras that look askew see them elsewhere.
    Cause(
        "unknown_risen_markers",
        "measurement",
        seen("risen_s", 1.6e-4),
        follows="the time since the last blow and its change of the disk's velocity, to either camera's own side",
        short_blows=True,
    ),
    # --- trackers ---
    # A tracker whose templates somebody clicks by hand in each run.
    Cause(
        "unknown_clicked_templates",
        "measurement",
        _clicked_templates,
        follows="the number of the run, in no order, at each marker in each camera by itself",
    ),
    # A tracker that loses two markers of the disk and finds each in the other's place, for a while.
    Cause(
        "unknown_hopping_labels",
        "measurement",
        _hopping_labels,
        follows="the time in the run, in one stretch of it, at two markers of the disk in one camera",
    ),
    # A tracker that moves on only where a marker has moved by so much.
    Cause(
        "unknown_dead_band",
        "measurement",
        seen("dead_band_px", 0.75),
        follows="the direction of the velocity in the picture, whatever its size",
    ),
    # A tracker that goes by the way of what the wall hides in part.
    Cause(
        "unknown_guessing_tracker",
        "measurement",
        seen("guessed", 0.36),
        follows="the way of each of the disk's markers to the wall, and each blow just after it",
        round_only=True,
    ),
    # A tracker that takes each frame's markers for its templates of the next one.
    Cause(
        "unknown_wandering_templates",
        "measurement",
        _wandering_templates,
        follows="the time in the run, farther and farther in no order, at each marker in each camera by itself",
    ),
    # A tracker whose search window is too small for what is fast.
    Cause(
        "unknown_small_window",
        "measurement",
        seen("missed", 0.08),
        follows="what the speed in the picture has beyond some speed, against its direction",
    ),
    # A tracker that loses the disk's markers now and then, and what is filled in.
    Cause(
        "unknown_bridged_gaps",
        "measurement",
        _bridged_gaps,
        follows="the time in the run, in short stretches in no order, and each blow within one",
    ),
    # A tracker that smooths its tracks, over blows, too.
    Cause(
        "unknown_smoothed_tracks",
        "measurement",
        seen("smoothed", 0.28),
        follows="the acceleration in the picture, and each blow within two frames of it",
    ),
]
