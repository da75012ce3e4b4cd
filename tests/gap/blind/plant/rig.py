"""The plant's rig as the tests of its causes need it: a driven and a resting Host, a bare disk, states by name, one
blow; plain runs with what the plant does on their way, and plain films, with a cause and without; and what the tests
of every group of causes ask of each."""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from analysis.blind.causes.groups import GROUPS
from analysis.blind.causes.named import CAUSES, draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.draw import draw_cases
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import SECTORS, STATES, STEP_S, TRODDEN_SIDE
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.plant.wall.lasting_contact import compliant_step, lasts_s, spring_dashpot
from analysis.blind.plant.wall.motion import swing
from analysis.blind.series import draw_start, outline_series, run_outline
from ovines.__main__ import main

DRIVE = 22.0 * np.pi
HOST = np.array([[0.0, 0.0164, DRIVE, 2.0, 0.0, 0.0, 0.0]])  # 8 g along x, as half of a trial's runs
STILL = np.zeros((1, 7))
PLACE = (
    *("x", "y", "vx", "vy", "angle", "spin", "impact_s", "stretch", "way", "hard", "lx", "ly", "azimuth", "count"),
    *("normal", "approach", "tired", "sleeve", "print_x", "print_y", "way_before", "core", "oiled", "slipped"),
    *("struck", "charge", "nod_x", "nod_y", "nod_vx", "nod_vy", "aged", "bead_x", "bead_y"),
    *("here_x", "here_y", "there_x", "there_y", "left", "blows", "heat"),
    *(f"dents_{sector}" for sector in range(SECTORS)),
    *("afloat", "angle_before", "walk_x", "walk_y"),
    *(f"trodden_{place}" for place in range(TRODDEN_SIDE**2)),
    *("leant_x", "leant_y"),
    *(f"rim_dents_{sector}" for sector in range(SECTORS)),
)
FREE = PlantParameters(floor_friction=0.0, smoothing_m_per_s=1e-6)
SLIDING = FREE._replace(floor_friction=0.3)
BARE = PlantParameters(floor_friction=0.0, restitution=0.7, wall_friction=0.15, tangential_restitution=0.45)
G = 0.3 * 9.81
TIMES = 0.05 + np.arange(60) / 60.0 / 11.0  # in a period of the drive
# What a severity of 1 means, RMS: m/s^2 in the flight and m/s at impacts (of the rim, where only the spin changes), m,
# px.
MEANT = {"flight": (0.2, 1.0), "impact": (0.05, 0.15), "geometry": (1.5e-4, 2.5e-4), "measurement": (0.5, 1.0)}


def state_of(**numbers):
    """A state (STATES,) with these numbers, before any impact."""
    state = np.zeros(STATES)
    state[6] = -1.0
    for name, value in numbers.items():
        state[PLACE.index(name)] = value
    return state


def rate_of(p, time=0.0, host=STILL, **numbers):
    """Acceleration (x, y) and spin's rate."""
    return derivative(time, state_of(**numbers), p, host, disk_friction_table())[[2, 3, 5]]


def struck(p, time=0.1, host=STILL, chance=0.0, **numbers):
    """The state after a blow along x at 1 m/s against the Host, but for what `numbers` say."""
    position, velocity, _ = host_pose(time, host)
    state = state_of(**{"vx": 1.0, **numbers})
    state[0] += position[0] + 0.04
    state[2] += velocity[0]
    return impact(time, state, p, host, np.array([0.0, chance]), 1.0)[0]


def head_on(p, speed=1.0, spin=0.0, time=0.1, host=STILL, **numbers):
    """Normal velocity against the wall, slip and spin after a blow along x."""
    out = struck(p, time, host, vx=speed, spin=spin, **numbers)
    return out[2] - host_pose(time, host)[1][0], out[3] + 0.01 * out[5], out[5]


