"""Every table of the application, once.

To add a column, add a line; its unit is the end of its name.  FORMATS' columns are never renamed or removed.
"""

from __future__ import annotations

from dataclasses import replace

from ovines.tables.column import Column, Table, flag, integer, maybe, number, optional, text

FRAME = integer("frame", "number of the frame, from 0")
TIME = number("time_s", "middle of the exposure")
NORMAL_SPEEDS = ("normal_speed_before_m_per_s", "normal_speed_after_m_per_s")
BODIES = {"nes": "NES", "host": "Host"}


def _motion_columns() -> tuple[Column, ...]:
    columns = []
    for body, title in BODIES.items():
        columns += [maybe(f"{body}_{axis}_m", f"{axis} of the {title}'s centre, world frame") for axis in "xyz"]
        columns += [optional(f"{body}_angle_rad", f"angle of the {title} from x to y, unwrapped")]
        columns += [optional(f"{body}_{axis}_sd_m", f"standard deviation of {body}_{axis}_m") for axis in "xyz"]
        columns += [optional(f"{body}_angle_sd_rad", f"standard deviation of {body}_angle_rad")]
        columns += [optional(f"{body}_v{axis}_m_per_s", f"velocity of the {title} along {axis}") for axis in "xyz"]
        columns += [optional(f"{body}_spin_rad_per_s", f"angular velocity of the {title}")]
        columns += [integer(f"{body}_markers", f"markers that gave the {title}'s pose", nullable=True, required=False)]
    return tuple(columns)


def _impact_columns() -> tuple[Column, ...]:
    speeds = []
    for side in ("normal", "tangential"):
        for when in ("before", "after"):
            name = f"{side}_speed_{when}"
            speeds.append(maybe(f"{name}_m_per_s", f"{side} speed of the contact point, relative to the wall, {when}"))
            speeds.append(optional(f"{name}_sd_m_per_s", f"standard deviation of {name}_m_per_s"))
    spins = [maybe(f"spin_{when}_rad_per_s", f"spin of the NES {when}") for when in ("before", "after")]
    return (
        integer("impact", "number of the impact, from 0"),
        maybe("time_s", "instant of the contact; null where impacts are all that is known"),
        maybe("time_sd_s", "standard deviation of time_s"),
        maybe("azimuth_rad", "direction of the contact seen from the Host's centre, world frame"),
        optional("normal_rad", "direction of the wall's outward normal at the contact, world frame"),
        text(
            "surface",
            'what was hit: "ring", "side 1" and on along polygon_m, or "cylinder"',
            nullable=True,
            required=False,
        ),
        *speeds,
        *spins,
        optional("lever_normal_m", "contact from the centre of mass along the outward normal; else the radius"),
        optional("lever_tangential_m", "contact from the centre of mass along the tangent, a quarter turn on; else 0"),
        maybe("restitution", "normal speed after / before"),
        maybe("restitution_sd", "standard deviation of restitution"),
        maybe("tangential_restitution", "informed by a sticking impact only"),
        optional("tangential_restitution_sd", "standard deviation of tangential_restitution"),
        maybe("wall_friction", "informed by a sliding impact only"),
        optional("wall_friction_sd", "standard deviation of wall_friction"),
        optional("effective_tangential_restitution", "tangential speed after / before, reversed; of every impact"),
        optional("effective_tangential_restitution_sd", "standard deviation of effective_tangential_restitution"),
        optional("impulse_ratio", "tangential over normal impulse, against the slip; of every impact"),
        optional("impulse_ratio_sd", "standard deviation of impulse_ratio"),
        optional(
            "spin_imbalance_m_per_s",
            "impulse per mass that the spin's change tells, less the tangential one; 0 for every law",
        ),
        optional("spin_imbalance_sd_m_per_s", "standard deviation of spin_imbalance_m_per_s"),
        text("regime", 'which of the last two the impact informs: "stick" or "slide"', nullable=True),
    )


