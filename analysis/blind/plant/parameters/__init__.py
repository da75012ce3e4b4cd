"""Every number of the plant's physics, SI: of a flight, then of the wall.  The neutral value switches a cause off."""

from collections import namedtuple
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, ClassVar

from analysis.blind.plant.parameters.of_flight import FlightParameters
from analysis.blind.plant.parameters.of_wall import WallParameters

if TYPE_CHECKING:

    @dataclass(frozen=True)
    class PlantParameters(WallParameters, FlightParameters):
        """Physics of one run."""

        _fields: ClassVar[tuple[str, ...]]

        def _replace(self, **numbers: float) -> "PlantParameters":
            """The same but for these."""

else:  # compiled code takes a tuple by name, which no class can inherit the names of
    _NUMBERS = (*fields(FlightParameters), *fields(WallParameters))
    PlantParameters = namedtuple(
        "PlantParameters", [number.name for number in _NUMBERS], defaults=[number.default for number in _NUMBERS]
    )
    PlantParameters.__doc__ = "Physics of one run."