def random_states(at_wall=False):
    """Sixty states (60, STATES) in the ring at TIMES, or at its wall and on their way into it, 5 to 100 ms after the
    impact before."""
    rng, out = np.random.default_rng(7), np.zeros((60, STATES))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, 60)
    radius = np.full(60, 0.04) if at_wall else 0.036 * np.sqrt(rng.random(60))
    out[:, :2] = radius[:, None] * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    out[:, 2:4] = rng.normal(0.0, 0.86, (60, 2))
    out[:, 4], out[:, 5] = rng.uniform(0.0, 2.0 * np.pi, 60), rng.normal(0.0, 32.0, 60)
    out[:, 6], out[:, 12], out[:, 13] = TIMES - rng.uniform(0.005, 0.1, 60), azimuth, np.arange(1, 61)
    out[:, 14], out[:, 15], out[:, 16] = rng.uniform([0.0, 0.2, 0.0], [2.0 * np.pi, 2.0, 2.5], (60, 3)).T
    out[:, 17], out[:, 18:20] = rng.normal(0.0, 0.15, 60), rng.normal(0.0, 0.015, (60, 2))
    if at_wall:
        inwards = np.minimum(np.sum(out[:, :2] * out[:, 2:4], axis=1) / 0.04**2, 0.0)
        out[:, 2:4] -= 2.0 * inwards[:, None] * out[:, :2]
        out[:, 12] += rng.normal(0.0, 0.5, 60)
    later = np.random.default_rng(8)
    out[:, 20], out[:, 21] = -0.06 * later.random(60), out[:, 5] + later.normal(0.0, 25.0, 60)
    last = np.random.default_rng(9)
    out[:, 22], out[:, 23] = last.random(60), last.normal(0.0, 0.8, 60)
    newest = np.random.default_rng(10)
    out[:, 25], out[:, 26:28] = newest.random(60), newest.normal(0.0, 0.015, (60, 2))
    out[:, 28:30] = newest.normal(0.0, 2.0, (60, 2))
    out[:, 30] = np.random.default_rng(11).random(60)
    latest = np.random.default_rng(12)
    turned, here, there = latest.uniform(0.0, 2.0 * np.pi, (3, 60))
    out[:, 31:33] = 0.8 * np.column_stack([np.cos(turned), np.sin(turned)])
    out[:, 33:35] = 0.04 * np.column_stack([np.cos(here), np.sin(here)])
    out[:, 35:37] = 0.04 * np.column_stack([np.cos(there), np.sin(there)])
    out[:, 37] = latest.uniform(0.3, 2.0, 60)
    out[:, 38] = np.arange(60) % 30
    out[:, 39] = np.random.default_rng(13).uniform(0.0, 12.0, 60)
    out[:, 40:48] = np.random.default_rng(14).integers(0, 5, (60, SECTORS))
    fresh = np.random.default_rng(15)
    out[:, 48], out[:, 49] = fresh.random(60), out[:, 4] - fresh.normal(0.0, 4.0, 60)
    out[:, 50:52], out[:, 52:61] = fresh.integers(-2, 3, (60, 2)), fresh.uniform(0.0, 0.3, (60, TRODDEN_SIDE**2))
    recent = np.random.default_rng(16)
    turned = recent.uniform(0.0, 2.0 * np.pi, 60)
    out[:, 61:63] = 0.8 * np.column_stack([np.cos(turned), np.sin(turned)])
    out[:, 63:] = recent.integers(0, 4, (60, SECTORS))
    out[:, 0] += [host_pose(time, HOST)[0][0] for time in TIMES]
    out[:, 2] += [host_pose(time, HOST)[1][0] for time in TIMES]
    return out


def after_blow(time, state, p, host, chances):
    """The state (STATES,) after a blow; of one that lasts as the disk leaves the wall, with what is remembered of one
    that takes no time: that of a contact which is sustained."""
    new, approach, _ = impact(time, state, p, host, chances, 1.0)
    if lasts_s(p) == 0.0 or approach <= 0.0:
        return new
    table, spring, now, room = disk_friction_table(), spring_dashpot(p), state.copy(), np.zeros((2, STATES))
    sustained = time + 5.0 * lasts_s(p)
    while time < sustained:
        moved = np.zeros(STATES)
        compliant_step(time, now, p, host, table, spring, room, moved)
        now, time = moved, time + STEP_S
        if wall_gap(time, now, p, host)[0] > 0.0:
            new[:6] = now[:6]
            break
    return new


