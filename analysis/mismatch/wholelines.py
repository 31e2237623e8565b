"""Rows and columns that differ in a part of their length only: what lies there is no line's."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_MAPS = {"row_fpn": "offset", "column_fpn": "offset", "row_prnu": "gain", "column_prnu": "gain"}
_PARTS = 12  # of a line: of each half of them the middle ones are asked
_LEAST_PIXELS = 4  # of a part
_SURE = 2.0  # standard errors
_MOST = 0.5  # of the lines' variance, that parts of them may make


def of_parts(state: State, kind: str) -> Denial | None:
    """Return how lines that differ are denied by parts of them that do; None: they are not.

    An offset or a gain of a line is that of each of its parts. Patches, blots and edges are not:
    they move the mean of a line, and few of its parts. So the median of every other part and that
    of the rest covary by the variance of lines, whatever their noise, and by none of what is in
    less than half of the parts. Where that is less than half of what means of lines have, for sure,
    something else makes these differ. So it does where lines that lie beside one another in a
    channel are alike: those of lines are drawn for each by itself.
    """
    if kind not in _MAPS:
        return None
    axis = int(kind.startswith("column"))
    images = _images(state, _MAPS[kind])
    products, beside, whole, lines = [], [], 0.0, 0
    for image, noise in images.values():
        across = image if axis else image.T  # (along the line, line)
        if len(across) < _PARTS * _LEAST_PIXELS:
            return None
        means = beyond_smooth(across.mean(0)) / noise
        parts = [beyond_smooth(part.mean(0)) / noise for part in np.array_split(across, _PARTS)]
        every, other = np.median(parts[::2], 0), np.median(parts[1::2], 0)
        products.append(every * other)
        beside.append(means[1:] * means[:-1])
        single = typical_square(np.diff(across, axis=0)) / 2 / noise**2  # of pixels by themselves
        whole += float((means**2).sum()) - single * means.size / len(across)
        lines += means.size
    if not products or whole <= 0:
        return None
    own, near = np.concatenate(products), np.concatenate(beside)
    name = "columns" if axis else "rows"
    alike = float(near.sum()) - _SURE * float(near.std()) * near.size**0.5
    if alike > _MOST * whole:
        return Denial(
            max(1 - float(near.sum()) / whole, 0.0), f"{name} differ as their neighbours do"
        )
    seen = float(own.sum()) + _SURE * float(own.std()) * lines**0.5
    if seen >= _MOST * whole:
        return None
    why = f"most of what {name} differ by lies in few parts of them"
    return Denial(max(float(own.sum()) / whole, 0.0), why)


def _images(state: State, name: str) -> Mapping[str, tuple[Array, float]]:
    """Return a map by channel, with its noise: the one that knows of no other, if it is there."""
    images = state.setting.seen.images
    found = {c: one for (c, kind), one in images.items() if kind == name}
    return found or {c: one for (c, kind), one in images.items() if kind == f"{name} alone"}
