"""Offsets of a dark's mean frame that no other exposure repeats: they are not fixed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import SMOOTH_DEGREE, beyond_smooth
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
_ACROSS = {"row_fpn": 1, "column_fpn": 0}
OFFSETS = frozenset({"dsnu", *_ACROSS})
_MOST = 0.5  # of a pattern, that others must repeat
_SURE = 4.0  # standard errors
_FAR_OUT = 6.0  # standard deviations: hot pixels grow with time, and are no offsets
_NORMAL = 1.4826  # standard deviations of a median absolute deviation
_DARK = "dark"


@dataclass(frozen=True)
class Repeated:
    """How much of the offsets of one dark others have.

    Attributes
    ----------
    pattern
        Variance of the dark's offsets beyond the noise of its mean frame, DN^2.
    shared
        Covariance of them with those of the other exposures, DN^2.
    error
        Standard error of half of the former less the latter, DN^2.
    """

    pattern: float
    shared: float
    error: float

    @property
    def denial(self) -> Denial | None:
        """How fixed offsets are denied; None: they are not."""
        if _MOST * self.pattern - self.shared < _SURE * self.error:
            return None
        why = "the pattern of darks is new in each exposure"
        return Denial(max(self.shared / self.pattern, 0.0), why)


def repeats_of(layout: Layout, frames_of: FramesOf) -> Mapping[str, Repeated]:
    """Return how far the offsets of the shortest dark are repeated by other darks and by flats.

    Of each kind of offsets: of pixels, beyond what lines have; of rows; of columns. What is fixed
    has in each pair of mean frames the covariance that is its variance in the one: gains of pixels,
    light and noise add to the error alone. A camera that takes off a dark frame of its own before
    each series, say, leaves a pattern in each, new each time. Nothing of a large recording, and of
    one without darks.
    """
    darks = [e for e in layout.uniform if e.kind == _DARK]
    if layout.large or not darks:
        return {}
    first = min(darks, key=lambda e: (e.exposure_time_s, -len(e.numbers)))
    means = {e.name: _mean(layout, frames_of, e) for e in layout.uniform}
    found = {}
    for kind in sorted(OFFSETS):
        own = _repeated(layout, kind, means, first)
        if own is not None:
            found[kind] = own
    return found


@dataclass(frozen=True)
class _Mean:
    """A mean frame (row, column), DN, and by kind and colour the variance of one of its offsets."""

    image: Array
    variance: Mapping[tuple[str, tuple[int, int]], float]


def _mean(layout: Layout, frames_of: FramesOf, exposure: Taken) -> _Mean:
    """Return the mean of an exposure's frames, and how its offsets scatter by these.

    Of lines by what each has beside its frame: noise of lines is in it.
    """
    step = 1 if len(layout.sites) == 1 else 2
    total = np.zeros((layout.rows, layout.columns))
    offsets: dict[tuple[str, tuple[int, int]], list[Array]] = {}
    square = np.zeros_like(total)
    for frame in frames_of(exposure.name):
        own = np.asarray(frame, np.float64)
        total += own
        square += own**2
        for y, x in layout.sites.values():
            plane = own[y::step, x::step]
            for kind, across in _ACROSS.items():
                offsets.setdefault((kind, (y, x)), []).append(plane.mean(across) - plane.mean())
    count = len(exposure.numbers)
    image = total / count
    spread = (square - count * image**2) / max(count - 1, 1)
    found = {
        key: float(np.var(own, axis=0, ddof=1).mean()) / count if count > 1 else np.inf
        for key, own in offsets.items()
    }
    for y, x in layout.sites.values():
        found["dsnu", (y, x)] = float(spread[y::step, x::step].mean()) / count
    return _Mean(image, found)


def _repeated(
    layout: Layout, kind: str, means: Mapping[str, _Mean], first: Taken
) -> Repeated | None:
    step = 1 if len(layout.sites) == 1 else 2
    pattern = shared = weight = 0.0
    for channel, (y, x) in layout.sites.items():
        own = {
            name: _beyond(kind, one.image[y::step, x::step])
            for name, one in means.items()
            if name == first.name or (name, channel) not in layout.full | layout.still
        }
        ours = own.pop(first.name)
        near = np.abs(ours) <= _FAR_OUT * _NORMAL * np.median(np.abs(ours))
        size = int(near.sum())
        if not own or not size:
            return None
        square = float((ours[near] ** 2).mean())
        # Of lines less what a smooth curve has of their noise.
        left = 1 - (SMOOTH_DEGREE + 1) / ours.size if kind in _ACROSS else 1.0
        variance = square - left * means[first.name].variance[kind, (y, x)]
        products = [
            (float((ours * other)[near].mean()), square * float((other[near] ** 2).mean()) / size)
            for other in own.values()
        ]
        inverse = sum(1 / max(v, 1e-300) for _, v in products)
        covariance = sum(c / max(v, 1e-300) for c, v in products) / inverse
        one = 2 * square**2 / size * _MOST**2 + 1 / inverse
        pattern += variance / one
        shared += covariance / one
        weight += 1 / one
    return Repeated(pattern / weight, shared / weight, weight**-0.5) if weight else None


def _beyond(kind: str, plane: Array) -> Array:
    """Return the deviations of pixels from the means of their lines; or those of lines."""
    if (across := _ACROSS.get(kind)) is not None:
        return beyond_smooth(plane.mean(across))
    rest = plane - plane.mean(1, keepdims=True)
    return np.asarray(rest - rest.mean(0, keepdims=True))
