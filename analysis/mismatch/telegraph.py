"""Pixels that jump between two levels, told by their own frames from pixels noisy otherwise.

Some pixels are random telegraphs, whose jumps are exponentially distributed over the pixels, or all
of one height. All others have one of the laws that noise of single pixels may have besides: alike,
of variances that spread, that grow with time, with noisier frames now and then, or a drift, as of
hot pixels that warm up. What telegraphs gain is counted from the best of these laws, and beside the
best of them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from math import exp, expm1, inf, isfinite, log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, ndtr

from analysis.mismatch.layout import Layout
from analysis.mismatch.pixelframes import blocks_of, chosen
from analysis.mismatch.pixellaw import of_drifts, of_jumps, of_mixtures, of_spikes, of_variances
from analysis.mismatch.projections import FramesOf
from analysis.mismatch.rank import TOLD_APART
from dsis.recording.ahead import in_order

Array = NDArray[np.float64]
_APART = 3.0  # standard deviations of noise between levels that frames show one by one
_OTHERS, _FEW_OTHERS = 1024, 512  # pixels that are not noisy
_HEIGHTS: Array = np.geomspace(0.7, 120.0, 24)  # in standard deviations of the least noise
_SWITCHING = np.array([0.02, 0.05, 0.1, 0.15, 0.2, 0.27, 0.35, 0.5])
_RATIOS: Array = np.exp(np.arange(-1.4, 4.3, 0.2))  # of a pixel's variance to that noise
_SPREADS = np.geomspace(0.05, 1.5, 18).tolist()  # of the logarithm of such ratios
_CENTRES = np.arange(-0.1, 0.101, 0.02).tolist()  # the median pixel's is not quite their median
_ADDED: Array = np.power(2.0, np.arange(-2, 9), dtype=np.float64)
_DRIFTS: Array = np.power(4.0, np.arange(-1, 7), dtype=np.float64)
_SPIKES: Array = np.power(4.0, np.arange(6), dtype=np.float64)
_SPIKY = np.array([1e-3, 0.01, 0.05, 0.15])  # shares of frames
_PARTS: Array = np.geomspace(1e-4, 0.05, 32)  # of pixels: jumps of more are told by sums
_MORE: Array = np.geomspace(0.07, 1.0, 8)  # which what else spreads the noise is told from
_MANY, _SURELY = 0.03, 0.1  # share of pixels from which they are many, and how likely they may be
_MOST = 0.5  # share of pixels from which all may be meant
_GRID, _FEW_HEIGHTS = 32, 12  # amplitudes
_STEPS = 200
_NORMAL = 1.96


@dataclass(frozen=True)
class Telegraph:
    """Pixels that jump.

    Attributes
    ----------
    share, amplitude_dn, switching
        Share of the pixels, mean height of the jump, and its probability from frame to frame.
    share_error, amplitude_error_dn, switching_error
        Their standard errors.
    gain
        By how much frames are likelier, in the mean over all telegraphs, than under the best law
        without, nats; minus infinity where the pixels that jump may be many.
    spread
        The same of read noises that spread over the pixels, beside jumps, few or many, or without.
    jumping
        The same of jumps, few or many, but not of most pixels. Rivals are also pixels as noisy that
        do not jump, and most pixels, whose noise another cause may make alike in time.
    equal
        Whether all jumps are of one height.
    """

    share: float
    share_error: float
    amplitude_dn: float
    amplitude_error_dn: float
    switching: float
    switching_error: float
    gain: float
    spread: float
    jumping: float
    equal: bool = False

    @property
    def known(self) -> bool:
        """Whether share and amplitude are known better than to their own size."""
        return self.share_error < self.share and self.amplitude_error_dn < self.amplitude_dn

    @property
    def few(self) -> bool:
        """Whether the pixels that jump are few in the mean, or alike, so that sizes are known."""
        return self.share <= _MANY or (self.equal and isfinite(self.gain))

    @property
    def values(self) -> Mapping[str, object]:
        """Parameters of the effect."""
        return {
            "pixel_fraction": self.share,
            "amplitude_dn": self.amplitude_dn,
            "switch_probability": self.switching,
            "heights": "equal" if self.equal else "exponential",
        }

    @property
    def errors(self) -> Mapping[str, float]:
        """Their standard errors."""
        return {
            "pixel_fraction": self.share_error,
            "amplitude_dn": self.amplitude_error_dn,
            "switch_probability": self.switching_error,
        }


@dataclass(frozen=True)
class _Others:
    """Log-likelihoods of pixels that do not jump, relative to Gaussian noise of the many.

    Attributes
    ----------
    own
        Of another variance: (pixel, ratio).
    grown
        Of a variance that grows with exposure time: (pixel, added).
    spikes
        Of single noisy frames: (pixel, added, share).
    drifts
        Of frames that drift, as far at all times or in proportion to it: (pixel, added, course).
    twins
        Of the variance that jumps of each height have, without any: (pixel, height).
    """

    own: Array
    grown: Array
    spikes: Array
    drifts: Array
    twins: Array

    @property
    def most(self) -> Array:
        """The largest of each pixel: (pixel,)."""
        laws = (self.own, self.grown, self.spikes, self.drifts, self.twins)
        every = [own.reshape(len(own), -1).max(1) for own in laws]
        return np.asarray(np.maximum(np.max(every, 0), 0.0))

    def laws(self, top: Array, weight: Array) -> Iterator[tuple[Array, float | None]]:
        """Yield the likelihood of each pixel, over exp(top), under laws of all pixels: (pixel,).

        All alike; of a read noise that spreads log-normally; few that grow noisier with time;
        frames that are noisier now and then; few that drift; any mixture of these. Beside each what
        the best of all spreads gains on their mean, nats; None: the law has none.
        """
        alike = np.exp(-top)
        yield alike, None
        own = np.exp(self.own - top[:, None])
        some = [own @ _log_normal(s, c) for s in _SPREADS for c in _CENTRES]
        sums = [_sum(one, weight) for one in some]
        spread = some[int(np.argmax(sums))]
        chosen = max(sums) - float(logsumexp(sums)) + log(len(sums))
        yield spread, chosen
        drifts = self.drifts.reshape(len(top), -1)
        some = [self.grown, *np.moveaxis(self.spikes, 2, 0), drifts]
        others = [np.exp(one - top[:, None]) for one in some]
        for classes in [*([alike, one] for one in others), [spread, *others]]:
            both = np.column_stack(classes)
            yield both @ _shares(both, weight), chosen if classes[0] is spread else None


def _sum(own: Array, weight: Array) -> float:
    """Return the log-likelihood of all pixels."""
    return float(weight @ np.log(np.maximum(own, 1e-300)))


def _log_normal(spread: float, centre: float) -> Array:
    """Return the share of pixels at each ratio of variances, that of the middle one at `centre`."""
    edges = np.concatenate([[-np.inf], (np.log(_RATIOS[1:]) + np.log(_RATIOS[:-1])) / 2, [np.inf]])
    return np.asarray(np.diff(ndtr((edges - centre) / spread)))


def telegraph(layout: Layout, frames_of: FramesOf, jobs: int = 1) -> Telegraph | None:
    """Return the pixels that jump; None: too few frames, or codes, tell.

    Parameters
    ----------
    layout, frames_of
        The frames: asked are darks and flats, of a larger sensor its middle.
    jobs
        Threads; the result is the same.

    References
    ----------
    Kirton & Uren, Advances in Physics 38, 1989 (random telegraphs); Kiefer & Wolfowitz, Annals of
    Mathematical Statistics 27, 1956 (shares of classes that make observations most likely).
    """
    blocks = list(blocks_of(layout, frames_of))
    if not blocks:
        return None
    least = min(float(noise.min()) for _, noise, _ in blocks)
    which, weight = chosen(blocks, least, _OTHERS)
    longest = max(time for *_, time in blocks)
    heights = _HEIGHTS * sqrt(least)

    def told(block: tuple[Array, Array, float]) -> tuple[Array, ...]:
        x, noise, time = block
        some, dn2 = x[which], noise[which]
        part = time / longest if longest > 0 else 1.0
        return (
            of_jumps(some, dn2, heights, _SWITCHING),
            of_variances(some, dn2, (_RATIOS - 1) * least),
            of_variances(some, dn2, _ADDED * least * part),
            of_spikes(some, dn2, _SPIKES * least, _SPIKY),
            np.hstack([of_drifts(some, dn2, _DRIFTS * least * own) for own in (1.0, part**2)]),
            of_variances(some, dn2, heights**2 / 4),
        )

    def added(sums: tuple[Array, ...], more: tuple[Array, ...]) -> tuple[Array, ...]:
        return tuple(a + b for a, b in zip(sums, more, strict=True))

    # Blocks are added in their order, whoever looked at them.
    jumps, *others = reduce(added, in_order(told, blocks, jobs if jobs > 1 else 0))
    return _fitted(jumps, _Others(*others), weight, heights)


def could_jump(layout: Layout, frames_of: FramesOf, least: float) -> bool:
    """Return whether `telegraph` may find pixels that jump, of a gain of so many nats.

    What telegraphs gain at most, on the best law of a variance for all other pixels, is as a rule
    no less than what they do in the mean, on the best of all; few of the pixels that are not noisy
    tell it, and every other height. Noise as strong that does not jump is left to `telegraph`: far
    from its height a strong jump is less likely than that.
    """
    blocks = list(blocks_of(layout, frames_of))
    if not blocks:
        return False
    noise = min(float(own.min()) for _, own, _ in blocks)
    which, weight = chosen(blocks, noise, _FEW_OTHERS)
    heights, switching = _HEIGHTS[::2] * sqrt(noise), _SWITCHING[::2]
    some = [(x[which], dn2[which]) for x, dn2, _ in blocks]
    jumps = np.sum([of_jumps(x, dn2, heights, switching) for x, dn2 in some], 0)
    own = np.sum([of_variances(x, dn2, (_RATIOS - 1) * noise) for x, dn2 in some], 0)
    top = np.maximum(np.maximum(own.max(1), jumps.max((1, 2))), 0.0)
    jumping, likely = np.exp(jumps - top[:, None, None]), np.exp(own - top[:, None])
    laws = [np.exp(-top), *(likely @ _log_normal(s, c) for s in _SPREADS for c in _CENTRES)]
    beside = max(laws, key=lambda one: _sum(one, weight))
    amplitudes = np.geomspace(heights[0], heights[-1] / 2, _FEW_HEIGHTS)
    least += _sum(beside, weight)
    return any(
        float(_of_shares(of(jumping, heights, amplitudes), beside, weight, _PARTS).max()) >= least
        for of in (_of_heights, _of_height)
    )


def _fitted(jumps: Array, others: _Others, weight: Array, heights: Array) -> Telegraph | None:
    """Return the telegraphs that are likely beside the likeliest law of all other pixels."""
    top = np.maximum(others.most, jumps.max((1, 2)))
    jumping = np.exp(jumps - top[:, None, None])
    still = np.exp(others.twins - top[:, None])
    amplitudes = np.geomspace(heights[0], heights[-1] / 2, _GRID)
    parts = np.concatenate([_PARTS, _MORE])
    exponential = _of_heights(jumping, heights, amplitudes)
    noisier = _of_heights(still[:, :, None], heights, amplitudes)
    found, alone, spreading, many, rivals = [], [], [], [], []
    laws = list(others.laws(top, weight))
    for beside, cost in laws:
        alone.append(_sum(beside, weight))
        own = _of_shares(exponential, beside, weight, parts)
        twins = _of_shares(noisier, beside, weight, parts)
        few = own[:, :, : parts.size if cost is None else _PARTS.size]
        best, chosen = max(alone[-1], float(few.max())), cost or 0.0
        spreading.append((cost is not None, best - chosen))
        minor, most = own[:, :, parts <= _MOST], own[:, :, parts > _MOST]
        many.append(_mean(minor) - chosen)
        rivals.append(max(alone[-1], float(np.max(twins)), _mean(most)) - chosen)
        found.append(own[:, :, : _PARTS.size])
    gain = max(_mean(own) for own in found) - max(alone)
    spread, other = (
        max(own for there, own in spreading if there == kind) for kind in (True, False)
    )
    # A mixture of laws takes some of the jumps; so sizes are those beside the best single law.
    single = max(range(len(found) - 1), key=lambda i: float(np.max(found[i])))
    sizes, gains = found[single], (gain, spread - other, max(many) - max(rivals))
    one = _of_height(jumping, heights, amplitudes)
    equal = _of_shares(one, laws[single][0], weight, _PARTS)
    more = _mean(equal) - _mean(sizes)
    if more > TOLD_APART:
        told = _told(equal, amplitudes, (gain + more, gains[1], gains[2]), _PARTS[-2])
        if told is not None and told.amplitude_dn > _APART * heights[0] / _HEIGHTS[0]:
            return replace(told, equal=True)
    return _told(sizes, amplitudes, gains)


def _mean(likely: Array) -> float:
    """Return the logarithm of the mean likelihood."""
    return float(logsumexp(likely)) - log(likely.size)


def _of_shares(own: Array, beside: Array, weight: Array, parts: Array) -> Array:
    """Return the log-likelihood of each share of pixels that jump: (switching, amplitude, share).

    From likelihoods (switching, amplitude, pixel).
    """
    out = np.empty((*own.shape[:2], parts.size))
    laws = np.ascontiguousarray(own).reshape(-1, own.shape[2])
    of_mixtures(laws, np.ascontiguousarray(beside), weight, parts, out.reshape(len(laws), -1))
    return out


def _told(
    likely: Array, amplitudes: Array, gains: tuple[float, float, float], most: float = _MANY
) -> Telegraph | None:
    """Return the mean telegraph, from log-likelihoods (switching, amplitude, share).

    All three are as likely beforehand in their logarithms, and so are means. Errors are the root
    mean squares about them, or reach to the farther end of the interval of the logarithm, if that
    is more. `gains` are `gain`, `spread` and `jumping`.
    """
    gain, spread, jumping = gains
    if not isfinite(gain):
        return None
    chance = np.exp(likely - logsumexp(likely))
    many = chance[:, :, most < _PARTS].sum() > _SURELY
    found = []
    for axis, places in enumerate((_SWITCHING, amplitudes, _PARTS)):
        end = _SWITCHING[-1] if axis == 0 else inf  # no frames switch oftener
        own = chance.sum(tuple(k for k in range(chance.ndim) if k != axis))
        # One place's own logarithm, rounded, may be beyond it: half of all frames is the most.
        mean = float(np.clip(exp(float(own @ np.log(places))), places[0], places[-1]))
        # No better than where between two places.
        step = mean * float(np.diff(np.log(places)).mean())
        wide = sqrt(float(own @ (np.log(places) - log(mean)) ** 2))
        farther = min(mean * expm1(_NORMAL * wide), end - mean) / _NORMAL
        square = max(float(own @ (places - mean) ** 2), farther**2)
        found.append((mean, sqrt(square + step**2 / 12)))
    (switching, a), (amplitude, b), (share, c) = found
    gain = -inf if many else gain
    return Telegraph(share, c, amplitude, b, switching, a, gain, spread, jumping)


def _of_heights(jumping: Array, heights: Array, amplitudes: Array) -> Array:
    """Return the likelihood of exponential heights of a mean: (switching, amplitude, pixel).

    Jumps that are too small to be seen are Gaussian noise, as the lowest of the heights nearly is.
    From likelihoods (pixel, height, switching).
    """
    edges = np.concatenate([[0.0], np.sqrt(heights[1:] * heights[:-1]), [np.inf]])
    parts = -np.diff(np.exp(-edges / amplitudes[:, None]), axis=1)
    return np.asarray(parts @ jumping.transpose(2, 1, 0))


def _of_height(jumping: Array, heights: Array, amplitudes: Array) -> Array:
    """Return the same of jumps of one height, by its neighbours' logarithms."""
    at = np.interp(np.log(amplitudes), np.log(heights), np.arange(heights.size))
    low = np.minimum(at.astype(np.intp), heights.size - 2)
    logs = np.log(np.maximum(jumping.transpose(2, 1, 0), 1e-300))
    part = (at - low)[:, None]
    return np.asarray(np.exp((1 - part) * logs[:, low] + part * logs[:, low + 1]))


def _shares(classes: Array, weight: Array) -> Array:
    """Return the shares of classes that make all pixels most likely, by expectation-maximisation.

    (class,), from likelihoods (pixel, class).
    """
    shares = np.full(classes.shape[1], 1 / classes.shape[1])
    for _ in range(_STEPS):
        likely = np.maximum(classes @ shares, 1e-300)
        shares = shares * (weight / likely @ classes) / weight.sum()
    return np.asarray(shares)