def energy(state):
    """Kinetic energy per unit mass (J / kg) of a bare disk."""
    return 0.5 * (state[2] ** 2 + state[3] ** 2) + 0.25 * (0.01 * state[5]) ** 2


def against_host(state, velocity):
    """The state (STATES,) with its velocity against a Host that moves (x, y first, m/s) and does not turn."""
    out = state.copy()
    out[2:4] -= velocity[:2]
    return out


def first_contacts(p, host=STILL, angle=0.7, duration_s=0.02):
    """Times from the start (k,), approach and slip of the impacts of a disk that starts 10 mm before the wall, along x
    at 1 m/s."""
    start = np.array([0.03, 0.0, 1.0, 0.0, angle, 0.0])
    impacts = run_plant(p, host, start, duration_s, np.random.default_rng(0)).impacts
    return impacts[:, 0] + 2e-3, impacts[:, 1], impacts[:, 2]


@cache
def physics(name, size):
    """Of a run with the cause `name` at `size` ("none": without one)."""
    return physics_of_run(draft_series(name, size, np.random.default_rng(1), 12), 0, DRIVE, 1.2)


@cache
def on_its_way(drop=None):
    """Times and states (k, STATES) of plain runs at 8 g: in flight, and as each blow begins, with what is remembered of
    those before; of a disk that is wetted by a `drop` of oil at that place (m)."""
    flying, striking, p = [], [], physics("none", 1.0)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        motion = run_plant(p, HOST, draw_start(rng), 1.2, rng)
        known = {"way": 0.0, "way_before": 0.0, "core": motion.nodes[0, 6], "impact_s": -1.0, "count": 0, "oiled": 0.0}
        dents, trodden = np.zeros(SECTORS), np.zeros((TRODDEN_SIDE, TRODDEN_SIDE))
        rim_dents, known["leant_x"], known["leant_y"] = np.zeros(SECTORS), 0.0, 0.0
        known |= {"afloat": 0.0, "angle_before": motion.nodes[0, 5], "walk_x": 0.0, "walk_y": 0.0}
        known |= {"heat": 0.0, "charge": 0.0, "aged": 0.0, "bead_x": 0.0, "bead_y": 0.0, "here_x": 0.0, "here_y": 0.0}
        for before, node in pairwise(motion.nodes):
            passed, (place, velocity, _) = node[0] - before[0], host_pose(node[0], HOST)
            slid = passed * np.hypot(node[3] - velocity[0], node[4] - velocity[1])
            known["way"] += slid
            known["core"] += passed * (node[6] - known["core"]) / 0.03
            known["charge"] += (slid * (1.0 - known["charge"]) - passed * known["charge"]) / 0.08
            known["aged"] += passed * (1.0 - known["aged"]) / 0.05 - slid * known["aged"] / 0.02
            known["bead_x"] += (passed * (node[3] - velocity[0]) - slid * known["bead_x"]) / 0.03
            known["bead_y"] += (passed * (node[4] - velocity[1]) - slid * known["bead_y"]) / 0.03
            known["leant_x"] += (passed * (node[3] - velocity[0]) - slid * known["leant_x"]) / 0.01
            known["leant_y"] += (passed * (node[4] - velocity[1]) - slid * known["leant_y"]) / 0.01
            if drop is not None:
                far = ((node[1] - place[0] - drop[0]) ** 2 + (node[2] - place[1] - drop[1]) ** 2) / 1e-4
                known["oiled"] += passed * np.exp(-0.5 * far) * (1.0 - known["oiled"]) / 0.01
                known["oiled"] *= 1.0 - slid / 0.06
            known |= {f"dents_{sector}": count for sector, count in enumerate(dents)}
            known |= {f"rim_dents_{sector}": count for sector, count in enumerate(rim_dents)}
            speed, at = np.hypot(*(node[3:5] - velocity[:2])), ((node[1:3] - place[:2]) / 0.02).clip(-1.0, 1.0)
            known["afloat"] = 1.0 if speed > 1.4 else 0.0 if speed < 0.7 else known["afloat"]
            near = np.maximum(1.0 - np.abs(at[:, None] - np.arange(-1, 2)), 0.0)
            trodden += slid * np.outer(near[1], near[0])
            known |= {f"trodden_{place_}": far for place_, far in enumerate(trodden.ravel())}
            state = state_of(**dict(zip(("x", "y", "vx", "vy", "angle", "spin"), node[1:7], strict=True)), **known)
            blows = known["count"]
            if blows < len(motion.impacts) and abs(node[0] - motion.impacts[blows, 0]) < 1e-11:
                striking.append((node[0], state))
                kick = motion.kicks[blows]
                _, approach, slip = motion.impacts[blows]
                known |= {"there_x": known["here_x"], "there_y": known["here_y"]}
                known |= {"here_x": node[1] - place[0], "here_y": node[2] - place[1]}
                known["left"] = np.hypot(*(node[3:5] + kick - velocity[:2]))
                known |= {"impact_s": node[0], "way_before": known["way"], "count": blows + 1}
                normal = np.arctan2(*(node[1:3] - place[:2])[::-1])
                if approach > 0.3:
                    known["walk_x"] += np.cos(normal)
                    known["walk_y"] += np.sin(normal)
                known["angle_before"] = node[5]
                dents[int(normal % (2.0 * np.pi) / (2.0 * np.pi) * SECTORS)] += approach > 0.3
                known |= {"normal": normal, "azimuth": normal, "approach": approach, "slipped": slip}
                after = impact(node[0], state, p, HOST, np.zeros(2), 1.0)[0]
                known |= {name: after[PLACE.index(name)] for name in ("tired", "struck", "blows")}
                rim_dents[int(known["struck"] % (2.0 * np.pi) / (2.0 * np.pi) * SECTORS)] += approach > 0.7
                known["heat"] += energy(against_host(state, velocity)) - energy(against_host(after, velocity))
                swung = np.array(swing(node[0], state, p)) - [0.0, 0.0, *kick]
                known |= dict(zip(("nod_x", "nod_y", "nod_vx", "nod_vy"), swung, strict=True))
                assert kick @ (node[1:3] - place[:2]) < 0.0
            elif passed > 1e-9:
                flying.append((node[0], state))
    return flying[::200], striking


