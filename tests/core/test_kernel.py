"""Kernels hold their helpers, and say the same whoever calls them."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import config, njit
from numba.core.codegen import CPUCodegen as Codegen

from ovines.core.kernel import KernelFlags

ROOT = Path(__file__).resolve().parents[2]
X = np.arange(5.0)
SOURCE = """
import numpy as np
from ovines.core.compiled import compiler

kernel = compiler("test")

@kernel
def helper(x):
    if x.size > 100:
        raise ValueError("too many")
    return np.median(x) + 1.0

@kernel
def middle(x):
    return 2.0 * helper(x)

@kernel
def outer(x):
    return helper(x) + middle(x)

@kernel
def power(x, k):
    return x ** k

@kernel
def powers(x, k):
    return power(x, 2) + power(x, 3) + power(x, k)
"""


@pytest.fixture
def kernels(tmp_path):
    """Loads three kernels as a new process would: one that the next calls, and one that calls both."""
    path = tmp_path / "kernels.py"
    path.write_text(SOURCE)

    def load():
        spec = importlib.util.spec_from_file_location("kernels", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.helper, module.middle, module.outer

    return load


def kept(kernel) -> bool:
    index = Path(kernel.index)
    return bool(list(index.parent.glob(index.name.removesuffix(".nbi") + ".*.nbc")))


@pytest.mark.further
def test_only_what_python_calls_is_kept_on_disk(kernels):
    helper, middle, outer = kernels()
    assert outer(X) == 9.0
    assert kept(outer) and not kept(middle) and not kept(helper)
    assert middle(X) == 6.0 and kept(middle)  # Python calls it too


@pytest.mark.further
def test_what_the_disk_has_is_loaded_and_says_the_same(kernels):
    first = kernels()
    said = first[2](X), first[0](X)
    helper, _, outer = kernels()
    assert (outer(X), helper(X)) == said
    assert sum(outer.stats.cache_hits.values()) == 1 and not outer.stats.cache_misses


def test_a_constant_makes_no_version_of_its_own(kernels):
    kernels_of_module = kernels()[2].py_func.__globals__
    assert kernels_of_module["powers"](2.0, 4) == 28.0
    assert len(kernels_of_module["power"].overloads) == 1


@pytest.mark.further
def test_a_helper_from_the_disk_is_lowered_anew_inside_a_kernel(kernels):
    """What stands in a kernel must not depend on what was compiled before it."""
    helper, _, outer = kernels()
    helper(X)
    helper, _, outer = kernels()
    assert helper(X) == 3.0 and sum(helper.stats.cache_hits.values()) == 1
    assert outer(X) == 9.0 and helper(X) == 3.0


def test_a_helpers_exception_comes_out(kernels):
    _, _, outer = kernels()
    with pytest.raises(ValueError, match="too many"):
        outer(np.zeros(200))


@pytest.mark.further
def test_levels_of_optimisation_are_the_kernels_own_and_never_above_what_is_asked_for(kernels, monkeypatch):
    """numba's is what it was, for whatever else is compiled; NUMBA_OPT=0 is for who looks for a mistake."""
    before, seen, builder = config.OPT, [], Codegen._pass_builder

    def noted(codegen, **given):
        seen.append(given.get("opt", config.OPT))
        return builder(codegen, **given)

    monkeypatch.setattr(Codegen, "_pass_builder", noted)
    assert kernels()[2](X) == 9.0
    assert {int(level) for level in seen} == {0, 1, 2} and config.OPT is before
    monkeypatch.setattr(config, "OPT", type(before)(0))
    seen.clear()
    assert kernels()[0](np.arange(5)) == 3.0 and {int(level) for level in seen} == {0}


@pytest.mark.further
def test_numbas_own_functions_call_kernels_and_share_its_library(kernels):
    _, _, outer = kernels()

    @njit
    def foreign(x):
        return outer(x) + np.median(x)  # numba's median may have been lowered within the kernel

    outer(X)
    assert foreign(X) == 11.0


@pytest.mark.further
def test_two_processes_compile_a_kernel_once(kernels, tmp_path):
    """The second waits for the first, then loads what that one has kept."""
    kernels()
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import numpy as np, kernels; "
        "print(kernels.outer(np.arange(5.0)), sum(kernels.outer.stats.cache_misses.values()))"
    )
    both = [
        subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True, cwd=ROOT)
        for _ in range(2)
    ]
    said = sorted(process.communicate(timeout=120)[0].split() for process in both)
    assert said == [["9.0", "0"], ["9.0", "1"]]


def test_flags_that_no_code_depends_on_make_no_version_of_their_own():
    """numba would lower `numpy.empty` for the outermost kernel, for those inside and for its own functions."""
    outermost, inside = KernelFlags(), KernelFlags()
    inside.no_cpython_wrapper, inside.release_gil = True, True
    assert outermost == inside and hash(outermost) == hash(inside)
    inside.fastmath = True
    assert outermost != inside