def _circle_columns() -> tuple[Column, ...]:
    columns = []
    for circle in ("circle1", "circle2", "circle3", "circle4", "mean", "fit"):
        what = {"mean": "mean of the four", "fit": "least-squares circle"}.get(circle, "circle of three markers")
        columns += [maybe(f"{circle}_{axis}_m", f"{axis} of the centre, {what}") for axis in "xyz"]
        columns += [maybe(f"{circle}_radius_m", f"radius, {what}")]
    return (*columns, optional("fit_residual_m", "RMS distance of the markers from the least-squares circle"))


IMPACTS = _impact_columns()
LOSSES = {
    "restitution": "in impacts, along the wall's normal",
    "wall_friction": "at the wall, along its tangent: impacts and sustained contact",
    "floor_sliding": "to the floor by sliding",
    "floor_spinning": "to the floor by spinning",
    "drag": "to drag",
    "damper": "to the dampers of a sprung Host",
}
STATE = {
    "x_m": "x",
    "y_m": "y",
    "vx_m_per_s": "velocity along x",
    "vy_m_per_s": "velocity along y",
    "angle_rad": "angle",
    "spin_rad_per_s": "spin",
}
DRIVE = "work of the driver, or of the ground under a sprung Host"
OUTCOMES = {
    "impacts_per_s": "impacts per second",
    "contact_share": "share of the time in sustained contact",
    "speed_m_per_s": "speed of the NES relative to the Host at the end",
    "spin_rad_per_s": "size of its relative spin at the end",
}


def _energy_columns() -> tuple[Column, ...]:
    stored = {
        "nes_kinetic": "kinetic energy of the NES' centre of mass",
        "nes_spin": "kinetic energy of the NES' spin",
        "nes_potential": "potential energy of the NES (gravity in the plane)",
        "host_kinetic": "kinetic energy of a movable Host",
        "host_spin": "kinetic energy of a movable Host's turning",
        "spring": "energy of the springs",
    }
    return (
        *(maybe(f"{name}_j", meaning) for name, meaning in stored.items()),
        *(maybe(f"{name}_loss_j", f"lost {where}, since the start") for name, where in LOSSES.items()),
        maybe("work_j", f"{DRIVE}, since the start"),
        maybe("residual_j", "stored and lost, less the start's energy and the work: what does not add up"),
    )


def _state_columns() -> tuple[Column, ...]:
    columns = []
    for body, title in BODIES.items():
        columns += [number(f"{body}_{axis}_m", f"{axis} of the {title}'s centre") for axis in "xy"]
        columns += [number(f"{body}_v{axis}_m_per_s", f"velocity of the {title} along {axis}") for axis in "xy"]
        columns += [number(f"{body}_angle_rad", f"angle of the {title} from x to y, unwrapped")]
        columns += [number(f"{body}_spin_rad_per_s", f"angular velocity of the {title}")]
    return tuple(columns)


def _sweep_columns() -> tuple[Column, ...]:
    over = {"mean": "mean", "sd": "standard deviation", "median": "median", "low": "5 %", "high": "95 %"}
    return (
        text("parameter", "what varies"),
        number("value", "its value, in the unit that its name ends in"),
        text("other_parameter", "what varies beside it", nullable=True),
        maybe("other_value", "its value"),
        integer("runs", "runs at this point"),
        *(
            number(f"{name}_{kind}", f"{meaning}, {word} over the runs")
            for name, meaning in OUTCOMES.items()
            for kind, word in over.items()
        ),
        *(number(f"{name}_loss_w", f"mean power lost {where}") for name, where in LOSSES.items()),
        number("work_w", f"mean power: {DRIVE}"),
    )


GIVEN = tuple(  # the same as they may be brought: of everything but the normal speeds what is known
    column
    if column.name == "impact"
    else replace(column, nullable=column.name not in NORMAL_SPEEDS, required=column.name in NORMAL_SPEEDS)
    for column in IMPACTS
)