def rates_on_its_way(name, size, drop=None):
    """Rates of the states in flight that plain runs have on their way, with the cause `name` at `size`."""
    p, table = physics(name, size), disk_friction_table()
    return np.array([derivative(time, state, p, HOST, table) for time, state in on_its_way(drop)[0]])


def blows_on_its_way(name, size, drop=None):
    """States after the blows of plain runs, each of its own chance."""
    p, striking = physics(name, size), on_its_way(drop)[1]
    chances = np.random.default_rng(2).normal(size=len(striking))
    return np.array(
        [
            after_blow(time, state, p, HOST, np.array([0.0, chance]))
            for (time, state), chance in zip(striking, chances, strict=True)
        ]
    )


def gaps_on_its_way(name, size, drop=None):
    """Gaps and normals at the wall, at the blows of plain runs."""
    p = physics(name, size)
    return np.array([wall_gap(time, state, p, HOST) for time, state in on_its_way(drop)[1]])


ON_ITS_WAY = {"flight": rates_on_its_way, "impact": blows_on_its_way, "geometry": gaps_on_its_way}


@cache
def plainly_done(stage, drop=None):
    """What the plant does on the way of plain runs without a cause."""
    return ON_ITS_WAY[stage]("none", 1.0, drop)


def rms(off):
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(off))))


