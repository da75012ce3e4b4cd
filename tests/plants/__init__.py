"""Rigs whose laws are not ours: a third simulator, apart from `ovines.core`, `analysis.flights.equation.model` and
`analysis.blind`.

Shares no law with any of them, and with the core only how it is compiled.  ``draw_rig`` draws a rig of any size at any
place under a law of flight (:data:`laws.LAWS`), ``make_run`` one recording of it, ``make_recording`` both at once,
``write_series`` the folder that ``ovines`` reads.
"""

from tests.plants.laws import LAWS
from tests.plants.recording import Run, make_recording, make_run, make_series, write_series
from tests.plants.rig import Rig, Spec, draw_rig

__all__ = ["LAWS", "Rig", "Run", "Spec", "draw_rig", "make_recording", "make_run", "make_series", "write_series"]
