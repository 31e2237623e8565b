"""What the maps of a mosaic's channels have in common: lines and surfaces across all colours.

A row of the sensor crosses two channels, a surface all four: each channel sees it by itself, their
mean, weighted by the inverse variance of its noise, sees it best.
"""

from collections.abc import Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.edges import names as edge_names
from analysis.mismatch.bank.parts import OUTLYING, Parts, root_of, sure_of_lines
from analysis.mismatch.bank.patches import patches
from analysis.mismatch.bank.scalars import Number, ratio_root
from analysis.mismatch.bank.seams import WHOLE
from analysis.mismatch.bank.surfaces import slopes, surfaces
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
TOGETHER = "all channels"
_AXES = ("rows", "columns")
_STEPS = (
    *(f"half_seam of {axis}{part}" for axis in _AXES for part in ("", f", {WHOLE}")),
    *(name for axis in _AXES for name in edge_names(axis)),
)


def together(
    parts: Mapping[str, Parts],
    sharpness: Mapping[str, float],
    sites: Mapping[str, tuple[int, int]],
) -> dict[str, Number]:
    """Return the numbers of lines and surfaces that channels share, and of pixels that stand out.

    Parameters
    ----------
    parts
        A map's parts by channel, in units of its noise.
    sharpness
        By channel: what is common (an offset in DN, a relative gain) in units of a map's noise.
    sites
        First row and column of each channel.
    """
    names = list(parts)
    squares = [parts[name].square for name in names]
    square = sum(squares) / len(squares)
    sizes = {name: parts[name].pixels.shape for name in names}
    dof = sum((n - 1) * (m - 1) for n, m in sizes.values())
    found = {}
    lines = {}
    for axis, label in ((0, "fixed_row_variance"), (1, "fixed_column_variance")):
        top = bottom = 0.0
        for side in (0, 1):
            own = [name for name in names if sites[name][axis] == side]
            means = [parts[name].rows if axis == 0 else parts[name].columns for name in own]
            # A mean over a line has the noise of a pixel over the root of the line's length.
            moved = _mean(means, [sharpness[name] for name in own])
            degree = len(parts[own[0]].coefficients) - 1
            across = sum(sizes[name][1 - axis] for name in own) / len(own)
            top += across * float(moved.dot(moved))
            bottom += moved.size - 1 - degree
        lines[axis] = sure_of_lines(top / bottom, square, bottom)
        found[f"{label} of {TOGETHER}"] = ratio_root(top / bottom / square, bottom, dof)
    sharp = [sharpness[name] for name in names]
    norm = _norm(sharp)
    numbers = [parts[name].numbers for name in names]
    for one in _STEPS:
        size = sum(w * own[one][0] for w, own in zip(sharp, numbers, strict=True))
        found[f"{one}, {TOGETHER}"] = (float(size / norm), 1.0)
    for name, number in patches(*shared_pixels(list(parts.values()), sharp)).items():
        found[_shared(name)] = number
    for one in OUTLYING:
        halves = [own[one][0] / 2 for own in numbers]
        count = sum(half * half - 3 / 8 for half in halves)
        found[f"{one}, {TOGETHER}"] = (root_of(count), 1.0)
    least = min(len(parts[name].coefficients) for name in names)
    surface = _mean([parts[name].coefficients[:least, :least] for name in names], sharp)
    squares_too = (lines[0], lines[1], square)
    shape = sizes[names[0]]
    common = {**surfaces(surface, squares_too, dof), **slopes(surface, squares_too, shape)}
    for name, number in common.items():
        found[_shared(name)] = number
    return found


def _shared(name: str) -> str:
    """Return the name of a number that channels share: `parity of rows, all channels`."""
    return f"{name}, {TOGETHER}" if " of " in name else f"{name} of {TOGETHER}"


def shared_pixels(parts: Sequence[Parts], sharpness: Sequence[float]) -> tuple[Array, float]:
    """Return the pixels of the map that channels share, and their mean square, unbiased.

    Of as many rows and columns as all have; see `together`.
    """
    rows, columns = (min(own.pixels.shape[axis] for own in parts) for axis in (0, 1))
    pixels = _mean([own.pixels[:rows, :columns] for own in parts], sharpness)
    dof = (rows - 1) * (columns - 1) - Smooth.of(rows, columns).kinds
    return pixels, float((pixels**2).sum()) / dof


def _mean(values: Sequence[Array], sharpness: Sequence[float]) -> Array:
    """Return the best mean of values, each of noise 1, in units of its own noise."""
    size = min(len(v) for v in values)
    total = np.zeros(values[0][:size].shape)
    for value, weight in zip(values, sharpness, strict=True):
        total += weight * value[:size]
    total /= _norm(sharpness)
    return total


def _norm(sharpness: Sequence[float]) -> float:
    return sqrt(sum(w**2 for w in sharpness))