def amount(name, size, drop=None, of_the_rim=False):
    """How much a cause of the plant does on the way of plain runs, RMS: m/s^2 in flight, m/s at impacts (of the rim,
    where only the spin changes), m at the wall."""
    stage = CAUSES[name].stage
    off = ON_ITS_WAY[stage](name, size, drop) - plainly_done(stage, drop)
    if stage == "geometry":
        return rms(off[:, 0])
    rim = 0.01 * rms(off[:, 5])
    return rim if of_the_rim else rms(np.hypot(off[:, 2], off[:, 3])) or rim


@cache
def film(name, size):
    """Pixels of the same run under the same noise, with the measurement as `name` at `size` has it; and its errors."""
    outline = outline_series("none", 1.0, np.random.default_rng(4), 1, "white")
    view = draft_series(name, size, np.random.default_rng(1), 1).view
    made = run_outline(replace(outline, draft=replace(outline.draft, view=view)), np.random.default_rng(5), 8.0)
    return made.recordings[0][1].set_index(["camera", "frame", "marker"])[["u_px", "v_px"]], view


def moved_px(name, size):
    """How far each marker in each frame (camera, frame, marker) is moved in the picture."""
    (seen, _), (plain, _) = film(name, size), film("none", 1.0)
    off = (seen - plain).dropna()
    assert len(off) > 0.97 * len(plain)
    return np.hypot(off["u_px"], off["v_px"])


@contextmanager
def short_runs(longest_s=0.4):
    """Runs of 0.4 s: some ten blows, where nothing grows with the length."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.blind.series.LONGEST_S", longest_s)
        patched.setattr("analysis.blind.series.SHORTEST_S", 0.5 * longest_s)
        yield


@contextmanager
def unfilmed():
    """Runs that no camera sees, where only the disk's path is asked for: to film one takes as long as to make it."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.blind.series.tracks_of", lambda *_: pd.DataFrame({"time_s": []}))
        yield


@cache
def run_of(name, size):
    """Path (n, 7) and impacts of a short run of the same chances with the cause `name` at `size`."""
    plain = outline_series("none", 1.0, np.random.default_rng(4), 1, "white")
    drafted = outline_series(name, size, np.random.default_rng(4), 1, "white").draft
    with short_runs(), unfilmed():
        states = run_outline(replace(plain, draft=drafted), np.random.default_rng(5), 8.0).states
    return states["state01"], states["imp01"]


def pictured(name, size, acts):
    """How far the markers that a cause in the cameras acts on are moved, RMS (px), but for the floor's: `acts` picks
    them by camera, marker and the view.  The others are not moved."""
    far, view = moved_px(name, size), film(name, size)[1]
    chosen = acts(*(far.index.get_level_values(level) for level in ("camera", "marker")), view)
    assert not (far[~chosen] > 1e-9).any()
    return rms(far[chosen & ~far.index.get_level_values("marker").str.startswith("G")])


def means_what_it_says(name, does, rel=0.12):
    """A severity of 1 is what it means, and half of it half: `does` says how much a cause does at a size."""
    low, high = MEANT[CAUSES[name].stage]
    whole = does(name, 1.0)
    assert low < whole < high, whole
    assert does(name, 0.5) == pytest.approx(0.5 * whole, rel=rel)


def drafted_as_plain(name):
    """Whether a severity of 0 leaves every number of the plant, of its Host and of the cameras as it is without the
    cause, as `film` and `run_of` draw them: the same numbers give the same films and runs, which need not be made."""

    def numbers(one):
        for seed, runs in ((1, 12), (4, 1)):
            draft = draft_series(one, 0.0, np.random.default_rng(seed), runs)
            yield from (physics_of_run(draft, run, DRIVE, 1.2) for run in range(runs))
            yield from (view_of(draft), draft.vertical_amplitude_m, draft.sway, draft.ringing)

    return list(numbers(name)) == list(numbers("none"))


