"""The bank's numbers of one observation in one fixed order."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from itertools import chain
from math import inf, isfinite, log, nan, sqrt
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import MOSAIC, Key, split_name
from analysis.mismatch.bank.local import LOCAL_NAMES
from analysis.mismatch.bank.scalars import NAMES, UNKNOWN, Number
from analysis.mismatch.basefit import CLIPPED_SHARE, BaseFit, colour
from analysis.mismatch.layout import Layout, Place, Taken
from analysis.mismatch.observe import Observation
from analysis.mismatch.scenes import SCENE

Array = NDArray[np.float64]
RELATIVE_LIGHT = 3e-5  # light is stated, and a lamp is stable, no better than this
RELATIVE_RATIO = 3e-5


_key = lru_cache(maxsize=None)(Key)  # the same in every simulation
_of_names = itemgetter(*NAMES)


@cache
def _keys(place: Place) -> tuple[Key, ...]:
    """Return the keys of all `NAMES` at a place, and of its pixel variance and level."""
    names = (*NAMES, "pixel_variance", "level")
    return tuple(_key(name, "exposure", *place) for name in names)


@lru_cache(maxsize=4096)
def _keys_of(scope: str, exposure: str, channel: str, labels: tuple[str, ...]) -> tuple[Key, ...]:
    """Return the keys of numbers by their labels."""
    each = map(split_name, labels)
    return tuple(_key(statistic, scope, exposure, channel, detail) for statistic, detail in each)


@dataclass(frozen=True)
class Vector:
    """Numbers of one observation.

    Attributes
    ----------
    keys
        What each number is.
    values
        Transformed, near normal; nan where unknown.
    errors
        Standard deviations, closed form; inf where unknown. In white noise; of the greens' ratio
        also from sensor to sensor.
    shared
        What of their squares exposures have in common, as one recording tells it, which may be less
        than none; empty: nothing.
    """

    keys: tuple[Key, ...]
    values: Array
    errors: Array
    shared: Array = field(default_factory=lambda: np.zeros(0))


def vector(layout: Layout, seen: Observation, fit: BaseFit) -> Vector:
    """Return the numbers of an observation beside the base numbers fitted to it."""
    keys: list[Key] = []
    numbers: list[Number] = []
    shared: dict[int, float] = {}

    def add(some: Iterable[Key], own: Iterable[Number]) -> None:
        keys.extend(some)
        numbers.extend(own)

    def add_all(scope: str, exposure: str, channel: str, own: Mapping[str, Number]) -> None:
        add(_keys_of(scope, exposure, channel, tuple(own)), own.values())

    channels = layout.channels
    darks = sum(e.kind == "dark" for e in layout.exposures)
    for exposure in layout.uniform:
        for channel in channels:
            place = (exposure.name, channel)
            variance = UNKNOWN if place in layout.still else _variance(place, seen, fit)
            level = _level(exposure, channel, seen, fit, darks)
            add(_keys(place), (*_of_names(seen.scalars[place]), variance, level))
        if "Gr" in channels and exposure.kind == "flat":
            drawn = _drawn(layout, exposure.name, seen, fit)
            shared[len(keys)] = drawn
            ratio = _ratio(exposure.name, seen, fit, drawn)
            add([_key("channel_ratio", "exposure", exposure.name, "G")], [ratio])
        add_all(MOSAIC, exposure.name, "", seen.common.get(exposure.name, {}))
    for exposure in layout.pictures:
        for key, number in _of_scene(layout, exposure.name, seen, fit):
            add([key], [number])
        add_all(MOSAIC, exposure.name, "", seen.common.get(exposure.name, {}))
    for (channel, name), own in seen.maps.items():
        add_all(name, "", channel, own)
    for channel, own in seen.pooled.items():
        add_all("all", "", channel, own)
    told = np.fromiter(chain.from_iterable(numbers), np.float64, 2 * len(numbers))
    values, errors = told[::2], told[1::2]
    unknown = ~(np.isfinite(values) & np.isfinite(errors) & (errors > 0))
    values, errors = np.where(unknown, nan, values), np.where(unknown, inf, errors)
    alike = np.zeros(len(keys))
    alike[list(shared)] = list(shared.values())
    return Vector(tuple(keys), values, errors, alike)


def _of_scene(
    layout: Layout, name: str, seen: Observation, fit: BaseFit
) -> Iterator[tuple[Key, Number]]:
    """Yield a scene's temporal measures, and its pixel variance by signal beside the line."""
    for channel, local in layout.scenes[name].channels.items():
        for statistic in LOCAL_NAMES:
            number = seen.scalars[name, channel][statistic]
            yield _key(statistic, SCENE, name, channel), number
        for label in local.bins:
            key = _key("pixel_variance", SCENE, name, channel, label)
            level, expected = seen.local[key.place], expected_dn2(layout, key.place, fit)
            told = tells_segment(layout.range_dn(key.place), fit)
            known = told and level.variance_dn2 > 0 and expected > 0
            yield (
                key,
                (log(level.variance_dn2 / expected), sqrt(2 / level.dof)) if known else (nan, inf),
            )


