"""The bank's numbers of one observation in one fixed order."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, log, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import split_name
from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.local import LOCAL_NAMES
from analysis.mismatch.bank.scalars import NAMES, OF_CODES, OF_MEAN_FRAMES, Number
from analysis.mismatch.basefit import CLIPPED_SHARE, BaseFit, colour
from analysis.mismatch.observe import Layout, Observation, Place
from analysis.mismatch.scenes import SCENE

Array = NDArray[np.float64]
_SAME = 0.98  # cosine from which two shapes are one
RELATIVE_LIGHT = 3e-5  # light is stated, and a lamp is stable, no better than this
RELATIVE_RATIO = 3e-5


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
        Standard deviations in white noise, closed form; inf where unknown.
    """

    keys: tuple[Key, ...]
    values: Array
    errors: Array


def vector(layout: Layout, seen: Observation, fit: BaseFit) -> Vector:
    """Return the numbers of an observation beside the base numbers fitted to it."""
    rows: list[tuple[Key, Number]] = []
    for exposure in layout.uniform:
        for channel in layout.channels:
            place = (exposure.name, channel)
            rows += [(Key(name, "exposure", *place), seen.scalars[place][name]) for name in NAMES]
            rows.append((Key("pixel_variance", "exposure", *place), _variance(place, seen, fit)))
            level = _level(layout, exposure.name, channel, seen, fit)
            rows.append((Key("level", "exposure", *place), level))
        if "Gr" in layout.channels and exposure.kind == "flat":
            rows.append((Key("channel_ratio", "exposure", exposure.name, "G"),
                         _ratio(exposure.name, seen, fit)))  # fmt: skip
        rows += _in_common(exposure.name, seen)
    for exposure in layout.pictures:
        rows += _of_scene(layout, exposure.name, seen, fit)
        rows += _in_common(exposure.name, seen)
    for (channel, name), numbers in seen.maps.items():
        for label, number in numbers.items():
            statistic, detail = split_name(label)
            rows.append((Key(statistic, name, "", channel, detail), number))
    for channel, numbers in seen.pooled.items():
        for label, number in numbers.items():
            statistic, detail = split_name(label)
            rows.append((Key(statistic, "all", "", channel, detail), number))
    keys = tuple(key for key, _ in rows)
    values, errors = np.array([number for _, number in rows]).T
    unknown = ~(np.isfinite(values) & np.isfinite(errors) & (errors > 0))
    return Vector(keys, np.where(unknown, nan, values), np.where(unknown, inf, errors))


def _in_common(name: str, seen: Observation) -> Iterator[tuple[Key, Number]]:
    for label, number in seen.common.get(name, {}).items():
        statistic, detail = split_name(label)
        yield Key(statistic, MOSAIC, name, "", detail), number


def _of_scene(
    layout: Layout, name: str, seen: Observation, fit: BaseFit
) -> Iterator[tuple[Key, Number]]:
    """Yield a scene's temporal measures, and its pixel variance by signal beside the line."""
    for channel, local in layout.scenes[name].channels.items():
        for statistic in LOCAL_NAMES:
            number = seen.scalars[name, channel][statistic]
            yield Key(statistic, SCENE, name, channel), number
        for label in local.bins:
            key = Key("pixel_variance", SCENE, name, channel, label)
            level, expected = seen.local[key.place], expected_dn2(layout, key.place, fit)
            known = level.variance_dn2 > 0 and expected > 0
            yield (
                key,
                (log(level.variance_dn2 / expected), sqrt(2 / level.dof)) if known else (nan, inf),
            )


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


def _level(layout: Layout, name: str, channel: str, seen: Observation, fit: BaseFit) -> Number:
    """Return a dark's level against all darks, a flat's against its light, DN."""
    level = seen.levels[name, channel]
    exposure = next(e for e in layout.exposures if e.name == name)
    if exposure.kind == "dark":
        if sum(e.kind == "dark" for e in layout.exposures) < 2:
            return nan, inf
        return level.level_dn - fit.black_dn[channel], level.level_error_dn
    per_light = fit.light_dn.get(colour(channel))
    if per_light is None or exposure.light is None or level.clipped_high > CLIPPED_SHARE:
        return nan, inf
    signal = fit.signal_dn[name, channel]
    error = sqrt(level.level_error_dn**2 + (RELATIVE_LIGHT * signal) ** 2)
    return signal - per_light * exposure.light, error


def _ratio(name: str, seen: Observation, fit: BaseFit) -> Number:
    """Return ln(Gr / Gb)."""
    first, second = fit.signal_dn[name, "Gr"], fit.signal_dn[name, "Gb"]
    if min(first, second) <= 0:
        return nan, inf
    a, b = seen.levels[name, "Gr"].level_error_dn, seen.levels[name, "Gb"].level_error_dn
    return log(first / second), sqrt((a / first) ** 2 + (b / second) ** 2 + RELATIVE_RATIO**2)


