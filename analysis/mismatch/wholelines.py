"""Rows and columns that differ in a part of their length only: what lies there is no line's."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
Images = Mapping[str, tuple[Array, float]]
_MAPS = {"row_fpn": "offset", "column_fpn": "offset", "row_prnu": "gain", "column_prnu": "gain"}
_PARTS, _FEWEST = 12, 6  # of a line: of each half of them the middle ones are asked
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
    channel are alike: those of lines are drawn for each by itself. Asked is a map of offsets beside
    gains, say; where it says nothing for sure, that as if there were no gain, which is less noisy.
    """
    if kind not in _MAPS:
        return None
    for images in _images(state, _MAPS[kind]):
        said = _told(images, int(kind.startswith("column")))
        if said is not None:
            return said if isinstance(said, Denial) else None
    return None


def _told(images: Images, axis: int) -> Denial | bool | None:
    """Return how maps of channels deny lines; True: all parts have them for sure; None: neither."""
    products, beside, whole, lines = [], [], 0.0, 0
    for image, noise in images.values():
        across = image if axis else image.T  # (along the line, line)
        count = min(len(across) // _LEAST_PIXELS, _PARTS)
        if count < _FEWEST:
            return None
        means = beyond_smooth(across.mean(0)) / noise
        parts = [beyond_smooth(part.mean(0)) / noise for part in np.array_split(across, count)]
        every, other = np.median(parts[::2], 0), np.median(parts[1::2], 0)
        products.append(every * other)
        beside.append(means[1:] * means[:-1])
        single = typical_square(np.diff(across, axis=0)) / 2 / noise**2  # of pixels by themselves
        whole += float((means**2).sum()) - single * means.size / len(across)
        lines += means.size
    if whole <= 0:
        return None
    own, near = np.concatenate(products), np.concatenate(beside)
    name = "columns" if axis else "rows"
    alike = float(near.sum()) - _SURE * float(near.std()) * near.size**0.5
    if alike > _MOST * whole:
        why = f"{name} differ as their neighbours do"
        return Denial(max(1 - float(near.sum()) / whole, 0.0), why)
    seen, error = float(own.sum()), _SURE * float(own.std()) * lines**0.5
    if seen + error >= _MOST * whole:
        return seen > error or None
    why = f"most of what {name} differ by lies in few parts of them"
    return Denial(max(seen / whole, 0.0), why)


def _images(state: State, name: str) -> tuple[Images, Images]:
    """Return two maps by channel, with their noise: one beside the other kind's, one alone."""
    images = state.setting.seen.images
    beside, alone = (
        {c: one for (c, kind), one in images.items() if kind == own}
        for own in (name, f"{name} alone")
    )
    return beside, alone
