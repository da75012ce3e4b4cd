"""Figures of one simulated run: paths, coordinates, velocities, impacts, energies, and what the thesis plots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from matplotlib.figure import Figure

from analysis.figures.style import save_figure
from analysis.simulations.energy_figure import energies
from analysis.simulations.floor_figure import floor_friction
from analysis.simulations.impact_figures import impacts, rebound_heights, rebound_heights_m
from analysis.simulations.motion_figures import coordinates, paths, velocities
from ovines.core import SimulationResult


def make_run_figures(result: SimulationResult, folder: Path) -> list[Path]:
    """Every figure that this run has something for, PNG and SVG, in ``folder``; returns their paths.

    ``result`` of ``simulate(..., with_energies=True)``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    return [
        save_figure(figure, folder / f"{name}.{ending}")
        for name, figure in figures(result)
        for ending in ("png", "svg")
    ]


def figures(result: SimulationResult) -> Iterator[tuple[str, Figure]]:
    """Name and figure, one after the other."""
    everywhere: tuple[Callable[[SimulationResult], Figure], ...] = (paths, coordinates, velocities, energies)
    for make in everywhere:
        yield make.__name__, make(result)
    if len(result.impacts):
        yield "impacts", impacts(result)
    if len(rebound_heights_m(result)) > 1:
        yield "rebound_heights", rebound_heights(result)
    if result.scenario.friction is not None:
        yield "floor_friction", floor_friction(result)


def names() -> list[str]:
    """File names that :func:`make_run_figures` may write."""
    every = ("paths", "coordinates", "velocities", "energies", "impacts", "rebound_heights", "floor_friction")
    return [f"{name}.{ending}" for name in every for ending in ("png", "svg")]
