"""Cost of sensitivities over a plain run, processor time, every column that means something (issue 22: at most 3).

python benchmarks/simulator/sensitivities.py
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from simulate import best_of

from ovines.core import simulate
from ovines.core.ensemble import run_chunk
from ovines.core.packing import pack
from ovines.core.sensitivity.run import sensitivities
from ovines.core.system.named import named_scenario

CASES = {"table-3": 25.0, "table-13": 300.0, "table-15-case-2": 1.0, "rig": 1.0, "obstacle": 0.3}


def main() -> None:
    print("| scenario | columns | plain run | sensitivities | ratio | over a run of an ensemble |")
    for name, duration in CASES.items():
        scenario = named_scenario(name, duration_s=duration, sample_rate_hz=0.0)
        packed = pack(scenario, with_energy=False)
        rows = packed.system._replace(p=packed.p[None], drive=packed.drive[None])

        def quick(rows=rows, start=packed.y[None]):
            return run_chunk(rows, start, np.zeros(0))

        def asked(scenario=scenario, end=duration):
            return sensitivities(scenario, times_s=np.array([end]))

        def plain(scenario=scenario):
            return simulate(replace(scenario))

        quick(), plain()
        columns = len(asked().names)
        (a, _), (b, _), (c, _) = best_of(plain, 15), best_of(asked, 15), best_of(quick, 15)
        print(
            f"| {name}, {duration:g} s | {columns} | {1e3 * a:.3g} ms | {1e3 * b:.3g} ms | {b / a:.2f} | {b / c:.2f} |"
        )


if __name__ == "__main__":
    main()
