"""How the mean of whole frames wanders: how far, and how long it stays where it is.

An offset that follows b(t) = rho b(t - 1) + sqrt(1 - rho^2) n(t) has the covariance sigma^2 rho^k
over k frames. Means of frames have it beside what pixels and lines make of them, which is new in
each. Of few frames an offset that stays shows less of its variance than one that does not: both are
fitted together, by the likelihood of contrasts between the frames of each exposure (restricted
maximum likelihood: Patterson & Thompson, Biometrika 58, 1971), whose level nobody knows.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import helmert

from analysis.mismatch.bank.linemeans import AXES, Axis, LineMeans
from analysis.mismatch.layout import Taken
from dsis.effects import Effect
from dsis.effects.flicker import Flicker

Array = NDArray[np.float64]
_LEAST = 3  # frames of an exposure
_PERSISTENCES = np.linspace(0.0, 0.98, 50)
_WIDEST, _SIZES = 30.0, 121  # of the scatter that is seen, times and over; sizes tried
_COARSE, _FINE = 60, 400  # of two at once; of one
_SMALL = 0.01  # of the least, that is as good as none
_INTERVAL = 1.92  # of log-likelihood: half of chi-squared at 95 %
_NORMAL = 1.96


@dataclass(frozen=True)
class Walk:
    """A wander of whole frames.

    Attributes
    ----------
    sigma_dn, persistence
        Its standard deviation, and its correlation from frame to frame.
    errors
        Of both by name: to the farther end of the 95 % interval of the profile likelihood, over
        1.96.
    gain
        Of log-likelihood over one that does not persist, nats.
    white_dn
        Standard deviation of the likeliest that does not.
    """

    sigma_dn: float
    persistence: float
    errors: Mapping[str, float]
    gain: float
    white_dn: float


@dataclass(frozen=True)
class FrameMeans:
    """Means of the frames of one exposure.

    Attributes
    ----------
    numbers
        Of the frames in the order of recording, (frame,).
    means
        DN, (frame,).
    new_dn2
        Variance of a mean by what is new in each frame: pixels, lines, light.
    """

    numbers: Array
    means: Array
    new_dn2: float

    @classmethod
    def of(
        cls,
        lines: Mapping[tuple[str, Axis], LineMeans],
        exposure: str,
        numbers: Sequence[int],
        light_dn: float = 0.0,
    ) -> "FrameMeans | None":
        """Return them of the lines of an exposure; None: they are not known.

        `light_dn` is the standard deviation of its light.
        """
        rows, columns = (lines.get((exposure, axis)) for axis in AXES)
        if rows is None or columns is None or not _LEAST <= rows.frames == len(numbers):
            return None
        new = [own.moving.mean() / own.moving.size for own in (rows, columns)]
        pixels = rows.noise_dn2 / rows.moving.size  # which both have
        means, new_dn2 = rows.parts.mean(1), float(sum(new) - pixels + light_dn**2)
        # Frames without noise tell no law by which their means scatter.
        return cls(np.array(numbers, float), means, new_dn2) if new_dn2 > 0 else None


def means_of(
    lines: Mapping[tuple[str, Axis], LineMeans],
    exposures: Iterable[Taken],
    effects: Iterable[Effect],
    signal_dn: Callable[[str], float],
) -> dict[str, FrameMeans]:
    """Return the means of the frames of exposures, by name, where they are known.

    `effects` are the camera's: its light flickers by its own share of what `signal_dn` gives.
    """
    share = share_of_light(effects)
    found = {}
    for exposure in exposures:
        light = share * signal_dn(exposure.name) if share else 0.0
        own = FrameMeans.of(lines, exposure.name, exposure.numbers, light)
        if own is not None:
            found[exposure.name] = own
    return found


def share_of_light(effects: Iterable[Effect]) -> float:
    """Return by which share of itself light flickers in a camera."""
    own = [effect.sigma_percent for effect in effects if isinstance(effect, Flicker)]
    return float(np.linalg.norm(own)) / 100 if own else 0.0


def walk_of(exposures: Sequence[FrameMeans]) -> Walk | None:
    """Return the likeliest wander of frames; None where they show none."""
    sizes = _sizes(exposures)
    if sizes[0] <= 0:
        return None
    likely = np.zeros((_PERSISTENCES.size, _SIZES))
    for own in exposures:
        likely += _loglik(own, sizes)
    at, of = (int(i) for i in np.unravel_index(int(likely.argmax()), likely.shape))
    best = float(likely[at, of])
    errors = {
        name: _reach(values, likely.max(axis), which) / _NORMAL
        for name, values, axis, which in (
            ("sigma_dn", sizes, 0, of),
            ("persistence", _PERSISTENCES, 1, at),
        )
    }
    gain = best - float(likely[0].max())
    white = float(sizes[int(likely[0].argmax())])
    return Walk(float(sizes[of]), float(_PERSISTENCES[at]), errors, gain, white)


def _sizes(exposures: Sequence[FrameMeans]) -> Array:
    """Return the standard deviations that are tried, DN."""
    excess = max((float(own.means.var(ddof=1)) - own.new_dn2 for own in exposures), default=0.0)
    return float(np.sqrt(max(excess, 0.0))) * np.geomspace(1 / _WIDEST, _WIDEST, _SIZES)


def shown(exposures: Sequence[FrameMeans]) -> float:
    """Return by how much frames within exposures are likelier to wander than not, nats.

    At the likeliest size and persistence.
    """
    sizes = np.concatenate([[0.0], _sizes(exposures)])
    likely = sum((_loglik(own, sizes) for own in exposures), np.zeros((1, sizes.size)))
    return float(likely.max() - likely[0, 0])


def growing(exposures: Sequence[FrameMeans], weights: Array) -> tuple[float, float]:
    """Return by how much frames are likelier to wander in proportion to weights than alike, nats.

    And by how much they are likelier to do both than that. `weights` are of the exposures, (n,), 0
    or more, the largest above 0. Each at its likeliest sizes and persistence.
    """
    least = _sizes(exposures)
    if not least[-1] > 0:
        return 0.0, 0.0
    sizes = np.concatenate([[0.0], least[:: _SIZES // _COARSE]])
    shares = np.asarray(weights, float) / np.max(weights)
    one, other = (grid.ravel() for grid in np.meshgrid(sizes, sizes))
    # Likelihoods change smoothly with the size: between those of many sizes they are interpolated.
    known = np.concatenate([[0.0], np.geomspace(_SMALL * least[0], 2 * least[-1], _FINE)])
    likely = np.zeros((_PERSISTENCES.size, one.size))
    for own, share in zip(exposures, shares, strict=True):
        at = np.hypot(one, share * other)
        likely += np.stack([np.interp(at, known, row) for row in _loglik(own, known)])
    alike, grown = (float(likely[:, size == 0].max()) for size in (other, one))
    return grown - alike, float(likely.max()) - grown


def _loglik(own: FrameMeans, sizes: Array) -> Array:
    """Return the log-likelihood of contrasts between frames: (persistence, size)."""
    contrasts = helmert(own.numbers.size)
    seen = contrasts @ own.means
    apart = np.abs(own.numbers[:, np.newaxis] - own.numbers)
    alike = _PERSISTENCES[:, np.newaxis, np.newaxis] ** apart
    values, vectors = np.linalg.eigh(contrasts @ alike @ contrasts.T)
    turned = np.einsum("pji,j->pi", vectors, seen)[:, np.newaxis]
    square = sizes[:, np.newaxis] ** 2 * np.maximum(values, 0.0)[:, np.newaxis] + own.new_dn2
    return np.asarray(-(np.log(square) + turned**2 / square).sum(2) / 2)


def _reach(values: Array, likely: Array, at: int) -> float:
    """Return how far the farther end of an interval is from the likeliest of some values."""
    inside = values[likely > likely[at] - _INTERVAL]
    return float(max(inside[-1] - values[at], values[at] - inside[0]))
