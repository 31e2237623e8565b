"""Counter-based random fields: a draw is a function of where it stands, never of what came before.

Every number comes from Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3",
SC 2011) of the counter (column group, row, frame, channel) under a key made of seed and purpose. So
a crop of a field is the field of the crop, frames and rows may be computed in any order by any
number of workers, and a new purpose leaves every other field as it was. Normal deviates are made by
Box and Muller's transform with polynomials in plain float32 arithmetic, no fused operations: the
same bytes wherever IEEE 754 holds. The largest deviate is 6.7.
"""

import hashlib
from dataclasses import dataclass
from functools import lru_cache, partial
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.grid import PixelGrid
from dsis.kept import Kept

_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW, _HALF = np.uint64(0xFFFFFFFF), np.uint64(32)
_ONE, _TWO, _THREE, _THIRTY = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(30)
_EIGHTH_TURN = np.uint64(1 << 29)
_TURN_TO_RADIANS = np.float32(2 * np.pi / 2**32)
_MOST_KEPT = 1 << 22  # deviates of a field that is kept
_NINE, _UNIT_23 = np.uint64(9), np.float32(2.0**-23)
_F, _I = np.float32, np.int32
_SQRT_HALF_BITS = np.int32(0x3F3504F3)
_LN_2 = np.float32(np.log(2.0))
_FIELDS = Kept(0, patience=16)
_FEW = 4096  # deviates, of a line or of one number a frame: to find them takes less time


