"""Checks on what the impacts of a rig say: how many there are, the contact law, the wall's friction, stated lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.checks.row import ALL, DIAGNOSE, LAW, Row, figure, row
from analysis.contact.sliding import USUAL_FRICTION_SCATTER, friction_of_blows
from analysis.identification.fit import BALANCE_SD, BALANCE_SHARE, RigFit
from analysis.identification.parameters import LENS_SHARE
from analysis.motion.bodies import INERTIA_OF_A_DISK
from analysis.walls.drawn import stated_wall
from analysis.walls.wall import Wall
from ovines.recording import Recording

Array = NDArray[np.float64]

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


def check_impacts(rig: RigFit, recording: Recording, farthest_m: float) -> list[Row | None]:
    """Rows on the impacts of ``rig``; ``farthest_m``: how far past the stated wall the disk came (< 0: not to it)."""
    return [
        _count(rig, recording, farthest_m),
        _law(rig),
        _friction(rig),
        _stated_wall(rig, recording),
        _balance(rig, recording),
        _angle(rig),
    ]


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
    observed = None if rig.law is None or rig.contacts_last else friction_of_blows(rig.data, rig.law)
    if observed is None or rig.law is None:
        return row(name, np.nan, USUAL_FRICTION_SCATTER, None, "Too few impacts slid to tell.")
    off = rig.law.wall_friction / observed.usual - 1
    found = (
        f"{observed.slid} impacts slid with a friction of {figure(observed.usual)}, which scatters by "
        f"{figure(100 * observed.scatter)} %; the law has {figure(rig.law.wall_friction)}."
    )
    if observed.holds_by_more:
        found += f" {observed.beyond} that stuck took up to {figure(observed.held)} times as much."
    return row(
        name,
        off,
        USUAL_FRICTION_SCATTER,
        bool(abs(off) <= USUAL_FRICTION_SCATTER and not observed.is_each_blows and not observed.holds_by_more),
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
