"""A free Host between impacts: it goes straight on and turns on (a mutant that forgot its angle had survived)."""

from dataclasses import replace

import numpy as np

from ovines.core import simulate
from ovines.core.system.model import Host, ImpactLaw, Nes, Scenario


def test_a_free_host_goes_on_and_turns_on_between_impacts():
    """Uniform motion, sampled and at the next impact, whose azimuth is the one of the moved ring."""
    scenario = Scenario(
        name="free", duration_s=0.05, nes=Nes(radius_m=0.01, mass_kg=0.02), impact=ImpactLaw(0.7, 0.1, 0.4),
        host=Host(radius_m=0.05, motion="free", mass_kg=0.1), initial_nes=(0.0, 0.0, 0.3, 0.1, 0.0, 5.0),
        initial_host=(0.001, -0.002, 0.1, -0.2, 0.3, 7.0),
    )  # fmt: skip
    result = simulate(scenario)
    motion, t = result.motion, result.time_s
    assert result.impacts["time_s"].size == 0 and len(t) > 10
    for column, start, rate in (("x_m", 0.001, 0.1), ("y_m", -0.002, -0.2), ("angle_rad", 0.3, 7.0)):
        np.testing.assert_allclose(motion[f"host_{column}"], start + rate * t, atol=1e-14)
    np.testing.assert_allclose(motion["nes_angle_rad"], 5.0 * t, atol=1e-14)
    longer = simulate(replace(scenario, duration_s=0.5))
    assert longer.impacts["time_s"].size > 0
    before = longer.time_s < longer.impacts["time_s"][0]
    np.testing.assert_allclose(longer.motion["host_angle_rad"][before], 0.3 + 7.0 * longer.time_s[before], atol=1e-13)
