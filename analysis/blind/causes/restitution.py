"""Unlisted causes in the restitution of a blow."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread

WARM_RUNS = 3.0  # after which a ring has warmed by two thirds


def _wandering_shim(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A shim that falls back to its place between the runs, and wanders in each of them alike."""
    out = {
        "shim": 0.16 * size * spread(rng),
        "shim_rad": float(rng.uniform(0.0, 6.283)),
        "shim_rad_per_s": float(rng.uniform(2.0, 4.0)) * sign(rng),
    }
    draft.plant.update(out)
    return out


def _ringing_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {
        "ringing": 0.25 * size * spread(rng) * sign(rng),
        "ringing_rad_per_s": 2.0 * np.pi * float(rng.uniform(25.0, 60.0)),
    }
    draft.plant.update(out)
    return out


def _warming_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much harder than on the mean at first as softer at last."""
    most = 0.1 * size * spread(rng)
    draft.run_numbers.update(warmed=most * np.linspace(-1.0, 1.0, runs))
    return {"warmed": most}


def _retightened_screws(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Once, somewhere in the middle of the series: as much less than on the mean before as more from then on."""
    most = 0.095 * size * spread(rng)
    first = max(round(runs * float(rng.uniform(0.35, 0.65))), 1)
    draft.run_numbers.update(retightened=most * np.where(np.arange(runs) < first, -1.0, 1.0))
    return {"retightened": most, "from_run": float(first + 1)}


def _warmed_up_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """By e to minus the runs before, softer or harder at first, around the mean of the series."""
    most = 0.2 * size * spread(rng) * sign(rng)
    cold = np.exp(-np.arange(runs) / WARM_RUNS)
    draft.run_numbers.update(warmed_up=most * (cold - cold.mean()))
    return {"warmed_up": most, "runs": WARM_RUNS}


