"""Distribution of the noise at one level: residuals about the mean frame, by channel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.photon_transfer.recorded import Recorded, channel_names

LEAST_FRAMES, MAX_FRAMES, MAX_SAMPLES = 4, 16, 2**21  # held in memory
_HALF_WIDTH = 5.5  # standard deviations shown


@dataclass(frozen=True)
class Distribution:
    """Histogram of temporal noise at one level.

    Attributes
    ----------
    exposure, channel, level_dn, frames
        Where it comes from; the level is the mean code.
    centres_dn, density
        Middle of each bin, and share of samples per DN.
    sd_dn
        Standard deviation of the noise.
    skewness, kurtosis
        Of the residuals as they are, the mean of the frames taken off.
    """

    exposure: str
    channel: str
    level_dn: float
    frames: int
    centres_dn: NDArray[np.float64]
    density: NDArray[np.float64]
    sd_dn: float
    skewness: float
    kurtosis: float


def noise_distribution(recording: Recorded, name: str) -> Distribution | None:
    """Return the noise of one exposure's first channel about its mean frame; None for one frame.

    The residuals of T frames about their mean are widened by sqrt(T / (T - 1)), each frame's own
    change of the mean taken off.
    """
    exposure = next(e for e in recording.exposures if e.name == name)
    names = channel_names(recording.sensor.cfa)
    # Gr has twice the neighbours of R at no cost; MONO has one channel.
    channel = names[0][0] if "Gr" not in np.ravel(names) else "Gr"
    i, j = next((i, j) for i in (0, 1) for j in (0, 1) if names[i][j] == channel)
    step = 1 if channel == "MONO" else 2
    planes: list[NDArray[np.float32]] = []
    for frame in recording.frames(exposure):
        planes.append(frame[i::step, j::step].astype(np.float32))
        if len(planes) >= max(LEAST_FRAMES, min(MAX_FRAMES, MAX_SAMPLES // planes[0].size)):
            break
    if len(planes) < 2:
        return None
    stack = np.stack(planes)
    level = float(stack.mean(dtype=np.float64))
    stack -= stack.mean(0)
    stack -= stack.mean((1, 2), keepdims=True)
    stack *= np.float32(np.sqrt(len(planes) / (len(planes) - 1)))
    return _histogram(exposure.name, channel, level, stack)


def _histogram(
    exposure: str, channel: str, level: float, stack: NDArray[np.float32]
) -> Distribution | None:
    sd = float(np.sqrt((stack * stack).mean(dtype=np.float64)))
    if sd == 0:
        return None
    # Residuals about a mean of T frames come in steps of 1/T; bins of whole codes stay smooth.
    width = max(1.0, round(sd / 6))
    edge = (np.ceil(_HALF_WIDTH * sd / width) + 0.5) * width
    edges = np.arange(-edge, edge + width / 2, width)
    bins = np.floor((stack.ravel() + np.float32(edge)) / np.float32(width)).astype(np.intp)
    inside = bins[(bins >= 0) & (bins < edges.size - 1)]
    counts = np.bincount(inside, minlength=edges.size - 1)
    z = stack.ravel() / np.float32(sd)
    square = z * z
    return Distribution(
        exposure,
        channel,
        level,
        len(stack),
        (edges[1:] + edges[:-1]) / 2,
        counts / (stack.size * width),
        sd,
        float((square * z).mean(dtype=np.float64)),
        float((square * square).mean(dtype=np.float64)) - 3.0,
    )
