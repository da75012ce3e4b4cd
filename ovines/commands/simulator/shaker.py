"""`ovines shaker`: what a shaker's limits leave at a frequency, the amplitude there, and the radii that go with it."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from ovines.core import ScenarioError
from ovines.core.system.shaker import (
    ShakerLimits,
    acceleration_of,
    amplitude_of,
    best_amplitude,
    clearance,
    host_radius_for,
)
from ovines.errors import InputError
from ovines.pipeline.ownership import refuse_theirs

NAME = "shaker"
HELP = "Design a test: a shaker's limits, the amplitude of an excitation, radii of Host and NES that go with it."
PICTURES = ("shaker.png", "shaker.svg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Excitation, limits of the shaker, radii, folder for the figure."""
    parser.description = HELP
    parser.add_argument("--frequency-hz", type=float, required=True, help="frequency of the excitation")
    parser.add_argument("--acceleration-g", type=float, required=True, help="its peak acceleration, in g")
    parser.add_argument("--travel-m", type=float, default=math.inf, help="limit: peak displacement from the middle")
    parser.add_argument("--velocity-m-per-s", type=float, default=math.inf, help="limit: peak velocity")
    parser.add_argument("--most-acceleration-g", type=float, default=math.inf, help="limit: peak acceleration, in g")
    parser.add_argument("--host-radius-m", type=float, help="inner radius of the Host (default: the best one)")
    parser.add_argument("--nes-radius-m", type=float, help="radius of the NES (default: --ratio of the Host's)")
    parser.add_argument("--ratio", type=float, default=0.2, help="radius of the NES over the Host's (default: 0.2)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="also draw the limits there (shaker.png, shaker.svg)")


def run(args: argparse.Namespace) -> int:
    """Print the design, draw it where asked; wrong numbers are an `InputError`."""
    try:
        return design(args)
    except ScenarioError as error:
        raise InputError(error.found, error.expected, error.do) from None


def design(args: argparse.Namespace) -> int:
    """The lines of the design, and its figure."""
    limits = ShakerLimits(args.travel_m, args.velocity_m_per_s, args.most_acceleration_g)
    amplitude = amplitude_of(args.acceleration_g, args.frequency_hz)
    which, most_g = limits.narrowest(args.frequency_hz)
    asked = f"{args.acceleration_g:g} g at {args.frequency_hz:g} Hz"
    print(f"{asked}: amplitude {1e3 * amplitude:.4g} mm, {amplitude * 2 * math.pi * args.frequency_hz:.4g} m/s")
    if math.isfinite(most_g):
        held = "within" if args.acceleration_g <= most_g else "BEYOND"
        print(f"{held} the shaker: at {args.frequency_hz:g} Hz its {which} leaves {most_g:.4g} g")
    host_best = host_radius_for(amplitude, args.ratio)
    print(
        f"best radii for that amplitude: Host {1e3 * host_best:.4g} mm, NES {1e3 * args.ratio * host_best:.4g} mm "
        "(amplitude = clearance/pi)"
    )
    host = host_best if args.host_radius_m is None else args.host_radius_m
    nes = args.ratio * host if args.nes_radius_m is None else args.nes_radius_m
    best = best_amplitude(host, nes)
    print(
        f"Host {1e3 * host:.4g} mm, NES {1e3 * nes:.4g} mm: clearance {1e3 * clearance(host, nes):.4g} mm, best "
        f"amplitude {1e3 * best:.4g} mm = {acceleration_of(best, args.frequency_hz):.4g} g; "
        f"asked for {amplitude / best:.3g} of it"
    )
    if args.out is not None:
        refuse_theirs(args.out, PICTURES)
        from analysis.figures.style import save_figure
        from analysis.simulations.shaker_figure import shaker_figure

        figure = shaker_figure(limits, args.frequency_hz, args.acceleration_g, best)
        args.out.mkdir(parents=True, exist_ok=True)
        for name in PICTURES:
            print(save_figure(figure, args.out / name))
    return 0
