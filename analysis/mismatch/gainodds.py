"""Which cause makes a gain uneven over a sensor: odds of the map itself, of all causes known.

Light that falls off or leans, halves that differ and decays from an edge are sums of a shape along
rows and one along columns: of the map's cosine transform they have the first column and row. Gains
that neighbours share lie at all low frequencies. Each cause is a Gaussian covariance beside white
noise of unknown size, so that its evidence is known in closed form: what has more shapes to choose
from explains by chance more, and pays for it.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import logsumexp

from analysis.mismatch.bank.robust import drawn_in, typical_square
from analysis.mismatch.bank.seams import beyond_smooth

Array = NDArray[np.float64]
_LOWEST = 1 / 8  # cycles a pixel: noise that neighbours share is white below
_STRENGTHS = 4.0 ** np.arange(1, 11)  # squares, in those of noise: from next to nothing to all
_COUNT = len(_STRENGTHS)
_LENGTHS = 8
_SHORTEST = 2.5  # pixels: fields that are shorter are white there
_DECAYS = 10  # lengths
_REACH = 1 / 8  # of the sensor: what is longer, of decays and fields, is a smooth surface
_MOST_LINES = 128  # of the shorter side
_PARTS = 12  # of the lines: halves, and where else amplifiers' parts may meet
_LEAST = 4  # lines, fewer of which hold no frequency of a field


class Cause(StrEnum):
    """What makes a gain uneven."""

    LIGHT = "light that falls off or leans"
    HALVES_OF_ROWS = "an upper and a lower part"
    HALVES_OF_COLUMNS = "a left and a right part"
    LEFT = "a decay from the left"
    RIGHT = "a decay from the right"
    TOP = "a decay from the top"
    BOTTOM = "a decay from the bottom"
    FIELD = "gains that neighbours share"


def evidences(image: Array) -> dict[Cause, float]:
    """Return the log evidence of each cause of a map's unevenness, relative to none.

    Nothing is said of a map that is too small, or without noise. A field may be there beside each
    of the others, or not, as likely beforehand; so may noise of lines beyond that of pixels.
    Strengths are uniform in their logarithm.

    Parameters
    ----------
    image
        A map of gains (row, column), in any unit.

    References
    ----------
    O'Hagan & Forster, Bayesian Inference, 2nd ed., 2004, section 11 (the normal linear model with
    unknown variance); Ahmed et al., IEEE Transactions on Computers 23, 1974 (the cosine transform
    of a stationary field).
    """
    own = _modes(image)
    if own is None:
        return {}
    by_noise = own.base - own.seen.size / 2 * np.log(own.squares)
    none = float(logsumexp(by_noise[: own.whites]))
    found = {Cause.FIELD: float(logsumexp(by_noise[own.whites :])) - none}
    for cause, some in _shapes(*own.shape).items():
        terms = [own.base[:, None] + _with(one, own) for one in some]
        found[cause] = float(logsumexp(terms)) - np.log(len(some) * len(_STRENGTHS)) - none
    return found


def evidence_beside(image: Array, cause: Cause, other: Cause) -> float:
    """Return the log evidence of a cause beside another one, relative to that other alone.

    Of the other its likeliest shape and strength. A field may be beside every cause anyway: it is
    none of the two.
    """
    own = _modes(image)
    if own is None:
        return -np.inf
    shapes = _shapes(*own.shape)
    of_other = [own.base[:, None] + _with(one, own) for one in shapes[other]]
    by_strength = [logsumexp(one, axis=0) for one in of_other]
    which, strength = np.unravel_index(int(np.argmax(by_strength)), (len(of_other), _COUNT))
    fixed = shapes[other][which] * _STRENGTHS[strength] ** 0.5
    terms = [own.base[:, None] + _with(one, own, fixed) for one in shapes[cause]]
    both = float(logsumexp(terms)) - np.log(len(terms) * _COUNT)
    return float(both - by_strength[which][strength])


@dataclass(frozen=True)
class Alone:
    """Log evidence of a cause without a field: relative to none and to a field without it."""

    seen: float
    behind: float
    beside: float
    """What a field beside it adds, relative to the cause alone."""


def without_field(image: Array, causes: Iterable[Cause]) -> dict[Cause, Alone]:
    """Return the log evidence of causes without a field, as `evidences`.

    Nothing is said of a map that is too small, or without noise.
    """
    own = _modes(image)
    if own is None:
        return {}
    by_noise = own.base - own.seen.size / 2 * np.log(own.squares)
    none, field = (float(logsumexp(some)) for some in np.split(by_noise, [own.whites]))
    shapes, found = _shapes(*own.shape), {}
    for cause in causes:
        terms = np.array([own.base[:, None] + _with(one, own) for one in shapes[cause]])
        plain, beside = (float(logsumexp(some)) for some in np.split(terms, [own.whites], axis=1))
        own_odds = plain - np.log(len(terms) * _COUNT)
        found[cause] = Alone(own_odds - none, own_odds - field, beside - plain)
    return found


@dataclass(frozen=True)
class _Modes:
    """Modes of a map, those of rows and columns first, and what noise and fields make of them.

    Attributes
    ----------
    shape
        Rows and columns of the map.
    seen
        (mode,).
    variances
        (noise, mode): white ones first, so many as `whites`; then with fields.
    base
        (noise,): log of what is likely beforehand, less half of the log determinant.
    """

    shape: tuple[int, int]
    seen: Array
    variances: Array
    base: Array
    whites: int

    @cached_property
    def squares(self) -> Array:
        """Sum of squares of all modes by each noise."""
        return np.asarray((self.seen**2 / self.variances).sum(1))

    @cached_property
    def inverse(self) -> Array:
        """Inverse variances of rows and columns, (noise, mode)."""
        return 1 / self.variances[:, : sum(self.shape) - 2]

    @cached_property
    def along(self) -> Array:
        """Modes of rows and columns by their variances, (noise, mode)."""
        return self.seen[: sum(self.shape) - 2] * self.inverse


def _modes(image: Array) -> _Modes | None:
    """Return the modes of a map; None: it is too small, or has no noise."""
    clipped = _coarse(drawn_in(image))
    rows, columns = clipped.shape
    low, lines = _low(rows, columns), rows + columns - 2
    modes = fft.dctn(clipped, norm="ortho")
    noise = typical_square(modes[low]) if low.any() else 0.0
    if noise == 0:
        return None
    seen = np.concatenate([modes[1:, 0], modes[0, 1:], modes[low]])
    whites = np.array(list(_whites(clipped, noise, seen.size)))
    fields = np.array(_fields(rows, columns))
    sizes = fields[:, :lines].sum(1)
    grown = _STRENGTHS[:, None] * (fields / sizes[:, None])[:, None]
    beside = (whites[:, None, None] + grown).reshape(-1, seen.size)
    variances = np.concatenate([whites, beside])
    prior = np.repeat([-np.log(2 * len(own)) for own in (whites, beside)],
                      [len(whites), len(beside)])  # fmt: skip
    base = prior - np.log(variances).sum(1) / 2
    return _Modes((rows, columns), seen, variances, base, len(whites))


def _with(shapes: Array, own: _Modes, fixed: Array | None = None) -> Array:
    """Return the log evidence of shapes beside each noise, less its own: (noise, strength).

    C = D + t F F', of which determinant and inverse follow from the few shapes (Woodbury); the
    size of all noise is integrated over, uniform in its logarithm. `fixed` are further shapes, of
    a strength that is theirs.
    """
    count = len(shapes)
    every = shapes if fixed is None else np.concatenate([shapes, fixed])
    gram = np.einsum("ki,bi,li->bkl", every, own.inverse, every, optimize=True)
    parts = own.along @ every.T
    scale = np.ones((_COUNT, len(every)))
    scale[:, :count] = _STRENGTHS[:, None] ** 0.5
    whole = np.eye(len(every)) + gram[:, None] * scale[:, :, None] * scale[:, None]
    part = parts[:, None] * scale
    left = own.squares[:, None] - (part * np.linalg.solve(whole, part[..., None])[..., 0]).sum(2)
    return np.asarray(-np.linalg.slogdet(whole)[1] / 2 - own.seen.size / 2 * np.log(left))


def _coarse(image: Array) -> Array:
    """Return a large map in means over squares: what is smooth is seen in them, and noise white."""
    side = max(min(image.shape) // _MOST_LINES, 1)
    rows, columns = (size // side for size in image.shape)
    squares = image[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return np.asarray(squares.mean((1, 3)))


def _whites(image: Array, noise: float, count: int) -> Iterator[Array]:
    """Yield the variance of each mode without a field, in that of pixels: lines may have more."""
    rows, columns = image.shape
    extra = []
    for axis, across in ((1, columns), (0, rows)):
        rest = beyond_smooth(image.mean(axis))
        extra.append(max(typical_square(rest) * across / noise, 1.0))
    for down in sorted({1.0, extra[0]}):
        for along in sorted({1.0, extra[1]}):
            own = np.ones(count)
            own[: rows - 1] = down
            own[rows - 1 : rows + columns - 2] = along
            yield own


@lru_cache(maxsize=4)
def _low(rows: int, columns: int) -> NDArray[np.bool_]:
    """Return which modes are of low frequency, but for those of rows and columns: (row, column)."""
    down, across = np.arange(rows)[:, None] / (2 * rows), np.arange(columns) / (2 * columns)
    enough = min(rows, columns) >= _LEAST
    return (np.hypot(down, across) < _LOWEST) & (down > 0) & (across > 0) & enough


@lru_cache(maxsize=4)
def _fields(rows: int, columns: int) -> list[Array]:
    """Return the power of each mode in fields of several lengths, of rows, columns and others."""
    around = 2 * rows, 2 * columns
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in around)
    distance, low = np.hypot(y[:, None], x), _low(rows, columns)
    found, longest = [], max(min(rows, columns) * _REACH, 2 * _SHORTEST)
    for length in np.geomspace(_SHORTEST, longest, _LENGTHS):
        power = np.maximum(fft.rfft2(np.exp(-distance / length)).real, 0.0)[:rows, :columns]
        found.append(np.concatenate([power[1:, 0], power[0, 1:], power[low]]))
    return found


@lru_cache(maxsize=4)
def _shapes(rows: int, columns: int) -> Mapping[Cause, tuple[Array, ...]]:
    """Return what each cause may make of rows and columns: shapes of norm 1 (shape, mode) each."""
    down, along = (_Lines(size) for size in (rows, columns))
    none = np.zeros(rows - 1), np.zeros(columns - 1)

    def of_rows(line: NDArray[Any]) -> Array:
        return np.concatenate([fft.dct(line, norm="ortho")[1:] * columns**0.5, none[1]])

    def of_columns(line: NDArray[Any]) -> Array:
        return np.concatenate([none[0], fft.dct(line, norm="ortho")[1:] * rows**0.5])

    bow = [of_rows(np.square(down.place)), of_columns(np.square(along.place))]
    fall = rows**2 * bow[0] + columns**2 * bow[1]
    lean = [of_rows(down.place), of_columns(along.place)]
    light = [[one] for one in (fall, *lean, *bow)]
    light += [lean, [fall, lean[0]], [fall, lean[1]], [fall, *lean], [*lean, *bow]]
    made: dict[Cause, list[list[Array]]] = {
        Cause.LIGHT: light,
        Cause.HALVES_OF_ROWS: [[of_rows(own)] for own in down.parts],
        Cause.HALVES_OF_COLUMNS: [[of_columns(own)] for own in along.parts],
        Cause.TOP: [[of_rows(own)] for own in down.decays],
        Cause.BOTTOM: [[of_rows(own[::-1])] for own in down.decays],
        Cause.LEFT: [[of_columns(own)] for own in along.decays],
        Cause.RIGHT: [[of_columns(own[::-1])] for own in along.decays],
    }
    return {
        cause: tuple(np.stack([own / np.linalg.norm(own) for own in one]) for one in some)
        for cause, some in made.items()
    }


class _Lines:
    """Shapes along an axis of so many lines."""

    def __init__(self, size: int) -> None:
        lengths: Array = np.geomspace(1.0, max(size * _REACH, 2.0), _DECAYS)
        self.place = (np.arange(size) - (size - 1) / 2) / (size / 2)
        seams = sorted({round(size * share / _PARTS) for share in range(1, _PARTS)} - {0, size})
        self.parts = [np.where(np.arange(size) < seam, -1.0, 1.0) for seam in seams]
        self.decays = np.exp(np.arange(size, dtype=np.float64) / -lengths[:, None])
