"""Checks on the fit of a rig: flights predicted ahead, what no law explains, noise, what the impacts say of law and
lengths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.checks.row import ALL, DIAGNOSE, LAW, Row, figure, row
from analysis.contact.sliding import USUAL_FRICTION_SCATTER, friction_of_blows
from analysis.flights.cutting.pieces import Flight, seen_frames
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.flights.fit import FlightFits, fit_flights
from analysis.flights.noise import FlightNoise
from analysis.identification.fit import BALANCE_SD, BALANCE_SHARE, RigFit
from analysis.identification.floor.law import FORMS, SURE_FORCE
from analysis.identification.floor.priors import HELD_M
from analysis.identification.parameters import LENS_SHARE
from analysis.motion.bodies import INERTIA_OF_A_DISK
from analysis.walls.drawn import stated_wall
from analysis.walls.wall import Wall
from ovines.recording import Recording

Array = NDArray[np.float64]

# Error (RMS) of flights' second halves over what noise and their first halves make likely: 0.76 to 1.2 on clean plants
# with ten flights and more, 1.5 at worst with four, 0.87 to 1.4 on 23 of 24 practice runs of one rig; 1.6 to 9 under
# nine wrong laws out of ten (least: a weak sticky patch, 1.4).  Each flight tells some four independent errors, so the
# RMS of n of them scatters by 1 / sqrt(8 n): three of these are allowed above AHEAD.
AHEAD, FEWEST_AHEAD, CLIP_SD, ERRORS_PER_FLIGHT, ALLOWED_SD = 1.2, 12, 10.0, 4, 3.0
# Probability of a force from which it counts although flights are predicted well ahead without it.
SURE_ALONE = 0.999
# A lens residual that the flights ask for, over the noise of a frame: none to 2.4 on 29 of 30 clean runs of plants (a
# third of them filmed through lenses that leave one), none to 3.2 on 24 practice runs of one rig, to 14 on a larger one
# at 40 frames a period; 4 to 22 where a sticky patch, gusts, a pull or a tilt bend the flights and are taken for it.
LENS_OVER_NOISE = 3.5
# What a wrong law of flight falsifies: floor friction, and with it the wall's, which rests on small differences of
# speeds along the wall (up to 14 sd off under a pull towards the wall); restitution was at most 3.3 sd off.
FLOWN = "wall_friction,floor_friction"
# Noise over the sds given: 0.83 to 1.21 on clean runs of plants, 0.66 to 1.13 on practice runs.
NOISE = (0.5, 1.5)
# Impacts off the law: of 10,000 none by chance.
LEFT_OUT_SHARE = 0.1
# Wall at the impacts off the one stated: 0.03 % of the contact radius at most on 29 of 30 clean runs of plants (the
# other has one impact); gluing and turning leave some tenths of a per cent, and of a large ring not half a millimetre.
WALL_SHARE, WALL_OFF_M, WALL_SD = 0.01, 5e-4, 3.0
#: what is stated of a wall, in words, and where
STATED_WORDS = {"radius": ("the ring", "inner_radius_m"), "cylinder_radius": ("the cylinder", "obstacle_radius_m")}
# The impacts' scatter about the law is known from themselves alone: errors beyond three of the sds given happen in 10 %
# of the cases with three impacts, in 3 % with six (Student's t), in 0.3 % where it is known.
FEWEST_IMPACTS = 6
# Nearer to the wall than this share of the contact radius the disk never came: the lengths are of other units, or the
# drive is too weak.
FAR_SHARE = 0.8
# A spin that is known (sd of its speed at the rim): all but those of a flight of two frames; and so many of them.
KNOWN_SPIN_M_PER_S, FEWEST_FOR_BALANCE = 1.0, 3
# What a wrong radius or inertia of the disk falsifies: the restitution knows neither.
TURNING = "wall_friction,tangential_restitution,floor_friction"
# What rounding leaves of a radius that was not changed.
ROUNDING = 1e-9
#: the check whose values add up over the runs of a series
COUNT = "impacts that could be used"


def check_fit(rig: RigFit, run: int, recording: Recording, farthest_m: float) -> list[Row | None]:
    """Rows on ``rig`` as ``run`` of it shows them; ``farthest_m``: how far past the stated wall the disk came (< 0:
    not to it).
    """
    return [
        ahead := _flights_ahead(rig.floor.fits[run], rig.floor.noise),
        _force(rig, ahead.state == "holds"),
        _lens(rig, run),
        _noise(rig),
        _count(rig, recording, farthest_m),
        _law(rig),
        _friction(rig),
        _stated_wall(rig, recording),
        _balance(rig, recording),
        _angle(rig),
    ]


def _flights_ahead(fits: FlightFits, noise: FlightNoise) -> Row:
    value, flights = ahead_over_noise(fits, noise)
    name = "second half of a flight, predicted from its first, over noise"
    if not np.isfinite(value):
        return row(name, np.nan, AHEAD, None, "No flight is long enough to be predicted.")
    limit = AHEAD + ALLOWED_SD / np.sqrt(2 * ERRORS_PER_FLIGHT * flights)
    return row(
        name,
        value,
        limit,
        bool(value < limit),
        f"Flights end {value:.2g} times as far from where their first half says as noise makes likely.",
        FLOWN,
        f"The law of flight misses something. {DIAGNOSE}.",
    )


def ahead_over_noise(fits: FlightFits, noise: FlightNoise) -> tuple[float, int]:
    """RMS error of the second halves of flights, predicted from fits to their first halves, over what noise makes of
    it, and the number of flights; NaN without long ones."""
    plain = noise.without_force()
    squares: list[Array] = []
    for k, flight in enumerate(fits.flights):
        index = seen_frames(fits.run, flight)
        if len(index) < FEWEST_AHEAD:
            continue
        half = int(index[len(index) // 2 - 1])
        first = fit_flights(
            fits.run, [Flight(flight.first, half, False)], fits.parameters, fits.shared, _start(fits, k), plain
        )
        later = index[index > half]
        squares.append(_standard(first, later, fits.run, plain) ** 2)
    if not squares:
        return float("nan"), 0
    return float(np.sqrt(np.mean(np.minimum(np.concatenate([s.ravel() for s in squares]), CLIP_SD**2)))), len(squares)


def _start(fits: FlightFits, k: int) -> FlightFits:
    return replace(fits, states=fits.states[k : k + 1], _force_paths={})


def _standard(first: FlightFits, later: NDArray[np.int64], run: RunData, noise: FlightNoise) -> Array:
    """Errors (n, 2 or 3) of frames ``later`` against a flight's first half, over their sds."""
    _, spread = first.propagate(0, run.time_s[later])
    angle = run.angle_sd_rad[later] < NO_ANGLE_SD_RAD
    sd = np.column_stack([noise.scale * run.xy_sd_m[later]] * 2 + [noise.angle_scale * run.angle_sd_rad[later]])
    own = np.sqrt(np.diagonal(spread, axis1=1, axis2=2)[:, :3] + sd**2)
    error = first.residuals(0, later) / own
    return error if angle.all() else error[:, :2]


