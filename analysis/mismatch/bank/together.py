"""What the maps of a mosaic's channels have in common: lines and surfaces across all colours.

A row of the sensor crosses two channels, a surface all four: each channel sees it by itself, their
mean, weighted by the inverse variance of its noise, sees it best.
"""

from collections.abc import Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.edges import names as edge_names
from analysis.mismatch.bank.parts import STANDING_OUT, Parts, counted, rooted, sure_of_lines
from analysis.mismatch.bank.patches import patches
from analysis.mismatch.bank.scalars import Number, ratio_root
from analysis.mismatch.bank.seams import WHOLE
from analysis.mismatch.bank.surfaces import slopes, surfaces
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
TOGETHER = "all channels"


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
    square = float(np.mean(squares))
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
            across = float(np.mean([sizes[name][1 - axis] for name in own]))
            top += across * float(moved @ moved)
            bottom += moved.size - 1 - degree
        lines[axis] = sure_of_lines(top / bottom, square, bottom)
        found[f"{label} of {TOGETHER}"] = ratio_root(top / bottom / square, bottom, dof)
    axes = ("rows", "columns")
    steps = [f"half_seam of {axis}{part}" for axis in axes for part in ("", f", {WHOLE}")]
    for one in (*steps, *(name for axis in axes for name in edge_names(axis))):
        values = [np.array([parts[n].numbers[one][0]]) for n in names]
        size = float(_mean(values, [sharpness[n] for n in names])[0])
        found[f"{one}, {TOGETHER}"] = (size, 1.0)
    for name, number in _patches(list(parts.values()), [sharpness[n] for n in names]).items():
        found[f"{name}, {TOGETHER}"] = number
    for one in (f"outlying_pixels of {limit:g}" for limit in STANDING_OUT):
        roots = np.array([parts[n].numbers[one][0] for n in names])
        found[f"{one}, {TOGETHER}"] = (float(rooted(counted(roots).sum())), 1.0)
    least = min(len(parts[name].coefficients) for name in names)
    surface = _mean(
        [parts[name].coefficients[:least, :least] for name in names],
        [sharpness[name] for name in names],
    )
    squares_too = (lines[0], lines[1], square)
    shape = sizes[names[0]]
    common = {**surfaces(surface, squares_too, dof), **slopes(surface, squares_too, shape)}
    for name, number in common.items():
        joined = name.replace(" of ", ", ", 1) if " of " in name else name
        statistic, _, order = joined.partition(", ")
        detail = f"{order}, {TOGETHER}" if order else TOGETHER
        found[f"{statistic} of {detail}"] = number
    return found


def _patches(parts: Sequence[Parts], sharpness: Sequence[float]) -> dict[str, Number]:
    """Return the numbers of patches that channels share."""
    rows, columns = np.min([own.pixels.shape for own in parts], axis=0)
    pixels = _mean([own.pixels[:rows, :columns] for own in parts], sharpness)
    dof = (rows - 1) * (columns - 1) - Smooth.of(rows, columns).kinds
    return patches(pixels, float((pixels**2).sum()) / dof)


def _mean(values: Sequence[Array], sharpness: Sequence[float]) -> Array:
    """Return the best mean of values, each of noise 1, in units of its own noise."""
    size = min(len(v) for v in values)
    total = sum(
        (w * v[:size] for v, w in zip(values, sharpness, strict=True)),
        np.zeros_like(values[0][:size]),
    )
    return np.asarray(total / sqrt(sum(w**2 for w in sharpness)))
