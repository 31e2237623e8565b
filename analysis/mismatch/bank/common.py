"""What the channels of a mosaic have in common: frames and lines that move in all colours.

Each channel measures a common offset by itself; their mean, weighted by the inverse variance of
white noise, measures it best. A mean square of 1 is white noise.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import UNKNOWN, Number, ratio_root
from dsis.compiled import kernel, pairwise_sum
from dsis.measures import Channel

Array = NDArray[np.float64]
SIGNS: Mapping[str, Callable[[int, int], int]] = {
    "checkerboard": lambda y, x: (y + x) % 2,
    "rows": lambda y, _x: y % 2,
    "columns": lambda _y, x: x % 2,
}
COMMON = (
    "row_variance",
    "column_variance",
    "frame_variance",
    "frame_variance of light",
    *(f"alternation_variance of {name}" for name in SIGNS),
)


def common(
    channels: Mapping[str, Channel],
    signal_dn: Mapping[str, float],
    frames: int,
    sites: Mapping[str, tuple[int, int]],
) -> dict[str, Number]:
    """Return the numbers `COMMON` of one exposure of a mosaic.

    Parameters
    ----------
    channels
        As measured.
    signal_dn
        Signal of each channel, DN above black: light that flickers moves it in proportion.
    frames
        Number of frames.
    sites
        First row and column of each channel.
    """
    pixel = {name: c.estimates["pixel_variance"].value for name, c in channels.items()}
    if not all(value > 0 for value in pixel.values()):
        return dict.fromkeys(COMMON, UNKNOWN)
    rows = _lines(channels, pixel, {name: y for name, (y, _) in sites.items()}, 0, frames)
    columns = _lines(channels, pixel, {name: x for name, (_, x) in sites.items()}, 1, frames)
    # Rows and columns that move carry the frame's mean along.
    still = max(rows[0] + columns[0] - 1, 1.0)
    shapes = {"frame_variance": (1.0,) * len(channels)}
    # What alternates from site to site is constant in every plane, but for its sign.
    for name, odd in SIGNS.items():
        signs = tuple(1.0 - 2.0 * odd(*sites[channel]) for channel in channels)
        shapes[f"alternation_variance of {name}"] = signs
    if all(value > 0 for value in signal_dn.values()):
        top = max(signal_dn.values())
        shapes["frame_variance of light"] = tuple(signal_dn[name] / top for name in channels)
    moved = np.array([c.frame_means for c in channels.values()])
    pixels = [(c.mean_frame.size, pixel[name]) for name, c in channels.items()]
    squares = _frames(moved, np.array(pixels), np.array(list(shapes.values()))).tolist()
    along = dict(zip(shapes, squares, strict=True))
    found = dict.fromkeys(COMMON, UNKNOWN)
    found["row_variance"], found["column_variance"] = ratio_root(*rows), ratio_root(*columns)
    for name, square in along.items():
        found[name] = ratio_root(square / still, frames - 1)
    return found


@kernel
def _frames(means: Array, pixels: Array, shapes: Array) -> Array:
    """Return the mean square of the frame means' amplitude along shapes over the channels.

    Parameters
    ----------
    means
        Of frames: (channel, frame).
    pixels
        How many a channel has, and their variance, DN^2: (channel, 2).
    shapes
        (shape, channel).
    """
    channels, frames = means.shape
    moved, found = np.empty(means.shape), np.empty(len(shapes))
    for c in range(channels):
        moved[c] = means[c] - pairwise_sum(means[c]) / frames
    for k in range(found.size):
        top, weight = np.zeros(frames), 0.0
        for c in range(channels):
            own = shapes[k, c] * pixels[c, 0] / pixels[c, 1]
            top += own * moved[c]
            weight += own * shapes[k, c]
        found[k] = pairwise_sum(top * top) / weight / (frames - 1)
    return found


def _lines(
    channels: Mapping[str, Channel],
    pixel: Mapping[str, float],
    parity: Mapping[str, int],
    axis: int,
    frames: int,
) -> tuple[float, float]:
    """Return the mean square of lines that two channels share, and its degrees of freedom."""
    squares = dof = 0.0
    for side in (0, 1):
        names = [name for name in channels if parity[name] == side]
        count = min(channels[name].mean_frame.shape[axis] for name in names)
        top = np.zeros((frames, count))
        weight = 0.0
        for name in names:
            channel = channels[name]
            moved = channel.moving_rows if axis == 0 else channel.moving_columns
            own = channel.mean_frame.shape[1 - axis] / pixel[name]
            _add(moved, own, top)
            weight += own
        squares += float((top * top).sum()) / weight
        dof += (frames - 1) * (count - 1)
    return squares / dof, dof


@kernel
def _add(moved: Array, weight: float, top: Array) -> None:
    """Add what moves (frame, line) to the first lines that all have."""
    for t in range(top.shape[0]):
        for i in range(top.shape[1]):
            top[t, i] += weight * moved[t, i]