def changes_nothing_at_zero(name):
    """At a severity of 0 films, what the plant does on its way and whole runs are the plain ones."""
    if drafted_as_plain(name):
        return
    if CAUSES[name].stage == "measurement":
        assert film(name, 0.0)[0].equals(film("none", 1.0)[0])
        return
    for stage, done in ON_ITS_WAY.items():
        assert np.array_equal(done(name, 0.0), plainly_done(stage))
    for with_it, without in zip(run_of(name, 0.0), run_of("none", 0.0), strict=True):
        assert np.array_equal(with_it, without)


@cache
def end_of(name):
    """Where the disk is after 0.4 s from a start that is always the same, under the same shaker."""
    start = np.array([0.02, 0.01, -0.6, 0.5, 0.3, 40.0])
    p = physics(name, 1.0)._replace(specked_share=0.1)  # it may set in later than 0.4 s
    motion = run_plant(p, HOST, start, 0.4, np.random.default_rng(0))
    return state_at(motion, np.array([0.39]))[0]


def goes_another_way(name):
    """From the same start the same shaker leads the disk elsewhere: not to where the plain one is after 0.4 s."""
    assert np.hypot(*(end_of(name) - end_of("none"))[:2]) > 5e-4


def of_group(group):
    """The causes that were written together, in their order."""
    return [CAUSES[name] for name in GROUPS[group]]


def say_what_they_follow(causes, of_each=(6, 5, 2, 3)):
    """Each of a group does, as many of each stage as are stated; none comes twice or is listed; its parameters are
    in the truth."""
    names = [cause.name for cause in causes]
    assert all(cause.follows for cause in causes) and len(set(names)) == sum(of_each)
    stages = [cause.stage for cause in causes]
    assert tuple(stages.count(stage) for stage in MEANT) == of_each
    assert not any(cause.listed for cause in causes)
    for name in names:
        assert draft_series(name, 1.0, np.random.default_rng(1), 2).parameters[name]


def command_takes_group(group, causes, folder, capsys):
    """One case of each of its causes in one trial, and one of the group's; a name that is none of them is refused."""
    names = [cause.name for cause in causes]
    assert {case.kind for case in draw_cases(len(names), np.random.default_rng(3), (group,))} == set(names)
    asked = [
        "blind",
        "make",
        str(folder / "trial"),
        "--cases",
        str(len(names) + 2),
        "--seed",
        "3",
        "--runs",
        "1",
        "--kinds",
    ]
    with short_runs(0.1):
        assert main([*asked, ",".join([*names, group, "none"])]) == 0
    truths = [json.loads(path.read_text()) for path in sorted((folder / "trial" / "sealed").rglob("*.json"))]
    effects = [truth["effect"] for truth in truths]
    assert set(effects) == {*names, "none"} and len(effects) == len(names) + 2
    assert {t["verdict"] for t in truths if t["effect"] != "none"} == {"unknown"}
    capsys.readouterr()
    assert main([*asked[:2], str(folder / "other"), *asked[3:], f"{group[:-2]}ing"]) == 2
    assert group in capsys.readouterr().err


def blows_at_rest():
    """Times and states of sixty blows against a Host that stands still."""
    for time, state in zip(TIMES, random_states(True), strict=True):
        position, velocity, _ = host_pose(time, HOST)
        state[:4] -= [*position[:2], *velocity[:2]]
        yield time, state


def leaves_no_more_energy(p):
    """No blow leaves the disk more energy than it finds."""
    for time, state in blows_at_rest():
        assert energy(after_blow(time, state, p, STILL, np.zeros(2))) <= energy(state) + 1e-12


def needs_a_round_wall(name):
    """A cylinder's is one, a square's none."""
    assert not may_stand_together(("table_tilt", name), "square", "sine")
    assert may_stand_together(("table_tilt", name), "cylinder", "sine")


def needs_a_blow_that_is_over(names):
    """None stands beside a contact that lasts."""
    for name in names:
        assert not may_stand_together(("finite_contact_time", name), "round", "sine")
