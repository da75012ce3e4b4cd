"""Systematic errors of what the two cameras see, by what has them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ViewErrors:
    """Systematic errors of the measurement; the defaults are none."""

    # the clock of both cameras
    rate_ratio: float = 1.0  # true frame rate over the nominal one
    oscillator: tuple[float, ...] = ()  # of each run: the true frame rate is more by this share
    jitter_s: float = 0.0
    uneven_s: float = 0.0  # both cameras are late by this much half-way through a run, and on time at its ends
    alternate_s: float = 0.0  # both cameras take every other frame this late
    flicker_s: float = 0.0  # both cameras see what light that flickers shows them, early and late by this much ...
    flicker_hz: float = 100.0  # ... so many times a second ...
    flicker_rad: float = 0.0  # ... of this phase as a run begins
    tick_s: float = 0.0  # both cameras take their frames at the next tick of a timer that ticks this often
    skipped_frame_share: float = 0.0  # from here on (share of a run) both cameras' frames are numbered one early
    # the second camera's own clock
    clock_s: float = 0.0  # the second camera sees the world this much later
    grounded_s: float = 0.0  # the second camera is late by this much at 8 g of the Host along x
    started_s: tuple[float, ...] = ()  # of each run: the second camera is late by this much
    free_running: float = 0.0  # the second camera's clock gains this share of the time, and agrees half-way
    sync_s: float = 0.0  # the second camera gains this between two pulses that set it right ...
    sync_every_s: float = 0.3  # ... which are this far apart ...
    sync_late_s: float = 0.0  # ... and of which one comes here
    loop_s: float = 0.0  # the second camera is late by this as a run begins, then early, and so on, less and less ...
    loop_hz: float = 3.0  # ... to and fro so many times a second
    waking_s: float = 0.0  # the second camera is late by this as a run begins, less and less from then on
    dropped_from: tuple[float, ...] = ()  # of each run: from this share on the second camera's frames are one early
    exposure_s: float = (
        0.0  # the second camera is late by this where the disk lies at the wall on one side, early opposite ...
    )
    exposure_rad: float = 0.0  # ... late on this one
    shocked_s: float = 0.0  # the second camera is late by this after a blow that changes the disk's velocity by 1 m/s
    lost_frame_share: float = 0.0  # from here on (share of a run) the second camera's frames are numbered one early
    # the board: lengths and the sliding plane
    scale: float = 1.0  # lengths come out this much too long
    board_stretch: float = 0.0  # lengths come out this much too long along one direction ...
    board_rad: float = 0.0  # ... this one
    board_bow: float = 0.0  # places come out too far from the world's origin by this share 50 mm off, with its square
    plane_rad: tuple[float, float] = (0.0, 0.0)  # sliding plane turned about the world's x, then y
    # the markers, and how the bodies are found
    centre_marker_offset_m: tuple[float, float] = (0.0, 0.0)
    slipped_m: tuple[float, float] = (0.0, 0.0)  # a NES marker moves by this much half-way through each run
    creeping_m: tuple[float, float] = (0.0, 0.0)  # a sticker of the disk moves by this much with each blow, on it ...
    creeping_marker: int = 1  # ... this one, the middle one being 0
    sliding_m_per_s: tuple[float, float] = (0.0, 0.0)  # a sticker of the disk slides on it at this speed ...
    sliding_marker: int = 1  # ... this one
    print_stretch: float = 0.0  # the markers of disk and Host lie farther out along x of their body by this share
    print_scale: float = 0.0  # the disk's markers lie farther from its middle by this share
    pads_m: float = 0.0  # all markers of the Host stay back by this much at 8 g of it
    paper: tuple[float, ...] = ()  # of each run: the Host's markers lie farther from its middle by this share
    tab_m: float = 0.0  # a marker of the Host stays back by this much at 8 g of it ...
    tab_marker: int = 0  # ... this one
    flung_m: float = 0.0  # a sticker of the disk is flung outwards by at most this ...
    flung_marker: int = 1  # ... this one, the middle one being 0
    card_s: float = 0.0  # the disk's markers swing about its middle after a blow, by its change of spin times this ...
    card_hz: float = 40.0  # ... so many times a second
    sheared_s: float = 0.0  # the disk's markers stay back by its change of velocity in a blow times this, ever less
    risen_s: float = 0.0  # the disk's markers stand higher by this after a blow that changes its velocity by 1 m/s
    card_play_rad: float = 0.0  # the disk's markers lie turned by this to the side that the last blow has left them at
    reading_rad: float = 0.0  # the disk's markers lie turned by this times the sine of its angle ...
    reading_at_rad: float = 0.0  # ... from this one on
    peeled_m: float = 0.0  # the disk's markers rise by this in a run
    pitched_rad: float = 0.0  # the Host's plate pitches by this at 8 g of it along x: its markers rise and sink
    raised_m: float = 0.0  # the disk's markers stand higher by this than the board lay
    card_lean_rad: float = 0.0  # the card with the disk's markers leans by this much ...
    card_rad: float = 0.0  # ... towards this direction of the disk, where it stands the highest
    smear_s2_per_m: float = 0.0  # all markers are found behind by this times the square of their speed
    blur_s: float = 0.0  # each body's place and angle scatter by the way (turn) of this time
    # light
    glare_px: float = 0.0  # markers near a lamp's reflection are drawn towards it, at most this far, ...
    glare_m: tuple[float, float] = (0.0, 0.0)  # ... where it lies over the rig ...
    glare_camera: int = 0  # ... in this camera's picture
    lid_px: float = 0.0  # markers beyond a pane's edge are displaced across it by this much, ...
    lid_m: tuple[float, float] = (0.0, 0.0)  # ... where the edge lies over the rig ...
    lid_rad: float = 0.0  # ... and looks to ...
    lid_camera: int = 0  # ... in this camera's picture
    haze_px: float = 0.0  # markers move to and fro by this much in waves that go over the picture ...
    haze_rad: float = 0.0  # ... in this direction of it ...
    haze_rad_per_s: float = 30.0  # ... at this rate ...
    haze_phase_rad: float = 0.0  # ... of this phase in its middle as a run begins ...
    haze_camera: int = 0  # ... in this camera's picture
    comet_s: float = 0.0  # the disk's markers are found where they were this long before
    glint_px: float = 0.0  # the disk's markers move to and fro by this much as it turns ...
    glint_rad: float = 0.0  # ... the farthest at this angle of it ...
    lamp_rad: float = 0.0  # ... in this direction ...
    glint_camera: int = 0  # ... of this camera's picture
    shade_px: float = 0.0  # the disk's markers move away from a lamp by this much in the ring's full shade ...
    shade_rad: float = 0.0  # ... a lamp that stands there
    bloom_px: float = 0.0  # the disk's markers are drawn to the Host's near by, at most this far
    lid_bulge: float = 0.0  # the disk's markers are found too far from the Host's middle by this share
    shadow_m: float = 0.0  # the disk's markers are found this much too far inwards at the wall
    # cameras that move
    wobble_px: float = 0.0  # the first camera sways along u
    wobble_hz: float = 0.0
    shaken_px: float = 0.0  # the first camera swings along u after each impact, for 1 m/s of the disk's change ...
    shaken_hz: float = 30.0  # ... so many times a second
    tripod_px: float = 0.0  # the first camera's picture moves by this much at 8 g of the Host along x ...
    tripod_rad: float = 0.0  # ... in this direction of it ...
    tripod_s: float = 0.0  # ... this much later
    button_px: float = 0.0  # the first camera's picture swings by this as a run begins, less and less ...
    button_rad: float = 0.0  # ... in this direction of it ...
    button_hz: float = 10.0  # ... so many times a second
    twisted_rad: float = 0.0  # the first camera is turned about its axis by this much at 8 g of the Host along x
    bumped_rad: float = 0.0  # the first camera is turned about its axis by this much ...
    bumped_from: int = 0  # ... from this run on
    nudged_px: float = 0.0  # the first camera's picture lies off by this much ...
    nudged_rad: float = 0.0  # ... in this direction of it ...
    nudged_share: tuple[float, ...] = ()  # ... of each run: from this share of it on
    warm_px: float = 0.0  # the first camera's picture lies off by this much in the first run, less later ...
    warm_rad: float = 0.0  # ... in this direction of it
    cold_zoom: float = 0.0  # the first camera's picture is too large by this share in the first run, less later
    followed: float = 0.0  # the first camera's picture goes after the disk by this share of its way from the middle
    focal: float = 0.0  # the first camera's picture is too large by this share
    zoom_swing: float = 0.0  # the first camera's picture grows and shrinks by this share about its centre ...
    zoom_swing_hz: float = 0.0  # ... so many times a second
    creep_px: float = 0.0  # the second camera's picture moves this far along u within a run
    rolled_rad: float = 0.0  # the second camera is turned about its axis by this
    sagging_rad: float = 0.0  # the second camera turns about its axis within a run, by twice this
    jogged_px: float = 0.0  # the second camera's picture lies off by this much ...
    jogged_rad: float = 0.0  # ... in this direction of it ...
    jogged_from: int = 0  # ... from this run on
    head_px: tuple[float, ...] = ()  # of each run: the second camera's picture lies this far off along v
    zoom: float = 0.0  # the second camera's picture grows by this share about its centre within a run
    # the picture
    window_px: tuple[float, float] = (0.0, 0.0)  # the window was this far from where it is said to be ...
    window_camera: int = 0  # ... in this camera
    stretched: float = 0.0  # both cameras' pictures are this much too tall, about their centres
    skewed: float = 0.0  # the second camera's picture leans: u is more by this share of v, from its middle
    keystone_px: float = (
        0.0  # the second camera's sensor is askew: it widens the picture by this 300 px off its middle ...
    )
    keystone_rad: float = 0.0  # ... in this direction of it
    interlaced_px: float = 0.0  # both cameras' pictures lie this far off along v, to and fro from frame to frame
    shutter_s: float = 0.0  # both cameras read their rows one after the other, the window in this time
    stutter_share: float = 0.0  # of the first camera's frames show the one before once more
    refocused_px: float = 0.0  # the first camera's picture is too far out by this 300 px from its middle, with the cube
    fifth_px: float = 0.0  # the second camera's picture is too far out by this 300 px off, with the fifth power
    knocked_px: float = 0.0  # the first camera's lens is off its axis: by three times this 300 px from the middle ...
    knocked_rad: float = 0.0  # ... in this direction of the picture
    clicked_px: float = 0.0  # each marker in each camera lies off by this, RMS along either side, all through a run ...
    clicked_draw: tuple[int, ...] = ()  # ... of each run: which ways
    hopped: tuple[float, ...] = ()  # of each run: from this share of it on two of the disk's markers are taken ...
    hopped_s: float = 0.0  # ... for each other by the second camera's tracker, for this time ...
    hopped_markers: tuple[int, int] = (1, 2)  # ... these, the middle one being 0
    dead_band_px: float = 0.0  # markers are found where they were until they are this far from there
    guessed: float = 0.0  # near the wall the disk's markers are found where their way would lead, by at most this share
    wander_px: float = 0.0  # each marker in each camera wanders off in a run by this at its end, along either side ...
    wander_draw: tuple[int, ...] = ()  # ... of each run: which ways
    missed: float = 0.0  # markers are found behind by this share of what their way from frame to frame has beyond some
    ghosted: float = 0.0  # markers are drawn back by this share to where they were in the film's last whole frame
    bridged: float = 0.0  # share of the stretches of some frames in which each marker of the disk is put on a line ...
    bridged_draw: tuple[int, ...] = ()  # ... of each run: which ones
    smoothed: float = 0.0  # share that a mean over some frames has in where markers are found
    unfocused_px: float = (
        0.0  # both cameras' markers scatter by this 300 px from the picture's middle, evenly less nearer
    )
    rounded_px: float = 0.0  # markers are written down in steps of this
    blocked_px: float = 0.0  # markers are drawn to the middles of the picture's blocks by at most this