SHAPES: Mapping[str, Callable[[float, float], float]] = {
    "at all levels": lambda _s, _v: 1.0,
    "constant": lambda _s, v: 1 / v,
    "with the signal": lambda s, v: s / v,
    "with the signal squared": lambda s, v: s**2 / v,
    "with the signal alone": lambda s, _v: s,
}


@dataclass(frozen=True)
class Contrasts:
    """Sums of departures over exposures, weighted by how an effect may grow with the signal.

    Attributes
    ----------
    keys
        What each contrast is.
    matrix
        (contrast, number): unit rows, applied to departures z.
    """

    keys: tuple[Key, ...]
    matrix: Array


def contrasts(layout: Layout, reference: Vector, known: NDArray[np.bool_]) -> Contrasts:
    """Return the contrasts over the numbers of single exposures that are known."""
    keys: list[Key] = []
    rows: list[Array] = []
    for (statistic, channel), which in _groups(reference, known).items():
        joint = channel == BOTH or channel.startswith(MOSAIC)
        shapes = dict(SHAPES)
        if joint or statistic in OF_MEAN_FRAMES:
            del shapes["with the signal alone"]
        for name, row in _shaped(layout, reference, which, shapes):
            detail = f"{name} {channel}" if joint else name
            keys.append(Key(statistic, "contrast", "", "" if joint else channel, detail))
            rows.append(row)
    for (statistic, scope, detail), which in _over_channels(reference, known).items():
        row = np.zeros(len(reference.keys))
        row[which] = 1 / np.sqrt(len(which))
        keys.append(Key(statistic, "contrast", "", "", f"{scope} {detail}".strip()))
        rows.append(row)
    return Contrasts(tuple(keys), np.array(rows).reshape(len(rows), len(reference.keys)))


def _groups(reference: Vector, known: NDArray[np.bool_]) -> dict[tuple[str, str], list[int]]:
    """Return which numbers are summed: by statistic, and by channel or what is put together."""
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(reference.keys):
        names = []
        if key.scope == MOSAIC and known[i]:
            odd = f"{MOSAIC}, {key.detail}" if key.statistic == "alternation_variance" else MOSAIC
            names = [(key.statistic, odd)]
        elif key.scope in ("exposure", SCENE) and known[i] and key.statistic not in OF_CODES:
            names = [(key.statistic, "")]
            if key.statistic in _PAIRS:
                names.append((_PAIRS[key.statistic], BOTH))
            if key.channel not in ("", "MONO") and key.statistic in _BY_CHANNEL:
                names.append((key.statistic, key.channel))
        for name in names:
            groups.setdefault(name, []).append(i)
    return {name: which for name, which in groups.items() if len(which) > 1}


def _shaped(
    layout: Layout,
    reference: Vector,
    which: Sequence[int],
    shapes: Mapping[str, Callable[[float, float], float]],
) -> Iterator[tuple[str, Array]]:
    """Yield unit rows of the shapes that differ from those before."""
    kept: list[Array] = []
    for name, shape in shapes.items():
        row = np.zeros(len(reference.keys))
        for i in which:
            place = reference.keys[i].place
            place = place if place in layout.signal_dn else (place[0], "Gr")
            s, v = max(layout.signal_dn[place], 0.0), layout.variance_dn2[place]
            row[i] = shape(s, v) / reference.errors[i]
        size = float(np.linalg.norm(row))
        if size == 0:
            continue
        row /= size
        if all(abs(float(row @ other)) <= _SAME for other in kept):
            kept.append(row)
            yield name, row


def _over_channels(
    reference: Vector, known: NDArray[np.bool_]
) -> dict[tuple[str, str, str], list[int]]:
    """Return the numbers of sums over exposures, channels together; long lags stay single."""
    groups: dict[tuple[str, str, str], list[int]] = {}
    for i, key in enumerate(reference.keys):
        if not key.exposure and known[i] and key.statistic != "line_correlation":
            groups.setdefault((key.statistic, key.scope, key.detail), []).append(i)
    return {name: which for name, which in groups.items() if len(which) > 1}


BOTH = "along rows and columns"
MOSAIC = "in all channels"
_PAIRS = {
    "correlation_0_1": "correlation_0_1",
    "correlation_1_0": "correlation_0_1",
    "correlation_0_2": "correlation_0_2",
    "correlation_2_0": "correlation_0_2",
}
_BY_CHANNEL = frozenset({"pixel_variance", "level"})