def _softening_liner(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """It cools between the runs."""
    out = {"softened": 0.23 * size * spread(rng), "softened_s": float(rng.uniform(0.3, 0.5))}
    draft.plant.update(out)
    return out


def _giving_screws(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """From a speed on that half of the blows have, about."""
    out = {"giving_s_per_m": 0.06 * size * spread(rng), "giving_m_per_s": float(rng.uniform(0.9, 1.2))}
    draft.plant.update(out)
    return out


def _climbing_disk(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """From a speed on that half of the blows have, about."""
    out = {"climbing": 0.26 * size * spread(rng), "climbing_m_per_s": float(rng.uniform(1.0, 1.4))}
    draft.plant.update(out)
    return out


def _catching_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Up to a speed that a third of the blows have, about, beside mere touches."""
    out = {"caught": 0.75 * size * spread(rng), "caught_m_per_s": float(rng.uniform(0.7, 0.9))}
    draft.plant.update(out)
    return out


def _backed_screw(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much harder than on the mean at first as softer at last."""
    most = 0.2 * size * spread(rng)
    draft.plant.update(backed_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    draft.run_numbers.update(backed=most * np.linspace(-1.0, 1.0, runs))
    return {"backed": most, "backed_rad": draft.plant["backed_rad"]}


def _round_contact(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Shared between normal and wall so that what sticks in a blow at 1 m/s comes back as it would in one that takes no
    time: of a slip that swings at sqrt(3) of the tangential spring's own rate for half a period of the normal one."""
    swung = 2.0 * np.pi - np.arccos(-draft.plant["tangential_restitution"])
    out = {"hertz_contact_s": 5e-4 * size * spread(rng)}
    draft.plant.update(out, contact_shear_share=float((swung / np.pi) ** 2 / 3.0))
    return out


RESTITUTION = [
    # --- by the place on the wall ---
    Cause("unknown_soft_spot", "impact", changes({"soft_amplitude": 0.25}, ("soft_azimuth_rad",))),
    Cause("unknown_three_clamps", "impact", changes({"clamps": 0.1}, ("clamps_rad",))),
    # A shim behind the ring that the drive makes wander.
    Cause(
        "unknown_wandering_shim",
        "impact",
        _wandering_shim,
        follows="the azimuth of the blow against one that goes round with the time in the run",
    ),
    # A felt pad that fills a gap behind the wall.
    Cause(
        "unknown_bottoming_pad",
        "impact",
        changes({"pad": 0.65}, ("pad_rad",)),
        follows="the approach speed, at one place of the wall",
    ),
    # A lamp that is switched on for each run, and warms the wall's plastic on its side.
    Cause(
        "unknown_lamplit_side",
        "impact",
        changes({"lamp": 0.42}, ("lamp_rad",)),
        follows="the time in the run, at one side of the wall",
    ),
    # One of the ring's screws, which backs out from run to run.
    Cause(
        "unknown_backed_screw",
        "impact",
        _backed_screw,
        follows="the number of the run from the middle one, at one side of the wall",
    ),
    # A ring that four bolts hold, and that gives between them.
    Cause(
        "unknown_bolted_ring",
        "impact",
        changes({"bolts": 0.14}, ("bolts_rad",)),
        follows="the azimuth of the blow, four times around",
    ),
    # A ring that is backed along one half of it.
    Cause(
        "unknown_half_backed_ring",
        "impact",
        changes({"half_backed": 0.08}, ("half_backed_rad",)),
        follows="on which half of the wall the blow is",
        rivals=("direction_dependent_restitution",),
    ),
    # --- by the place on the disk's rim ---
    Cause("unknown_nicked_disk", "impact", changes({"nick": 0.2}, ("nick_rad",))),
    # A washer punched of rolled sheet is harder along the grain.
    Cause(
        "unknown_rolled_sheet",
        "impact",
        changes({"sheet": 0.11}, ("sheet_rad",)),
        follows="the place on the disk's rim that is struck, twice around it",
    ),
    # A washer that was quenched from one side.
    Cause(
        "unknown_hardened_side",
        "impact",
        changes({"hardened": 0.13}, ("hardened_rad",)),
        follows="the place on the disk's rim that is struck, once around it, in the rebound",
    ),
    # A soft rim that blows peen where they strike, of a fresh washer in each run.
    Cause(
        "unknown_peened_rim",
        "impact",
        changes({"peened": 0.08}),
        follows="how many blows the struck place of the disk's rim has had, in the rebound",
    ),
    # A loose rubber band around the rim, which each blow pushes to the other side.
    Cause(
        "unknown_shifted_band",
        "impact",
        changes({"shifted": 0.12}),
        follows="the place on the disk's rim that is struck against the last one",
    ),
    # A ring and a washer that both run out, and mesh like two wheels.
    Cause(
        "unknown_meshing_sides",
        "impact",
        changes({"meshed": 0.17}, ("meshed_wall_rad", "meshed_rim_rad")),
        follows="the azimuth of the blow times the place on the disk's rim that is struck, once around either",
    ),
    # --- by how the blow comes ---
    Cause("unknown_spin_restitution", "impact", changes({"spin_restitution_s": 0.0012})),
    Cause("unknown_slip_restitution", "impact", changes({"slip_restitution_s_per_m": 0.15})),
    Cause("unknown_glancing_blows", "impact", changes({"glancing": 0.25})),
    Cause("unknown_adhesion", "impact", changes({"adhesion_m_per_s": 0.35})),
    # A film of oil or water on the wall, which takes the same speed of every approach.
    Cause(
        "unknown_wetted_wall",
        "impact",
        changes({"wetted_m_per_s": 0.13}),
        follows="one over the approach speed",
        rivals=("speed_dependent_restitution",),
    ),
    # A wall whose loss grows with the speed.
    Cause(
        "unknown_straight_loss",
        "impact",
        changes({"straight_s_per_m": 0.085}),
        follows="the approach speed, evenly",
        rivals=("speed_dependent_restitution",),
    ),
    # A wall of plastic or rubber, viscoelastic as a sphere's contact is.
    Cause(
        "unknown_viscoelastic_wall",
        "impact",
        changes({"viscoelastic": 0.42}),
        follows="the fifth root of the approach speed",
        rivals=("speed_dependent_restitution",),
    ),
    # A soft wall that is sheared where it holds on to the rim.
    Cause(
        "unknown_gripping_wall",
        "impact",
        changes({"gripped": 0.12}),
        follows="whether the blow sticks or slips along the wall, in the rebound",
    ),
    # A contact with a spring and a dashpot that grows with its way.
    Cause(
        "unknown_damped_contact",
        "impact",
        changes({"dashpot_s_per_m": 0.13}),
        follows="one over one and the approach speed",
        rivals=("speed_dependent_restitution",),
    ),
    # Screws that hold the ring up to a speed, and give beyond it.
    Cause(
        "unknown_giving_screws",
        "impact",
        _giving_screws,
        follows="what the approach speed has beyond some speed, evenly",
        rivals=("speed_dependent_restitution",),
    ),
    # A disk that hard blows make climb up the wall.
    Cause(
        "unknown_climbing_disk",
        "impact",
        _climbing_disk,
        follows="whether the approach speed is above some speed",
        rivals=("speed_dependent_restitution",),
    ),
    # A sticky wall, which holds on to what comes slowly.
    Cause(
        "unknown_catching_wall",
        "impact",
        _catching_wall,
        follows="whether the approach speed is below some speed",
        rivals=("speed_dependent_restitution",),
    ),
    # A disk that heels over as it slips along the wall.
    Cause(
        "unknown_heeling_disk",
        "impact",
        changes({"heeled": 0.21}),
        follows="the slip's size over the approach speed, evenly, in the rebound",
    ),
    # A washer that yields in hard blows only.
    Cause(
        "unknown_yield_speed",
        "impact",
        changes({"yielded": 0.25}),
        follows="the approach speed, where it is above one",
        rivals=("speed_dependent_restitution",),
    ),
    # A rim that yields at its edge, and loses the more the harder it is struck.
    Cause(
        "unknown_plastic_rim",
        "impact",
        changes({"plastic": 0.7}),
        follows="the fourth root of the approach speed",
        rivals=("speed_dependent_restitution",),
    ),
    # A loose chip in the ring, which now and then lies between.
    Cause("unknown_loose_chip", "impact", changes({"loose_chip": 0.25})),
    # A wall of coarse grains, which a blow that slips meets as it happens.
    Cause(
        "unknown_scattering_glances",
        "impact",
        changes({"glances": 0.2}),
        follows="nothing but how much it scatters: with the slip's size over the approach, in the rebound",
    ),
    # A liner wound with overlaps, like shingles.
    Cause(
        "unknown_shingled_liner", "impact", changes({"shingled": 0.11}, signed=True), follows="the slip with its sense"
    ),
    # A wall that is sheared by oblique blows.
    Cause(
        "unknown_oblique_restitution",
        "impact",
        changes({"oblique": 0.5}, signed=True),
        follows="the angle of incidence",
    ),
    # A rim that is rounded, and wall and rim that give as Hertz has it.
    Cause(
        "unknown_round_contact",
        "impact",
        _round_contact,
        follows="the approach speed to the power -1/5, in how long a blow lasts",
        rivals=("finite_contact_time",),
    ),
    # --- by the blows before, the time in the run and the run ---
    Cause("unknown_ageing_restitution", "impact", changes({"ageing_per_s": 0.35})),
    # A liner that warms in a run and softens, ever more slowly.
    Cause(
        "unknown_softening_liner",
        "impact",
        _softening_liner,
        follows="the time in the run, ever more slowly",
        rivals=("restitution_drift",),
    ),
    Cause("unknown_restless_restitution", "impact", changes({"rest_amplitude": 0.2})),
    Cause("unknown_damaged_wall", "impact", changes({"damage": 0.12})),
    # A soft liner that each blow dents, turned to a fresh side before each run.
    Cause(
        "unknown_hammered_liner",
        "impact",
        changes({"hammered": 0.06}),
        follows="how many blows the struck place of the wall has had",
        rivals=("restitution_drift",),
    ),
    # Screws that blows loosen, and that are tightened before each run.
    Cause(
        "unknown_loosening_screws",
        "impact",
        changes({"loosened": 0.3}),
        follows="the number of the blow in its run",
    ),
    # Soft metal that a blow hardens for the next.
    Cause(
        "unknown_hardening_dints",
        "impact",
        changes({"dinted_s_per_m": 0.075}),
        follows="the approach speed of the last blow, in the rebound",
    ),
    # A soft rim that a slip leaves rough.
    Cause(
        "unknown_scuffed_rim",
        "impact",
        changes({"scuffed_s_per_m": 0.13}),
        follows="the size of the last blow's slip, in the rebound",
    ),
    # Clamps that creep after they were tightened, before each run.
    Cause(
        "unknown_slackening_clamps",
        "impact",
        changes({"slackened": 0.045}),
        follows="the logarithm of the time in the run",
        rivals=("restitution_drift",),
    ),
    # A washer that blows heat, and that cools between the runs.
    Cause(
        "unknown_heated_washer",
        "impact",
        changes({"heated": 0.2}),
        follows="the energy that the blows so far have taken",
        rivals=("restitution_drift",),
    ),
    # The wall's coating is still pressed in where it was hit the last time.
    Cause("unknown_bruised_wall", "impact", changes({"bruise": 0.35})),
    # A washer that rocks from blow to blow strikes with its upper edge, then with its lower one.
    Cause("unknown_two_edges", "impact", changes({"two_edges": 0.1}, signed=True)),
    # The ring still rings from the blow before.
    Cause("unknown_ringing_wall", "impact", _ringing_wall),
    # A rubber liner tires from blow to blow, and recovers.
    Cause("unknown_tiring_liner", "impact", changes({"tired": 0.07})),
    # A weight in the washer's hole whose glue has failed: it rattles.
    Cause(
        "unknown_rattling_weight",
        "impact",
        changes({"rattling": 0.12}),
        follows="the angle between this blow's normal and the last one's",
    ),
    # Dust that the disk sweeps together as it slides, and that cushions its next blow.
    Cause(
        "unknown_swept_cushion",
        "impact",
        changes({"swept": 0.11}),
        follows="the way slid since the last blow",
    ),
    # A shaker that warms the ring from run to run.
    Cause(
        "unknown_warming_ring",
        "impact",
        _warming_ring,
        follows="the number of the run",
        rivals=("restitution_drift",),
    ),
    # A ring that warms up in the first runs of a day.
    Cause(
        "unknown_warmed_up_ring",
        "impact",
        _warmed_up_ring,
        follows="the number of the run, ever less",
        rivals=("restitution_drift",),
    ),
    # Screws that somebody finds loose and tightens between two runs.
    Cause(
        "unknown_retightened_screws",
        "impact",
        _retightened_screws,
        follows="the number of the run, from one on",
        rivals=("restitution_drift",),
    ),
    # --- by the Host's motion ---
    Cause(
        "unknown_drive_phase_restitution",
        "impact",
        changes({"phase_amplitude": 0.12}, ("phase_rad",)),
        steady_only=True,
    ),
    Cause("unknown_yielding_wall", "impact", changes({"yielding_s_per_m": 0.2}, signed=True)),
    # A ring that its own inertia presses into its seat, or lifts from it.
    Cause("unknown_seated_ring", "impact", changes({"seated": 0.13}, signed=True)),
    # A hollow ring filled with lead shot.
    Cause("unknown_shot_filled_ring", "impact", changes({"shot": 0.12}), follows="the size of the Host's acceleration"),
    # A shaker whose armature gives way along its axis.
    Cause(
        "unknown_soft_armature",
        "impact",
        changes({"armature": 0.2}),
        follows="the blow's direction against the drive's axis, twice around",
    ),
]
