"""The place of a parameter in the flight model's vector means nothing: physics goes by names."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

from tests.sources import trees

ANALYSIS = Path(__file__).resolve().parents[3] / "analysis"

# The flight model with other tables of parameters, in plain Python: every parameter given by name a value of its own.
# Each line printed: acceleration, path and derivatives with a parameter inserted before another ("-": none).
SCRIPT = """
import importlib, json, sys
from pathlib import Path
import numpy as np

import analysis.flights.equation.parameters as parameters
from analysis.motion.host_path import HostMotion

SOURCE = Path(parameters.__file__).read_text(encoding="utf-8")
NAMES = list(parameters.PARAMETERS)
VALUES = 0.01 + 0.3 * np.random.default_rng(1).random(len(NAMES))
harmonics = np.zeros((4, 3))
harmonics[:, 1:] = 1e-3 * np.random.default_rng(2).random((4, 2))
state = np.array([0.01, -0.02, 0.4, 0.7, -0.5, 30.0])
for before in sys.argv[1:]:
    entry = f'    "{before}": ("'
    assert before == "-" or entry in SOURCE
    exec(compile(SOURCE.replace(entry, '    "another": ("1", "inserted"),\\n' + entry), "p", "exec"), vars(parameters))
    for name in ("model", "friction_slopes", "law_slopes", "slopes"):
        sys.modules.pop("analysis.flights.equation." + name, None)
    sys.modules.pop("analysis.flights.single_flight", None)
    model, single = (importlib.import_module("analysis.flights." + one) for one in ("equation.model", "single_flight"))
    p = np.zeros(len(parameters.PARAMETERS))
    for name, value in zip(NAMES, VALUES):
        p[parameters.INDEX[name]] = value
    host = HostMotion(harmonics, 60.0, 0.0, np.zeros(4), 0.3, np.zeros((0, 4))).table(0.0, 0.5)
    rig = model.FlightRig(host, 60.0, 0.01, 0.5, 0.04, 0.3)
    free = np.array([parameters.INDEX[name] for name in ("friction", "coupling", "load", "magnus", "wall_pull")])
    out, derivative = np.empty((2, 6)), np.empty((2, 6, 6 + len(free)))
    single.fly_with_derivatives(state, 0.0, np.array([0.001, 0.002]), p, free, rig, out, derivative)
    print(json.dumps([list(model.acceleration(0.4, state, p, rig)), out.tolist(), derivative.tolist()]))
"""


def test_a_parameter_inserted_anywhere_changes_no_number():
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ANALYSIS.parent)}
    arguments = [sys.executable, "-c", SCRIPT, "-", "friction", "tilt_x", "gyro", "host_drag"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True, env=environment, timeout=300)
    as_it_is, *inserted = (json.loads(line) for line in done.stdout.splitlines())
    assert inserted == 4 * [as_it_is]


def test_every_parameter_has_its_own_name_and_changes_the_acceleration():
    """Named constants and table agree, one to one; each parameter acts in the equation of motion."""
    from analysis.flights.equation import parameters as P

    constants = {name: value for name, value in vars(P).items() if name.isupper() and isinstance(value, int)}
    # A law's terms, and the blows before, stand side by side: compiled code counts them from the first.
    blows = [name for name in P.INDEX if name.startswith("blow_")]
    lists = ("BLOW_TIMES", "BLOW_SPEEDS", "BLOW_WAYS", "BLOW_SIDES", "BLOW_SLIPS")
    each = len(blows) // len(lists)
    counted = {name: blows[i * each : (i + 1) * each] for i, name in enumerate(lists)} | {"LAW": list(P.LAW_TERMS)}
    for first, names in counted.items():
        assert [P.INDEX[name] - constants[first] for name in names] == list(range(len(names)))
    named = {name.upper(): P.INDEX[name] for name in set(P.INDEX).difference(*counted.values())}
    assert constants == named | {first: constants[first] for first in counted}
    used = {
        node.attr
        for node in ast.walk(ast.parse((ANALYSIS / "flights" / "equation" / "model.py").read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "P"
    }
    assert used == set(constants)


RECORDS = {"p", "rig", "view", "later", "contact", "work", "frames", "host", "parameters", "record", "rub"}
COMPILED = {"compiled", "inlined"}


def test_compiled_code_takes_no_parameter_by_number():
    """Neither a parameter nor a field of a record."""
    kernels = [
        (path.name, node)
        for path, tree in trees("analysis", tuple(COMPILED)).items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(mark, ast.Name) and mark.id in COMPILED for mark in node.decorator_list)
    ]
    assert len(kernels) > 20
    numbered = [
        f"{name}:{node.lineno}"
        for name, kernel in kernels
        for node in ast.walk(kernel)
        if isinstance(node, ast.Subscript)
        and isinstance(node.value, ast.Name)
        and node.value.id in RECORDS
        and isinstance(node.slice, ast.Constant)
    ]
    assert numbered == []


def test_compiled_code_is_compiled_again_when_its_numbers_change():
    """Compiled code holds the constants that it imports: the stamp must cover the files that they stand in."""
    from analysis.compiled import CONSTANTS
    from ovines.core.compiled import CONSTANTS as CORE

    def covered(module: str) -> bool:
        path = ANALYSIS.parent / (module.replace(".", "/") + ".py")
        inside = path.relative_to(ANALYSIS.parent).as_posix()
        own = inside.startswith("analysis/") and inside.removeprefix("analysis/") in CONSTANTS
        core = inside.startswith("ovines/core/") and inside.removeprefix("ovines/core/") in CORE
        marker = "analysis.compiled" if inside.startswith("analysis/") else "ovines.core.compiled"
        return own or core or marker in path.read_text(encoding="utf-8")

    loose = []
    for path in ANALYSIS.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if "from analysis.compiled import " not in text:
            continue
        tree = ast.parse(text)
        origin = {
            alias.asname or alias.name: f"{node.module}.{alias.name}"
            if (ANALYSIS.parent / str(node.module).replace(".", "/") / f"{alias.name}.py").is_file()
            else node.module
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith(("analysis", "ovines"))
            for alias in node.names
        }
        for kernel in ast.walk(tree):
            if isinstance(kernel, ast.FunctionDef) and any(
                isinstance(mark, ast.Name) and mark.id in COMPILED for mark in kernel.decorator_list
            ):
                names = {node.id for node in ast.walk(kernel) if isinstance(node, ast.Name) and node.id in origin}
                modules = {"analysis.flights.equation.parameters" if name == "P" else origin[name] for name in names}
                loose += [f"{path.name}:{kernel.name} {module}" for module in modules if not covered(module)]
    assert loose == []