def _force(rig: RigFit, foreseen: bool) -> Row:
    """``foreseen``: flights are predicted well ahead without it.  A force of a known form that was fitted along is in
    no list of effects either: its numbers are right if its form is."""
    noise, radius_m = rig.floor.noise, rig.runs[0].data.radius_m
    size = max(noise.acceleration_m_per_s2, noise.spin_rad_per_s2 * radius_m)
    formed = [name for name, terms in FORMS.items() if set(terms) & set(rig.floor.names)]
    said = "None is seen."
    if noise.sure > SURE_FORCE:
        said = f"Something acts on the disk that nothing listed explains: {noise.force_in_words(radius_m).rstrip(',')}."
    elif formed:
        said = f"Something acts on the disk that no listed effect is: {' and '.join(formed)}, fitted along."
    return row(
        "force that no law describes",
        size,
        0.0,
        bool(noise.sure <= (SURE_ALONE if foreseen else SURE_FORCE)) and not formed,
        said,
        FLOWN,
        f"The law of flight misses something. {DIAGNOSE}.",
    )


def _lens(rig: RigFit, run: int) -> Row:
    """A missing force and a lens residual bend paths alike: only a calibration, or the Host's path, separates them."""
    lens_m = rig.floor.lens_sd_m if rig.floor.lens_sd_m > HELD_M else 0.0
    value = lens_m / float(np.median(rig.runs[run].data.xy_sd_m) * max(rig.floor.noise.scale, 1.0))
    return row(
        "lens residual that the flights ask for, over noise",
        value,
        LENS_OVER_NOISE,
        value < LENS_OVER_NOISE,
        f"The flights ask for a lens residual of {figure(value)} times the noise of a frame: the calibration leaves "
        f"one, or the law of flight misses something."
        if value >= LENS_OVER_NOISE
        else "No more than noise hides.",
        FLOWN,
        f"The law of flight misses something, or the calibration does. {DIAGNOSE}.",
    )


