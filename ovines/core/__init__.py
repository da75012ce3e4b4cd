"""The core simulator: a disk in a moving container; next contact, move to it, resolve it."""

from ovines.core.energies import EnergyBalance
from ovines.core.ensemble import EnsembleResult, Workers, simulate_ensemble
from ovines.core.refusal import ScenarioError
from ovines.core.simulate import SimulationResult, simulate
from ovines.core.system.model import FloorFriction, Harmonic, Host, ImpactLaw, MeasuredMotion, Nes, Scenario, Suspension

__all__ = [
    "EnergyBalance",
    "EnsembleResult",
    "FloorFriction",
    "Harmonic",
    "Host",
    "ImpactLaw",
    "MeasuredMotion",
    "Nes",
    "Scenario",
    "ScenarioError",
    "SimulationResult",
    "Suspension",
    "Workers",
    "simulate",
    "simulate_ensemble",
]
