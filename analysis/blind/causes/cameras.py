"""Unlisted causes in boards, light, cameras and their pictures."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, seen, sign, spread, vector


def _heat_haze(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The lamp is switched on with each run, below either camera."""
    draft.view.update(
        haze_px=1.0 * size * spread(rng),
        haze_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        haze_rad_per_s=float(rng.uniform(20.0, 60.0)),
        haze_phase_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        haze_camera=int(rng.integers(2)),
    )
    return {"haze_px": draft.view["haze_px"], "rate_rad_per_s": draft.view["haze_rad_per_s"]}


def _glare(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    at = vector(0.02, rng)
    draft.view.update(glare_px=2.0 * size * spread(rng), glare_m=at, glare_camera=int(rng.integers(2)))
    return {"glare_px": draft.view["glare_px"], "x_m": at[0], "y_m": at[1]}


def _half_lid(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    edge = vector(0.012, rng)
    draft.view.update(
        lid_px=1.2 * size * spread(rng) * sign(rng),
        lid_m=edge,
        lid_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        lid_camera=int(rng.integers(2)),
    )
    return {"lid_px": draft.view["lid_px"], "x_m": edge[0], "y_m": edge[1], "edge_rad": draft.view["lid_rad"]}


def _glinting_stickers(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Foil stickers of the disk, and a lamp at one side of one camera."""
    draft.view.update(
        glint_px=1.0 * size * spread(rng),
        glint_rad=float(rng.uniform(0.0, 6.283)),
        lamp_rad=float(rng.uniform(0.0, 6.283)),
        glint_camera=int(rng.integers(2)),
    )
    return {"glint_px": draft.view["glint_px"], "angle_rad": draft.view["glint_rad"]}


def _shaded_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A low lamp at any side."""
    draft.view.update(shade_px=2.2 * size * spread(rng), shade_rad=float(rng.uniform(0.0, 6.283)))
    return {"shade_px": draft.view["shade_px"], "angle_rad": draft.view["shade_rad"]}


def _wobble(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(wobble_px=0.9 * size * spread(rng), wobble_hz=float(rng.uniform(15.0, 60.0)))
    return {"amplitude_px": draft.view["wobble_px"], "frequency_hz": draft.view["wobble_hz"]}


def _swinging_zoom(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(zoom_swing=8e-4 * size * spread(rng), zoom_swing_hz=float(rng.uniform(4.0, 40.0)))
    return {"zoom": draft.view["zoom_swing"], "frequency_hz": draft.view["zoom_swing_hz"]}


def _shaken_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(shaken_px=0.4 * size * spread(rng), shaken_hz=float(rng.uniform(15.0, 60.0)))
    return {"shaken_px": draft.view["shaken_px"], "frequency_hz": draft.view["shaken_hz"]}


def _shaking_tripod(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In any direction of the picture, late by a quarter of the drive's period at most."""
    draft.view.update(
        tripod_px=1.0 * size * spread(rng),
        tripod_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        tripod_s=float(rng.uniform(0.0, 0.02)),
    )
    return {"tripod_px": draft.view["tripod_px"], "late_s": draft.view["tripod_s"]}


def _pressed_button(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In any direction of the picture, in each run alike."""
    draft.view.update(
        button_px=2.3 * size * spread(rng),
        button_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        button_hz=float(rng.uniform(6.0, 18.0)),
    )
    return {"button_px": draft.view["button_px"], "frequency_hz": draft.view["button_hz"]}


def _twisted_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The first camera, on the shaker's own frame."""
    draft.view["twisted_rad"] = 4.5e-3 * size * spread(rng) * sign(rng)
    return {"twisted_rad": draft.view["twisted_rad"]}


def _bumped_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Between two runs, any two of them; before the only one."""
    draft.view.update(
        bumped_rad=3.5e-3 * size * spread(rng) * sign(rng),
        bumped_from=int(rng.integers(1, runs)) if runs > 1 else 0,
    )
    return {"bumped_rad": draft.view["bumped_rad"], "from_run": float(draft.view["bumped_from"] + 1)}


def _jogged_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Between two runs, any two of them; before the only one."""
    draft.view.update(
        jogged_px=0.8 * size * spread(rng),
        jogged_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        jogged_from=int(rng.integers(1, runs)) if runs > 1 else 0,
    )
    return {"jogged_px": draft.view["jogged_px"], "from_run": float(draft.view["jogged_from"] + 1)}


def _rolled_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """To either side, in all runs alike."""
    draft.view["rolled_rad"] = 3.5e-3 * size * spread(rng) * sign(rng)
    return {"rolled_rad": draft.view["rolled_rad"]}


def _longer_lens(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Too long or too short."""
    draft.view["focal"] = 0.0035 * size * spread(rng) * sign(rng)
    return {"focal": draft.view["focal"]}


def _tilted_sensor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Towards any side."""
    draft.view.update(keystone_px=2.0 * size * spread(rng), keystone_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"keystone_px": draft.view["keystone_px"], "angle_rad": draft.view["keystone_rad"]}


def _nudged_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The same way in each run, and in each at a time of its own; it is put back before the next."""
    draft.view.update(
        nudged_px=1.05 * size * spread(rng),
        nudged_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        nudged_share=tuple(rng.uniform(0.3, 0.7, runs).tolist()),
    )
    return {"nudged_px": draft.view["nudged_px"], "angle_rad": draft.view["nudged_rad"]}


def _fitted_lens(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Too far out or too far in."""
    draft.view["fifth_px"] = 1.4 * size * spread(rng) * sign(rng)
    return {"fifth_px": draft.view["fifth_px"]}


def _warming_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In any direction of the picture."""
    draft.view.update(warm_px=0.8 * size * spread(rng), warm_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"warm_px": draft.view["warm_px"], "angle_rad": draft.view["warm_rad"]}


def _skewed_picture(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """To either side."""
    draft.view["skewed"] = 0.006 * size * spread(rng) * sign(rng)
    return {"skewed": draft.view["skewed"]}


def _stretched_board(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Along any direction, too long or too short."""
    draft.view.update(board_stretch=0.0055 * size * spread(rng) * sign(rng), board_rad=float(rng.uniform(0.0, np.pi)))
    return {"board_stretch": draft.view["board_stretch"], "angle_rad": draft.view["board_rad"]}


def _bowed_board(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Up or down."""
    draft.view["board_bow"] = 0.003 * size * spread(rng) * sign(rng)
    return {"board_bow": draft.view["board_bow"]}


def _stretched_picture(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["stretched"] = 0.006 * size * spread(rng) * sign(rng)
    return {"stretched": draft.view["stretched"]}


def _knocked_lens(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Off its axis in any direction of the picture."""
    draft.view.update(knocked_px=0.6 * size * spread(rng), knocked_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"knocked_px": draft.view["knocked_px"], "angle_rad": draft.view["knocked_rad"]}


def _sagging_arm(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """To either side."""
    draft.view["sagging_rad"] = 6e-3 * size * spread(rng) * sign(rng)
    return {"sagging_rad": draft.view["sagging_rad"]}


def _sinking_head(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as far to one side of the mean at first as to the other at last."""
    most = 0.75 * size * spread(rng) * sign(rng)
    draft.view.update(head_px=tuple((most * np.linspace(-1.0, 1.0, runs)).tolist()))
    return {"head_px": most}


CAMERAS = [
    # --- the board ---
    # A printer that stretches the board along one direction.
    Cause(
        "unknown_stretched_board",
        "measurement",
        _stretched_board,
        follows="the place in the world along one direction, along that direction only",
        rivals=("length_scale_error",),
    ),
    # A board that was bowed as the cameras were calibrated.
    Cause(
        "unknown_bowed_board",
        "measurement",
        _bowed_board,
        follows="the third power of the place in the world",
        rivals=("length_scale_error",),
    ),
    # --- light ---
    # A lamp's reflection on a lid draws the markers' centres towards it.
    Cause("unknown_glare", "measurement", _glare),
    # Warm air that rises from a lamp, between a camera and the rig.
    Cause(
        "unknown_heat_haze",
        "measurement",
        _heat_haze,
        follows="the place in one camera's picture along one direction, against waves that go over it",
    ),
    # A pane over one half of the rig, put there after the calibration.
    Cause("unknown_half_lid", "measurement", _half_lid),
    # Bright markers on bare steel draw tails; the Host's do not.
    Cause(
        "unknown_comet_tails",
        "measurement",
        seen("comet_s", 6e-5),
        follows="the velocity of the disk's markers in the picture",
    ),
    # Foil stickers that light up at one edge as the disk turns.
    Cause("unknown_glinting_stickers", "measurement", _glinting_stickers, follows="the disk's angle"),
    # A low lamp, and the ring's own shade.
    Cause(
        "unknown_shaded_wall",
        "measurement",
        _shaded_wall,
        follows="the place of the disk's markers in the Host, along one direction",
    ),
    # Pictures that are exposed too much, in which the Host's bright markers run out.
    Cause(
        "unknown_blooming_markers",
        "measurement",
        seen("bloom_px", 1.9),
        follows="the way in the picture from each of the disk's markers to the Host's",
    ),
    # A lid on the ring that bulges, and through which the disk is seen.
    Cause(
        "unknown_bulging_lid",
        "measurement",
        seen("lid_bulge", 0.0045),
        follows="the place of the disk's markers from the Host's middle",
    ),
    # A lamp that the wall stands in the way of.
    Cause(
        "unknown_marker_shadow",
        "measurement",
        seen("shadow_m", 8e-4),
        follows="the way of each of the disk's markers to the wall",
        round_only=True,
    ),
    # --- cameras that move ---
    Cause("unknown_camera_wobble", "measurement", _wobble),
    Cause("unknown_camera_creep", "measurement", seen("creep_px", 1.5)),
    Cause("unknown_zooming_camera", "measurement", seen("zoom", 1.2e-3)),
    Cause("unknown_swinging_zoom", "measurement", _swinging_zoom),
    # A tripod that stands on the rig's own bench.
    Cause("unknown_shaken_camera", "measurement", _shaken_camera),
    # A tripod on the shaker's own floor.
    Cause(
        "unknown_shaking_tripod",
        "measurement",
        _shaking_tripod,
        follows="the Host's acceleration along the drive's axis, some time before",
    ),
    # A camera whose button somebody presses as a run begins.
    Cause(
        "unknown_pressed_button",
        "measurement",
        _pressed_button,
        follows="the time in the run, to and fro and dying out, the same all over one camera's picture",
    ),
    # A camera on the shaker's own frame, which the drive's reaction twists.
    Cause(
        "unknown_twisted_camera",
        "measurement",
        _twisted_camera,
        follows="the Host's acceleration, and the place in the picture",
    ),
    # A tripod that somebody has bumped between two runs.
    Cause(
        "unknown_bumped_camera",
        "measurement",
        _bumped_camera,
        follows="the place in one camera's picture, from one run on",
    ),
    # A tripod whose head sinks from run to run.
    Cause(
        "unknown_sinking_head",
        "measurement",
        _sinking_head,
        follows="the number of the run, the same all over one camera's picture",
    ),
    # A camera on an arm that gives in the lamps' heat, and is set right before each run.
    Cause(
        "unknown_sagging_arm",
        "measurement",
        _sagging_arm,
        follows="the time in the run, and the place in one camera's picture",
    ),
    # A camera that somebody has knocked against between two runs.
    Cause(
        "unknown_jogged_camera",
        "measurement",
        _jogged_camera,
        follows="the number of the run, from one on, the same all over one camera's picture",
    ),
    # A camera that was turned about its axis after the calibration.
    Cause(
        "unknown_rolled_camera",
        "measurement",
        _rolled_camera,
        follows="the place in one camera's picture, across it, always as much",
    ),
    # A camera that somebody nudges in each run, and sets right after it.
    Cause(
        "unknown_nudged_camera",
        "measurement",
        _nudged_camera,
        follows="the time in the run, from one on, the same all over one camera's picture",
    ),
    # A camera that was calibrated warm, whose mount gives as it warms up again.
    Cause(
        "unknown_warming_camera",
        "measurement",
        _warming_camera,
        follows="the number of the run, ever less, the same all over one camera's picture",
    ),
    # A camera that was calibrated warm, and that is cold as the series begins.
    Cause(
        "unknown_cold_camera",
        "measurement",
        seen("cold_zoom", 3.3e-3),
        follows="the place in one camera's picture, and the number of the run",
    ),
    # A camera that steadies its picture by what moves in it.
    Cause(
        "unknown_steadied_picture",
        "measurement",
        seen("followed", 0.0046),
        follows="the disk's place in the picture, the same all over one camera's picture",
    ),
    # --- the picture ---
    # A lens that was focused anew after its calibration.
    Cause(
        "unknown_refocused_lens",
        "measurement",
        seen("refocused_px", 1.0),
        follows="the third power of the place in one camera's picture",
    ),
    # A lens that is a little longer or shorter than the calibration says.
    Cause(
        "unknown_longer_lens",
        "measurement",
        _longer_lens,
        follows="the place in one camera's picture, away from its middle, always as much",
    ),
    # A sensor that is not square to its lens.
    Cause(
        "unknown_tilted_sensor",
        "measurement",
        _tilted_sensor,
        follows="the second power of the place in one camera's picture, along one direction of it",
    ),
    # A lens whose distortion was fitted with too few terms.
    Cause(
        "unknown_fitted_lens",
        "measurement",
        _fitted_lens,
        follows="the fifth power of the place in one camera's picture",
    ),
    # Lenses that are sharp in the middle of their pictures only.
    Cause(
        "unknown_shallow_focus",
        "measurement",
        seen("unfocused_px", 0.8),
        follows="the distance from the picture's middle, in the markers' scatter",
    ),
    # A table of tracks whose numbers were rounded.
    Cause(
        "unknown_rounded_pixels",
        "measurement",
        seen("rounded_px", 1.8),
        follows="the place in the picture, once in each of its steps",
    ),
    # A lens that was knocked after its calibration.
    Cause(
        "unknown_knocked_lens",
        "measurement",
        _knocked_lens,
        follows="the square of the place in one camera's picture",
    ),
    Cause("unknown_rolling_shutter", "measurement", seen("shutter_s", 6e-4)),
    # Frames of every other row, the even and the odd in turn.
    Cause(
        "unknown_interlaced_rows",
        "measurement",
        seen("interlaced_px", 0.7),
        follows="whether a frame's number is even, the same all over both pictures",
    ),
    # A camera that writes a full buffer's frame again where it misses one.
    Cause("unknown_stuttering_camera", "measurement", seen("stutter_share", 0.05)),
    # A film scaled to another height than its calibration.
    Cause("unknown_stretched_picture", "measurement", _stretched_picture),
    # A film put upright by a program that leaves it leaning.
    Cause(
        "unknown_skewed_picture",
        "measurement",
        _skewed_picture,
        follows="the place in one camera's picture along v, along u",
    ),
    # Films coded too coarsely, in blocks.
    Cause(
        "unknown_coded_blocks",
        "measurement",
        seen("blocked_px", 0.75),
        follows="the place in the picture, once in eight pixels",
    ),
    # A film that is coded as a whole frame now and then, and what changes after it.
    Cause(
        "unknown_ghosted_film",
        "measurement",
        seen("ghosted", 0.008),
        follows="the way in the picture since the last of some frames that are evenly spaced",
    ),
]
