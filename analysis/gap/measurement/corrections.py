"""Measurement findings taken out one after the other, strongest first, each time measuring again; last what only moves
or widens frames, as the points behind these are then no longer theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from analysis.flights.stated_terms import stated_sizes
from analysis.gap.finding import Finding
from analysis.gap.measurement.body_rows import with_places_on_time
from analysis.gap.measurement.speed_noise import speed_noise
from analysis.gap.measurement.tests import MeasurementTests, measurement_tests
from analysis.gap.series import (
    Series,
    levelled,
    retimed,
    scaled,
    with_blur,
    with_motions,
    with_window_shift,
    without_jitter,
)
from analysis.gap.thresholds import SIGNIFICANCE
from ovines.recording_schema import Nominal

#: how each finding is taken out of the data; a late camera leaves the plane motion a constant half delay for both
#: bodies alike; what it does beyond that is put right when all else is (`_on_time`)
CORRECTIONS: dict[str, Callable[[Series, Finding], Series]] = {
    "frame_rate_error": lambda s, f: retimed(s, 1 / f.parameters["ratio"][0]),
    "length_scale_error": lambda s, f: scaled(s, 1 / f.parameters["scale"][0]),
    "sensor_window_offset": lambda s, f: with_window_shift(s, (-f.parameters["u_px"][0], -f.parameters["v_px"][0])),
    "plane_tilt": lambda s, f: levelled(s, -f.parameters["y_rad"][0], f.parameters["x_rad"][0]),
    "trigger_jitter": lambda s, f: without_jitter(s, f.parameters["sd_s"][0], s),
    "motion_blur": lambda s, f: with_blur(s, f.parameters["sd_s"][0]),
    "camera_clock_offset": lambda s, f: s,
}
#: what its correction leaves in the data, to be found again
KEPT = ("camera_clock_offset", "motion_blur")
ADDITIVE = ("sensor_window_offset", "plane_tilt")
LAST = ("trigger_jitter", "motion_blur")


@dataclass(frozen=True, eq=False)
class Corrected:
    """The corrected ``series``, ``as_timed``: the same before frames were moved in time or widened; ``findings`` in the
    order taken out, and the first round's ``tests``."""

    series: Series
    as_timed: Series
    findings: tuple[Finding, ...]
    tests: MeasurementTests

    def beside(self, as_timed: Series, calm: Series, withheld: frozenset[str]) -> Corrected:
        """The same with frames moved and widened as the ``calm`` Host asks, which does nothing beside its drive: what
        it does there passes for late frames, or hides them.  ``as_timed``: with whatever the Host does."""
        found = [one for one in self.findings if one.effect not in LAST]
        excluded = withheld | ({"trigger_jitter"} if self.tests.clock_change is not None else set())
        series, noise = as_timed, speed_noise(calm)
        first = {one.effect: one for one in noise}
        for _ in LAST:
            left = [one for one in noise if one.found and one.effect not in excluded]
            if not left:
                break
            strongest = max(left, key=Finding.times_least)
            found.append(strongest)
            excluded |= {strongest.effect}
            take = CORRECTIONS[strongest.effect]
            jitter = strongest.effect == "trigger_jitter"
            series = (
                without_jitter(series, strongest.parameters["sd_s"][0], calm) if jitter else take(series, strongest)
            )
            calm = take(calm, strongest)
            noise = speed_noise(calm)
        tests = replace(self.tests, findings=self.tests.findings | first)
        return Corrected(series, as_timed, tuple(found), tests)


def correct(series: Series, withheld: frozenset[str] = frozenset(), most: int = 3) -> Corrected:
    """A series without what its measurement shows, but for what is ``withheld``."""
    first = tests = measurement_tests(series)
    found: list[Finding] = []
    after: dict[str, Finding] = {}
    as_timed = series
    for _ in range(most):
        taken = {f.effect for f in found}
        left = [f for f in tests.findings.values() if f.found and f.effect not in taken | withheld]
        if not left:
            break
        strongest = max(left, key=lambda f: (f.effect not in LAST, f.times_least()))
        found.append(strongest)
        series = CORRECTIONS[strongest.effect](series, strongest)
        as_timed = as_timed if strongest.effect in LAST else series
        tests = measurement_tests(series)
        after |= tests.findings
    late = [f.parameters["offset_s"][0] for f in found if f.effect == "camera_clock_offset"]
    if late:  # last, as the tests above read lines and heights of the same camera
        series, as_timed = _on_time(series, as_timed, late[0])
    return Corrected(series, as_timed, tuple(_refined(f, after.get(f.effect)) for f in found), first)


def _on_time(series: Series, as_timed: Series, delay_s: float) -> tuple[Series, Series]:
    """Both without what a late camera makes of places and heights."""
    on_time = with_places_on_time(as_timed, delay_s)
    if series is as_timed:
        return on_time, on_time
    moved = [f"{body}_{a}_m" for body in ("host", "nes") for a in "xyz"]
    each = zip(series.motions, as_timed.motions, on_time.motions, strict=True)
    motions = [motion.assign(**(motion[moved] + (after[moved] - before[moved]))) for motion, before, after in each]
    return with_motions(series, motions), on_time


def without_stated(series: Series) -> Series:
    """``series`` without what ``[model.effect_parameters]`` says of its measurement, but for what a correction leaves
    in the data: that is found and taken out again."""
    for effect, sizes in stated_sizes(series.recordings[0].model).items():
        if effect in CORRECTIONS and effect not in KEPT:
            stated = {name: (value, 0.0) for name, value in sizes.items()}
            series = CORRECTIONS[effect](
                series, Finding(effect, series.frame.rig_parameters(effect, stated), 0, 0, True)
            )
    return series


def beyond_stated(findings: Sequence[Finding], model: Nominal | None) -> list[Finding]:
    """Those of the ``findings`` that ``[model]`` does not name, or names with another size."""
    sizes = stated_sizes(model)
    named = set(model.effects if model else ())

    def known(finding: Finding) -> bool:
        if finding.effect not in sizes:
            return finding.effect in named
        stated = sizes[finding.effect]
        return finding.effect in KEPT and all(
            abs(value - stated[name]) < max(SIGNIFICANCE * sd, finding.least)
            for name, (value, sd) in finding.parameters.items()
        )

    return [finding for finding in findings if not known(finding)]


def _refined(finding: Finding, left: Finding | None) -> Finding:
    """What a linear correction ``left`` over is measured on the corrected data, and belongs to the effect."""
    if finding.effect not in ADDITIVE or left is None:
        return finding
    return replace(
        finding,
        parameters={name: (value + left.parameters[name][0], sd) for name, (value, sd) in finding.parameters.items()},
    )
