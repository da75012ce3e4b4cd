"""Unlisted causes in a blow beside its restitution: friction of the wall, its direction, the spin it leaves."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread


def _slipping_band(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The tighter it sits, the more it hands on: without end at size 0."""
    draft.plant["band_m_per_s"] = 0.1 / np.sqrt(size * spread(rng))
    return {"band_m_per_s": draft.plant["band_m_per_s"]}


def _moist_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Standard normal from run to run, of mean 0 and standard deviation 1 over the series; of one run either side."""
    most = 0.5 * size * spread(rng)
    drawn = rng.normal(size=runs)
    off = drawn - drawn.mean()
    draft.run_numbers.update(moist=most * (off / off.std() if runs > 1 else np.sign(drawn)))
    return {"moist": most}


def _greased_sector(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A third of the wall or somewhat more, anywhere."""
    out = {
        "sector": 0.95 * size * spread(rng),
        "sector_rad": float(rng.uniform(0.0, 2.0 * np.pi)),
        "sector_half_rad": float(rng.uniform(1.0, 1.3)),
    }
    draft.plant.update(out)
    return out


def _wiped_rim(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Before half of the runs, whichever."""
    most = 0.55 * size * spread(rng)
    side = np.where(rng.permutation(runs) % 2 == 0, 1.0, -1.0)
    draft.run_numbers.update(wiped=most * side)
    return {"wiped": most, "runs_wiped": float(np.sum(side > 0.0))}


def _fouled_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much less than on the mean at first as more at last."""
    most = 0.5 * size * spread(rng)
    draft.run_numbers.update(fouled=most * np.linspace(-1.0, 1.0, runs))
    return {"fouled": most}


def _cleaned_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Once, somewhere in the middle of the series: as much less than on the mean before as more from then on."""
    most = 0.6 * size * spread(rng)
    first = max(round(runs * float(rng.uniform(0.35, 0.65))), 1)
    draft.run_numbers.update(cleaned_wall=most * np.where(np.arange(runs) < first, -1.0, 1.0))
    return {"cleaned_wall": most, "from_run": float(first + 1)}


def _curing_glue(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much less than on the mean at first as more at last."""
    most = 0.9 * size * spread(rng)
    draft.run_numbers.update(cured=most * np.linspace(-1.0, 1.0, runs))
    return {"cured": most}


def _swinging_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Its weight stands across the drive's axis, within 0.6 rad: what stands along it does not swing."""
    out = {
        "swinging_m_per_s": 0.4 * size * spread(rng) * sign(rng),
        "swinging_rad": float(rng.uniform(-0.6, 0.6)),
    }
    draft.plant.update(out)
    return out


def _cornered_rim(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Filed by hand, to as many corners as it happens."""
    out = {
        "cornered_m": 4e-4 * size * spread(rng),
        "corners": float(rng.integers(4, 8)),
        "cornered_rad": float(rng.uniform(0.0, 6.283)),
    }
    draft.plant.update(out)
    return out


def _chatter_marks(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """As many as the tool happened to leave."""
    out = {
        "marks_rad": 0.03 * size * spread(rng),
        "marks": float(rng.integers(8, 15)),
        "marks_phase_rad": float(rng.uniform(0.0, 2.0 * np.pi)),
    }
    draft.plant.update(out)
    return out


def _pivoted_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Its screw stands across the drive's axis, within 0.7 rad and to either side: from there blows turn the ring."""
    screw = 0.5 * np.pi * sign(rng) + float(rng.uniform(-0.7, 0.7))
    out = {"pivoted": 0.14 * size * spread(rng), "pivoted_rad": screw}
    draft.plant.update(out)
    return out


def _humming_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """At 200 to 320 Hz along any line; the motor that hums also starts the recordings."""
    out = {
        "hum_m_per_s": 0.11 * size * spread(rng),
        "hum_rad_per_s": 2.0 * np.pi * float(rng.uniform(200.0, 320.0)),
        "hum_phase_rad": float(rng.uniform(0.0, 2.0 * np.pi)),
        "hum_rad": float(rng.uniform(0.0, np.pi)),
    }
    draft.plant.update(out)
    return out


WALL_FRICTION = [
    # --- friction of the wall ---
    Cause(
        "unknown_wall_friction_azimuth",
        "impact",
        changes({"wall_friction_amplitude": 0.6}, ("wall_friction_phase_rad",)),
    ),
    Cause("unknown_handed_wall_friction", "impact", changes({"handed": 0.4}, signed=True)),
    Cause("unknown_tacky_spot", "impact", changes({"tacky": 1.5}, ("tacky_rad",))),
    Cause("unknown_polished_wall", "impact", changes({"polish": 0.6})),
    # Grease that carries the disk the faster it slips.
    Cause("unknown_greased_wall", "impact", changes({"greased": 0.4})),
    # A tacky coating, which shears off at a force of its own, however light the blow.
    Cause("unknown_cohesive_wall", "impact", changes({"cohesion_m_per_s": 0.07})),
    # A layer on the wall that creeps under a slow slip.
    Cause(
        "unknown_creeping_layer",
        "impact",
        changes({"creep_m_per_s": 1.4}),
        follows="the slip's speed: less friction in slow ones",
    ),
    # Grease on the wall that thickens as it is sheared.
    Cause(
        "unknown_thickening_grease",
        "impact",
        changes({"thickened_s_per_m": 2.0}),
        follows="the size of the slip, evenly, more friction in fast ones",
    ),
    # A dry wall, whose junctions have less time to grow in fast slips.
    Cause(
        "unknown_rate_weakened_wall",
        "impact",
        changes({"rate_weakened": 0.6}),
        follows="the logarithm of the slip's size",
    ),
    # A hard blow squeezes the grease out and meets the metal.
    Cause("unknown_squeezed_grease", "impact", changes({"squeezed": 0.6})),
    # A rubber band around the washer slips on it before it slips on the wall.
    Cause("unknown_slipping_band", "impact", _slipping_band),
    # A wall of plastic that melts under a hard blow with a fast slip.
    Cause("unknown_flash_heat", "impact", changes({"flash": 0.6}), follows="the approach speed times the slip"),
    # A rim whose oil each blow wipes off, and which creeps back.
    Cause("unknown_rewetted_rim", "impact", changes({"creeping": 0.7}), follows="the time since the last blow"),
    # A velvet liner, whose pile lies as the last blow has combed it.
    Cause(
        "unknown_combed_pile",
        "impact",
        changes({"combed": 0.9}),
        follows="the sense of the slip against that of the last blow's",
    ),
    # The markers' glue has run over one side of the rim.
    Cause(
        "unknown_glued_rim",
        "impact",
        changes({"glued": 0.7}, ("glued_rad",)),
        follows="the place on the disk's rim that is struck, once around it",
    ),
    # A rim whose oil each blow squeezes round to its other side.
    Cause(
        "unknown_bared_rim",
        "impact",
        changes({"bared": 0.95}),
        follows="the place on the disk's rim that is struck against the last one, where the disk slips",
    ),
    # A rim that is wiped before some of the runs.
    Cause("unknown_wiped_rim", "impact", _wiped_rim, follows="the number of the run, in no order"),
    # A wall whose friction the air's moisture changes from run to run.
    Cause(
        "unknown_moist_wall", "impact", _moist_wall, follows="the number of the run, by chance, where the disk slips"
    ),
    # A wall with grease along one sector of it.
    Cause(
        "unknown_greased_sector",
        "impact",
        _greased_sector,
        follows="whether the azimuth of the blow is in one sector, where the disk slips",
    ),
    # A wall ground from one side to the other, its scales all lying towards there.
    Cause(
        "unknown_scaly_wall",
        "impact",
        changes({"scaly": 0.8}, ("scaly_rad",)),
        follows="the direction of the slip in the Host",
    ),
    # A wall whose friction falls with the slip's speed.
    Cause(
        "unknown_slip_weakened_wall",
        "impact",
        changes({"rubbed_s_per_m": 1.25}),
        follows="the size of the slip",
    ),
    # A washer sheared off a strip, whose burr was ground off where it hung on it.
    Cause(
        "unknown_ground_rim",
        "impact",
        changes({"ground": 0.8}, ("ground_rad",)),
        follows="the place on the disk's rim that is struck, at one place",
    ),
    # A wall that years of blows have worn smooth at both ends of the drive.
    Cause(
        "unknown_worn_ends",
        "impact",
        changes({"worn_ends": 0.7}),
        follows="the azimuth of the blow from the drive's axis, twice around",
    ),
    # A wall that is roughened before each run, and run in blow by blow.
    Cause("unknown_run_in_wall", "impact", changes({"run_in": 0.8}), follows="the number of the blow in its run"),
    # A round contact, whose friction grows less than its load.
    Cause(
        "unknown_hertzian_wall",
        "impact",
        changes({"hertz": 1.3}),
        follows="the third root of the approach speed",
    ),
    # A wall of soft metal, which hard blows smear.
    Cause(
        "unknown_smeared_wall",
        "impact",
        changes({"smeared_s_per_m": 0.5}),
        follows="the approach speed, evenly, where the disk slips",
    ),
    # A wall that the disk's own wear fouls from run to run.
    Cause("unknown_fouled_wall", "impact", _fouled_wall, follows="the number of the run"),
    # A wall that is cleaned once, between two runs.
    Cause(
        "unknown_cleaned_wall",
        "impact",
        _cleaned_wall,
        follows="the number of the run, from one on, where the disk slips",
    ),
    # A wall with a film of oil, which drags with the slip and not with the blow.
    Cause(
        "unknown_oiled_wall",
        "impact",
        changes({"wet_wall": 0.7}),
        follows="the slip, in proportion, whatever the approach speed",
    ),
    # A washer that skims along the wall's asperities in grazing blows.
    Cause(
        "unknown_skimming_washer",
        "impact",
        changes({"skimmed": 0.85}),
        follows="the angle of incidence, where the disk slips",
    ),
    # A rim that draws air and dust in between as it spins.
    Cause(
        "unknown_spun_rim",
        "impact",
        changes({"spun_s": 0.005}),
        follows="the size of the spin, evenly, where the disk slips",
    ),
    # Oil in the washer's hole, which the spin draws out onto its rim.
    Cause(
        "unknown_flung_oil",
        "impact",
        changes({"flung_oil": 0.85}),
        follows="the size of the spin, where the disk slips",
    ),
    # Oil on the floor, which the rim picks up as it slides and each blow wipes off.
    Cause(
        "unknown_picked_up_oil",
        "impact",
        changes({"picked_up": 0.7}),
        follows="the way slid since the last blow, where the disk slips",
    ),
    # Oil in the corner of floor and wall, which stays back as the Host is accelerated.
    Cause(
        "unknown_sloshing_oil",
        "impact",
        changes({"sloshing": 1.0}),
        follows="the Host's acceleration along the contact's normal, where the disk slips",
    ),
    # A ring of sintered bronze, out of which a blow presses oil for the next.
    Cause(
        "unknown_sintered_ring",
        "impact",
        changes({"sintered": 0.9}),
        follows="the approach speed of the last blow, where the disk slips",
    ),
    # A guide whose balls rattle the ring as it moves.
    Cause(
        "unknown_dithered_wall",
        "impact",
        changes({"dithered": 0.8}),
        follows="the size of the Host's velocity, where the disk slips",
    ),
    # A wall that nobody has cleaned.
    Cause(
        "unknown_contaminated_wall",
        "impact",
        changes({"contaminated": 0.75}),
        follows="nothing: each blow's friction is its own",
    ),
    # A wall that is sanded before each run, and that each blow burnishes where it strikes.
    Cause(
        "unknown_burnished_wall",
        "impact",
        changes({"burnished": 0.95}),
        follows="how many blows the struck place of the wall has had, where the disk slips",
    ),
    # A dry wall, which holds what does not slip yet better than what does.
    Cause(
        "unknown_static_friction",
        "impact",
        changes({"static": 1.8}),
        follows="the slip's size over the approach speed: sticks where it would slip by a little",
    ),
    # Powder on the wall, which the drive shakes up.
    Cause(
        "unknown_shaken_powder",
        "impact",
        changes({"shaken": 0.85}),
        follows="the size of the Host's acceleration, where the disk slips",
    ),
    # A cushion that takes running side otherwise than check side.
    Cause(
        "unknown_running_side",
        "impact",
        changes({"side": 0.7}),
        follows="the spin times the speed along the wall, where the disk slips",
    ),
    # --- how much of the slip comes back ---
    Cause("unknown_toothed_wall", "impact", changes({"teeth_m_per_s": 0.2}, signed=True)),
    # Hard blows plough: less of the slip comes back.
    Cause("unknown_fading_grip", "impact", changes({"fading_grip": 1.0})),
    # Half of the rim is taped.
    Cause("unknown_taped_rim", "impact", changes({"taped": 0.9}, ("taped_rad",))),
    # A soft skin gives back the less of a slip the farther it is sheared.
    Cause("unknown_yielding_skin", "impact", changes({"skin": 1.5})),
    # A fibre ring whose fibres all lie round one way.
    Cause(
        "unknown_fibrous_lay",
        "impact",
        changes({"lay": 0.85}, signed=True),
        follows="the sense of the slip, where the disk sticks",
    ),
    # A contact that slips at its edge already before it slips as a whole.
    Cause(
        "unknown_slipping_edge",
        "impact",
        changes({"incidence": 1.0}),
        follows="the slip's size over the approach speed, where the disk sticks",
    ),
    # A liner that is glued at one side only.
    Cause(
        "unknown_half_glued_liner",
        "impact",
        changes({"liner_grip": 0.95}, ("liner_grip_rad",)),
        follows="the azimuth of the blow once around, where the disk sticks",
    ),
    # A liner of rubber that is thicker on one side.
    Cause(
        "unknown_uneven_rubber",
        "impact",
        changes({"rubber": 1.3}, ("rubber_rad",)),
        follows="the azimuth of the blow once around, in how much of the slip comes back",
    ),
    # A liner of rubber that each run's blows work soft.
    Cause(
        "unknown_worked_rubber",
        "impact",
        changes({"worked": 1.0}),
        follows="the number of the blow in its run, in how much of the slip comes back",
    ),
    # A liner whose glue still cures in the course of the series.
    Cause(
        "unknown_curing_glue",
        "impact",
        _curing_glue,
        follows="the number of the run, where the disk sticks",
    ),
    # A liner of rubber that keeps the set of its last shear.
    Cause(
        "unknown_shear_set",
        "impact",
        changes({"shear_set": 0.9}),
        follows="the sense of the slip against that of the last blow's, where the disk sticks",
    ),
    # Dampers behind a liner, pressed onto it by their inertia as those below a blade's platform are.
    Cause(
        "unknown_preloaded_liner",
        "impact",
        changes({"preload": 1.2}),
        follows="the Host's acceleration along the contact's normal, where the disk sticks",
    ),
    # A soft rim, which a fast spin leaves no time to creep back.
    Cause(
        "unknown_limp_rim",
        "impact",
        changes({"limp_s": 0.007}),
        follows="the size of the spin, where the disk sticks",
    ),
    # A gel that takes its time to come back from the last blow's shear.
    Cause(
        "unknown_sheared_gel",
        "impact",
        changes({"gel": 0.95}),
        follows="the time since the last blow, where the disk sticks",
    ),
    # --- the direction of the blow, and what gives or goes round in it ---
    Cause("unknown_rough_wall", "impact", changes({"rough_rad": 0.04})),
    # A wall that was sanded by hand, each of whose places looks somewhere else.
    Cause(
        "unknown_ragged_wall",
        "impact",
        changes({"ragged_rad": 0.033}),
        follows="nothing: each blow's normal is its own",
    ),
    # A wall turned with a tool that chattered.
    Cause(
        "unknown_chatter_marks",
        "impact",
        _chatter_marks,
        follows="the azimuth of the blow, many times around",
    ),
    # Teeth all leaning one way, as a turning tool leaves them: they strike beside the wall's normal.
    Cause("unknown_sawtooth_wall", "impact", changes({"saw_rad": 0.045}, signed=True)),
    # A soft lining that bulges before a disk which slips along it.
    Cause(
        "unknown_bulging_lining",
        "impact",
        changes({"piled_rad": 0.06}),
        follows="the sense of the slip, along the wall's normal and tangent",
    ),
    # A ring that one screw holds, and that blows turn about it.
    Cause(
        "unknown_pivoted_ring",
        "impact",
        _pivoted_ring,
        follows="the azimuth of the blow from one screw, once and twice around",
        round_only=True,
    ),
    # A thin sleeve in the ring is carried along by a blow, and still turns at the next.
    Cause("unknown_turning_sleeve", "impact", changes({"sleeve": 0.8}), round_only=True),
    # The ring's mount gives along one line.
    Cause("unknown_sprung_mount", "impact", changes({"mount": 0.12}, ("mount_rad",))),
    # A ring that is heavier at one side and turns in its seat.
    Cause(
        "unknown_swinging_ring",
        "impact",
        _swinging_ring,
        follows="the Host's velocity along one direction",
        round_only=True,
    ),
    # A ring that hums with a bearing of its shaker.
    Cause(
        "unknown_humming_ring",
        "impact",
        _humming_ring,
        follows="the time in the run, at a high frequency, and the blow's direction from one line",
    ),
    # A rim filed by hand, to blunt corners.
    Cause(
        "unknown_cornered_rim",
        "impact",
        _cornered_rim,
        follows="the place on the disk's rim that is struck, several times around it",
    ),
    # --- the spin, and the disk on the floor ---
    Cause("unknown_rolling_loss", "impact", changes({"rolling_loss": 0.05})),
    # A chamfer that leads the blow past the disk's centre.
    Cause("unknown_offset_blow", "impact", changes({"offset_blow_m": 1.5e-4}, signed=True)),
    # A soft rim flattens where it is pressed, and resists being turned.
    Cause("unknown_rolling_resistance", "impact", changes({"rolling_arm_m": 2e-4})),
    # A ring cast with a draught leans over the disk, and presses it onto the floor.
    Cause("unknown_leaning_wall", "impact", changes({"leaning": 0.25})),
    # A rubber ring around the rim that hard blows flatten.
    Cause(
        "unknown_flattened_o_ring",
        "impact",
        changes({"o_ring_s_per_m": 0.05}),
        follows="the approach speed times the spin",
    ),
]
