"""Means of whole lines of a sensor: what is fixed in each, and how far it moves between frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth
from dsis.measures import Channel

Array = NDArray[np.float64]
Axis = Literal["row", "column"]
AXES: tuple[Axis, ...] = ("row", "column")
PARTS = 12  # of a frame along an axis: they show waves of some cycles


@dataclass(frozen=True, eq=False)
class LineMeans:
    """The rows, or columns, of one exposure.

    Attributes
    ----------
    frames
        How many.
    means
        Mean of each line over all frames, about that of all lines of its colours: (line,), DN.
    fixed
        The same beyond what is smooth across lines.
    moving
        Variance of each line's mean from frame to frame, what all lines have in common taken off:
        (line,), DN^2, of `frames` - 1 degrees of freedom.
    noise_dn2
        What the noise of single pixels makes of that variance.
    parts
        Means of parts of each frame, lines side by side: (frame, part), DN.
    """

    frames: int
    means: Array
    fixed: Array
    moving: Array
    noise_dn2: float
    parts: Array


def line_means(
    channels: Mapping[str, Channel],
    sites: Mapping[str, tuple[int, int]],
    shape: tuple[int, int],
    frames: int,
    axis: Axis,
) -> LineMeans:
    """Return the lines of a sensor of a shape, from the channels that share them.

    `sites` are the first row and column of each channel.
    """
    along = AXES.index(axis)
    step = 1 if len(sites) == 1 else 2
    means, fixed, moving = np.zeros((3, shape[along]))
    noise = []
    lines = np.zeros((frames, shape[along]))
    for first in range(step):
        own = [channels[c] for c, site in sites.items() if site[along] == first or step == 1]
        pixels = [one.mean_frame.shape[1 - along] for one in own]
        series = sum(
            (one.row_means if along == 0 else one.column_means) * n
            for one, n in zip(own, pixels, strict=True)
        ) / sum(pixels)
        lines[:, first::step] = series
        series = series - series.mean(1, keepdims=True)
        mean = series.mean(0)
        means[first::step] = mean
        fixed[first::step] = beyond_smooth(mean)
        moving[first::step] = ((series - mean) ** 2).sum(0) / (frames - 1)
        variances = [one.estimates["pixel_variance"].value for one in own]
        noise.append(sum(v * n for v, n in zip(variances, pixels, strict=True)) / sum(pixels) ** 2)
    ends = np.arange(PARTS + 1) * shape[along] // PARTS
    each = zip(ends[:-1], np.maximum(ends[1:], ends[:-1] + 1), strict=True)  # of few lines one
    parts = np.stack([lines[:, first:last].mean(1) for first, last in each], 1)
    return LineMeans(frames, means, fixed, moving, float(np.mean(noise)), parts)