def _noise(rig: RigFit) -> Row:
    """Too large is judged by what is new in each frame, which few frames determine; too small by all of it."""
    noise = rig.floor.noise
    all_of_it = [noise.scale, *([noise.angle_scale] if rig.angle else [])]
    new = [value * np.sqrt(1 - noise.correlation**2) for value in all_of_it]
    value = max(new) if max(new) > NOISE[1] else min(all_of_it, key=lambda v: min(v, 1.0))
    holds = bool(max(new) <= NOISE[1] and min(all_of_it) >= NOISE[0])
    return row(
        "noise over the sds given",
        value,
        NOISE[1] if value > 1 else NOISE[0],
        holds,
        f"From frame to frame places scatter by {figure(value)} times their stated sds.",
        "",
        "Check sd_px of the tracks or the _sd_ columns of the motion; intervals here follow the scatter that is seen.",
    )


def _count(rig: RigFit, recording: Recording, farthest_m: float) -> Row:
    count = len(rig.data)
    share = 1 + farthest_m / stated_wall(recording).size_m
    far = bool(np.isfinite(share) and share < FAR_SHARE)
    return row(
        COUNT,
        float(count),
        FEWEST_IMPACTS,
        count >= FEWEST_IMPACTS,
        f"{count} impact{'' if count == 1 else 's'} could be used"
        + (f"; fewer than {FEWEST_IMPACTS} determine their own scatter badly." if count < FEWEST_IMPACTS else ".")
        + (f" The disk never comes farther out than {100 * share:.2g} % of the contact radius." if far else ""),
        LAW,
        "Drive harder, or check inner_radius_m and radius_m (metres)."
        if far
        else "Record longer, or identify several recordings as a series.",
    )


def _law(rig: RigFit) -> Row:
    name = "impacts that follow the contact law"
    count = len(rig.data) + rig.left_out
    if not count:
        return row(name, np.nan, 1 - LEFT_OUT_SHARE, None, "No impact could be used.")
    share = 1 - rig.left_out / count
    return row(
        name,
        share,
        1 - LEFT_OUT_SHARE,
        share >= 1 - LEFT_OUT_SHARE,
        f"{rig.left_out} of {count} impacts lie more than 5 sd off the law.",
        LAW,
        f"Look for marks on the wall, or another law. {DIAGNOSE}.",
    )


def _friction(rig: RigFit) -> Row:
    """The wall friction of the law against that of the impacts that have surely slid."""
    name = "wall friction against that of the impacts that slid"
    told = None if rig.law is None or rig.contacts_last else friction_of_blows(rig.data, rig.law)
    if told is None or rig.law is None:
        return row(name, np.nan, USUAL_FRICTION_SCATTER, None, "Too few impacts slid to tell.")
    off = rig.law.wall_friction / told.usual - 1
    found = (
        f"{told.slid} impacts slid with a friction of {figure(told.usual)}, which scatters by "
        f"{figure(100 * told.scatter)} %; the law has {figure(rig.law.wall_friction)}."
    )
    if told.holds_by_more:
        found += f" {told.beyond} that stuck took up to {figure(told.held)} times as much."
    return row(
        name,
        off,
        USUAL_FRICTION_SCATTER,
        bool(abs(off) <= USUAL_FRICTION_SCATTER and not told.is_each_blows and not told.holds_by_more),
        found,
        "wall_friction",
        f"Look for dirt, and for a wall that holds by more than it slips with. {DIAGNOSE}.",
    )


