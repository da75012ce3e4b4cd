"""Every number of the plant's physics, SI; the neutral value switches a cause off."""

from typing import NamedTuple


class PlantParameters(NamedTuple):
    """Physics of one run. Angles in the world frame; `azimuth` is of the contact seen from the Host's
    centre."""

    # the disk
    disk_radius_m: float = 0.01
    mass_kg: float = 0.0246
    inertia_factor: float = 0.5
    mass_x_m: float = 0.0  # centre of mass from the geometric centre, in the disk
    mass_y_m: float = 0.0
    # the run
    duration_s: float = 1.2
    drive_rad_per_s: float = 0.0
    # the Host's give: it swings back from an impulse like a mass on a damped spring
    recoil_kg: float = 0.0
    recoil_rad_per_s: float = 0.0
    recoil_damping: float = 0.0  # of the critical one
    # the floor's load, and how much of the disk stands on it
    load_m_per_s2: float = 9.81
    arc_per_m: float = 0.0  # the Host moves along an arc of this curvature: it rises by half of it times x squared
    hop_s: float = 0.0  # the floor carries no load this long after an impact
    toss: float = 0.0  # a blow tosses the disk up at this share of its approach
    dome: float = 0.0  # the disk touches the floor only within its radius less this share
    burr: float = 0.0  # share of the weight that stands on the disk's rim
    grain: float = 0.0  # share of the weight that stands on one grain under the disk
    grain_rad: float = 0.0
    ring_foot: float = 0.0  # the floor's torque is more by this share
    # floor friction: how much
    floor_friction: float = 0.25
    spin_share: float = 1.0  # 0 plain Coulomb, 1 Farkas
    smoothing_m_per_s: float = 1e-3
    friction_change_per_s: float = 0.0
    lag_s: float = 0.0  # the floor's friction follows its law this late
    # ... by the place on the floor
    patch_amplitude: float = 0.0
    patch_x_m: float = 0.0
    patch_y_m: float = 0.0
    patch_width_m: float = 0.012
    groove: float = 0.0  # floor friction more and less along one direction, once in groove_m
    groove_m: float = 0.012
    groove_rad: float = 0.0
    groove_phase_rad: float = 0.0
    seam: float = 0.0  # floor friction more by this share on one side of a line of the Host's floor
    seam_m: float = 0.0
    seam_rad: float = 0.0
    rim: float = 0.0  # floor friction more by this share near the wall
    rim_share: float = 0.75  # from this share of the contact radius on
    track: float = 0.0  # floor friction less by this share at track_m from the Host's centre
    track_m: float = 0.023
    bead: float = 0.0  # share of the floor friction lost over a bead of oil, which goes round
    bead_rad: float = 0.0
    bead_rad_per_s: float = 0.0
    worn: float = 0.0  # floor friction more by this share at the Host's centre
    screws: float = 0.0  # share of the floor friction lost over each of four screws
    screws_rad: float = 0.0
    drifted: float = 0.0  # floor friction more by this share at the wall on one side, less on the other ...
    drifted_rad: float = 0.0  # ... more on this one
    pulsing: float = 0.0  # floor friction more and less by this share in the course of the run ...
    pulsing_rad_per_s: float = 40.0  # ... at this rate ...
    pulsing_rad: float = 0.0  # ... and of this phase as the run begins
    # ... by the speed
    weakening: float = 0.0  # floor friction more by this share at rest, gone beyond weakening_m_per_s
    weakening_m_per_s: float = 0.4
    stribeck: float = 0.0  # floor friction more by this share at rest, gone beyond stribeck_m_per_s
    stribeck_m_per_s: float = 0.75
    film: float = 0.0  # share of the floor friction that a spinning disk loses
    film_rad_per_s: float = 60.0
    lift: float = 0.0  # floor friction less by this share at lift_m_per_s and more, with the square of the speed
    lift_m_per_s: float = 2.0
    strengthening: float = 0.0  # floor friction more by this share where the speed is e times as much
    chatter: float = 0.0  # share of the floor friction lost at slips near chatter_m_per_s
    chatter_m_per_s: float = 0.7
    # ... by the direction, and what turns it aside
    anisotropy: float = 0.0
    anisotropy_phase_rad: float = 0.0
    canted_rad: float = 0.0  # the floor's friction is turned by this much from the slip
    curling: float = 0.0  # friction across the slip of a disk that spins as fast as it slides, in units of mu N
    warped: float = 0.0  # floor friction more along one line of the disk, less across it
    warped_rad: float = 0.0
    rings: float = 0.0  # floor friction more by this share along the radius, less across it
    nap: float = 0.0  # floor friction more in one direction of sliding and less in the opposite one
    nap_rad: float = 0.0
    bevel: float = 0.0  # floor friction more where one side of the disk leads and less where it trails
    bevel_rad: float = 0.0
    brushed: float = 0.0  # floor friction more and less twice in a turn of the disk
    brushed_rad: float = 0.0
    scratched: float = 0.0  # floor friction more by this share for slips along one direction, less across it ...
    scratched_rad: float = 0.0  # ... this one
    bristled: float = 0.0  # floor friction more in slips along the Host's acceleration, less against it, at 8 g
    # ... by what went before
    settling: float = 0.0  # floor friction less by this share after an impact, back within settling_s
    settling_s: float = 0.02
    lifted: float = 0.0  # share of the floor friction lost just after a blow, back within lifted_s
    lifted_s: float = 0.04
    warming: float = 0.0  # share of the floor friction lost along the way slid, most of it within warming_m
    warming_m: float = 0.5
    grit: float = 0.0  # standard deviation of the floor's friction from flight to flight, relative
    grit_draw: float = 0.0  # of each run: which ones it has
    drop: float = 0.0  # share of the floor friction that a disk fresh from a drop of oil loses
    drop_x_m: float = 0.0
    drop_y_m: float = 0.0
    clinging: float = 0.0  # floor friction more by this share under a disk that holds all the charge it can
    aged: float = 0.0  # floor friction more by this share under contacts that have rested long
    drum: float = 0.0  # share of the load that a floor which drums takes and gives just after a blow ...
    drum_rad_per_s: float = 350.0  # ... at this rate
    # ... by the Host's motion
    loose_floor: float = 0.0  # share of the Host's velocity that its floor does not have
    floor_turn_rad_per_s: float = 0.0  # the floor turns about the Host's centre
    swing_rad_per_m: float = 0.0  # the floor turns about one screw by this much for the Host's way along x ...
    swing_x_m: float = 0.0  # ... which is here
    swing_y_m: float = 0.0
    pitching: float = 0.0  # load more at the wall on the side that the Host is accelerated to, at 8 g of it
    rumble: float = 0.0  # share of the floor friction lost at the Host's full speed at 8 g, with the square of it
    # a floor that is not level
    tilt_x_m_per_s2: float = 0.0
    tilt_y_m_per_s2: float = 0.0
    central_per_s2: float = 0.0
    dished_per_m: float = 0.0  # curvature of the Host's floor, lowest at its centre
    saddle_per_s2: float = 0.0  # the floor rises along one line and falls across it
    saddle_rad: float = 0.0
    bowl_m_per_s2: float = 0.0  # the floor rises towards the wall: this steep at it, with the sixth power of the radius
    ridge_m_per_s2: float = 0.0  # along a line of the Host's floor
    ridge_m: float = 0.0
    ridge_rad: float = 0.0
    sway_m_per_s2: float = 0.0  # the room's floor tilts to and fro
    sway_rad_per_s: float = 0.0
    sway_rad: float = 0.0
    sag_m_per_s2: float = 0.0  # the room's floor tilts steadily during the run
    sag_rad: float = 0.0
    feet_x_m_per_s2: float = 0.0  # of each run: how the table stands since its feet have sunk in
    feet_y_m_per_s2: float = 0.0
    slam_m_per_s2: float = 0.0  # a blow against the room's floor, which swings and dies out
    slam_s: float = 0.0
    slam_rad: float = 0.0
    slam_rad_per_s: float = 75.0
    slam_decay_s: float = 0.08
    rocking: float = 0.0  # the table rocks: this share of the Host's acceleration pushes the disk
    lean_m_per_s2: float = 0.0  # the floor leans one way or the other, by the sense of the Host's velocity
    lean_rad: float = 0.0
    buckled_per_s2: float = 0.0  # a floor that buckles pushes the disk outwards by this times its place, at 8 g along x
    # what lies on it, and how the disk stands
    mat_per_s2: float = 0.0  # the floor pulls back to where the disk stood before
    bow_m_per_s2: float = 0.0  # the dust that a disk pushes along holds it back by at most this
    wobble_per_s: float = 0.0  # a wobbling disk is pushed by this times the last blow's approach at first ...
    wobble_rad_per_s: float = 0.0  # ... and round at this rate
    oil_film_per_s: float = 0.0  # drag of an oil film on the slip, and on the spin over the floor
    thin_film_per_s: float = 0.0  # the same of a film of air that has thinned since the last blow
    # air
    viscous_per_s: float = 0.0
    air_per_m: float = 0.0
    cubic_s_per_m2: float = 0.0  # drag with the third power of the speed
    rail_per_s: float = 0.0  # drag along one direction of the room
    rail_rad: float = 0.0
    magnus: float = 0.0
    stream_per_s: float = 0.0  # a stream of air along a line across the ring
    stream_m_per_s: float = 0.8
    stream_width_m: float = 0.01
    stream_rad: float = 0.0
    jets_m_per_s2: float = 0.0  # the jets of a floor's holes push the disk by at most this along x and along y
    jets_x_rad: float = 0.0  # phase of the holes along x, and along y
    jets_y_rad: float = 0.0
    enclosed_per_m: float = 0.0  # drag with the square of the speed against the Host
    bellows_m_per_s2: float = 0.0  # air that the Host's motion blows, with the square of its velocity, at 8 g of it
    cushion_per_s: float = 0.0  # drag of the air between disk and wall on what moves towards it or away, at the wall
    # magnets, charge and threads
    pull_m_per_s2: float = 0.0
    pull_x_m: float = 0.0
    pull_y_m: float = 0.0
    pull_width_m: float = 0.015
    wall_pull_m_per_s2: float = 0.0  # towards the wall, falling off within wall_pull_m of it
    wall_pull_m: float = 0.004
    swirl_per_s2: float = 0.0  # across the radius from the Host's centre
    coil_m_per_s2: float = 0.0  # the shaker's coil pulls in one direction, with the square of the Host's acceleration
    coil_rad: float = 0.0
    charged_per_s2: float = 0.0  # a charged disk is drawn outwards by at most this times its place
    poles_m_per_s2: float = 0.0  # a magnetised disk between two opposed poles: a push that turns against its angle
    poles_rad: float = 0.0
    poled_m_per_s2: float = 0.0  # a magnetised disk is drawn to the wall or off it by this where they meet
    poled_rad: float = 0.0
    eddy_per_s: float = 0.0  # drag over a magnet under the Host's floor
    eddy_x_m: float = 0.0
    eddy_y_m: float = 0.0
    eddy_width_m: float = 0.012
    eddied_per_s: float = 0.0  # drag on the rim's speed along the wall where they meet
    stray_field_per_s: float = 0.0  # drag in the room, more towards the side of x that its sign says; this at x = 0
    tether_per_s2: float = 0.0  # a thread from a point of the Host, slack up to tether_slack_m
    tether_x_m: float = 0.0
    tether_y_m: float = 0.0
    tether_slack_m: float = 0.03
    thread_m_per_s2: float = 0.0  # a thread of glue pulls back to where the wall was hit the last time
    # torques
    spin_drag_per_s: float = 0.0
    ratchet_rad_per_s2: float = 0.0  # spin of this sign is braked steadily, the other is not
    needle_rad_per_s2: float = 0.0  # the disk turns like a compass needle
    needle_rad: float = 0.0
    bistable_rad_per_s2: float = 0.0  # the disk turns to the nearer of two opposite angles
    bistable_rad: float = 0.0
    alternating_rad_per_s2: float = 0.0  # a field turns the disk like a compass needle, to and fro, at 8 g of the Host
    alternating_rad: float = 0.0
    windmill_per_s: float = 0.0  # a draught turns the disk, towards windmill_rad_per_s
    windmill_rad_per_s: float = 150.0
    vane_rad_per_s2: float = 0.0  # a fin turns the disk towards where it goes, at 1 m/s
    vane_rad: float = 0.0
    wound_per_s2: float = 0.0  # a wire turns the disk back by this times its angle, whole turns counted ...
    wound_rad: float = 0.0  # ... from this one on
    spiral_rad_per_s2: float = 0.0  # the disk is turned by this at 1 m/s of slip
    core_per_s: float = 0.0  # a loose core holds the spin back by this times what it lacks of it
    # the wall's shape
    contact_radius_m: float = 0.04
    wall_sides: float = 0.0  # 0: round; else a regular polygon whose sides lie contact_radius_m from its middle
    wall_turn_rad: float = 0.0  # normal of its first side, in the Host
    obstacle_m: float = 0.0  # from the cylinder's axis to the disk's middle where they touch; 0: no cylinder
    ellipticity: float = 0.0
    ellipticity_phase_rad: float = 0.0
    lobes: float = 0.0  # the wall's radius more by this share at so many places
    lobe_order: float = 3.0
    lobe_phase_rad: float = 0.0
    dent_m: float = 0.0  # the wall stands in by this much in a spot
    dent_rad: float = 0.0
    dent_width_rad: float = 0.3
    step_m: float = 0.0  # one half of the wall stands back by this much
    step_rad: float = 0.0
    joint_m: float = 0.0  # the wall's two ends overlap by this much, its radius goes round from one to the other
    joint_rad: float = 0.0
    split_m: float = 0.0  # the wall's two halves are this far from each other along their joint
    split_rad: float = 0.0
    chucked_m: float = 0.0  # the wall's radius is more by this at three places, less between them
    chucked_rad: float = 0.0
    seam_bead_m: float = 0.0  # the wall stands in by this at one place
    seam_bead_rad: float = 0.0
    warping_m: float = 0.0  # of each run: the wall's radius is more by this along one line, less across it ...
    warping_rad: float = 0.0  # ... this one
    packed_m: float = 0.0  # of each run: how far the wall stands back
    # the disk's shape
    oval: float = 0.0  # the disk's radius, relative to the contact radius, twice around its rim
    oval_rad: float = 0.0
    trilobe: float = 0.0  # the disk's radius, relative to the contact radius, three times around its rim
    trilobe_rad: float = 0.0
    chip_m: float = 0.0  # a piece of the disk's rim is missing, this deep
    chip_rad: float = 0.0
    tyre_m: float = 0.0  # from the disk's middle to that of its rim
    tyre_rad: float = 0.0
    lap_m: float = 0.0  # tape around the rim, its end this much higher than its beginning, to either side of the mean
    lap_rad: float = 0.0
    tipped_m: float = 0.0  # the disk's radius is less by at most this just after a hard blow
    swollen_m: float = 0.0  # the disk's radius is more by this at a fast spin, less by it at none
    # where the wall lies and how it moves
    wall_x_m: float = 0.0
    wall_y_m: float = 0.0
    refit_x_m: float = 0.0  # of each run: where the wall lies since it was put in the last time
    refit_y_m: float = 0.0
    breathing_m: float = 0.0  # the wall's radius grows by twice this much during a run
    liner: float = 0.0  # an ellipse of the wall that turns during the run
    liner_rad: float = 0.0
    liner_rad_per_s: float = 0.0
    springy_m: float = 0.0  # the wall stays back by this much at 8 g of the Host
    loose_ring_m: float = 0.0  # the wall lies this far off, to where it was pushed the last time
    squash_m: float = 0.0  # the wall's ellipse that goes with the Host's acceleration, at 8 g of it
    squash_rad: float = 0.0
    slipping_m: float = 0.0  # the wall moves by twice this much during a run
    slipping_rad: float = 0.0
    trailing_m: float = 0.0  # the wall trails behind the Host's velocity by this much
    orbit_m: float = 0.0  # the wall lies this far off, in a direction that goes round
    orbit_rad: float = 0.0
    orbit_rad_per_s: float = 0.0
    nodding: float = 0.0  # mass of the disk over that of a wall that swings after each blow
    nodding_rad_per_s: float = 160.0
    leaking_m: float = 0.0  # the wall stands back by at most this after many hard blows, stands in by it after none
    sleeve: float = 0.0  # mass of the disk over that of a sleeve of the wall that turns
    swinging_m_per_s: float = 0.0  # the wall's surface goes round this fast at the Host's full speed at 8 g
    swinging_rad: float = 0.0
    # restitution
    restitution: float = 0.75
    restitution_scatter: float = 0.0
    restitution_floor: float = 0.0  # eps -> floor + (eps - floor) exp(-v / speed); 0 speed: constant
    restitution_speed_m_per_s: float = 0.0
    ageing_per_s: float = 0.0  # relative loss of restitution over a run
    warmed: float = 0.0  # of each run: share of the restitution lost
    # ... by the place on the wall
    direction_amplitude: float = 0.0
    direction_phase_rad: float = 0.0
    soft_amplitude: float = 0.0  # restitution lost in a spot of the wall
    soft_azimuth_rad: float = 0.0
    soft_width_rad: float = 0.4
    clamps: float = 0.0  # restitution more and less three times around the wall
    clamps_rad: float = 0.0
    shim: float = 0.0  # restitution lost where a shim behind the wall just is
    shim_rad: float = 0.0
    shim_rad_per_s: float = 0.0
    pad: float = 0.0  # restitution lost in the lightest blows where a pad is, less in harder ones
    pad_rad: float = 0.0
    # ... by the place on the disk's rim
    nick: float = 0.0  # restitution lost where a spot of the disk's rim meets the wall
    nick_rad: float = 0.0
    sheet: float = 0.0  # restitution more and less twice around the disk's rim
    sheet_rad: float = 0.0
    shifted: float = 0.0  # restitution won where the rim was struck the last time, lost at its other side
    # ... by how the blow comes
    spin_restitution_s: float = 0.0  # restitution lost per rad/s of spin
    slip_restitution_s_per_m: float = 0.0  # restitution lost per slip
    glancing: float = 0.0  # restitution lost with the square of the sine of the angle of incidence
    oblique: float = 0.0  # share of the restitution lost in blows that only slip
    shingled: float = 0.0  # restitution lost in slips of one sense and won in those of the other
    wetted_m_per_s: float = 0.0  # speed that the wall's film takes of a blow's approach
    adhesion_m_per_s: float = 0.0  # the wall keeps the energy of this speed in each impact
    loose_chip: float = 0.0  # restitution lost in one impact of six
    # ... by the blows before
    rest_amplitude: float = 0.0  # restitution lost when the impact before was this recent
    rest_s: float = 0.03
    bruise: float = 0.0  # restitution lost where the wall was hit the last time
    damage: float = 0.0  # restitution lost for good after a blow harder than damage_m_per_s
    damage_m_per_s: float = 1.6
    loosened: float = 0.0  # share of the restitution lost after many blows of a run
    two_edges: float = 0.0  # restitution more and less in turn, from impact to impact
    ringing: float = 0.0  # restitution that swings about, at this frequency, from the impact before on
    ringing_rad_per_s: float = 250.0
    rattling: float = 0.0  # restitution won where a blow comes from the last one's side, lost from the opposite one
    tired: float = 0.0  # restitution lost after a blow at 1 m/s, with the square of its speed
    # ... by the Host's motion
    phase_amplitude: float = 0.0  # restitution with the drive's phase
    phase_rad: float = 0.0
    yielding_s_per_m: float = 0.0  # restitution lost per speed of the wall towards the disk
    seated: float = 0.0  # restitution more by this much where the Host is accelerated away from the disk, at 8 g
    shot: float = 0.0  # restitution lost at 8 g of the Host, whichever way
    armature: float = 0.0  # share of the restitution lost in blows along x, none across it
    # a contact that lasts
    contact_time_s: float = 0.0
    contact_shear_share: float = 0.82
    # the direction of a blow, and what gives in it
    rough_rad: float = 0.0  # the wall's normals scatter by this much from impact to impact
    ragged_rad: float = 0.0  # standard deviation of the wall's normals from blow to blow
    marks_rad: float = 0.0  # the wall's normals lean by at most this to either side, once in each tool mark ...
    marks: float = 12.0  # ... of so many around the wall ...
    marks_phase_rad: float = 0.0  # ... of this phase
    saw_rad: float = 0.0  # blows of the wall are turned by this much from its normal
    cornered_m: float = 0.0  # a blow passes the disk's middle by at most this ...
    corners: float = 6.0  # ... to either side, so many times around its rim
    cornered_rad: float = 0.0
    mount: float = 0.0  # mass of the disk over that of a wall that gives along one line
    mount_rad: float = 0.0
    # wall friction
    wall_friction: float = 0.15
    wall_friction_amplitude: float = 0.0
    wall_friction_phase_rad: float = 0.0
    wall_friction_lobes: float = 1.0
    tacky: float = 0.0  # wall friction more by this share in a spot of the wall
    tacky_rad: float = 0.0
    glued: float = 0.0  # wall friction more and less once around the disk's rim
    glued_rad: float = 0.0
    ground: float = 0.0  # wall friction less by this share where one place of the disk's rim strikes
    ground_rad: float = 0.0
    worn_ends: float = 0.0  # wall friction less by this share at both ends of x, more between them
    scaly: float = 0.0  # wall friction more in slips towards one direction of the Host, less in those back ...
    scaly_rad: float = 0.0  # ... this one
    handed: float = 0.0  # wall friction larger in one sense of slip
    greased: float = 0.0  # share of the wall friction lost at slips well above greased_m_per_s
    greased_m_per_s: float = 0.4
    rubbed_s_per_m: float = 0.0  # wall friction divided by one and this times the slip
    squeezed: float = 0.0  # wall friction more by this share in hard blows
    hertz: float = 0.0  # wall friction less in hard blows and more in light ones, with the third root of the speed
    flash: float = 0.0  # share of the wall friction lost where approach times slip is large
    combed: float = 0.0  # wall friction less where the slip has the last one's sense, more where it has the other
    polish: float = 0.0  # share of the wall friction lost in the course of a run
    polish_s: float = 0.4
    run_in: float = 0.0  # share of the wall friction lost after many blows of a run
    creeping: float = 0.0  # share of the wall friction lost long after the blow before
    wiped: float = 0.0  # of each run: wall friction more by this share
    cohesion_m_per_s: float = 0.0  # the wall's friction beyond its share of the blow
    band_m_per_s: float = 0.0  # the most that a blow changes the slip's side of the disk by; 0: no band
    # how much of the slip comes back
    tangential_restitution: float = 0.45
    fading_grip: float = 0.0  # share of the tangential restitution lost at fading_m_per_s and faster
    fading_m_per_s: float = 0.8
    skin: float = 0.0  # tangential restitution divided by one and this, at 0.3 m/s of slip
    taped: float = 0.0  # share of the tangential restitution lost along half of the disk's rim
    taped_rad: float = 0.0
    incidence: float = 0.0  # share of the tangential restitution lost in blows that slip far for their approach
    lay: float = 0.0  # tangential restitution more by this share in slips of one sense, less in the other
    teeth_m_per_s: float = 0.0  # slip at which the wall leaves a sticking disk alone
    # what a blow does to the spin besides, and to the disk on the floor
    rolling_loss: float = 0.0  # share of the spin lost in each impact
    rolling_arm_m: float = 0.0  # a blow's torque against the spin
    o_ring_s_per_m: float = 0.0  # share of the spin lost in a blow, for its approach
    offset_blow_m: float = 0.0  # the normal impulse passes the disk's centre this far to one side
    leaning: float = 0.0  # share of a blow that presses the disk onto the floor
