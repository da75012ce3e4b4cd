"""Every number of the plant's physics, SI; the neutral value switches a cause off."""

from typing import NamedTuple

STATES = 15  # numbers of a state: `accelerations.derivative` names them


class PlantParameters(NamedTuple):
    """Physics of one run. Angles in the world frame; `azimuth` is of the contact seen from the Host's
    centre."""

    disk_radius_m: float = 0.01
    mass_kg: float = 0.0246
    inertia_factor: float = 0.5
    contact_radius_m: float = 0.04
    load_m_per_s2: float = 9.81
    smoothing_m_per_s: float = 1e-3
    duration_s: float = 1.2
    # contact law
    restitution: float = 0.75
    restitution_scatter: float = 0.0
    wall_friction: float = 0.15
    tangential_restitution: float = 0.45
    restitution_floor: float = 0.0  # eps -> floor + (eps - floor) exp(-v / speed); 0 speed: constant
    restitution_speed_m_per_s: float = 0.0
    direction_amplitude: float = 0.0
    direction_phase_rad: float = 0.0
    contact_time_s: float = 0.0
    contact_shear_share: float = 0.82
    # floor
    floor_friction: float = 0.25
    spin_share: float = 1.0  # 0 plain Coulomb, 1 Farkas
    friction_change_per_s: float = 0.0
    # the Host's give: it swings back from an impulse like a mass on a damped spring
    recoil_kg: float = 0.0
    recoil_rad_per_s: float = 0.0
    recoil_damping: float = 0.0  # of the critical one
    # accelerations
    viscous_per_s: float = 0.0
    air_per_m: float = 0.0
    tilt_x_m_per_s2: float = 0.0
    tilt_y_m_per_s2: float = 0.0
    # geometry
    ellipticity: float = 0.0
    ellipticity_phase_rad: float = 0.0
    lobes: float = 0.0  # the wall's radius more by this share at so many places
    lobe_order: float = 3.0
    lobe_phase_rad: float = 0.0
    wall_x_m: float = 0.0
    wall_y_m: float = 0.0
    mass_x_m: float = 0.0  # centre of mass from the geometric centre, in the disk
    mass_y_m: float = 0.0
    # flat walls, a cylinder in the ring
    wall_sides: float = 0.0  # 0: round; else a regular polygon whose sides lie contact_radius_m from its middle
    wall_turn_rad: float = 0.0  # normal of its first side, in the Host
    obstacle_m: float = 0.0  # from the cylinder's axis to the disk's middle where they touch; 0: no cylinder
    # causes in nobody's list
    central_per_s2: float = 0.0
    magnus: float = 0.0
    pull_m_per_s2: float = 0.0
    pull_x_m: float = 0.0
    pull_y_m: float = 0.0
    pull_width_m: float = 0.015
    patch_amplitude: float = 0.0
    patch_x_m: float = 0.0
    patch_y_m: float = 0.0
    patch_width_m: float = 0.012
    anisotropy: float = 0.0
    anisotropy_phase_rad: float = 0.0
    spin_drag_per_s: float = 0.0
    hop_s: float = 0.0  # the floor carries no load this long after an impact
    soft_amplitude: float = 0.0  # restitution lost in a spot of the wall
    soft_azimuth_rad: float = 0.0
    soft_width_rad: float = 0.4
    phase_amplitude: float = 0.0  # restitution with the drive's phase
    phase_rad: float = 0.0
    drive_rad_per_s: float = 0.0
    spin_restitution_s: float = 0.0  # restitution lost per rad/s of spin
    ageing_per_s: float = 0.0  # relative loss of restitution over a run
    wall_friction_amplitude: float = 0.0
    wall_friction_phase_rad: float = 0.0
    wall_friction_lobes: float = 1.0
    wall_pull_m_per_s2: float = 0.0  # towards the wall, falling off within wall_pull_m of it
    wall_pull_m: float = 0.004
    swirl_per_s2: float = 0.0  # across the radius from the Host's centre
    weakening: float = 0.0  # floor friction more by this share at rest, gone beyond weakening_m_per_s
    weakening_m_per_s: float = 0.4
    rail_per_s: float = 0.0  # drag along one direction of the room
    rail_rad: float = 0.0
    sway_m_per_s2: float = 0.0  # the room's floor tilts to and fro
    sway_rad_per_s: float = 0.0
    sway_rad: float = 0.0
    ridge_m_per_s2: float = 0.0  # along a line of the Host's floor
    ridge_m: float = 0.0
    ridge_rad: float = 0.0
    settling: float = 0.0  # floor friction less by this share after an impact, back within settling_s
    settling_s: float = 0.02
    rest_amplitude: float = 0.0  # restitution lost when the impact before was this recent
    rest_s: float = 0.03
    slip_restitution_s_per_m: float = 0.0  # restitution lost per slip
    handed: float = 0.0  # wall friction larger in one sense of slip
    rolling_loss: float = 0.0  # share of the spin lost in each impact
    # causes in nobody's list that came after the diagnosis was made (`causes.later`)
    groove: float = 0.0  # floor friction more and less along one direction, once in groove_m
    groove_m: float = 0.012
    groove_rad: float = 0.0
    groove_phase_rad: float = 0.0
    warming: float = 0.0  # share of the floor friction lost along the way slid, most of it within warming_m
    warming_m: float = 0.5
    needle_rad_per_s2: float = 0.0  # the disk turns like a compass needle
    needle_rad: float = 0.0
    stream_per_s: float = 0.0  # a stream of air along a line across the ring
    stream_m_per_s: float = 0.8
    stream_width_m: float = 0.01
    stream_rad: float = 0.0
    saddle_per_s2: float = 0.0  # the floor rises along one line and falls across it
    saddle_rad: float = 0.0
    film: float = 0.0  # share of the floor friction that a spinning disk loses
    film_rad_per_s: float = 60.0
    rim: float = 0.0  # floor friction more by this share near the wall
    rim_share: float = 0.75  # from this share of the contact radius on
    sag_m_per_s2: float = 0.0  # the room's floor tilts steadily during the run
    sag_rad: float = 0.0
    tacky: float = 0.0  # wall friction more by this share in a spot of the wall
    tacky_rad: float = 0.0
    nick: float = 0.0  # restitution lost where a spot of the disk's rim meets the wall
    nick_rad: float = 0.0
    glancing: float = 0.0  # restitution lost with the square of the sine of the angle of incidence
    damage: float = 0.0  # restitution lost for good after a blow harder than damage_m_per_s
    damage_m_per_s: float = 1.6
    teeth_m_per_s: float = 0.0  # slip at which the wall leaves a sticking disk alone
    dent_m: float = 0.0  # the wall stands in by this much in a spot
    dent_rad: float = 0.0
    dent_width_rad: float = 0.3
    oval: float = 0.0  # the disk's radius, relative to the contact radius, twice around its rim
    oval_rad: float = 0.0
    # causes in nobody's list that came after those (`causes.latest`)
    tether_per_s2: float = 0.0  # a thread from a point of the Host, slack up to tether_slack_m
    tether_x_m: float = 0.0
    tether_y_m: float = 0.0
    tether_slack_m: float = 0.03
    bowl_m_per_s2: float = 0.0  # the floor rises towards the wall: this steep at it, with the sixth power of the radius
    cubic_s_per_m2: float = 0.0  # drag with the third power of the speed
    slam_m_per_s2: float = 0.0  # a blow against the room's floor, which swings and dies out
    slam_s: float = 0.0
    slam_rad: float = 0.0
    slam_rad_per_s: float = 75.0
    slam_decay_s: float = 0.08
    windmill_per_s: float = 0.0  # a draught turns the disk, towards windmill_rad_per_s
    windmill_rad_per_s: float = 150.0
    bistable_rad_per_s2: float = 0.0  # the disk turns to the nearer of two opposite angles
    bistable_rad: float = 0.0
    seam: float = 0.0  # floor friction more by this share on one side of a line of the Host's floor
    seam_m: float = 0.0
    seam_rad: float = 0.0
    lift: float = 0.0  # floor friction less by this share at lift_m_per_s and more, with the square of the speed
    lift_m_per_s: float = 2.0
    adhesion_m_per_s: float = 0.0  # the wall keeps the energy of this speed in each impact
    clamps: float = 0.0  # restitution more and less three times around the wall
    clamps_rad: float = 0.0
    yielding_s_per_m: float = 0.0  # restitution lost per speed of the wall towards the disk
    rough_rad: float = 0.0  # the wall's normals scatter by this much from impact to impact
    polish: float = 0.0  # share of the wall friction lost in the course of a run
    polish_s: float = 0.4
    step_m: float = 0.0  # one half of the wall stands back by this much
    step_rad: float = 0.0
    trilobe: float = 0.0  # the disk's radius, relative to the contact radius, three times around its rim
    trilobe_rad: float = 0.0
    breathing_m: float = 0.0  # the wall's radius grows by twice this much during a run
    # causes in nobody's list that came after those (`causes.newest`)
    canted_rad: float = 0.0  # the floor's friction is turned by this much from the slip
    curling: float = 0.0  # friction across the slip of a disk that spins as fast as it slides, in units of mu N
    lag_s: float = 0.0  # the floor's friction follows its law this late
    warped: float = 0.0  # floor friction more along one line of the disk, less across it
    warped_rad: float = 0.0
    eddy_per_s: float = 0.0  # drag over a magnet under the Host's floor
    eddy_x_m: float = 0.0
    eddy_y_m: float = 0.0
    eddy_width_m: float = 0.012
    rocking: float = 0.0  # the table rocks: this share of the Host's acceleration pushes the disk
    ratchet_rad_per_s2: float = 0.0  # spin of this sign is braked steadily, the other is not
    fading_grip: float = 0.0  # share of the tangential restitution lost at fading_m_per_s and faster
    fading_m_per_s: float = 0.8
    bruise: float = 0.0  # restitution lost where the wall was hit the last time
    offset_blow_m: float = 0.0  # the normal impulse passes the disk's centre this far to one side
    greased: float = 0.0  # share of the wall friction lost at slips well above greased_m_per_s
    greased_m_per_s: float = 0.4
    loose_chip: float = 0.0  # restitution lost in one impact of six
    chip_m: float = 0.0  # a piece of the disk's rim is missing, this deep
    chip_rad: float = 0.0
    liner: float = 0.0  # an ellipse of the wall that turns during the run
    liner_rad: float = 0.0
    liner_rad_per_s: float = 0.0
    springy_m: float = 0.0  # the wall stays back by this much at 8 g of the Host
    # causes in nobody's list that came after those (`causes.unforeseen`)
    cushion_per_s: float = 0.0  # drag of the air between disk and wall on what moves towards it or away, at the wall
    coil_m_per_s2: float = 0.0  # the shaker's coil pulls in one direction, with the square of the Host's acceleration
    coil_rad: float = 0.0
    loose_floor: float = 0.0  # share of the Host's velocity that its floor does not have
    grit: float = 0.0  # standard deviation of the floor's friction from flight to flight, relative
    grit_draw: float = 0.0  # of each run: which ones it has
    grain: float = 0.0  # share of the weight that stands on one grain under the disk
    grain_rad: float = 0.0
    thread_m_per_s2: float = 0.0  # a thread of glue pulls back to where the wall was hit the last time
    two_edges: float = 0.0  # restitution more and less in turn, from impact to impact
    cohesion_m_per_s: float = 0.0  # the wall's friction beyond its share of the blow
    taped: float = 0.0  # share of the tangential restitution lost along half of the disk's rim
    taped_rad: float = 0.0
    rolling_arm_m: float = 0.0  # a blow's torque against the spin
    joint_m: float = 0.0  # the wall's two ends overlap by this much, its radius goes round from one to the other
    joint_rad: float = 0.0
    loose_ring_m: float = 0.0  # the wall lies this far off, to where it was pushed the last time
