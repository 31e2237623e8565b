"""What the channels of a mosaic have in common: frames and lines that move in all colours.

Each channel measures a common offset by itself; their mean, weighted by the inverse variance of
white noise, measures it best. A mean square of 1 is white noise.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import UNKNOWN, Number, ratio_root
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
    alike = dict.fromkeys(channels, 1.0)
    moved = {name: c.frame_means - c.frame_means.sum() / frames for name, c in channels.items()}

    def along(shape: Mapping[str, float]) -> Number:
        return _frames(channels, pixel, shape, moved, still)

    found = {
        "row_variance": ratio_root(*rows),
        "column_variance": ratio_root(*columns),
        "frame_variance": along(alike),
        "frame_variance of light": UNKNOWN,
    }
    # What alternates from site to site is constant in every plane, but for its sign.
    for name, odd in SIGNS.items():
        signs = {channel: 1.0 - 2.0 * odd(*sites[channel]) for channel in channels}
        found[f"alternation_variance of {name}"] = along(signs)
    if all(value > 0 for value in signal_dn.values()):
        top = max(signal_dn.values())
        shares = {name: signal_dn[name] / top for name in channels}
        found["frame_variance of light"] = along(shares)
    return found


def _frames(
    channels: Mapping[str, Channel],
    pixel: Mapping[str, float],
    shape: Mapping[str, float],
    moved: Mapping[str, Array],
    still: float,
) -> Number:
    """Return the mean square of the frame means' amplitude along a shape over the channels."""
    frames = min(map(len, moved.values()))
    top = np.zeros(frames)
    weight = 0.0
    for name, channel in channels.items():
        own = shape[name] * channel.mean_frame.size / pixel[name]
        top += own * moved[name]
        weight += own * shape[name]
    square = float((top**2).sum()) / weight / (frames - 1)
    return ratio_root(square / still, frames - 1)


def _lines(
    channels: Mapping[str, Channel],
    pixel: Mapping[str, float],
    parity: Mapping[str, int],
    axis: int,
    frames: int,
) -> tuple[float, float]:
    """Return the mean square of lines that two channels share, and its degrees of freedom."""
    total = dof = 0.0
    for side in (0, 1):
        names = [name for name in channels if parity[name] == side]
        count = min(channels[name].mean_frame.shape[axis] for name in names)
        top = np.zeros((frames, count))
        weight = 0.0
        for name in names:
            channel = channels[name]
            moved = channel.moving_rows if axis == 0 else channel.moving_columns
            own = channel.mean_frame.shape[1 - axis] / pixel[name]
            top += own * moved[:, :count]
            weight += own
        total += float((top**2).sum()) / weight
        dof += (frames - 1) * (count - 1)
    return total / dof, dof
