"""Sizes and significances that decide the diagnosis, in one place, each with its reason."""

# Acceptance, set on series of analysis.blind and of the practice set (results tuned there are called that): a term must
# hold in most runs and stand clear of the scatter between them, not only of the noise.
SIGNIFICANCE, IMPROVED, GAIN = 5.0, 0.7, 50.0
IMPACT_GAIN = 25.0
# A probe overrides a named effect of the same residual when it explains more by this much (fall of -2 log L).
OVERRIDES = 10.0
# ... and structure left over beside an accepted effect makes the answer "unknown" when it is this share of the effect's
# own size.
LEFT_OVER = 0.25
# Two candidates whose held-out gains differ by less than this (fall of -2 log L) cannot be distinguished by these data.
EQUIVALENT = 10.0
# Of the contact radius: what turning, gluing and a lens residual leave of centres (0.1 mm of 40 mm), of the
# distance at which the disk meets the wall, and of the way that it goes at its median approach during a contact.
CENTRE_NEGLIGIBLE = 2.5e-3
DISTANCE_NEGLIGIBLE, USUAL_DISTANCE = 6.25e-4, 1e-3
CONTACT_NEGLIGIBLE = 1.6e-3
# A wall's centre or a marker off by less than so many times layout_sd_m is its placement.
PLACEMENTS = 2.0
# A wall that is not where recording.toml says: turning and gluing leave some tenths of a per cent, and less than this.
STATED_SHARE = 0.01
# Ellipticity; where a lens residual is seen, what the like of it leaves in 50 series (0.7e-3 at most) is no finding.
ELLIPTICITY_NEGLIGIBLE, ELLIPTICITY_UNDER_LENS = 5e-4, 1.1e-3
ELLIPTICITY_SD_UNDER_LENS = 2.5e-4

#: smallest size that is called an effect; below it lies what calibration, placement and lens leave over on a good rig:
#: a window in pixels (it is off by whole ones), ratios and angles; times as shares of the frame interval, of a blur
#: more than a marker's size hides
NEGLIGIBLE = {
    "sensor_window_offset": 0.35,
    "length_scale_error": 1.6e-3,
    "frame_rate_error": 2.5e-4,
    "plane_tilt": 1.7e-3,
}
NEGLIGIBLE_FRAMES = {"camera_clock_offset": 0.024, "trigger_jitter": 0.0056, "motion_blur": 0.005}
# A formula that closes less than this of what is left on runs held out explains nothing, however rare by chance.
LAW_LEAST_CLOSED = 0.1
