"""What is said of each effect: the test by hand that would show it apart from everything else."""

from __future__ import annotations

from analysis.gap.cause import BENT, BY_BOARDS, EACH_RUN, IN_PICTURE, THAN_STATED

NEXT_TEST: dict[str, str] = {
    "floor_friction": "Flick the disk over the Host's floor at rest and let it stop twice, once spinning: the "
    "stopping distance gives mu_s alone.",
    "spin_coupling": "Flick the disk once without spin and once with a fast one: with coupling the spinning disk "
    "slides further.",
    "nes_rocking": "Film an impact from the side, in the plane of the floor: a disk that rocks lifts its rim for "
    "the time found.",
    "viscous_drag": "Let the disk coast over twice the distance at 2 m/s and at 0.5 m/s: drag proportional to v keeps "
    "the relative loss equal.",
    "air_drag": "Let the disk coast at 2 m/s and at 0.5 m/s, and once with a card of twice its area on it: quadratic "
    "drag grows with both.",
    "table_tilt": "Turn the Host by 90 degrees on the shaker and repeat: a tilted table stays in the room, a force of "
    "the Host turns with it.",
    "vertical_motion": "Run once at half the level: z'' and the share of the load that follows it halve, a plain "
    "change of friction does not.",
    "friction_drift": "Repeat the first run at the end of the series and clean the floor before one in the middle: "
    "wear stays, dust goes.",
    "speed_dependent_restitution": "Drop the disk against the wall at 0.3, 1 and 3 m/s by hand launches: restitution "
    "against speed alone.",
    "direction_dependent_restitution": "Turn the ring by 90 degrees in its mount: a stiffness of the ring turns with "
    "it, one of the mount does not.",
    "restitution_drift": "Repeat the first run at the end of the series, and once more after the ring has been turned: "
    "wear stays at its place, warmth goes.",
    "finite_contact_time": "Film one impact at ten times the frame rate: the disk's centre goes past the contact "
    "radius by about v T / pi.",
    "wall_ellipticity": "Measure the ring's diameter along and across with calipers, and turn the ring by 45 degrees "
    "for one run.",
    "wall_lobes": "Turn the ring in its mount by half a lobe for one run, and measure its diameter with calipers all "
    "round: of an odd number of lobes the diameter shows nothing, a dial gauge on a rotary table does.",
    "wall_centre_offset": "Fit the wall's edge in the images (or touch it with a marked disk at four places) and "
    "compare with the markers' circle.",
    "mass_centre_offset": "Spin the disk freely on the floor: the marker circle's centre wobbles about the mass "
    "centre at the spin's rate.",
    "inertia_error": "Hang the disk on three threads and time its swings about its axis: their period gives the "
    "inertia; a caliper its radius, whose error looks alike.",
    "centre_marker_offset": "Spin the disk by hand under one camera: the centre marker draws a circle of the offset's "
    "radius.",
    "stated_radius": "Measure the wall's inner width and the disk's diameter with calipers, and write them into "
    "recording.toml.",
    "host_recoil": "Tap the Host at rest with a soft hammer and record it: it swings back as it does after impacts; a "
    "heavier table recoils less.",
    "host_ringing": "Tap the Host beside its markers with the shaker off: they ring at the frequency found; glue them "
    "to the ring itself for one run.",
    "host_sway": "Record the Host with the shaker off and the building at work, and once more with the air legs of the "
    "table blocked.",
    "camera_clock_offset": "Film a flashing diode with both cameras: the frame in which it lights up tells the delay.",
    "sensor_window_offset": "Record the extrinsic board once in the recording's window and once on the full sensor.",
    "length_scale_error": "Measure the distance of two Host markers (or the board's ten squares) with calipers.",
    "frame_rate_error": "Record the trigger on the acquisition card and give it as trigger.csv.",
    "plane_tilt": "Lay the board flat on the sliding floor for the extrinsic view.",
    "motion_blur": "Halve the exposure (and double the light) in one run: what is smeared halves, frame times that "
    "scatter do not care.",
    "trigger_jitter": "Record the trigger on the acquisition card and give it as trigger.csv.",
}
NONE_TEST = (
    "Nothing to separate. To see smaller effects: longer runs, a higher level (faster impacts), or launches with "
    "spin; the table of "
    "detectable sizes says what would have been seen."
)


def unknown_test(stage: str, goes_with: str) -> str:
    """The next test where structure has no name: change what it goes with, keep the rest."""
    if goes_with == EACH_RUN:
        return (
            f"The structure lies in the {stage}, and each run has its own, in no order. Note what is done between runs "
            "(wiping, touching, taking apart, warming up). Record one setting twice with nothing done in between, then "
            "twice with one of these: what makes the difference is its cause."
        )
    if goes_with.startswith(IN_PICTURE):
        until = (
            "The field that was learnt has taken it out as far as markers tell: not what shifts, tilts or scales all "
            "of them, so do not trust a tilt, a scale or a window found here."
            if goes_with.endswith(BENT)
            else "Until that is done, its law corrects these recordings (`ovines diagnose --law`)."
        )
        return (
            f"The structure goes with {goes_with}. Film the boards once more, with the camera as it is, and diagnose "
            f"with that calibration: nothing of it is left then. {until}"
        )
    if THAN_STATED in goes_with:
        return (
            f"The structure is {goes_with}. Measure where the markers lie on the body, and how high (a calliper, a "
            "scan), and write that into layout_m: nothing of it is left then. The markers' places are learnt from the "
            "recordings, so motion and impacts hardly depend on it."
        )
    if goes_with.startswith(BY_BOARDS):
        return (
            f"The structure goes with {goes_with}. Measure the board's squares along both sides and lay a straight "
            "edge on it. Calibrate on one that is true, and diagnose with that calibration: nothing of it is left "
            "then. Until that is done, its law corrects these recordings (`ovines diagnose --law`)."
        )
    return (
        f"The structure lies in the {stage} and goes with {goes_with}. Change that alone in two recordings (twice as "
        f"much, half as much; or turn "
        "Host, ring or disk by 90 degrees) and repeat the diagnosis: what follows the change is its cause."
    )
