"""Runs of one rig to one set of parameters: floor, flights, wall and contact law, each fitted on what the one before
explains.

Shared unknowns of the flights (floor friction and the terms that ``[model]`` names) are found first, on all flights of
all runs; the impacts are where neighbouring flights meet; the wall is the circle on which they meet; the law is fitted
to what happens there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.contact.effect_rows import CONTACT_TIME
from analysis.contact.held_laws import without_laws
from analysis.contact.inertia import SpinBalance, fit_inertia, spin_balance
from analysis.contact.law import (
    Law,
    LawData,
    fit_law,
    fit_restitution,
    follows,
    lasting_law,
    law_data,
)
from analysis.contact.middle import middle_of_disk, same_middle, with_middle
from analysis.contact.restitution import EffectsFit, Sizes, conditions
from analysis.contact.tangential.lasting import LastingContact
from analysis.contact.wall_fit import WallFit, outside_the_wall
from analysis.contact.wall_force import WallForce, wall_force
from analysis.flights.cutting.kinks import SMOOTH_M_PER_S2
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.flights.cutting.runs import Run, cut_again
from analysis.flights.evidence import columns_of
from analysis.identification.contact_law.fit import ELLIPSE_WORDS, fit_contact_law, wall_and_words
from analysis.identification.contact_law.lasting_intervals import LastingIntervals, lasting_intervals
from analysis.identification.contact_law.restitution_rows import restitution_fit, without_effects
from analysis.identification.floor.fit import FirstLook, FloorFit
from analysis.identification.floor.law import SURE_FORCE, choose_floor, looked_at
from analysis.identification.floor.priors import HELD_M, WEAK_SD, prior_sd
from analysis.identification.lens_residual import LensResidual, lens_residual

DEFAULT_EFFECTS = ("floor_friction", "spin_coupling")
# An ellipse smaller than this share of the lens residual may be spurious, caused by it (two sds of such ones,
# LENS_SHARE).
SPURIOUS_SHARE = 2.6
SPURIOUS_WORDS = (
    "The contact distances follow an ellipse of {:.2g} of the radius. A lens residual as large as the flights show may "
    "cause it: the ellipse was fitted, but the wall may be round."
)
# Spin and impulse may differ by this share, and by five sd, before radius or inertia are doubted.
BALANCE_SHARE = 2e-3
BALANCE_SD = 5.0
# The tangential law of contacts that last has a friction, a stiffness and a scatter: one impact more tells it.
FEWEST_FOR_LASTING = 4
# An inertia factor is positive, whatever the impacts ask for.
LEAST_INERTIA = 0.01
# Lengths may be off by this many times the imbalance that nothing explains: it goes with (k - 1) / (1 + 1/q), q = 0.5.
DOUBT_PER_IMBALANCE = 3.0
# What a contact that lasts leaves open of a speed: the Host's acceleration (9 g) meanwhile.
HOST_ACCELERATION_M_PER_S2 = 90.0
# An impact this far from the law (sd, its scatter included) is none of it: of 10,000 none by chance.
OFF_THE_LAW_SD = 5.0
# An inertia that the impacts show is fitted until it moves by less than this share of its sd, so often at most.
INERTIA_RESTS_SD, MOST_INERTIAS = 0.05, 3
# The disk's fastest spin, single wrong angles left out.
FASTEST_SHARE = 0.99


@dataclass(frozen=True, eq=False)
class RigFit:
    """Everything fitted to one or more runs; ``law`` is None without an impact, ``angle`` False where no run shows the
    disk's angle.

    ``lens`` the lens residual that the flights show, ``balance`` of spin and impulse as given, ``length_doubt`` the
    relative error of lengths that an imbalance leaves open, ``left_out`` impacts that do not follow the law.
    ``named``: effects of ``[model]``, ``held``: stated sizes of those at impacts, in the rig's frame and units;
    ``inertia``: ratio of the true inertia to the stated one with its sd, where it was fitted."""

    runs: tuple[Run, ...]
    floor: FloorFit
    wall: WallFit
    data: LawData
    law: Law | None
    angle: bool
    notes: tuple[str, ...]
    lens: LensResidual
    balance: SpinBalance
    length_doubt: float = 0.0
    left_out: int = 0
    named: tuple[str, ...] = ()
    held: Sizes = field(default_factory=dict)
    inertia: tuple[float, float] | None = None

    @cached_property
    def restitution(self) -> EffectsFit | None:
        """The restitution with the effects on it that ``[model]`` names; None where it names none, or impacts are too
        few."""
        return restitution_fit(self.from_start(self.data), self.named, self.held)

    def from_start(self, data: LawData) -> LawData:
        """``data`` with times that count from the starts of the runs, as laws count them."""
        starts = np.array([run.data.start_s for run in self.runs])
        return data.from_starts(starts)

    @property
    def contacts_last(self) -> bool:
        """Whether ``[model]`` names contacts that last, and the impacts show them."""
        return CONTACT_TIME in self.named and self.wall.delay_s > 0

    @cached_property
    def lasting(self) -> LastingContact | None:
        """The tangential law of contacts that last, where it is likelier than ``law``, which is that of an instant."""
        if not self.contacts_last or not self.angle or len(self.data) < FEWEST_FOR_LASTING:
            return None
        return lasting_law(self.data, fit_law(self.data))

    @cached_property
    def lasting_intervals(self) -> LastingIntervals | None:
        """What the impacts leave open of the law of contacts that last; None where there is none."""
        return None if self.lasting is None else lasting_intervals(self.data, self.lasting)

    @property
    def plain_data(self) -> LawData:
        """The impacts as they would be without the effects on the restitution."""
        if self.restitution is None:
            return self.data
        return without_effects(self.data, self.from_start(self.data), self.restitution)

    @cached_property
    def wall_force(self) -> WallForce | None:
        """A force towards the wall, where an unknown one is certain and grows towards it."""
        if not self.floor.noise.sure > SURE_FORCE:
            return None
        return wall_force(self.floor.fits, columns_of(self.floor.names), self.wall.impacts)


def fit_rig(
    runs: Sequence[Run],
    effects: Sequence[str] | None,
    stated: Mapping[str, float] | None = None,
    search: bool = True,
    held_sizes: Sizes | None = None,
) -> RigFit:
    """Floor, wall and contact law of the runs of one rig; ``effects`` as in ``[model]``, None for the default, and what
    it states of the flights (:func:`analysis.flights.stated_terms.stated_terms`) and of impacts (``held_sizes``).

    ``search``: whether what ``[model]`` does not name is looked for.  Where spins and impulses then do not balance, the
    disk's radius and its inertia factor are each tried with what they need, and the one taken with which the impacts
    follow the law better; the notes say so.
    """
    named = DEFAULT_EFFECTS if effects is None else tuple(effects)
    held = stated or {}
    angle = any(np.any(run.data.angle_sd_rad < NO_ANGLE_SD_RAD) for run in runs)
    runs, look = _with_centres(runs, named, angle, held)
    rig = replace(_fit(runs, named, held, search, look), held=held_sizes or {})
    origin_m, middle_m = rig.floor.fits[0].shared[:2], middle_of_disk(rig.wall)
    again = cut_again(runs, origin_m) if angle and _swings(runs, origin_m) else list(runs)
    again = _outside_the_wall(again, rig.wall)
    if not all(map(_same_flights, again, runs)) or not same_middle(
        middle_m, runs[0].data.middle_m, rig.wall.wall.size_m
    ):
        # The first look saw one of the centres, or how long contacts last, elsewhere than the fit does.
        runs = with_middle(again, middle_m)
        rig = replace(_fit(runs, named, held, search), held=rig.held)
    if "inertia_error" in named and "inertia_error" not in rig.held:
        return _with_inertia(rig, named, held, search)
    if not search or not rig.angle or rig.law is None or rig.wall.delay_s > 0:
        return rig
    return _balanced(rig, runs, named, held)


def _with_centres(
    runs: Sequence[Run], named: Sequence[str], angle: bool, held: Mapping[str, float]
) -> tuple[Sequence[Run], FirstLook]:
    """``runs`` cut on the path of the mass centre, their friction at the disk's geometric centre, without the frames
    in which the disk is in the wall, all as a first look at the flights shows them; and the look at these runs.

    A floor fitted to flights about the wrong centre knows them no better: it finds forces that are not there."""
    look = looked_at(runs, named, angle, held)
    if angle and _swings(runs, look.origin_m):
        before, runs = runs, cut_again(runs, look.origin_m)
        if not all(map(_same_flights, runs, before)):
            look = looked_at(runs, named, angle, held)
    wall = wall_and_words(look.fits, named, angle)[0]
    middle_m = middle_of_disk(wall) if angle else (0.0, 0.0)
    before, runs = runs, _outside_the_wall(runs, wall)
    if any(middle_m):
        # The floor's friction acts there: it turns the disk, which flights about the centre of mass alone lack.
        runs = with_middle(runs, middle_m)
    if any(middle_m) or not all(map(_same_flights, runs, before)):
        look = looked_at(runs, named, angle, held)
    return runs, look


def _outside_the_wall(runs: Sequence[Run], wall: WallFit) -> list[Run]:
    """``runs`` without the frames in which the disk is in the ``wall``, where contacts last."""
    if not wall.used.any():
        return list(runs)
    first = runs[0].data
    data = law_data(wall.impacts, wall.used, first.radius_m, first.inertia_factor)
    return outside_the_wall(runs, wall.impacts.junctions, wall.delay_s, float(fit_restitution(data)[0][0]))


def _balanced(rig: RigFit, runs: Sequence[Run], named: Sequence[str], held: Mapping[str, float]) -> RigFit:
    """``rig`` where its spins and impulses balance; else with the radius or the inertia factor that the impacts follow
    better, or left as it is, and in doubt, where they follow neither."""
    off = rig.balance.ratio - 1
    limit = max(BALANCE_SHARE, BALANCE_SD * rig.balance.ratio_sd, BALANCE_SD * rig.lens.relative)
    if not abs(off) > limit:
        return rig
    tried = {
        name: replace(
            _fit([_scaled(run, name, rig.balance.ratio) for run in runs], named, held, search=True), held=rig.held
        )
        for name in ("radius_m", "inertia_factor")
    }
    best = min(tried, key=lambda name: _misfit(tried[name]))
    words = (
        f"Spins and tangential impulses of the impacts disagree by {100 * off:+.2f} % (sd "
        f"{100 * rig.balance.ratio_sd:.2f} %): the length "
        "scale of the calibration, radius_m or inertia_factor of the NES is off."
    )
    if _misfit(tried[best]) >= _misfit(rig):
        return replace(rig, notes=(*rig.notes, words), length_doubt=DOUBT_PER_IMBALANCE * abs(off))
    data = tried[best].runs[0].data
    value = data.radius_m if best == "radius_m" else data.inertia_factor
    more = (
        f"The law was fitted with {best} = {value:.5g}, which the impacts follow; floor friction and lengths are "
        f"uncertain by as much."
    )
    doubt = abs(value / runs[0].data.radius_m - 1) if best == "radius_m" else 0.0
    return replace(tried[best], notes=(*tried[best].notes, words, more), length_doubt=doubt)


def _with_inertia(rig: RigFit, named: Sequence[str], held: Mapping[str, float], search: bool) -> RigFit:
    """``rig`` with the inertia that its impacts show, fitted again with it as often as that changes it."""
    ratio = 1.0
    for _ in range(MOST_INERTIAS):
        first = rig.runs[0].data
        data = law_data(rig.wall.impacts, rig.wall.used, first.radius_m, first.inertia_factor)
        inertia_fit = fit_inertia(data, len(rig.runs), first.radius_m) if rig.angle else None
        if inertia_fit is None:
            return rig
        rig = replace(rig, inertia=(ratio * inertia_fit.ratio, ratio * inertia_fit.sd))
        if abs(inertia_fit.ratio - 1) < INERTIA_RESTS_SD * inertia_fit.sd:
            return rig
        ratio *= inertia_fit.ratio
        runs = [
            replace(run, data=replace(run.data, inertia_factor=inertia_fit.ratio * run.data.inertia_factor))
            for run in rig.runs
        ]
        rig = replace(_fit(runs, named, held, search), held=rig.held, inertia=rig.inertia)
    return rig


def _swings(runs: Sequence[Run], origin_m: NDArray[np.float64]) -> bool:
    """Whether the markers' origin, at ``origin_m`` (2,) as the flights show it, swings about the mass centre so fast
    that it looks like impacts.
    """
    spins = [np.abs(np.diff(run.data.angle_rad) / np.diff(run.data.time_s)) for run in runs]
    fastest = max((float(np.quantile(spin, FASTEST_SHARE)) for spin in spins if len(spin)), default=0.0)
    return float(np.hypot(*origin_m)) * fastest**2 > SMOOTH_M_PER_S2


def _same_flights(one: Run, other: Run) -> bool:
    """Whether two cuts of a run leave the same flights of the same frames."""
    same = one.data is other.data or np.array_equal(one.data.xy_m, other.data.xy_m, equal_nan=True)
    return same and [*map(astuple, one.flights)] == [*map(astuple, other.flights)]


def _misfit(rig: RigFit) -> float:
    return rig.law.tangential_misfit if rig.law is not None else np.inf


def _scaled(run: Run, name: str, ratio: float) -> Run:
    """``run`` with the disk's radius or inertia factor such that impulse over spin comes out as ``ratio``.

    The impulse is (dv + R d(omega)) / (1 + 1/q), its spin q R d(omega): lengths k times too long make the ratio 1 + (k
    - 1) / (1 + 1/q), an inertia factor q' for q makes it (1 + q') / (1 + q)."""
    data, q = run.data, run.data.inertia_factor
    if name == "radius_m":
        return replace(run, data=replace(data, radius_m=data.radius_m * (1 + (1 + 1 / q) * (ratio - 1))))
    return replace(run, data=replace(data, inertia_factor=max(ratio * (1 + q) - 1, LEAST_INERTIA)))


def _fit(
    runs: Sequence[Run], named: Sequence[str], held: Mapping[str, float], search: bool, look: FirstLook | None = None
) -> RigFit:
    angle = any(np.any(run.data.angle_sd_rad < NO_ANGLE_SD_RAD) for run in runs)
    return _rig(*choose_floor(runs, named, angle, held, search, look), named, angle)


def _rig(runs: Sequence[Run], floor: FloorFit, notes: Sequence[str], named: Sequence[str], angle: bool) -> RigFit:
    """Wall and contact law on the floor that was chosen."""
    wall, more = wall_and_words(floor.fits, named, angle)
    first = runs[0].data
    lens = lens_residual(
        floor.lens_sd_m if floor.lens_sd_m > HELD_M else 0.0,
        floor.evidence,
        floor.names,
        prior_sd(floor.lens_sd_m),
        WEAK_SD,
        first.contact_radius_m,
    )
    size = float(np.hypot(*wall.wall.ellipse))
    if 0 < size < SPURIOUS_SHARE * lens.relative:
        more = [SPURIOUS_WORDS.format(size) if note == ELLIPSE_WORDS else note for note in more]
    balance = spin_balance(wall.impacts, wall.used, first.radius_m, first.inertia_factor)
    data = _law_data(wall, wall.used, floor, first, balance)
    law = fit_contact_law(data, angle)
    return RigFit(tuple(runs), floor, wall, data, law, angle, (*notes, *more), lens, balance, named=tuple(named))


def _law_data(wall: WallFit, used: NDArray[np.bool_], floor: FloorFit, rig: RunData, balance: SpinBalance) -> LawData:
    """What the contact law is fitted to: without what the laws that ``[model]`` holds add to it."""
    data = law_data(wall.impacts, used, rig.radius_m, rig.inertia_factor, balance.speed_floor_m_per_s)
    return without_laws(data, wall.impacts.junctions, floor.fits)


def _follows(rig: RigFit, data: LawData) -> NDArray[np.bool_]:
    """Which impacts of ``data`` follow the restitution that was fitted, with its effects."""
    assert rig.law is not None
    if rig.restitution is None:
        return follows(data, rig.law.restitution, rig.law.scatter, OFF_THE_LAW_SD)
    expected = rig.restitution.at(conditions(rig.from_start(data)))
    return follows(data, expected, rig.restitution.scatter, OFF_THE_LAW_SD)


def refit_law(rig: RigFit, junctions: NDArray[np.bool_]) -> RigFit:
    """The contact law once more, on those of the usable impacts that are true for ``junctions`` (K,) and follow it."""
    used = rig.wall.used & junctions
    first = rig.runs[0].data
    fitted, chosen = rig, used
    for _ in range(3):
        if not np.array_equal(chosen, rig.wall.used):
            data = _law_data(rig.wall, chosen, rig.floor, first, rig.balance)
            fitted = replace(rig, data=data, law=fit_contact_law(data, rig.angle))
        if fitted.law is None:
            break
        everyone = _law_data(rig.wall, used, rig.floor, first, rig.balance)
        still = used.copy()
        still[everyone.at.index[~_follows(fitted, everyone)]] = False
        if np.array_equal(still, chosen):
            break
        chosen = still
    return replace(fitted, left_out=int(np.count_nonzero(used & ~chosen)))
