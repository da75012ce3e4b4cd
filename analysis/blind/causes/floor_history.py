"""Unlisted causes in the floor's friction and load, by what went before, the run and the Host's motion."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread, vector

BENCH_RUNS = 3.0  # after which a bench has warmed by two thirds


def _cleaned_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Once, somewhere in the middle of the series: as much less than on the mean before as more from then on."""
    most = 0.17 * size * spread(rng)
    first = max(round(runs * float(rng.uniform(0.35, 0.65))), 1)
    draft.run_numbers.update(cleaned=most * np.where(np.arange(runs) < first, -1.0, 1.0))
    return {"cleaned": most, "from_run": float(first + 1)}


def _turned_washer(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The rougher face down in half of the runs, whichever."""
    most = 0.18 * size * spread(rng)
    side = np.where(rng.permutation(runs) % 2 == 0, 1.0, -1.0)
    draft.run_numbers.update(turned=most * side)
    return {"turned": most, "runs_rough": float(np.sum(side > 0.0))}


def _humid_day(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Once up and down in the course of the series, from anywhere on."""
    most, phase = 0.26 * size * spread(rng), float(rng.uniform(0.0, 2.0 * np.pi))
    draft.run_numbers.update(humid=most * np.sin(2.0 * np.pi * np.arange(runs) / runs + phase))
    return {"humid": most, "phase_rad": phase}


def _settling_dust(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Wiped off before the first run and before every third, fourth or fifth from then on: as much less than on the
    mean just after that as more just before, evenly in between."""
    most, every = 0.25 * size * spread(rng), int(rng.integers(3, 6))
    draft.run_numbers.update(dusted=most * (2.0 * (np.arange(runs) % every) / (every - 1) - 1.0))
    return {"dusted": most, "every": float(every)}


def _warming_bench(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """By e to minus the runs before, more at first, around the mean of the series."""
    most = 0.4 * size * spread(rng)
    cold = np.exp(-np.arange(runs) / BENCH_RUNS)
    draft.run_numbers.update(bench=most * (cold - cold.mean()))
    return {"bench": most, "runs": BENCH_RUNS}


def _damp_face(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """It rubs more or less than a dry one, and is wiped anew before each run."""
    out = {"damp": 0.4 * size * spread(rng) * sign(rng), "damp_s": float(rng.uniform(0.3, 0.5))}
    draft.plant.update(out)
    return out


def _gritty_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant["grit"] = 0.35 * size * spread(rng)
    draft.run_numbers["grit_draw"] = rng.random(runs)
    return {"grit": draft.plant["grit"]}


def _smeared_drop(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A drop of oil between the Host's middle and its wall."""
    x, y = vector(0.016, rng)
    out = {"drop": 0.65 * size * spread(rng), "drop_x_m": x, "drop_y_m": y}
    draft.plant.update(out)
    return out


def _lifted_disk(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """It settles within a flight or two."""
    out = {"lifted": 0.6 * size * spread(rng), "lifted_s": float(rng.uniform(0.03, 0.05))}
    draft.plant.update(out)
    return out


def _swinging_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A floor plate on one screw, to either side of the drive's axis: what hangs on a screw on it does not swing."""
    out = {
        "swing_rad_per_m": 10.0 * size * spread(rng),
        "swing_x_m": float(rng.uniform(-0.01, 0.01)),
        "swing_y_m": float(rng.uniform(0.035, 0.045)) * sign(rng),
    }
    draft.plant.update(out)
    return out


def _drumming_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """So slow that a flight has several of its swings, each in several frames."""
    out = {"drum": 0.65 * size * spread(rng), "drum_rad_per_s": 2.0 * np.pi * float(rng.uniform(30.0, 70.0))}
    draft.plant.update(out)
    return out


def _clogging_face(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Some times in a run, from wherever the run before has left it, which is cleaned off to the same."""
    out = {
        "clogged": 0.35 * size * spread(rng),
        "clogged_m": float(rng.uniform(0.15, 0.3)),
        "clogged_share": float(rng.random()),
    }
    draft.plant.update(out)
    return out


def _pulsing_air(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A slow compressor, whose pulses also start the recordings."""
    out = {
        "pulsing": 0.27 * size * spread(rng),
        "pulsing_rad_per_s": float(rng.uniform(20.0, 60.0)),
        "pulsing_rad": float(rng.uniform(0.0, 2.0 * np.pi)),
    }
    draft.plant.update(out)
    return out


def _caught_speck(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In each run from a time of its own on; wiped off between the runs."""
    out = {"specked": 0.36 * size * spread(rng)}
    draft.plant.update(out)
    draft.run_numbers["specked_share"] = rng.uniform(0.1, 0.5, runs)
    return out


def _wearing_middle(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, polished or roughened: as much less than on the mean at first as more at last, or
    the other way."""
    most = 0.45 * size * spread(rng) * sign(rng)
    draft.run_numbers.update(wearing=most * np.linspace(-1.0, 1.0, runs))
    return {"wearing": most}


def _kicked_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """So slow that a flight has some of its swings."""
    out = {"kicked": 0.55 * size * spread(rng), "kicked_rad_per_s": 2.0 * np.pi * float(rng.uniform(15.0, 35.0))}
    draft.plant.update(out)
    return out


def _rolling_grain(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In stretches of its own in each run."""
    if size > 0.0:
        draft.plant["rolling"] = 0.42 * size * spread(rng)
        draft.run_numbers["rolling_draw"] = rng.random(runs)
    return {"rolling": draft.plant.get("rolling", 0.0)}


FLOOR_HISTORY = [
    # --- by what went before ---
    # A washer whose face was wiped with something wet before each run, and that rubs itself dry.
    Cause(
        "unknown_damp_face",
        "flight",
        _damp_face,
        follows="the time in the run, ever less, in the floor's friction",
        rivals=("friction_drift",),
    ),
    Cause("unknown_warming_floor", "flight", changes({"warming": 0.45})),
    # Each blow shakes off one grain of grit and picks up another.
    Cause("unknown_gritty_floor", "flight", _gritty_floor),
    # A grain that gets under the disk now and then, and on which it rolls.
    Cause(
        "unknown_rolling_grain",
        "flight",
        _rolling_grain,
        follows="the time in the run, in short stretches in no order, less of the friction",
    ),
    # Oil of which the disk draws the more below itself the faster a blow lets it go.
    Cause(
        "unknown_primed_film",
        "flight",
        changes({"primed": 0.4}),
        follows="the disk's speed over the Host's floor after the last blow, in the friction",
        short_blows=True,
    ),
    # A drop of oil on the floor: a disk that has been there carries some of it along.
    Cause(
        "unknown_smeared_drop",
        "flight",
        _smeared_drop,
        follows="the way slid since the disk was last at one place of the Host's floor",
    ),
    # A blow beside the height of the mass centre lifts the disk.
    Cause(
        "unknown_lifted_disk",
        "flight",
        _lifted_disk,
        follows="the time since the last blow",
        rivals=("nes_rocking", "unknown_hop"),
    ),
    # A painted floor in dry air: the disk is charged as it slides, clings to it, and loses the charge again.
    Cause(
        "unknown_clinging_disk",
        "flight",
        changes({"clinging": 0.6}),
        follows="how fast the disk has slid over the last tenth of a second",
    ),
    # Contacts that grow stronger as they rest, and are made anew as the disk slides.
    Cause(
        "unknown_aged_contacts",
        "flight",
        changes({"aged": 1.0}),
        follows="how slowly the disk has slid over the last twenty millimetres",
    ),
    # Beads of wax on the floor, on which the disk rolls until it goes another way.
    Cause(
        "unknown_wax_beads",
        "flight",
        changes({"beads": 0.8}),
        follows="the angle between the slip and its direction over the last thirty millimetres",
    ),
    # A disk that gathers debris as a tape's head does, until it breaks off.
    Cause(
        "unknown_clogging_face",
        "flight",
        _clogging_face,
        follows="the way slid in the run, slowly up and at once down, many times",
    ),
    # A blow that tips the disk like a coin, so that it stands on its edge for a while.
    Cause(
        "unknown_edge_stand",
        "flight",
        changes({"edged": 0.8}),
        follows="the time since the last blow, its approach speed, and for the torque the slip across its normal",
        rivals=("nes_rocking",),
        short_blows=True,
    ),
    # A floor plate that each blow makes drum.
    Cause(
        "unknown_drumming_floor",
        "flight",
        _drumming_floor,
        follows="the time since the last blow, to and fro",
        rivals=("nes_rocking",),
    ),
    # A compressor that pulsates below an air table.
    Cause(
        "unknown_pulsing_air",
        "flight",
        _pulsing_air,
        follows="the time in the run, to and fro at a frequency that is not the drive's",
    ),
    # Dust that each blow knocks off the wall, and that the disk leaves behind.
    Cause(
        "unknown_knocked_dust",
        "flight",
        changes({"debris_s_per_m": 0.45}),
        follows="the way slid since the last blow, and its approach speed",
        short_blows=True,
    ),
    # Dirt along one side of the wall, of which a blow there leaves some under the disk.
    Cause(
        "unknown_dirty_side",
        "flight",
        changes({"dirty_side": 0.3}, ("dirty_rad",)),
        follows="the azimuth of the last blow, once around, in the friction",
        short_blows=True,
    ),
    # A disk that rattles on its floor after a blow, the more the harder it was.
    Cause(
        "unknown_rattling_disk",
        "flight",
        changes({"rattled_s_per_m": 0.25}),
        follows="the time since the last blow, times its approach speed, in the friction",
        rivals=("nes_rocking", "unknown_hop"),
        short_blows=True,
    ),
    # A speck that gets under the disk in the course of each run.
    Cause(
        "unknown_caught_speck",
        "flight",
        _caught_speck,
        follows="the time in the run, from one on, in the friction",
        rivals=("friction_drift",),
    ),
    # A floor that is cleaned once, between two runs.
    Cause(
        "unknown_cleaned_floor",
        "flight",
        _cleaned_floor,
        follows="the number of the run, from one on",
        rivals=("friction_drift",),
    ),
    # A washer that is put in by hand, one face down or the other.
    Cause(
        "unknown_turned_washer",
        "flight",
        _turned_washer,
        follows="the number of the run, in no order, in the floor's friction",
        rivals=("friction_drift",),
    ),
    # Air that is more and less humid in the course of a day.
    Cause(
        "unknown_humid_day",
        "flight",
        _humid_day,
        follows="the number of the run, once up and down",
        rivals=("friction_drift",),
    ),
    # Dust that settles from run to run, and that somebody wipes off now and then.
    Cause(
        "unknown_settling_dust",
        "flight",
        _settling_dust,
        follows="the number of the run since the last of some that are evenly spaced",
        rivals=("friction_drift",),
    ),
    # A bench that warms in the first runs of a day.
    Cause(
        "unknown_warming_bench",
        "flight",
        _warming_bench,
        follows="the number of the run, ever less of the friction",
        rivals=("friction_drift",),
    ),
    # A floor and a washer that blows polish, and that are wiped between the runs.
    Cause(
        "unknown_glazed_floor",
        "flight",
        changes({"glazed": 0.05}),
        follows="the number of blows so far, ever less of the friction",
        rivals=("friction_drift",),
    ),
    # Grit that blows strew on the floor, and that is wiped off between the runs.
    Cause(
        "unknown_strewn_grit",
        "flight",
        changes({"strewn": 0.045}),
        follows="the number of blows so far, as much more friction with each",
        rivals=("friction_drift",),
    ),
    # A floor that wears in its middle in the course of the series.
    Cause(
        "unknown_wearing_middle",
        "flight",
        _wearing_middle,
        follows="the number of the run from the middle one, in the middle of the Host",
    ),
    # Powder that blows shed, and that gathers along the wall in the course of each run.
    Cause(
        "unknown_shed_powder",
        "flight",
        changes({"powder": 0.7}),
        follows="the number of blows so far, and the way to the wall",
    ),
    # A floor that was dusted before each run, and that the disk polishes where it goes.
    Cause(
        "unknown_trodden_floor",
        "flight",
        changes({"trodden": 0.5}),
        follows="the way slid so far in the run near the disk's place in the Host",
        rivals=("friction_drift",),
    ),
    # A disk that throws the dust out from below itself as it turns, until a blow lets it in again.
    Cause(
        "unknown_spun_out_dust",
        "flight",
        changes({"spun_out": 0.35}),
        follows="the angle turned since the last blow, ever less, in the friction",
    ),
    # A floor plate on soft pads, which each blow on the ring kicks.
    Cause(
        "unknown_kicked_floor",
        "flight",
        _kicked_floor,
        follows="the time since the last blow, to and fro, and its normal and approach, in the slip",
        short_blows=True,
    ),
    # --- by the Host's motion ---
    # A floor plate whose screws are loose follows the ring only in part.
    Cause("unknown_loose_floor", "flight", changes({"loose_floor": 0.6})),
    # A floor plate on one screw in its middle, which creeps round under the drive.
    Cause("unknown_turning_floor", "flight", changes({"floor_turn_rad_per_s": 7.0}, signed=True)),
    # A floor plate on one screw at its edge, about which the drive makes it swing.
    Cause(
        "unknown_swinging_floor",
        "flight",
        _swinging_floor,
        follows="the Host's velocity along the drive's axis, times the place from one point of the Host",
    ),
    # The shaker's table pitches as it is accelerated: one side of the floor presses, the other gives way.
    Cause("unknown_pitching_floor", "flight", changes({"pitching": 0.6}, signed=True)),
    # A guide with play, which shakes the floor's load twice in a period of the drive.
    Cause(
        "unknown_galloping_guide",
        "flight",
        changes({"galloping": 0.33}, ("galloping_rad",)),
        follows="the drive's phase, twice in a period, in the load",
        steady_only=True,
    ),
    # A thin floor plate that bends as the drive shakes it.
    Cause(
        "unknown_thin_floor",
        "flight",
        changes({"thin_floor_m_per_s2": 4.5}, signed=True),
        follows="the Host's acceleration along the drive's axis, the less the nearer to the wall, in the load",
        rivals=("vertical_motion",),
    ),
    # The shaker's coil draws the steel washer down, whichever way its current flows.
    Cause(
        "unknown_drawn_down",
        "flight",
        changes({"drawn_down": 0.35}),
        follows="the square of the Host's acceleration, in the friction",
    ),
    # A magnet of the shaker, below one end of the stroke, draws the steel down.
    Cause(
        "unknown_magnet_beneath",
        "flight",
        changes({"beneath": 0.2}, signed=True),
        follows="the place in the room along the drive's axis, in the friction",
    ),
    # A guide with worn bearings, whose rumble shakes the load off the floor.
    Cause("unknown_rumbling_guide", "flight", changes({"rumble": 0.4}), follows="the square of the Host's speed"),
]
