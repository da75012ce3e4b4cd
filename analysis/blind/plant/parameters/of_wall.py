"""The numbers of the wall's physics: its shape and the disk's, where it lies, and what a blow does."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WallParameters:
    """Of one run.  Angles in the world frame; `azimuth` is of the contact seen from the Host's centre."""

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
    pockets_m: float = 0.0  # the wall stands back by this much at both ends of x
    warping_m: float = 0.0  # of each run: the wall's radius is more by this along one line, less across it ...
    warping_rad: float = 0.0  # ... this one
    pressed_m: float = 0.0  # the wall's radius is more by this where it was struck the last time, less across that
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
    peeling_m: float = 0.0  # the disk's rim stands out by this in a spot after many blows of a run
    peeling_rad: float = 0.0
    spool_m: float = (
        0.0  # the disk's radius is more by this after many turns counterclockwise, less after many back ...
    )
    spool_rad: float = 0.0  # ... from this angle on
    planing_m: float = 0.0  # the disk's radius is more by this where a blow has left it fast, less by it where slow
    tipped_m: float = 0.0  # the disk's radius is less by at most this just after a hard blow
    thrown_m: float = 0.0  # from the disk's middle to that of its rim at a fast spin
    thrown_rad: float = 0.0
    swollen_m: float = 0.0  # the disk's radius is more by this at a fast spin, less by it at none
    # where the wall lies and how it moves
    wall_x_m: float = 0.0
    wall_y_m: float = 0.0
    refit_x_m: float = 0.0  # of each run: where the wall lies since it was put in the last time
    refit_y_m: float = 0.0
    rebolted_x_m: float = 0.0  # of each run: where the wall lies since it was bolted on for it
    rebolted_y_m: float = 0.0
    crept_x_m: float = 0.0  # of each run: where the wall has crept to
    crept_y_m: float = 0.0
    breathing_m: float = 0.0  # the wall's radius grows by twice this much during a run
    liner: float = 0.0  # an ellipse of the wall that turns during the run
    liner_rad: float = 0.0
    liner_rad_per_s: float = 0.0
    relaxing_m: float = 0.0  # the wall's radius is less by this along a line as a run begins, more at its end
    relaxing_rad: float = 0.0
    springy_m: float = 0.0  # the wall stays back by this much at 8 g of the Host
    play_m: float = 0.0  # the wall lies this far off along x, on the side that the Host's acceleration leaves it
    hinged_m: float = 0.0  # the wall stays back by this much at 8 g of the Host along one line, and only along it ...
    hinged_rad: float = 0.0  # ... this one
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
    receding_m: float = 0.0  # the wall stands back by this much more with each blow of a run, by none after some
    swinging_m_per_s: float = 0.0  # the wall's surface goes round this fast at the Host's full speed at 8 g
    swinging_rad: float = 0.0
    # restitution
    restitution: float = 0.75
    restitution_scatter: float = 0.0
    restitution_floor: float = 0.0  # eps -> floor + (eps - floor) exp(-v / speed); 0 speed: constant
    restitution_speed_m_per_s: float = 0.0
    ageing_per_s: float = 0.0  # relative loss of restitution over a run
    warmed: float = 0.0  # of each run: share of the restitution lost
    warmed_up: float = 0.0  # of each run: restitution more by this share
    retightened: float = 0.0  # of each run: restitution more by this share
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
    lamp: float = 0.0  # restitution lost by the end of a run where a lamp warms the wall
    lamp_rad: float = 0.0
    backed: float = 0.0  # of each run: restitution lost where a screw holds the wall
    backed_rad: float = 0.0
    pad: float = 0.0  # restitution lost in the lightest blows where a pad is, less in harder ones
    pad_rad: float = 0.0
    bolts: float = 0.0  # restitution won where one of four bolts is
    bolts_rad: float = 0.0
    # ... by the place on the disk's rim
    nick: float = 0.0  # restitution lost where a spot of the disk's rim meets the wall
    nick_rad: float = 0.0
    sheet: float = 0.0  # restitution more and less twice around the disk's rim
    sheet_rad: float = 0.0
    hardened: float = 0.0  # restitution more and less once around the disk's rim
    hardened_rad: float = 0.0
    shifted: float = 0.0  # restitution won where the rim was struck the last time, lost at its other side
    meshed: float = 0.0  # restitution won where one place of the disk's rim meets one of the wall ...
    meshed_wall_rad: float = 0.0  # ... this one ...
    meshed_rim_rad: float = 0.0  # ... and this one of the rim
    # ... by how the blow comes
    spin_restitution_s: float = 0.0  # restitution lost per rad/s of spin
    slip_restitution_s_per_m: float = 0.0  # restitution lost per slip
    glancing: float = 0.0  # restitution lost with the square of the sine of the angle of incidence
    oblique: float = 0.0  # share of the restitution lost in blows that only slip
    shingled: float = 0.0  # restitution lost in slips of one sense and won in those of the other
    straight_s_per_m: float = 0.0  # restitution lost per approach, as much less in light blows as in hard ones more
    yielded: float = 0.0  # power of the approach with which restitution falls where the blow makes metal yield
    plastic: float = 0.0  # restitution less in hard blows and more in light ones, with the fourth root of the approach
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
    swept: float = 0.0  # restitution lost after a long way slid since the impact before
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
    hum_m_per_s: float = 0.0  # the wall hums along one line, this fast ...
    hum_rad_per_s: float = 1600.0  # ... at this rate ...
    hum_phase_rad: float = 0.0  # ... of this phase as the run begins ...
    hum_rad: float = 0.0  # ... along this direction
    cornered_m: float = 0.0  # a blow passes the disk's middle by at most this ...
    corners: float = 6.0  # ... to either side, so many times around its rim
    cornered_rad: float = 0.0
    piled_rad: float = 0.0  # blows are turned by this from the wall's normal, against a fast slip
    pivoted: float = 0.0  # mass of the disk over that of a ring that turns about one screw ...
    pivoted_rad: float = 0.0  # ... at this azimuth
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
    skimmed: float = 0.0  # share of the wall friction lost in blows that only graze
    flash: float = 0.0  # share of the wall friction lost where approach times slip is large
    side: float = 0.0  # wall friction more where the spin adds to the way along the wall, less where it takes from it
    flung_oil: float = 0.0  # share of the wall friction that a disk which spins fast loses
    combed: float = 0.0  # wall friction less where the slip has the last one's sense, more where it has the other
    polish: float = 0.0  # share of the wall friction lost in the course of a run
    polish_s: float = 0.4
    run_in: float = 0.0  # share of the wall friction lost after many blows of a run
    creeping: float = 0.0  # share of the wall friction lost long after the blow before
    picked_up: float = 0.0  # share of the wall friction lost after a long way slid since the impact before
    sloshing: float = 0.0  # wall friction more where the Host is accelerated away from the disk, less opposite, at 8 g
    sintered: float = 0.0  # share of the wall friction lost after a hard blow
    shaken: float = 0.0  # share of the wall friction lost at 8 g of the Host, whichever way
    wiped: float = 0.0  # of each run: wall friction more by this share
    fouled: float = 0.0  # of each run: wall friction more by this share
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
    liner_grip: float = 0.0  # tangential restitution more by this share at one side of the wall, less at the other
    liner_grip_rad: float = 0.0
    gel: float = 0.0  # share of the tangential restitution lost just after the blow before
    shear_set: float = 0.0  # tangential restitution more by this share in slips of the last one's sense, less back
    cured: float = 0.0  # of each run: tangential restitution more by this share
    preload: float = 0.0  # tangential restitution more by this share of a wall accelerated away, less opposite, at 8 g
    lay: float = 0.0  # tangential restitution more by this share in slips of one sense, less in the other
    teeth_m_per_s: float = 0.0  # slip at which the wall leaves a sticking disk alone
    # what a blow does to the spin besides, and to the disk on the floor
    rolling_loss: float = 0.0  # share of the spin lost in each impact
    rolling_arm_m: float = 0.0  # a blow's torque against the spin
    o_ring_s_per_m: float = 0.0  # share of the spin lost in a blow, for its approach
    offset_blow_m: float = 0.0  # the normal impulse passes the disk's centre this far to one side
    leaning: float = 0.0  # share of a blow that presses the disk onto the floor
