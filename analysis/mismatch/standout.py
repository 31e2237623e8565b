"""Single pixels that stand out of maps, and such that lie side by side."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.hotlaw import around
from analysis.mismatch.state import State
from dsis.measures.spikes import variance_of_quartiles

Array = NDArray[np.float64]
_HOT = "hot_pixels"
_ONE_BY_ONE = {_HOT: ("time", "time alone"), "rts": ("variance",)}
_STANDS_OUT = {"hot_pixels": 5.0, "rts": 8.0}  # variances of few frames scatter far above
_ONE_BY_ONE_WHY = {
    "hot_pixels": "pixels that stand out with exposure time lie side by side",
    "rts": "pixels that are noisier than the others lie side by side",
}
_LIKE, _RARE = 0.3, 1e-6  # a share of a height; the chance of as many neighbours
_MOST = 0.5  # of those that stand out
_AROUND = 9  # pixels: most trails and clusters are smaller, and a glow is as bright beside a pixel


def side_by_side(state: State, kind: str) -> Denial | None:
    """Return how single pixels are denied by such that lie side by side; None: they do not.

    Pixels that are hot, or jump, are drawn one by one: f of them leave 1 - (1 - f)^8 of them a
    neighbour that does. Where most of those that stand out - of what grows with time, or of how
    noisy pixels are - have one, of a height like their own, and far more than that leaves, they are
    trails, clusters, or something that is written into the frames. Of a mosaic those of the sensor
    count, or those of its channels. Hot pixels stand out of what is around them, be it a glow.
    """
    if kind not in _ONE_BY_ONE:
        return None
    maps = first_maps(state, _ONE_BY_ONE[kind])
    most = _beside(state, kind, maps)
    if most is not None and kind == _HOT:
        apart = {channel: (_apart(image), noise) for channel, (image, noise) in maps.items()}
        most = _beside(state, kind, apart)
    return None if most is None else Denial(1 - most, _ONE_BY_ONE_WHY[kind])


def _beside(state: State, kind: str, maps: Mapping[str, tuple[Array, float]]) -> float | None:
    """Return which share of pixels that stand out of maps has one like itself beside it.

    None: half or less, or what may be chance, of the sensor and of its channels.
    """
    planes = {channel: heights(*own) for channel, own in maps.items()}
    shares = [_with_neighbours(list(planes.values()), _STANDS_OUT[kind])]
    if len(planes) > 1:
        shares.append(_with_neighbours([_mosaic(state, planes)], _STANDS_OUT[kind]))
    return max((share for share in shares if share is not None), default=None)


def _apart(image: Array) -> Array:
    """Return a map less the median around each pixel, where it is large enough for one."""
    return image - around(image, _AROUND) if min(image.shape) > _AROUND else image


def heights(image: Array, noise: float) -> Array:
    """Return how far pixels of a map are from most, in what these spread by, or noise if more."""
    low, middle, high = np.percentile(image, [25, 50, 75])
    spread = max(variance_of_quartiles(float(low), float(high)) ** 0.5, noise)
    return np.asarray((image - middle) / spread)


def _mosaic(state: State, planes: Mapping[str, Array]) -> Array:
    """Return the planes of a mosaic's channels as they lie on the sensor; 0 where one has none."""
    layout = state.setting.layout
    whole: Array = np.zeros((layout.rows, layout.columns))
    for channel, plane in planes.items():
        y, x = layout.sites[channel]
        own = whole[y::2, x::2]
        own[: plane.shape[0], : plane.shape[1]] = plane
    return whole


def _with_neighbours(planes: Sequence[Array], least: float) -> float | None:
    """Return which share of pixels that stand out has one like itself beside it.

    None: that is half or less, or may be chance.
    """
    out, with_one, by_chance = 0, 0, 0.0
    for height in planes:
        warm = np.pad(np.where(height > least, height, 0.0), 1)
        own = warm[1:-1, 1:-1]
        beside = np.lib.stride_tricks.sliding_window_view(warm, (3, 3)).reshape(*own.shape, 9)
        alike = (beside > _LIKE * own[..., np.newaxis]) & (beside * _LIKE < own[..., np.newaxis])
        alike[..., 4] = False  # itself
        hot = own > 0
        out += int(hot.sum())
        with_one += int((hot & alike.any(-1)).sum())
        by_chance += float(hot.sum() * (1 - (1 - hot.mean()) ** 8))
    chance = float(binom.sf(with_one - 1, out, min(by_chance / out, 1.0))) if out else 1.0
    return with_one / out if with_one > _MOST * out and chance <= _RARE else None


def first_maps(state: State, names: tuple[str, ...]) -> dict[str, tuple[Array, float]]:
    """Return the first of some maps that there is, and its noise, by channel."""
    images = state.setting.seen.images
    return {
        channel: next(images[channel, name] for name in names if (channel, name) in images)
        for channel in sorted({channel for channel, name in images if name in names})
    }
