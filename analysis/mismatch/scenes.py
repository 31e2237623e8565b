"""The clean picture of a static scene, and its pixels by local signal.

The mean over frames is the picture. Its own noise is smoothed away where the picture has no detail
above it (Lee 1980: each pixel is drawn to the mean around it, by the share of noise in the variance
around it), so that pixels sorted by signal are not sorted by noise.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from dsis.camera import Camera
from dsis.effects import Image

Array = NDArray[np.float64]
Plane = tuple[slice, slice]
SCENE = "scene"  # kind of exposure, and scope of the bank's numbers of it
_AROUND = 5  # pixels of the channel's plane, a side
_MOST_BINS, _LEAST_PIXELS = 6, 500
_FINER = 6  # times as many, within which pixels count as alike
_WIDE = 4.0  # standard errors of the picture, that a bin is wide at least
_MOVES_Z, _MOVES_SHARE = 6.0, 1e-3  # of the variance: less does not show elsewhere
_LARGEST = 0.998  # quantile from which on gradients count alike: few edges are no law
# What the mean frame of a scene holds already; simulated once more it would be there twice.
_IN_THE_PICTURE = frozenset(
    {
        "shading",
        "prnu",
        "smooth_prnu",
        "channel_imbalance",
        "tap_mismatch",
        "dsnu",
        "row_fpn",
        "column_fpn",
        "row_prnu",
        "column_prnu",
        "line_settling",
    }
)


@dataclass(frozen=True)
class Bin:
    """Some ranges of signal, from one to another signal."""

    ranges: slice
    low_dn: float
    high_dn: float


@dataclass(frozen=True, eq=False)
class Local:
    """The pixels of one channel by signal.

    Attributes
    ----------
    labels
        Which of many narrow ranges of signal a pixel is in, from 0: (row, column) of the plane.
    pixels, signal_dn, variance_dn2
        How many pixels each of them has, their mean signal above the dark, and their variance.
    bins
        By name: ranges that are wide beside the noise.
    """

    labels: NDArray[np.uint8]
    pixels: NDArray[np.int64]
    signal_dn: Array
    variance_dn2: Array
    bins: Mapping[str, Bin]

    def mean(self, values: Array, part: slice = slice(None)) -> float:
        """Return the mean over pixels of what is known of each range."""
        return float(np.average(values[part], weights=self.pixels[part]))

    def by_range(self, image: Array) -> Array:
        """Return the mean of an image (row, column) in each range."""
        total = np.bincount(self.labels.reshape(-1), image.reshape(-1), self.pixels.size)
        return np.asarray(total / self.pixels)


@dataclass(frozen=True, eq=False)
class Scene:
    """A static scene.

    Attributes
    ----------
    signal_dn
        The picture: (row, column), DN above the dark.
    planes, channels
        By channel: which pixels of the picture, and these by signal.
    """

    signal_dn: Image
    planes: Mapping[str, Plane]
    channels: Mapping[str, Local]

    def steadied(self, frame: NDArray[np.generic]) -> Image:
        """Return a frame, (row, column) in DN, whose contrast is the picture's.

        Light that changes from frame to frame, or from row to row, moves bright places more than
        dark ones. In each row, and among the means of rows, what is in proportion to the picture is
        set to the picture's own contrast; means of rows and frame otherwise stay.
        """
        steady = np.array(frame, np.float32)
        for plane in self.planes.values():
            own, picture = steady[plane], self.signal_dn[plane]
            rows = picture.mean(1, dtype=np.float64)
            inner = picture - rows[:, np.newaxis].astype(np.float32)
            own -= _excess(own, inner, 1)[:, np.newaxis] * inner
            outer = rows - rows.mean()
            means = own.mean(1, dtype=np.float64)
            own -= (_excess(means, outer, 0) * outer).astype(np.float32)[:, np.newaxis]
        return steady


def _excess(
    values: NDArray[np.floating], shape: NDArray[np.floating], axis: int
) -> NDArray[np.float32]:
    """Return by how much more than once values hold a shape of mean 0, along an axis."""
    square = (shape * shape).sum(axis, dtype=np.float64)
    held = (values * shape).sum(axis, dtype=np.float64)
    return np.where(square > 0, held / np.maximum(square, 1e-30) - 1, 0.0).astype(np.float32)


def scene_of(
    frames: Iterable[NDArray[np.generic]],
    planes: Mapping[str, Plane],
    dark_dn: Mapping[str, float],
) -> Scene | None:
    """Return the scene of at least two frames, codes in DN; None where it moves between them.

    Parameters
    ----------
    frames
        (row, column), in any order.
    planes
        Pixels of each channel.
    dark_dn
        Level of each channel without light, DN of codes.
    """
    mean, variance, count = _moments(frames)
    picture = np.zeros(mean.shape, np.float32)
    channels = {}
    for name, plane in planes.items():
        own = _smoothed(mean[plane] - dark_dn[name], variance[plane] / count)
        channels[name] = local = _local(own, variance[plane], count)
        if moves(own, variance[plane], local):
            return None
        picture[plane] = own
    return Scene(picture, planes, channels)


def _moments(frames: Iterable[NDArray[np.generic]]) -> tuple[Array, Array, int]:
    """Return mean and variance of each pixel, and the number of frames."""
    first: Array | None = None
    total = square = np.zeros(())
    count = 0
    for frame in frames:
        codes = np.asarray(frame, np.float64)
        if first is None:
            first, total, square = codes, np.zeros(codes.shape), np.zeros(codes.shape)
        d = codes - first  # from the first frame: squares stay small
        total += d
        square += d * d
        count += 1
    if first is None or count < 2:
        message = f"a scene of {count} frame(s) shows no noise"
        raise ValueError(message)
    return first + total / count, (square - total * total / count) / (count - 1), count


def _smoothed(mean: Array, noise_dn2: Array) -> Array:
    """Return a plane without noise of a variance that is known by pixel only roughly."""
    middle = float(mean.mean())
    own = mean - middle
    around = uniform_filter(own, _AROUND)
    spread = uniform_filter(own * own, _AROUND) - around * around
    noise = uniform_filter(noise_dn2, _AROUND)
    kept = np.maximum(spread - noise, 0.0) / np.maximum(spread, 1e-12)
    return np.asarray(middle + around + kept * (own - around))


def _local(signal: Array, variance: Array, frames: int) -> Local:
    low, high = np.quantile(signal, [0.05, 0.95])
    error = sqrt(max(float(np.median(variance)), 1e-9) / frames)
    count = int(min((high - low) / (_WIDE * error), _MOST_BINS, signal.size / _LEAST_PIXELS))
    ranges = max(count, 1) * _FINER
    edges = np.quantile(signal, np.arange(1, ranges) / ranges, method="lower")
    edges = np.unique(edges[edges > signal.min()])
    labels = np.searchsorted(edges, signal, side="right").astype(np.uint8)
    pixels = np.bincount(labels.reshape(-1), minlength=edges.size + 1)
    means, variances = (
        np.bincount(labels.reshape(-1), image.reshape(-1), pixels.size) / pixels
        for image in (signal, variance)
    )
    limits = [float(signal.min()), *edges.tolist(), float(signal.max())]
    count = min(max(count, 1), pixels.size)
    first = [k * pixels.size // count for k in range(count + 1)]
    bins = {
        f"bin {k} of {count}": Bin(slice(low, high), limits[low], limits[high])
        for k, (low, high) in enumerate(pairwise(first), 1)
    }
    return Local(labels, pixels, means, variances, bins)


def moves(signal: Array, variance: Array, local: Local) -> bool:
    """Return whether pixels vary from frame to frame the more, the steeper the picture is there.

    A picture that shifts by d varies by (d g)^2 where it has the gradient g. Variance and squared
    gradient are compared within narrow ranges of signal, linear trends taken off: noise has no
    other reason to follow the gradient.
    """
    if min(signal.shape) < 2:
        return False
    down, right = np.gradient(signal)
    steep = down * down + right * right
    steep = np.minimum(steep, np.quantile(steep, _LARGEST))
    left = _detrended(steep, signal, local)
    ratio = (variance / np.maximum(local.variance_dn2, 1e-9)[local.labels]) - 1
    square = float((left * left).sum())
    if not square > 0:
        return False
    slope = float((left * ratio).sum()) / square
    z = slope * sqrt(square) / max(float(ratio.std()), 1e-9)
    return z > _MOVES_Z and slope * float(steep.mean()) > _MOVES_SHARE


def _detrended(image: Array, signal: Array, local: Local) -> Array:
    """Return an image less its straight line against the signal, range by range."""
    x = signal - local.signal_dn[local.labels]
    y = image - local.by_range(image)[local.labels]
    spread = np.maximum(local.by_range(x * x), 1e-30)
    return np.asarray(y - (local.by_range(x * y) / spread)[local.labels] * x)


def without_picture(camera: Camera) -> Camera:
    """Return the camera without what the picture of a scene holds already."""
    kept = tuple(e for e in camera.effect if e.kind not in _IN_THE_PICTURE)
    return camera if len(kept) == len(camera.effect) else camera.model_copy(update={"effect": kept})