def tells_segment(range_dn: tuple[float, float], fit: BaseFit) -> bool:
    """Return whether uniform exposures tell which segment a range of signal is read out in.

    They only say between which two of their levels a segment begins.
    """
    levels = np.array(sorted(fit.signal_dn.values()))
    for piece in fit.pieces[1:]:
        below, above = levels[levels <= piece.from_dn], levels[levels > piece.from_dn]
        start = below[-1] if below.size else 0.0
        if range_dn[1] > start and (above.size == 0 or range_dn[0] < above[0]):
            return False
    return True


def expected_dn2(layout: Layout, place: Place, fit: BaseFit) -> float:
    """Return the variance that the base numbers give at a place, of a scene or not."""
    if place in fit.expected_dn2:
        return fit.expected_dn2[place]
    local, part = layout.part(place)
    return local.mean(fit.line_dn2(local.signal_dn), part) + 1 / 12


def _variance(place: Place, seen: Observation, fit: BaseFit) -> Number:
    level, expected = seen.levels[place], fit.expected_dn2[place]
    if level.variance_dn2 <= 0 or expected <= 0 or level.clipped_high > CLIPPED_SHARE:
        return nan, inf
    return log(level.variance_dn2 / expected), sqrt(2 / level.dof)


def _level(exposure: Taken, channel: str, seen: Observation, fit: BaseFit, darks: int) -> Number:
    """Return a dark's level against all darks, of so many, a flat's against its light, DN."""
    name = exposure.name
    level = seen.levels[name, channel]
    if exposure.kind == "dark":
        if darks < 2:
            return nan, inf
        return level.level_dn - fit.black_dn[channel], level.level_error_dn
    per_light = fit.light_dn.get(colour(channel))
    if per_light is None or exposure.light is None:
        return nan, inf
    signal = fit.signal_dn[name, channel]
    error = sqrt(level.level_error_dn**2 + (RELATIVE_LIGHT * signal) ** 2)
    return signal - per_light * exposure.light, error


def _ratio(name: str, seen: Observation, fit: BaseFit, drawn: float) -> Number:
    """Return ln(Gr / Gb), whose variance over sensors is known."""
    first, second = fit.signal_dn[name, "Gr"], fit.signal_dn[name, "Gb"]
    if min(first, second) <= 0:
        return nan, inf
    a, b = seen.levels[name, "Gr"].level_error_dn, seen.levels[name, "Gb"].level_error_dn
    error = (a / first) ** 2 + (b / second) ** 2 + max(drawn, 0.0) + RELATIVE_RATIO**2
    return log(first / second), sqrt(error)


def _drawn(layout: Layout, name: str, seen: Observation, fit: BaseFit) -> float:
    """Return the variance of ln(Gr / Gb) over sensors whose rows, columns and pixels scatter so.

    The greens share none of them: means of n rows of variance v have v / n. Each part of a fixed
    pattern is known by its mean square over that of the next finer one; of no pattern chance makes
    less than none as often as more.
    """
    pixels, total = layout.rows * layout.columns / 4, 0.0
    frames = next(len(e.numbers) for e in layout.exposures if e.name == name)
    for place in ((name, "Gr"), (name, "Gb")):
        signal, own = fit.signal_dn[place], seen.scalars[place]
        if signal <= 0:
            return 0.0
        pixel, row, column = (
            own[f"fixed_{part}_variance"][0] ** 3 for part in ("pixel", "row", "column")
        )
        noise = seen.levels[place].variance_dn2 / frames
        excess = pixel * (row + column - 1) - 1
        if isfinite(excess):
            total += excess * noise / pixels / signal**2
    return total