@inlined
def philox(c0: Any, c1: Any, c2: Any, c3: Any, k0: Any, k1: Any) -> Any:
    """Return the four 32-bit words of Philox4x32-10, each in a uint64."""
    for _ in range(10):
        p0 = _M0 * c0
        p1 = _M1 * c2
        c0, c1, c2, c3 = (p1 >> _HALF) ^ c1 ^ k0, p1 & _LOW, (p0 >> _HALF) ^ c3 ^ k1, p0 & _LOW
        k0 = (k0 + _W0) & _LOW
        k1 = (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@inlined
def unit(word: Any) -> Any:
    """Return a 32-bit word as a deviate uniform on (0, 1)."""
    return (np.float64(word) + 0.5) / 4294967296.0


@inlined
def log_of_uniform(word: Any) -> Any:
    """Return ln of (word/2 + 1/2) / 2^31: Cephes' logf on mantissa and exponent, error 1e-7."""
    x = np.float32(_I(word >> _ONE)) + _F(0.5)
    bits = np.float32(x).view(np.int32)
    exponent = (bits - _SQRT_HALF_BITS) >> _I(23)
    m = np.int32(bits - (exponent << _I(23))).view(np.float32) - _F(1)
    p = _F(7.0376836292e-2)
    p = p * m + _F(-1.1514610310e-1)
    p = p * m + _F(1.1676998740e-1)
    p = p * m + _F(-1.2420140846e-1)
    p = p * m + _F(1.4249322787e-1)
    p = p * m + _F(-1.6668057665e-1)
    p = p * m + _F(2.0000714765e-1)
    p = p * m + _F(-2.4999993993e-1)
    p = p * m + _F(3.3333331174e-1)
    square = m * m
    return m * square * p - _F(0.5) * square + m + _F(exponent - _I(31)) * _LN_2


@inlined
def box_muller(word_radius: Any, word_angle: Any) -> Any:
    """Return two independent standard normal deviates (float32) from two 32-bit words."""
    radius = np.sqrt(max(_F(-2) * log_of_uniform(word_radius), _F(0)))
    quadrant = (word_angle + _EIGHTH_TURN) >> _THIRTY
    angle = _F(_I(np.uint32(word_angle - (quadrant << _THIRTY)))) * _TURN_TO_RADIANS
    s = angle * angle
    sine = _F(-1.9515295891e-4) * s + _F(8.3321608736e-3)
    sine = (sine * s + _F(-1.6666654611e-1)) * s * angle + angle
    cosine = _F(2.443315711809948e-5) * s + _F(-1.388731625493765e-3)
    cosine = (cosine * s + _F(4.166664568298827e-2)) * s * s - _F(0.5) * s + _F(1)
    quadrant = quadrant & _THREE
    odd = (quadrant & _ONE) != np.uint64(0)
    x = sine if odd else cosine
    y = cosine if odd else sine
    x = -x if ((quadrant + _ONE) & _TWO) != np.uint64(0) else x
    y = -y if quadrant >= _TWO else y
    return radius * x, radius * y


@inlined
def _normal_lanes(
    lanes: Any, groups: Any, c0: Any, c1: Any, frame: Any, channel: Any, k0: Any, k1: Any
) -> Any:
    """Fill lanes (4, groups) with normal deviates of the counters c0, c0 + 2, c0 + 4 ..."""
    for g in range(groups):
        a, b, c, d = philox(c0 + np.uint64(2 * g), c1, frame, channel, k0, k1)
        lanes[0, g], lanes[1, g] = box_muller(a, b)
        lanes[2, g], lanes[3, g] = box_muller(c, d)


@inlined
def _uniform_lanes(
    lanes: Any, groups: Any, c0: Any, c1: Any, frame: Any, channel: Any, k0: Any, k1: Any
) -> Any:
    """Fill lanes (4, groups) with deviates uniform on (0, 1): odd multiples of 2^-24."""
    for g in range(groups):
        a, b, c, d = philox(c0 + np.uint64(2 * g), c1, frame, channel, k0, k1)
        lanes[0, g] = (_F(_I(a >> _NINE)) + _F(0.5)) * _UNIT_23
        lanes[1, g] = (_F(_I(b >> _NINE)) + _F(0.5)) * _UNIT_23
        lanes[2, g] = (_F(_I(c >> _NINE)) + _F(0.5)) * _UNIT_23
        lanes[3, g] = (_F(_I(d >> _NINE)) + _F(0.5)) * _UNIT_23


@kernel
def _fill(
    out: NDArray[np.float32],
    place: NDArray[np.int64],
    channels: NDArray[np.uint8],
    key: NDArray[np.uint64],
    frame: np.uint64,
    normal: bool,
) -> None:
    """Fill `out` (rows, columns, planes), whose first pixel is sensor pixel place = (row, column).

    One call of the generator serves four columns of one parity, so that a mosaic, whose columns
    alternate between two channels, wastes nothing.
    """
    rows, columns, planes = out.shape
    first_group = place[1] // 8
    groups = (place[1] + columns - 1) // 8 - first_group + 1
    lanes = np.empty((4, groups), np.float32)
    for row in range(rows):
        sensor_row = place[0] + row
        for parity in range(2):
            for plane in range(planes):
                channel = np.uint64(channels[sensor_row % 2, parity, plane])
                c0, c1 = np.uint64(2 * first_group + parity), np.uint64(sensor_row)
                if normal:
                    _normal_lanes(lanes, groups, c0, c1, frame, channel, key[0], key[1])
                else:
                    _uniform_lanes(lanes, groups, c0, c1, frame, channel, key[0], key[1])
                for lane in range(4):
                    start = 8 * first_group + 2 * lane + parity - place[1]
                    begin = 1 if start < 0 else 0
                    end = min(groups, (columns - 1 - start) // 8 + 1)
                    for g in range(begin, end):
                        out[row, start + 8 * g, plane] = lanes[lane, g]


@kernel
def _scatter(
    out: NDArray[np.float64], places: NDArray[np.int64], key: NDArray[np.uint64], frame: np.uint64
) -> None:
    """Fill `out` (2, pixel) with deviates uniform on (0, 1) of places (3, pixel)."""
    for i in range(places.shape[1]):
        row, column, channel = places[0, i], places[1, i], places[2, i]
        a, b, _, _ = philox(
            np.uint64(column), np.uint64(row), frame, np.uint64(channel), key[0], key[1]
        )
        out[0, i], out[1, i] = unit(a), unit(b)


@kernel
def _chain(
    out: NDArray[np.bool_],
    places: NDArray[np.int64],
    key: NDArray[np.uint64],
    frame: int,
    forgetting: float,
) -> None:
    """Fill `out` (pixel,) with the states of two that chains of places (3, pixel) are in."""
    for i in range(places.shape[1]):
        row, column, channel = places[0, i], places[1, i], places[2, i]
        for back in range(frame, -1, -1):
            a, b, _, _ = philox(
                np.uint64(column), np.uint64(row), np.uint64(back), np.uint64(channel),
                key[0], key[1],
            )  # fmt: skip
            if back == 0 or unit(a) < forgetting:
                out[i] = unit(b) < 0.5
                break


@dataclass(frozen=True)
class Draw:
    """Random fields of one seed.

    Attributes
    ----------
    seed
        Any integer.
    scope
        Names that set one use of the seed apart from another (a content, a level).
    """

    seed: int
    scope: tuple[str, ...] = ()

    def within(self, *names: str) -> "Draw":
        """Return the fields of a narrower scope: independent of these and of every other scope."""
        return Draw(self.seed, (*self.scope, *names))

    def normal(
        self, purpose: str, grid: PixelGrid, frame: int = 0, threads: int = 1
    ) -> NDArray[np.float32]:
        """Return independent standard normal deviates on `grid`: float32, `grid.shape`."""
        return self._field(purpose, grid, frame, threads, normal=True)

    def fixed(self, purpose: str, grid: PixelGrid, threads: int = 1) -> NDArray[np.float32]:
        """Return `normal(purpose, grid)`, read-only: what every frame of a sensor asks for is kept.

        Fields of more than 4 million deviates are made anew.
        """
        if grid.rows * grid.columns > _MOST_KEPT:
            field = self.normal(purpose, grid, threads=threads)
            field.flags.writeable = False
            return field
        return _kept(self, purpose, grid)

    def uniform(
        self, purpose: str, grid: PixelGrid, frame: int = 0, threads: int = 1
    ) -> NDArray[np.float32]:
        """Return independent deviates, uniform on (0, 1), on `grid`: float32, `grid.shape`."""
        return self._field(purpose, grid, frame, threads, normal=False)

    def rows(self, purpose: str, grid: PixelGrid, frame: int = 0) -> NDArray[np.float32]:
        """Return one standard normal deviate per sensor row, common to all channels."""
        line = PixelGrid(grid.rows, 1, Cfa.MONO, grid.first_row, 0)
        offsets: NDArray[np.float32] = self.normal(purpose, line, frame)[:, 0]
        return offsets

    def columns(self, purpose: str, grid: PixelGrid, frame: int = 0) -> NDArray[np.float32]:
        """Return one standard normal deviate per sensor column, common to all channels."""
        line = PixelGrid(1, grid.columns, Cfa.MONO, 0, grid.first_column)
        offsets: NDArray[np.float32] = self.normal(purpose, line, frame)[0]
        return offsets

    def scattered(
        self, purpose: str, places: NDArray[np.int64], frame: int = 0
    ) -> NDArray[np.float64]:
        """Return two deviates, uniform on (0, 1), for each of some pixels: float64 (2, pixel).

        `places` (3, pixel) holds sensor row, sensor column and channel. For effects that few
        pixels have.
        """
        out = np.empty((2, places.shape[1]), np.float64)
        key = _key(self.seed, self.scope, purpose)
        _scatter(out, np.ascontiguousarray(places), key, np.uint64(frame))
        return out

    def chained(
        self, purpose: str, places: NDArray[np.int64], frame: int, switching: float
    ) -> NDArray[np.bool_]:
        """Return the state in a frame of chains of two states, equally long: bool (pixel,).

        Each switches with probability `switching`, 0.5 at most, from frame to frame: it forgets
        with twice that and is drawn anew, so its state is that of the last frame, counted back, at
        which it forgot; frame 0 is drawn for all. `places` as of `scattered`, whose deviates they
        are.
        """
        out = np.empty(places.shape[1], np.bool_)
        key = _key(self.seed, self.scope, purpose)
        _chain(out, np.ascontiguousarray(places), key, frame, 2 * switching)
        return out

    def normal_rows(
        self, purpose: str, grid: PixelGrid, frame: int, first: int, last: int
    ) -> NDArray[np.float32]:
        """Return rows first..last-1 of `normal(purpose, grid, frame)`, for work in row blocks.

        Of a field that is kept, read-only: see `keep_fields`.
        """
        key = self.seed, self.scope, purpose, grid, frame
        made = partial(self._field, purpose, grid, frame, 1, normal=True)
        whole = _FIELDS.if_room(key, 4 * prod(grid.shape), made)
        if whole is not None:
            return whole[first:last]
        block = PixelGrid(
            last - first, grid.columns, grid.cfa, grid.first_row + first, grid.first_column
        )
        return self._field(purpose, block, frame, 1, normal=True)

    def held(self, purpose: str, grid: PixelGrid, frame: int) -> bool:
        """Return whether the field of `normal_rows` is kept: then any rows are at hand."""
        return (self.seed, self.scope, purpose, grid, frame) in _FIELDS

    def _field(
        self, purpose: str, grid: PixelGrid, frame: int, threads: int, *, normal: bool
    ) -> NDArray[np.float32]:
        place = self.seed, self.scope, purpose
        if grid.rows * grid.columns <= _FEW:
            return _few(*place, grid, frame, normal).copy()
        return _drawn(_key(*place), grid, frame, threads, normal=normal)


def keep_fields(most_bytes: int) -> None:
    """Keep up to so many bytes of the fields asked for by rows, where the same come back."""
    _FIELDS.keep(most_bytes)


@lru_cache(maxsize=8)
def _kept(draw: Draw, purpose: str, grid: PixelGrid) -> NDArray[np.float32]:
    field = draw.normal(purpose, grid)
    field.flags.writeable = False
    return field


def _key(seed: int, scope: tuple[str, ...], purpose: str) -> NDArray[np.uint64]:
    name = "\x1f".join((str(seed), *scope, purpose)).encode()
    words: NDArray[np.uint32] = np.frombuffer(hashlib.blake2b(name, digest_size=8).digest(), "<u4")
    return words.astype(np.uint64)


def _drawn(
    key: NDArray[np.uint64], grid: PixelGrid, frame: int, threads: int, *, normal: bool
) -> NDArray[np.float32]:
    """Return the deviates of a key on `grid`."""
    channels = grid.channels()
    out = np.empty((grid.rows, grid.columns, channels.shape[2]), np.float32)

    def block(first: int, last: int) -> None:
        place = np.array([grid.first_row + first, grid.first_column], np.int64)
        _fill(out[first:last], place, channels, key, np.uint64(frame), normal)

    over_rows(block, grid.rows, threads)
    field: NDArray[np.float32] = out.reshape(grid.shape)
    return field


@lru_cache(maxsize=2048)
def _few(
    seed: int, scope: tuple[str, ...], purpose: str, grid: PixelGrid, frame: int, normal: bool
) -> NDArray[np.float32]:
    """Return few deviates, that every camera with the same draws asks for: not to be changed."""
    return _drawn(_key(seed, scope, purpose), grid, frame, 1, normal=normal)
