"""Measures of a stack of frames in memory."""

from typing import Any

from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.measures.accumulator import measure_exposure
from dsis.measures.estimate import Estimate


def measure(stack: NDArray[Any], cfa: Cfa = Cfa.MONO) -> dict[str, Estimate]:
    """Return every scalar measure of a stack (frame, row, column) of one channel, DN above black.

    Needs two frames, rows and columns at least; a mosaic with filters needs `measure_channels`.
    """
    if cfa is not Cfa.MONO:
        message = f"measure takes one channel, a {cfa} mosaic has four: use measure_channels"
        raise ValueError(message)
    return measure_channels(stack, cfa)["MONO"]


def measure_channels(stack: NDArray[Any], cfa: Cfa) -> dict[str, dict[str, Estimate]]:
    """Return every scalar measure by channel (MONO, or R Gr Gb B) of a stack of mosaics.

    Stack (frame, row, column), DN above black; `measure_exposure` streams and gives the arrays.
    """
    return measure_exposure(stack, cfa, lowest_code=None).estimates()