def _stated_wall(rig: RigFit, recording: Recording) -> Row | None:
    """The wall's lengths at the impacts (radius, flat sides' distances, cylinder) against those of recording.toml."""
    if not rig.wall.used.any():
        return None
    stated, size = rig.runs[0].data.wall.values(), rig.runs[0].data.wall.size_m
    limit = min(WALL_SHARE, WALL_OFF_M / stated_wall(recording).size_m)
    lens = LENS_SHARE["contact_radius"] * rig.lens.relative
    found = []
    for k, term in enumerate(rig.wall.terms):
        if Wall.is_length(term):
            off = float(rig.wall.estimate[k] - stated[term]) / size
            sd = float(np.hypot(np.sqrt(rig.wall.covariance[k, k]) / size, lens))
            found.append((abs(off) / max(limit, WALL_SD * sd), off, term))
    worst, off, term = max(found)
    words, name = STATED_WORDS.get(term, (f"side {term.removeprefix('side_')} of the wall", "polygon_m"))
    off_m = off * stated_wall(recording).size_m
    return row(
        "wall at the impacts against the stated one",
        off,
        limit,
        bool(worst < 1),
        f"Impacts put {words} {1e3 * off_m:+.2g} mm ({100 * off:+.2g} % of the contact radius) from where "
        f"recording.toml has it.",
        ALL,
        f"Measure {name} and the disk's radius_m again; check the calibration's lengths (board's square size).",
    )


def _balance(rig: RigFit, recording: Recording) -> Row | None:
    """Spin against impulse holds the disk's radius and inertia against the measured lengths, whatever the contact law.

    The fit may have taken another radius or inertia factor than the one given: then it did not hold with that."""
    if not rig.angle:
        return None
    name = "spins against tangential impulses of the impacts"
    nes, data = recording.bodies["nes"], rig.runs[0].data
    given = float(getattr(nes, "radius_m", np.nan)) / stated_wall(recording).size_m * data.contact_radius_m
    radius, inertia = (
        data.radius_m / given - 1,
        data.inertia_factor / (getattr(nes, "inertia_factor", None) or INERTIA_OF_A_DISK) - 1,
    )
    do = "Measure radius_m and inertia_factor of the NES again; check the calibration's lengths (board's square size)."
    ratio, sd = _impulse_over_spin(rig)
    limit = max(BALANCE_SHARE, BALANCE_SD * sd, BALANCE_SD * rig.lens.relative)
    if max(abs(radius), abs(inertia)) > ROUNDING:
        what, taken = ("radius_m", radius) if abs(radius) > abs(inertia) else ("inertia_factor", inertia)
        return row(
            name,
            taken,
            limit,
            False,
            f"The impacts ask for a {what} {100 * taken:+.2g} % from the one given; the law was fitted with it.",
            TURNING,
            do,
        )
    if (
        not np.isfinite(sd) or rig.wall.delay_s > 0
    ):  # spins and impulses of a contact that lasts do not balance at one instant
        return row(name, np.nan, BALANCE_SHARE, None, "The impacts do not determine it.")
    return row(
        name,
        ratio - 1,
        limit,
        bool(abs(ratio - 1) <= limit),
        f"Spins and tangential impulses disagree by {100 * (ratio - 1):+.2g} %.",
        TURNING,
        do,
    )


def _impulse_over_spin(rig: RigFit) -> tuple[float, float]:
    """Ratio and sd: the fit's own, or, of too few impacts for it, with the speed errors that such fits usually find; sd
    infinite with none.
    """
    if np.isfinite(rig.balance.ratio_sd):
        return rig.balance.ratio, rig.balance.ratio_sd
    data = rig.data
    known = data.angular_sd < KNOWN_SPIN_M_PER_S
    if known.sum() < FEWEST_FOR_BALANCE:
        return 1.0, np.inf
    turned, weight = (
        (data.angular + data.tangential_impulse)[known],
        1 / (data.angular_sd[known] ** 2 + rig.balance.speed_floor_m_per_s**2),
    )
    square = float(np.sum(weight * turned**2))
    return float(np.sum(weight * turned * data.tangential_impulse[known])) / square, square**-0.5


def _angle(rig: RigFit) -> Row:
    """Without an angle sliding and spinning friction are one: floor friction came out up to 14 sd too low on clean
    plants.
    """
    return row(
        "the disk's angle is measured",
        float(rig.angle),
        1.0,
        rig.angle,
        "The disk's angle is measured."
        if rig.angle
        else "The disk's angle is not measured: floor friction comes out too low where the disk spins.",
        "floor_friction",
        "Put a second marker on the disk, far from its middle.",
    )
