"""What no linter here asks of the code's form: stated tolerances, few arguments, and what runs by default."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from types import SimpleNamespace

from tests.conftest import TURNS, without_further
from tests.sources import PACKAGES, ROOT, trees

COMPARISONS, TOLERANCES = ("allclose", "assert_allclose", "isclose"), {"rtol", "atol", "rel_tol", "abs_tol"}
MOST_PARAMETERS = 8
LEFT_OUT = ("pytest.mark.further", "pytest.mark.long")


def without_tolerance(tree: ast.Module) -> Iterator[int]:
    """Lines of comparisons of numbers that leave the tolerance to the library's default."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in COMPARISONS and not {keyword.arg for keyword in node.keywords} & TOLERANCES:
                yield node.lineno


def parameters(function: ast.FunctionDef) -> int:
    every = [one.arg for one in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return len(every) - (every[:1] in (["self"], ["cls"]))


def test_every_comparison_states_its_tolerance():
    assert list(without_tolerance(ast.parse("np.allclose(a, b)\nnp.allclose(a, b, rtol=1e-5)"))) == [1]
    every = [one for top in (*PACKAGES, "tests", "benchmarks") for one in trees(top, COMPARISONS).items()]
    assert [f"{path.relative_to(ROOT)}:{line}" for path, tree in every for line in without_tolerance(tree)] == []


def test_no_function_takes_many_parameters():
    assert parameters(ast.parse("class A:\n    def f(self, a, b=0, *, c): ...").body[0].body[0]) == 3  # type: ignore
    functions = (node for top in PACKAGES for tree in trees(top).values() for node in ast.walk(tree))
    counts = [(node.name, parameters(node)) for node in functions if isinstance(node, ast.FunctionDef)]
    assert [(name, count) for name, count in counts if count > MOST_PARAMETERS] == []


def test_of_further_cases_the_whole_suite_takes_the_first():
    def item(name: str, *marks: str) -> SimpleNamespace:
        return SimpleNamespace(nodeid=name, get_closest_marker=lambda mark: mark if mark in marks else None)

    items = [
        *(item(f"a.py::one[{case}]", "others_further") for case in range(3)), item("a.py::two", "further"),
        item("b.py::one[0]", "others_further"), *(item(f"b.py::two[{case}]") for case in range(2)),
    ]  # fmt: skip
    left = [one.nodeid for one in without_further(items)[1]]  # type: ignore
    assert left == ["a.py::one[1]", "a.py::one[2]", "a.py::two"]
    asked = [[one.nodeid for one in without_further(items, turn)[0]] for turn in range(TURNS)]  # type: ignore
    assert sorted(one for some in asked for one in some if one in left) == left  # each has its turn, and one
    assert without_further(items, 3 + TURNS) == without_further(items, 3)  # type: ignore


def test_every_file_of_tests_asks_something_by_default():
    """Further cases stand beside one that the whole suite runs; but for two files of what takes minutes."""
    silent = []
    for path, tree in trees("tests", LEFT_OUT).items():
        asked = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name.startswith("test_")]
        if asked and all(any(mark in LEFT_OUT for mark in map(ast.unparse, one.decorator_list)) for one in asked):
            silent.append(path.name)
    assert silent == ["test_coverage.py", "test_calibrate_real.py"]
