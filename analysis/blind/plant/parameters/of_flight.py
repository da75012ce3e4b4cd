"""The numbers of a flight's physics: the disk, its run and its Host, the floor, air, fields and torques."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FlightParameters:
    """Of one run.  Angles in the world frame."""

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
    lane: float = 0.0  # floor friction less by this share along one line through the Host's centre
    lane_rad: float = 0.0
    bead: float = 0.0  # share of the floor friction lost over a bead of oil, which goes round
    bead_rad: float = 0.0
    bead_rad_per_s: float = 0.0
    worn: float = 0.0  # floor friction more by this share at the Host's centre
    wearing: float = 0.0  # of each run: floor friction more by this share at the Host's centre
    screws: float = 0.0  # share of the floor friction lost over each of four screws
    screws_rad: float = 0.0
    drifted: float = 0.0  # floor friction more by this share at the wall on one side, less on the other ...
    drifted_rad: float = 0.0  # ... more on this one
    drying: float = 0.0  # share of the floor friction lost over a wet spot, as a run begins ...
    drying_x_m: float = 0.0  # ... here ...
    drying_y_m: float = 0.0
    drying_s: float = 0.5  # ... which dries within this
    ribs: float = 0.0  # floor friction more and less three times around, by this share at the wall ...
    ribs_rad: float = 0.0  # ... more here
    path: float = 0.0  # share of the floor friction lost on the line that the flight before has left
    powder: float = 0.0  # floor friction more by this share at the wall after many blows of a run
    beneath: float = 0.0  # floor friction more by this share 20 mm to one side of the room along x, less to the other
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
    mixed: float = 0.0  # floor friction more by this share at rest, like a bell of mixed_m_per_s over the speed
    mixed_m_per_s: float = 1.3
    breakaway: float = 0.0  # floor friction more by this share at speeds below breakaway_m_per_s
    breakaway_m_per_s: float = 1.0
    strengthening: float = 0.0  # floor friction more by this share where the speed is e times as much
    chatter: float = 0.0  # share of the floor friction lost at slips near chatter_m_per_s
    chatter_m_per_s: float = 0.7
    # ... by the direction, and what turns it aside
    anisotropy: float = 0.0
    anisotropy_phase_rad: float = 0.0
    canted_rad: float = 0.0  # the floor's friction is turned by this much from the slip
    curling: float = 0.0  # friction across the slip of a disk that spins as fast as it slides, in units of mu N
    swerve: float = 0.0  # the same in slips towards one direction, and to the other side in those back ...
    swerve_rad: float = 0.0  # ... this one
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
    faced: float = 0.0  # floor friction more by this share in slips round the Host's centre counterclockwise, less back
    outward: float = 0.0  # floor friction more by this share in slips away from the Host's centre, less towards it
    scaly_face: float = 0.0  # floor friction more by this share in pure spins counterclockwise, less in the other sense
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
    cleaned: float = 0.0  # of each run: floor friction more by this share
    turned: float = 0.0  # of each run: floor friction more by this share
    humid: float = 0.0  # of each run: floor friction more by this share
    bench: float = 0.0  # of each run: floor friction more by this share
    glazed: float = 0.0  # floor friction times e to minus this times the blows of the run so far
    strewn: float = 0.0  # floor friction more by this share with each blow of a run
    debris_s_per_m: float = 0.0  # floor friction more by this times the last blow's approach just after it
    beads: float = 0.0  # floor friction more by this share in slips back, against those of the way just slid
    clogged: float = 0.0  # floor friction that rises by twice this share along the way slid, and falls at once ...
    clogged_m: float = 0.2  # ... after each such way ...
    clogged_share: float = 0.0  # ... of which this share has passed as the run begins
    edged: float = 0.0  # share of the weight that stands on the struck edge just after a hard blow
    drum: float = 0.0  # share of the load that a floor which drums takes and gives just after a blow ...
    drum_rad_per_s: float = 350.0  # ... at this rate
    # ... by the Host's motion
    loose_floor: float = 0.0  # share of the Host's velocity that its floor does not have
    floor_turn_rad_per_s: float = 0.0  # the floor turns about the Host's centre
    swing_rad_per_m: float = 0.0  # the floor turns about one screw by this much for the Host's way along x ...
    swing_x_m: float = 0.0  # ... which is here
    swing_y_m: float = 0.0
    pitching: float = 0.0  # load more at the wall on the side that the Host is accelerated to, at 8 g of it
    drawn_down: float = 0.0  # floor friction more by this share at 8 g of the Host, with the square of its acceleration
    rumble: float = 0.0  # share of the floor friction lost at the Host's full speed at 8 g, with the square of it
    # a floor that is not level
    tilt_x_m_per_s2: float = 0.0
    tilt_y_m_per_s2: float = 0.0
    levelled_x_m_per_s2: float = 0.0  # of each run: how the table stands since somebody has levelled it anew
    levelled_y_m_per_s2: float = 0.0
    central_per_s2: float = 0.0
    cone_m_per_s2: float = 0.0  # a floor that is a flat cone pushes the disk outwards by this
    dished_per_m: float = 0.0  # curvature of the Host's floor, lowest at its centre
    saddle_per_s2: float = 0.0  # the floor rises along one line and falls across it
    saddle_rad: float = 0.0
    bowl_m_per_s2: float = 0.0  # the floor rises towards the wall: this steep at it, with the sixth power of the radius
    doming_per_s2: float = 0.0  # of each run: the floor pushes the disk outwards by this times its place
    bowed_per_s2: float = 0.0  # a floor bowed along one direction pushes the disk by this times its place along it ...
    bowed_rad: float = 0.0  # ... this one
    kink_m_per_s2: float = 0.0  # a floor bent along a line pushes the disk off that line, on either side ...
    kink_m: float = 0.0  # ... this far from the Host's centre ...
    kink_rad: float = 0.0  # ... in this direction
    plates_m_per_s2: float = (
        0.0  # two plates of a floor meet at a step that pushes the disk down it by at most this ...
    )
    plates_m: float = 0.0  # ... this far from the Host's centre ...
    plates_rad: float = 0.0  # ... in this direction, where the higher one lies
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
    guide_per_s2: float = 0.0  # the floor leans by the Host's place: this times its way along x pushes the disk ...
    guide_rad: float = 0.0  # ... in this direction
    buckled_per_s2: float = 0.0  # a floor that buckles pushes the disk outwards by this times its place, at 8 g along x
    # what lies on it, and how the disk stands
    nodal_m_per_s2: float = 0.0  # a floor's waves drive the disk to circles by this, at 8 g of the Host ...
    nodal_m: float = 0.012  # ... one of which has this radius
    hunting_m_per_s2: float = 0.0  # a disk that hunts is pushed across its slip by this, to and fro along its way
    mat_per_s2: float = 0.0  # the floor pulls back to where the disk stood before
    bow_m_per_s2: float = 0.0  # the dust that a disk pushes along holds it back by at most this
    wobble_per_s: float = 0.0  # a wobbling disk is pushed by this times the last blow's approach at first ...
    wobble_rad_per_s: float = 0.0  # ... and round at this rate
    oil_film_per_s: float = 0.0  # drag of an oil film on the slip, and on the spin over the floor
    fading_film_per_s: float = 0.0  # the same of a film of oil that loses its grip in a run, this as it begins ...
    fading_film_s: float = 0.4  # ... and less by two thirds after this
    thin_film_per_s: float = 0.0  # the same of a film of air that has thinned since the last blow
    # air
    viscous_per_s: float = 0.0
    air_per_m: float = 0.0
    cubic_s_per_m2: float = 0.0  # drag with the third power of the speed
    laminar_m_per_s2: float = 0.0  # drag with the power 3/2 of the speed, this at 1 m/s
    rail_per_s: float = 0.0  # drag along one direction of the room
    rail_rad: float = 0.0
    sail_per_m: float = 0.0  # drag with the square of the speed across a sail on the disk ...
    sail_rad: float = 0.0  # ... which looks to this direction of it
    fan_per_m: float = 0.0  # drag with the square of the speed against air that a fan blows through the room ...
    fan_m_per_s: float = 2.5  # ... this fast ...
    fan_rad: float = 0.0  # ... in this direction
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
    ring_poles_m_per_s2: float = 0.0  # a magnetised ring draws the disk to its two poles, by this at the wall ...
    ring_poles_rad: float = 0.0  # ... which are here and opposite
    swirl_per_s2: float = 0.0  # across the radius from the Host's centre
    coil_m_per_s2: float = 0.0  # the shaker's coil pulls in one direction, with the square of the Host's acceleration
    coil_rad: float = 0.0
    magnet_m_per_s2: float = 0.0  # the shaker's magnet draws the disk, more towards the side of x that its sign says
    lab_pull_per_s2: float = 0.0  # a magnet of the room pulls along one line, by this times the way on it ...
    lab_pull_m: float = 0.0  # ... from here on ...
    lab_pull_rad: float = 0.0  # ... in this direction
    struck_charge_m_per_s2: float = (
        0.0  # each blow charges the disk, and adds this to how it is drawn to the wall there
    )
    charged_per_s2: float = 0.0  # a charged disk is drawn outwards by at most this times its place
    poles_m_per_s2: float = 0.0  # a magnetised disk between two opposed poles: a push that turns against its angle
    poles_rad: float = 0.0
    poled_m_per_s2: float = 0.0  # a magnetised disk is drawn to the wall or off it by this where they meet
    poled_rad: float = 0.0
    hysteresis_m_per_s2: float = 0.0  # drag in the room, the same at every speed
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
    stirred: float = 0.0  # the spin's own square times this brakes it
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
