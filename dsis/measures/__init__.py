"""Statistics of recordings that effects contribute to and diagnosis compares.

`measure_exposure` streams the frames of one exposure, `measure` takes a stack of one channel; the
scalar measures and their units are `MEASURES`, the arrays behind them are in `Channel`.
"""

from dsis.measures.accumulator import Accumulator, measure_exposure
from dsis.measures.codes import Codes, Lattice, Middle
from dsis.measures.estimate import Estimate
from dsis.measures.measured import Channel, Measured
from dsis.measures.pairs import PairVariance
from dsis.measures.response import Response, response
from dsis.measures.stack import measure, measure_channels
from dsis.measures.vocabulary import MEASURES

__all__ = [
    "MEASURES",
    "Accumulator",
    "Channel",
    "Codes",
    "Estimate",
    "Lattice",
    "Measured",
    "Middle",
    "PairVariance",
    "Response",
    "measure",
    "measure_channels",
    "measure_exposure",
    "response",
]