TABLES: dict[str, Table] = {
    table.name: table
    for table in (
        Table(
            "tracks",
            "camera, frame, marker seen",
            (
                text("camera", "name of the camera"),
                FRAME,
                TIME,
                text("marker", "name of the marker"),
                number("u_px", "to the right, in the window"),
                number("v_px", "downwards, in the window"),
                maybe("sd_px", "standard deviation of either coordinate; null = unknown"),
            ),
            key=("camera", "frame", "marker"),
            clock="camera",
        ),
        Table(
            "points",
            "frame, marker",
            (
                FRAME,
                TIME,
                text("marker", "name of the marker"),
                *(number(f"{axis}_m", f"{axis}, world frame") for axis in "xy"),
                maybe("z_m", "z, world frame; null where one camera saw the plane"),
                *(maybe(f"{axis}_sd_m", f"standard deviation of {axis}_m") for axis in "xyz"),
                *(
                    optional(
                        f"{axis}_calibration_sd_m",
                        f"standard deviation of {axis}_m from the calibration alone (and, with one camera, the "
                        f"marker's height), not in {axis}_sd_m",
                    )
                    for axis in "xyz"
                ),
                *(
                    optional(
                        f"{axis}_common_sd_m",
                        f"standard deviation of {axis}_m that all markers of a body share (one camera, a body that "
                        f"leaves the plane), not in {axis}_sd_m",
                    )
                    for axis in "xy"
                ),
                maybe("reprojection_px", "RMS distance from the measured image points"),
                optional("epipolar_px", "signed residual across the epipolar line, the one that two views leave over"),
            ),
            key=("frame", "marker"),
            clock="",
        ),
        Table(
            "walls",
            "frame, round body seen whole",
            (
                FRAME,
                TIME,
                text("body", '"host": its inner wall\'s rim; "nes": its upper rim'),
                *(number(f"{axis}_m", f"{axis} of the circle's centre, world frame") for axis in "xyz"),
                number("radius_m", "radius, from the edges in both images"),
                *(
                    number(f"{axis}_sd_m", f"standard deviation of {axis}_m, the calibration's own left out")
                    for axis in "xyz"
                ),
                number("radius_sd_m", "standard deviation of radius_m, the calibration's own left out"),
                number("residual_px", "RMS distance of the edge points from the circle"),
                integer("points", "edge points that gave it"),
                number("marker_x_m", "x of the centre as the body's markers and layout_m say"),
                number("marker_y_m", "y of the centre as the body's markers and layout_m say"),
            ),
            key=("frame", "body"),
        ),
        Table("motion", "frame", (FRAME, TIME, *_motion_columns()), key=("frame",), clock=""),
        Table("host_circle", "frame", (FRAME, TIME, *_circle_columns()), key=("frame",), clock=""),
        Table(
            "rotation",
            "frame",
            (
                FRAME,
                TIME,
                maybe("nes_angle_triplet_rad", "NES angle from marker triplets, mean of all combinations"),
                maybe("nes_angle_triplet_spread_rad", "standard deviation over the combinations"),
                maybe("nes_angle_fit_rad", "NES angle of the rigid-body fit"),
                maybe("nes_angle_fit_sd_rad", "standard deviation of nes_angle_fit_rad"),
            ),
            key=("frame",),
            clock="",
        ),
        Table(
            "flights",
            "flight or sustained contact",
            (
                integer("flight", "number of the segment, from 0"),
                number("start_s", "its start"),
                number("end_s", "its end"),
                text("kind", '"flight", "rest", "chatter", "contact", "unseen" or "unresolved"'),
            ),
            key=("flight",),
        ),
        Table(
            "thesis_impacts",
            "maximum of the Savitzky-Golay acceleration norm",
            (
                integer("impact", "number of the maximum, from 0"),
                integer("frame", "its frame"),
                number("time_s", "its time"),
                maybe("acceleration_m_per_s2", "acceleration norm there"),
                maybe("prominence_m_per_s2", "prominence of the maximum"),
                maybe("normal_speed_before_m_per_s", "straight line through the frames before"),
                maybe("normal_speed_after_m_per_s", "straight line through the frames after"),
                maybe("tangential_speed_before_m_per_s", "of the contact point, straight lines before"),
                maybe("tangential_speed_after_m_per_s", "of the contact point, straight lines after"),
                maybe("spin_before_rad_per_s", "straight line through the angles before"),
                maybe("spin_after_rad_per_s", "straight line through the angles after"),
                maybe("azimuth_rad", "direction of the wall's normal at the contact, world frame"),
                maybe("restitution", "normal speed after / before, as in Table 16"),
            ),
            key=("impact",),
        ),
        Table(
            "accelerometers",
            "channel of the accelerometers' record",
            (
                text("channel", "its column in the record"),
                text("body", '"host" or "table"'),
                *(number(f"direction_{axis}", f"{axis} of the sensor's direction, world frame") for axis in "xyz"),
                number("offset_s", "the cameras' time = offset_s + time_scale * the record's time"),
                number("offset_sd_s", "standard deviation of offset_s"),
                number("time_scale", "seconds of the cameras in a second of the record"),
                number("time_scale_sd", "standard deviation of time_scale"),
                number("middle_sd_s", "standard deviation of the synchronised time in the middle of the run"),
                maybe("other_offset_s", "nearest other offset that fits as well; null: none does"),
                number("gain", "the Host's displacement by the cameras over the one by the record"),
                number("gain_sd", "standard deviation of gain"),
                maybe("stated_sensitivity_mv_per_g", "as recording.toml has it"),
                maybe("sensitivity_mv_per_g", "by which the record agrees with the cameras"),
                maybe("sensitivity_sd_mv_per_g", "standard deviation of sensitivity_mv_per_g"),
                maybe("record_frequency_hz", "main line of the record, in its own clock"),
                maybe("cameras_frequency_hz", "main line of the Host's motion, in the cameras' clock"),
                maybe("record_amplitude_m_per_s2", "acceleration amplitude of the main line, stated sensitivity"),
                maybe("cameras_amplitude_m_per_s2", "acceleration amplitude of the main line by the cameras"),
                maybe("phase_rad", "of the record's main line before the cameras', synchronised"),
                number("share", "of the Host's displacement along the channel that the record follows"),
                number("error_m_per_s2", "RMS difference of the accelerations, each a mean over a frame's interval"),
                number("error_with_gain_m_per_s2", "the same with the record times gain"),
                number("error_m", "RMS difference of the displacements without what is slower than the drive"),
                number("error_with_gain_m", "the same with the record times gain"),
                integer("frames", "frames within the record"),
            ),
            key=("channel",),
        ),
        Table(
            "accelerations",
            "channel, frame",
            (
                text("channel", "its column in the record"),
                FRAME,
                TIME,
                number("record_m_per_s2", "acceleration by the record, mean over a frame's interval and less its mean"),
                number("cameras_m_per_s2", "the same of the Host's path by the cameras"),
                number("record_m", "displacement by the record, without what is slower than the drive"),
                number("cameras_m", "the same by the cameras"),
            ),
            key=("channel", "frame"),
            clock="channel",
        ),
        Table("impacts", "impact", IMPACTS, key=("impact",)),
        Table(
            "simulated_impacts",
            "impact, exact values",
            (
                *IMPACTS,
                optional("restitution_loss_j", "lost along the normal; a share of a finite contact is in it"),
                optional("wall_friction_loss_j", "lost along the tangent: friction and tangential restitution"),
                optional("work_j", "work of the wall's motion on the NES (driven Host)"),
            ),
            key=("impact",),
        ),
        Table(
            "energies", "time sample", (number("time_s", "time since the start"), *_energy_columns()), key=("time_s",)
        ),
        Table(
            "ensemble",
            "scattered copy of the run",
            (
                integer("run", "number of the copy, from 0"),
                number("start_x_m", "x of the NES at the start"),
                number("start_y_m", "y of the NES at the start"),
                integer("impacts", "number of its impacts"),
                integer("contacts", "number of its sustained contacts"),
                number("contact_s", "time in sustained contact"),
                number("end_s", "when it ended"),
                *(
                    number(f"{body}_{name}", f"{meaning} of the {title} at the end")
                    for body, title in BODIES.items()
                    for name, meaning in STATE.items()
                ),
                *(number(f"{name}_loss_j", f"lost {where}") for name, where in LOSSES.items()),
                number("work_j", DRIVE),
            ),
            key=("run",),
        ),
        Table("sweep", "point of a sweep", _sweep_columns(), key=("value", "other_value")),
        Table(
            "plan",
            "setting and parameter of a planned day",
            (
                text("setting", '"as stated", or what would be done otherwise'),
                text("parameter", "name of the parameter, as in identification"),
                maybe("sd", "standard deviation that the day would give, SI, median over the simulated days"),
                maybe("sd_low", "the smallest of the days"),
                maybe("sd_high", "the largest"),
                number("determined", "share of the days that determine it"),
                maybe("gain", "sd as stated over sd of this setting, median over days with the same starts"),
                number("impacts", "impacts of a day, median"),
                number(
                    "usable", "share of starts that give a run long enough and with ten impacts; others are repeated"
                ),
                number("filmed_s", "time until the disk rolls along the wall for good, or the run's end, mean"),
            ),
            key=("setting", "parameter"),
        ),
        Table(
            "sensitivities",
            "derivative",
            (
                number("time_s", "instant of the state, or of the impact"),
                text("of", 'what changes: a state at that instant, or "impact_time_s"'),
                text("by", "what is changed"),
                number("derivative", "change of the one per unit of the other, SI"),
            ),
        ),
        Table(
            "lyapunov",
            "Lyapunov exponent",
            (
                integer("exponent", "number of the exponent, the largest is 0"),
                number("value_per_s", "growth of a tangent"),
                number("sd_per_s", "standard deviation of value_per_s, from ten batches"),
                number("impacts_per_s", "impacts of the run after the transient"),
            ),
            key=("exponent",),
        ),
        Table(
            "section",
            "state of a Poincaré section",
            (
                integer("run", "number of the run, from 0"),
                integer("period", "number of the period of the drive, from 0"),
                text("parameter", "number that varies from run to run", nullable=True),
                maybe("value", "its value"),
                *_state_columns(),
            ),
            key=("run", "period"),
        ),
        Table(
            "orbits",
            "periodic orbit along a branch",
            (
                integer("orbit", "place along the branch, from 0"),
                text("parameter", "number that varies"),
                number("value", "its value"),
                number("period_s", "period of the orbit"),
                flag("stable", "every Floquet multiplier is inside the unit circle"),
                number("multiplier", "size of the largest Floquet multiplier"),
                number("multiplier_angle_rad", "its angle: 0 at a fold, pi where the period doubles"),
                integer("impacts", "impacts in a period"),
                maybe("fastest_impact_m_per_s", "largest normal speed before an impact"),
                *_state_columns(),
            ),
            key=("orbit",),
        ),
        Table(
            "basins",
            "start of a map of basins",
            (
                text("parameter", "state along the first axis"),
                number("value", "its value at the start"),
                text("other_parameter", "state along the second axis"),
                number("other_value", "its value at the start"),
                integer(
                    "attractor",
                    "number of the attractor, the largest basin is 0; null outside the walls",
                    nullable=True,
                ),
                maybe("attractor_period", "its period in periods of the drive; 0: none"),
                maybe("attractor_impacts", "its impacts per period of the drive"),
            ),
            key=("value", "other_value"),
        ),
        Table(
            "energy_taken",
            "sample of a run",
            (
                number("time_s", "instant"),
                number("host_j", "energy of the Host: moving, turning, springs"),
                number("bare_j", "the same without a NES"),
                number("pumped_j", "gone from Host to NES since the start"),
                number("nes_j", "of it, in the NES"),
                *(number(f"{name}_loss_j", f"lost {where} since the start") for name, where in LOSSES.items()),
                number("work_j", f"since the start: {DRIVE}"),
            ),
            key=("time_s",),
        ),
        Table(
            "response",
            "NES and frequency",
            (
                text("nes", '"scenario", or "best" of a design'),
                number("frequency_hz", "of the ground"),
                integer("runs", "runs at this frequency"),
                number("amplitude_m", "Host's amplitude (root of twice the variance), both axes, mean of the runs"),
                number("amplitude_sd_m", "its standard deviation over the runs"),
                number("amplitude_low_m", "its 5 %"),
                number("amplitude_high_m", "its 95 %"),
                number("amplitude_x_m", "mean amplitude along x"),
                number("amplitude_y_m", "mean amplitude along y"),
                number("bare_amplitude_m", "amplitude without NES, closed form"),
                number("stuck_amplitude_m", "amplitude with a disk that sticks to the floor, closed form"),
                number("impacts_per_period", "impacts per period of the drive"),
            ),
            key=("nes", "frequency_hz"),
        ),
        Table(
            "design",
            "candidate of a design",
            (
                integer("candidate", "number, from 0; those tried with all runs first, the best of all"),
                maybe("clearance_m", "2 R_H - 2 R_N; null where the scenario's own is kept, as in the next ones"),
                maybe("mass_ratio", "mass of the NES over the Host's"),
                maybe("floor_friction", "coefficient of the floor"),
                maybe("restitution", "restitution of the wall"),
                maybe("wall_friction", "friction of the wall"),
                maybe("tangential_restitution", "tangential restitution of the wall"),
                integer("runs", "runs at each frequency"),
                number("amplitude_m", "Host's largest mean amplitude over the band"),
                number("amplitude_low_m", "its 5 %, by resampling the runs"),
                number("amplitude_high_m", "its 95 %"),
                maybe("best_share", "share of resampled ensembles in which it is the best of those kept"),
                number("bare_amplitude_m", "largest amplitude without NES"),
                number("damper_amplitude_m", "with an optimal tuned mass damper of the best one's mass"),
            ),
            key=("candidate",),
        ),
        Table("given_impacts", "impact that a recording brings (its impacts.parquet)", GIVEN, key=("impact",)),
        Table("contact", "sustained wall contact", (number("start_s", "its start"), number("end_s", "its end"))),
        Table(
            "identification",
            "parameter",
            (
                text("parameter", "name of the parameter"),
                maybe("value", "estimate"),
                maybe("sd", "standard deviation"),
                maybe("low", "lower end of the 90 % interval"),
                maybe("high", "upper end of the 90 % interval"),
                integer("n_impacts", "impacts that inform it", nullable=True),
            ),
            key=("parameter",),
        ),
        Table(
            "checks",
            "check of the identification that can fail",
            (
                text("check", "what is held against what"),
                maybe("value", "what was found, unit of the check"),
                maybe("limit", "what it is held against"),
                text("state", '"holds", "fails" or "open" (cannot be checked)'),
                text("found", "the same in words"),
                text("parameters", "not to be used where it fails, comma between them"),
                text("do", "what to do where it fails"),
            ),
            key=("check",),
        ),
        Table(
            "flights_ahead",
            "flight predicted from the impact before it",
            (
                number("start_s", "the impact before"),
                number("end_s", "the impact after"),
                integer("frames", "frames compared"),
                number("rms_m", "RMS distance of measured from simulated places"),
                number("end_m", "distance at the last frame"),
                maybe("angle_rms_rad", "RMS difference of the angles"),
            ),
            key=("start_s",),
        ),
        Table(
            "impacts_ahead",
            "impact predicted from what was measured before it",
            (
                integer("impact", "number of the impact, from 0"),
                number("time_s", "instant of the contact"),
                *(
                    maybe(
                        f"{simulated}{name}", f"{meaning} after the impact, {'simulated' if simulated else 'measured'}"
                    )
                    for simulated in ("", "simulated_")
                    for name, meaning in (
                        ("normal_speed_after_m_per_s", "normal speed"),
                        ("tangential_speed_after_m_per_s", "tangential speed"),
                        ("spin_after_rad_per_s", "spin"),
                    )
                ),
            ),
            key=("impact",),
        ),
        Table(
            "run_statistics",
            "quantity of the whole run",
            (
                text("quantity", "name of the quantity"),
                number("measured", "median (the rate itself)"),
                number("simulated", "median of the simulated runs' medians"),
                number("low", "5 % of the simulated runs"),
                number("high", "95 % of the simulated runs"),
                number("p", "share of simulated runs at least as far from their median"),
                maybe("ks", "Kolmogorov-Smirnov distance of the values"),
            ),
            key=("quantity",),
        ),
        Table("simulation", "time sample", (FRAME, TIME, *_motion_columns()), key=("frame",), clock=""),
        Table(
            "predictions",
            "held-out run, frame, quantity",
            (
                text("run", "name of the held-out run"),
                FRAME,
                TIME,
                text("quantity", '"nes_x_m", "nes_y_m" or "nes_angle_rad"'),
                maybe("measured", "measured value, unit of the quantity"),
                maybe("as_given", "predicted one flight ahead with the parameters of [model]"),
                maybe("recalibrated", "predicted with the nominal model refitted"),
                maybe("with_effect", "predicted with the named effect(s)"),
            ),
            key=("run", "frame", "quantity"),
        ),
        Table(
            "calibration_views",
            "camera, view of the board",
            (
                text("camera", "name of the camera"),
                text("view", "name of the image"),
                integer("points", "corners found"),
                flag("used", "whether the view stayed in the fit"),
                maybe("rms_px", "RMS reprojection error of the view"),
                text("reason", "why the view was dropped; null when used", nullable=True),
            ),
            key=("camera", "view"),
        ),
        Table(
            "calibration_parameters",
            "camera, parameter",
            (
                text("camera", "name of the camera"),
                text("parameter", "fx, fy, cx, cy, k1, ... in px or 1"),
                number("value", "estimate"),
                maybe("sd", "standard deviation from the full covariance"),
            ),
            key=("camera", "parameter"),
        ),
        Table(
            "calibration_covariance",
            "pair of parameters of the cameras",
            (
                text("camera", "name of the camera"),
                text(
                    "parameter",
                    "fx, ..., k3; rx, ry, rz: turn after its rotation; tx, ty, tz; spline_u_0_0, ...: nodes",
                ),
                text("other_camera", "name of the other's camera"),
                text("other_parameter", "the same of the other"),
                number("covariance", "covariance of the two; the mirrored pair has no row"),
            ),
            key=("camera", "parameter", "other_camera", "other_parameter"),
        ),
        Table(
            "calibration_lens",
            "camera, lens that was tried",
            (
                text("camera", "name of the camera"),
                text("lens", "four terms, five terms, rational, thin prism or spline"),
                integer("terms", "distortion terms that are free, and numbers of the spline"),
                number("fitted_px", "RMS over the points of all views, which the fit has seen"),
                maybe("held_out_px", "RMS over the points of views that the fit has not seen"),
                maybe("p", "probability that views are foreseen so much better than by the lens before by chance"),
                flag("chosen", "whether the calibration has this lens"),
                text("reason", "why, or why not"),
            ),
            key=("camera", "lens"),
        ),
        Table(
            "calibration_spline",
            "camera whose lens has a spline, node of it on the sensor",
            (
                text("camera", "name of the camera"),
                number("u_px", "to the right, on the whole sensor"),
                number("v_px", "downwards, on the whole sensor"),
                number("du_px", "where the camera sees a point less where its distortion terms put it, to the right"),
                number("dv_px", "the same, downwards"),
                number("du_sd_px", "standard deviation of du_px"),
                number("dv_sd_px", "standard deviation of dv_px"),
            ),
            key=("camera", "u_px", "v_px"),
        ),
        Table(
            "calibration_corners",
            "camera, view, point of the board in the fit",
            (
                text("camera", "name of the camera"),
                text("view", "name of the image"),
                integer("point", "number of the board's point"),
                number("u_px", "to the right, on the whole sensor"),
                number("v_px", "downwards, on the whole sensor"),
                number("residual_u_px", "measured minus projected, by the camera's own views"),
                number("residual_v_px", "measured minus projected, by the camera's own views"),
            ),
            key=("camera", "view", "point"),
        ),
        Table(
            "calibration_boards",
            "camera, view, corner of the board's outline",
            (
                text("camera", "name of the camera"),
                text("view", "name of the image"),
                integer("corner", "0 to 3 around the outline"),
                *(number(f"{axis}_m", f"{axis} of the corner in the world") for axis in "xyz"),
            ),
            key=("camera", "view", "corner"),
        ),
        Table(
            "calibration_image",
            "camera, place in the image",
            (
                text("camera", "name of the camera"),
                number("u_px", "to the right, on the whole sensor"),
                number("v_px", "downwards, on the whole sensor"),
                flag("visited", "whether the board was seen about there"),
                number("lens_sd_px", "standard deviation of a coordinate there by the lens, camera's turn left out"),
                maybe("apart_u_px", "lens of the second half of the views minus that of the first"),
                maybe("apart_v_px", "lens of the second half of the views minus that of the first"),
                maybe("apart_sd_px", "standard deviation of that difference by the two covariances"),
            ),
            key=("camera", "v_px", "u_px"),
        ),
        Table(
            "calibration_plane",
            "place on the sliding plane that all cameras see",
            (
                number("x_m", "x in the world"),
                number("y_m", "y in the world"),
                *(number(f"{axis}_sd_m", f"standard deviation of {axis} from the calibration alone") for axis in "xyz"),
            ),
            key=("y_m", "x_m"),
        ),
        Table(
            "calibration_world",
            "quantity of the world that the board defined: its plane z = 0, and where the cameras stand",
            (
                text(
                    "quantity",
                    "height_m of the plane at the world's origin, slope_x and slope_y along the axes; distance_m of "
                    "two cameras' centres",
                ),
                number("sd", "standard deviation from the calibration alone, in m or 1"),
            ),
            key=("quantity",),
        ),
        Table(
            "lens_field",
            "camera, node of a grid on its sensor",
            (
                text("camera", "name of the camera"),
                number("u_px", "to the right, on the whole sensor"),
                number("v_px", "downwards, on the whole sensor"),
                number("du_px", "where the camera sees a point less where its lens model puts it, to the right"),
                number("dv_px", "the same, downwards"),
                number("du_sd_px", "standard deviation of du_px, open terms included"),
                number("dv_sd_px", "standard deviation of dv_px, open terms included"),
            ),
            key=("camera", "u_px", "v_px"),
        ),
        Table(
            "lens_terms",
            "number that tells what a lens field is worth",
            (
                text(
                    "term",
                    "its name; _before: before the recordings, from the field's size and smoothness alone; with a "
                    "camera's name behind a colon: how its picture has changed since the calibration",
                ),
                number("value", "what it is: of an open term, how much of it the field holds"),
                maybe("sd", "standard deviation of an open term, which no recording narrows directly, or of a change"),
            ),
            key=("term",),
        ),
        Table(
            "calibration_next",
            "camera, view that would help",
            (
                text("camera", "name of the camera"),
                integer("order", "1 for the most helpful, then each in addition to those before"),
                text("pose", "how to hold the board"),
                number("now_px", "RMS over the image of the lens' standard deviation before the view"),
                number("then_px", "the same with the view, simulated by the covariance"),
            ),
            key=("camera", "order"),
        ),
        Table(
            "truth",
            "camera, frame, marker of a rendered recording",
            (
                text("camera", "name of the camera"),
                FRAME,
                TIME,
                text("body", "ground, host or nes"),
                text("marker", "name of the marker"),
                number("u_px", "to the right, in the window"),
                number("v_px", "downwards, in the window"),
                *(number(f"{axis}_m", f"{axis}, world frame") for axis in "xyz"),
                flag("visible", "whether the camera sees the whole marker"),
                *(
                    number(f"{body}_{name}", f"{meaning} of the {title}")
                    for body, title in BODIES.items()
                    for name, meaning in (("x_m", "x"), ("y_m", "y"), ("angle_rad", "angle"))
                ),
            ),
            key=("camera", "frame", "marker"),
            clock="camera",
        ),
    )
}
