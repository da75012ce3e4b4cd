"""Write samples of the motion while the engine passes their times."""

from __future__ import annotations

from ovines.core.compiled import Floats, Ints, compiled
from ovines.core.integration.flight import glide
from ovines.core.system.kinematics import place

N_SAMPLE = 12  # centre x, y, vx, vy, angle, spin of the NES, the same six of the Host


@compiled
def take_sample(
    t: float, y: Floats, p: Floats, k: Ints, drive: Floats, table: Floats, work: Floats, row: Floats
) -> None:
    """Geometric centre of the NES and the Host at ``t`` into ``row``."""
    at = work[14]
    place(t, y, p, k, drive, table, work[13], at)
    row[0], row[1], row[2], row[3], row[4], row[5] = at[0], at[1], at[2], at[3], y[4], y[5]
    row[6], row[7], row[8], row[9], row[10], row[11] = at[4], at[5], at[7], at[8], at[6], at[9]


@compiled
def sample_glide(
    t: float,
    y: Floats,
    until: float,
    p: Floats,
    k: Ints,
    drive: Floats,
    table: Floats,
    work: Floats,
    trial: Floats,
    sample_times: Floats,
    samples: Floats,
    next_sample: int,
) -> int:
    """Samples of a closed-form flight that starts at ``t``, up to but not including ``until``."""
    while next_sample < sample_times.shape[0] and sample_times[next_sample] < until:
        glide(t, sample_times[next_sample] - t, y, p, k, drive, table, work[13], trial)
        take_sample(sample_times[next_sample], trial, p, k, drive, table, work, samples[next_sample])
        next_sample += 1
    return next_sample
