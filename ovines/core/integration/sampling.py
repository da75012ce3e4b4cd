"""Write samples of the motion while the engine passes their times."""

from __future__ import annotations

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled, copy_into
from ovines.core.integration.flight import glide
from ovines.core.integration.suspension import suspension_work
from ovines.core.system import parameters as P
from ovines.core.system.kinematics import place
from ovines.core.system.packed import Samples, System

N_SAMPLE = 12  # centre x, y, vx, vy, angle, spin of the NES, the same six of the Host


@compiled
def take_sample(t: float, y: Floats, system: System, work: Floats, row: Floats) -> None:
    """Geometric centre of the NES and the Host at ``t`` into ``row``."""
    at = work[P.PLACE]
    place(t, y, system, work[P.SCRATCH], at)
    row[0], row[1], row[2], row[3], row[4], row[5] = at[S.X], at[S.Y], at[S.VX], at[S.VY], y[S.ANGLE], y[S.SPIN]
    row[6], row[7], row[8], row[9], row[10], row[11] = (
        at[S.HOST_X],
        at[S.HOST_Y],
        at[S.HOST_VX],
        at[S.HOST_VY],
        at[S.HOST_ANGLE],
        at[S.HOST_SPIN],
    )


@compiled
def due(samples: Samples, until: float) -> bool:
    """Whether the next sample's instant lies before ``until``."""
    i = samples.written[0]
    return i < samples.times.shape[0] and samples.times[i] < until


@compiled
def keep_sample(y: Floats, system: System, work: Floats, samples: Samples) -> None:
    """The next sample, whose instant is that of state ``y``."""
    i = samples.written[0]
    take_sample(samples.times[i], y, system, work, samples.rows[i])
    if i < samples.states.shape[0]:
        copy_into(samples.states[i], y)
    samples.written[0] = i + 1


@compiled
def sample_glide(
    t: float, y: Floats, until: float, system: System, work: Floats, trial: Floats, samples: Samples
) -> float:
    """Samples of a closed-form flight that starts at ``t``, up to but not including ``until``.

    Where states are wanted, what passes through the suspension is added to ``y`` up to each sample; returns how far
    (s after ``t``).
    """
    counted = 0.0
    while due(samples, until):
        s = samples.times[samples.written[0]] - t
        if samples.states.shape[0] > 0 and system.k[P.HOST_KIND] == P.SPRUNG:
            suspension_work(t, counted, s, y, system, work)
            counted = s
        glide(t, s, y, system, work[P.SCRATCH], trial)
        keep_sample(trial, system, work, samples)
    return counted
