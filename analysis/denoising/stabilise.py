"""Signal-dependent noise: made even before denoising, undone without bias after it.

A variance m x + t per read-out segment becomes 1 under f(x), the integral from 0 of
1/sqrt(m x + t + c m^2), which in one segment is the generalised Anscombe transform
2/m sqrt(m x + t + c m^2). c makes the variance right to second order: 3/8 for Poisson shot noise
(Anscombe, Biometrika 35 (1948) 246-254), 7/8 for Gaussian, which is not skewed. The inverse maps
E[f(z) | x] to x: the exact unbiased inverse of Makitalo and Foi, "Optimal inversion of the
generalized Anscombe transformation for Poisson-Gaussian noise", IEEE Trans. Image Processing 22
(2013) 91-103.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.denoising.arguments import Denoiser
from analysis.denoising.spectrum import NoiseSpectrum

Shot = Literal["gaussian", "poisson"]
OFFSET: dict[str, float] = {"gaussian": 7 / 8, "poisson": 3 / 8}
NODES = (
    4096  # of the tabulated inverse: the error of its chords stays below 0.01 standard deviations
)
DEVIATES = np.linspace(-6, 6, 121)


@dataclass(frozen=True)
class VarianceStabiliser:
    """The transform of one channel; all in the unit of the signal x above black.

    Attributes
    ----------
    lower
        Where each read-out segment begins, ascending; the first is -inf.
    slope, intercept
        m (unit) and t (unit squared) of each. As in `dsis.noise.Segments`, shot and read noise each
        count from 0: where t < 0 it is taken from the shot noise.
    shot
        Which distribution the shot noise has.

    Raises
    ------
    ValueError
        Where the segments are not so, or one has no noise at all.
    """

    lower: NDArray[np.float64]
    slope: NDArray[np.float64]
    intercept: NDArray[np.float64]
    shot: Shot = "gaussian"

    def __post_init__(self) -> None:
        sizes = {self.lower.shape, self.slope.shape, self.intercept.shape}
        if len(sizes) != 1 or self.lower.ndim != 1 or self.lower.size == 0:
            raise ValueError("lower, slope and intercept must have one number a segment")
        ascending = (np.diff(self.lower) > 0).all() and (self.lower[1:] > 0).all()
        if self.lower[0] != -np.inf or not ascending:
            message = f"segments must begin at -inf and then ascend above 0: {self.lower}"
            raise ValueError(message)
        if not (np.isfinite(self.slope) & np.isfinite(self.intercept)).all():
            raise ValueError("slope and intercept must be finite")
        if (self.slope < 0).any() or (np.maximum(self.intercept, self.slope) <= 0).any():
            raise ValueError("each segment needs slope >= 0, and one of slope and intercept > 0")
        if self.shot not in get_args(Shot):
            message = f"shot must be one of {', '.join(get_args(Shot))}: {self.shot!r}"
            raise ValueError(message)

    def forward(self, signal: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return f(x); below x = 0, where noise does not change, f goes on as a straight line."""
        x = np.asarray(signal, np.float64)
        begin, slope, variance = self._pieces()
        width = np.diff(begin)
        at_begin = np.concatenate([[0.0], np.cumsum(_area(width, slope[:-1], variance[:-1]))])
        i = np.searchsorted(begin[1:], x, side="right")
        above = at_begin[i] + _area(np.maximum(x - begin[i], 0), slope[i], variance[i])
        return np.asarray(above + np.minimum(x, 0) / np.sqrt(variance[0]))

    def inverse(self, stabilised: NDArray[np.floating], highest: float) -> NDArray[np.float64]:
        """Return the x whose E[f(z)] is given; exact up to x = `highest`, straight lines beyond.

        Where noise rises at a switch of segments, E[f(z)] steps back a little: what lies between
        belongs to the switch.
        """
        lowest = -6 * np.sqrt(self.variance(np.zeros(1))[0])
        top = max(highest, -lowest, self.slope[0])
        x = lowest + (top - lowest) * np.linspace(0, 1, NODES) ** 2
        x = np.union1d(x, self.lower[1:][self.lower[1:] < top])
        expected = np.maximum.accumulate(self.expected(x))
        d = np.asarray(stabilised, np.float64)
        below, above = np.minimum(d - expected[0], 0), np.maximum(d - expected[-1], 0)
        first, last = 1 / self._rise(x[[0, -1]])
        return np.asarray(np.interp(d, expected, x) + below * first + above * last)

    def _rise(self, signal: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivative of f."""
        begin, slope, variance = self._pieces()
        i = np.searchsorted(begin[1:], signal, side="right")
        return np.asarray((variance[i] + slope[i] * np.maximum(signal - begin[i], 0)) ** -0.5)

    def variance(self, signal: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the noise variance at a clean signal, unit squared."""
        return self._moments(signal)[0]

    def expected(self, signal: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return E[f(z)] at a clean signal x; z is Gaussian, for Poisson shot noise with its skew.

        The skew enters as the first Edgeworth term, which is off by less than 0.01 from five
        electrons upwards; fewer than one electron count as the skew of one.
        """
        variance, third = self._moments(signal)
        deviation = np.sqrt(variance)
        skew = np.zeros(signal.shape)
        if self.shot == "poisson":
            skew = np.minimum(third / np.maximum(deviation, 1e-90) ** 3, 1.0)
        total = np.zeros(signal.shape)
        for n in DEVIATES:
            density = np.exp(-(n**2) / 2) * (1 + skew / 6 * (n**3 - 3 * n))
            total += density * self.forward(signal + deviation * n)
        return np.asarray(total / np.exp(-(DEVIATES**2) / 2).sum())

    def _moments(
        self, signal: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return variance and third central moment of z at a clean signal."""
        i = np.searchsorted(self.lower[1:], signal, side="right")
        m, t = self.slope[i], self.intercept[i]
        shot = np.maximum(m * np.maximum(signal, 0) + np.minimum(t, 0), 0)
        return shot + np.maximum(t, 0), m * shot

    def _pieces(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return where the stabilised variance is a straight line, its slope, its value there."""
        c, pieces = OFFSET[self.shot], []
        ends = np.append(self.lower[1:], np.inf)
        for lower, end, m, t in zip(self.lower, ends, self.slope, self.intercept, strict=True):
            begin, least = max(lower, 0.0), max(t, 0.0) + c * m**2
            kink = -t / m if t < 0 else 0.0  # up to here there is no shot noise
            if kink > begin:
                pieces.append((begin, 0.0, least))
            if kink < end:
                begin = max(begin, kink)
                pieces.append((begin, m, least + m * (begin - kink)))
        begin, slope, variance = np.array(pieces).T
        return begin, slope, variance


def _area(
    width: NDArray[np.float64], slope: NDArray[np.float64], variance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the integral of 1/sqrt(variance + slope x) from 0 to `width`."""
    root = np.sqrt(variance)
    return np.asarray(2 * width / (np.sqrt(variance + slope * width) + root))


def stabilised(
    denoiser: Denoiser,
    image: NDArray[np.float32],
    slope: ArrayLike,
    intercept: ArrayLike,
    *,
    lower: ArrayLike = -np.inf,
    shot: Shot = "gaussian",
    correlation: NoiseSpectrum | None = None,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Denoise where the noise variance depends on the signal: stabilise, denoise, undo.

    Parameters
    ----------
    denoiser, image, threads
        See `Denoiser`; the image above black, its noise of variance slope * x + intercept.
    slope, intercept, lower
        One number, or one a read-out segment, (segment,); for channels of different noise (white
        balance, demosaicking) (segment, 3). `lower` is where a segment begins, the first at -inf.
    shot
        "gaussian" or "poisson": which distribution the shot noise has.
    correlation
        Spectrum of the noise where it is not white; only its correlation counts.

    Raises
    ------
    ValueError
        Where an argument is not as said above.
    """
    given = np.asarray(image, np.float32)
    grey = given[..., None] if given.ndim == 2 else given
    laws = (np.asarray(law, np.float64) for law in (lower, slope, intercept))
    lowers, slopes, intercepts = (np.atleast_1d(law) for law in laws)
    channels = [
        VarianceStabiliser(_of(lowers, c), _of(slopes, c), _of(intercepts, c), shot)
        for c in range(grey.shape[-1])
    ]
    # Every channel has noise 1 now. Where their laws differ, the same grey has become different
    # numbers, which opponent colours would take for color: back to equal steps at the mean.
    level = np.full(1, grey.mean(dtype=np.float64))
    scale = np.sqrt(np.concatenate([s.variance(level) for s in channels]))
    scale = scale / scale.mean() if scale.all() else np.ones(len(channels))
    flat = [s.forward(grey[..., c]) * scale[c] for c, s in enumerate(channels)]
    noise = NoiseSpectrum.white(1.0) if correlation is None else correlation.normalised()
    if len(channels) > 1:
        noise = noise.mixed(np.diag(scale))
    even = np.stack(flat, -1).reshape(given.shape).astype(np.float32)
    found = denoiser(even, noise, threads=threads).reshape(grey.shape) / scale
    back = [s.inverse(found[..., c], float(grey[..., c].max())) for c, s in enumerate(channels)]
    return np.stack(back, -1).reshape(given.shape).astype(np.float32)


def _of(law: NDArray[np.float64], channel: int) -> NDArray[np.float64]:
    """Return a channel's column of (segment, channel); (segment,) holds for all."""
    return law if law.ndim < 2 else law[:, channel]
