"""Sums of departures: over exposures, as an effect grows with the signal, and over channels."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.home import (
    ABOVE,
    BENT,
    BOTH,
    PERSISTENT,
    READ_NOISE,
    SHAPED,
    STEPPED,
    TIME,
    together_too,
)
from analysis.mismatch.bank.key import MOSAIC, Key
from analysis.mismatch.bank.motion import STATISTIC as MOTION
from analysis.mismatch.bank.scalars import OF_MEAN_FRAMES
from analysis.mismatch.basefit import colour
from analysis.mismatch.layout import Layout
from analysis.mismatch.scenes import SCENE
from analysis.mismatch.vector import Vector

Array = NDArray[np.float64]
Shape = Callable[[float, float], float]
_LEAST_BEND = 1e-3  # share of the line that no line follows, to say anything
_SAME = 0.98  # cosine from which two shapes are one
SHAPES: Mapping[str, Shape] = {
    "at all levels": lambda _s, _v: 1.0,
    "constant": lambda _s, v: 1 / v,
    "with the signal": lambda s, v: s / v,
    "with the signal squared": lambda s, v: s**2 / v,
    "with the signal alone": lambda s, _v: s,
}
_OF_MOMENTS: Mapping[str, Shape] = {
    READ_NOISE: lambda _s, v: 1 / v**2,
    "of few electrons": lambda s, v: s / v**1.5,
}
_MOMENTS = frozenset({"skewness", "kurtosis", "kurtosis_within_pixels", "variance_spread"})
_PAIRS = {
    "correlation_0_1": "correlation_0_1",
    "correlation_1_0": "correlation_0_1",
    "correlation_0_2": "correlation_0_2",
    "correlation_2_0": "correlation_0_2",
}
_BY_CHANNEL = frozenset({"pixel_variance", "level"})


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
        if statistic in _MOMENTS:
            shapes |= _OF_MOMENTS
        # Of shapes that are one, that which an effect is best seen by stays.
        first = SHAPED.get(statistic, ())
        ordered = {name: shapes[name] for name in (*first, *shapes) if name in shapes}
        for name, row in _shaped(layout, reference, which, ordered):
            detail = f"{name} {channel}" if joint else name
            keys.append(Key(statistic, "contrast", "", "" if joint else channel, detail))
            rows.append(row)
    grown = _with_time(layout, reference, known)
    if grown is not None:
        keys.append(Key("level", "contrast", "", "", TIME))
        rows.append(grown)
    for detail, row in _bent_levels(layout, reference, known):
        keys.append(Key("level", "contrast", "", "", detail))
        rows.append(row)
    for signal, row in _second_paths(layout, reference, known):
        keys.append(Key("pixel_variance", "contrast", "", "", f"{ABOVE} {signal:.4g} DN"))
        rows.append(row)
    persistent = _persistent(keys, rows, reference, known)
    if persistent is not None:
        keys.append(Key("variance_spread", "contrast", "", "", PERSISTENT))
        rows.append(persistent)
    for (statistic, scope, detail), which in _over_channels(reference, known).items():
        row = np.zeros(len(reference.keys))
        row[which] = 1 / np.sqrt(len(which))
        keys.append(Key(statistic, "contrast", "", "", together_too(scope, detail)))
        rows.append(row)
    matrix = np.stack(rows) if rows else np.zeros((0, len(reference.keys)))
    return Contrasts(tuple(keys), matrix)


def _groups(reference: Vector, known: NDArray[np.bool_]) -> dict[tuple[str, str], list[int]]:
    """Return which numbers are summed: by statistic, and by channel or what is put together."""
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(reference.keys):
        names = []
        if key.statistic == MOTION:  # of few scenes, each by itself
            continue
        if key.scope == MOSAIC and known[i]:
            names = [(key.statistic, f"{MOSAIC}, {key.detail}" if key.detail else MOSAIC)]
        elif key.scope in ("exposure", SCENE) and known[i] and key.statistic != "code_spacing":
            names = [(key.statistic, "")]
            if key.statistic in _PAIRS:
                names.append((_PAIRS[key.statistic], BOTH))
            if key.channel not in ("", "MONO") and key.statistic in _BY_CHANNEL:
                names.append((key.statistic, key.channel))
        for name in names:
            groups.setdefault(name, []).append(i)
    return {name: which for name, which in groups.items() if len(which) > 1}


def _shaped(
    layout: Layout, reference: Vector, which: Sequence[int], shapes: Mapping[str, Shape]
) -> Iterator[tuple[str, Array]]:
    """Yield unit rows of the shapes that differ from those before."""
    kept: list[Array] = []
    expected = []
    for place in (reference.keys[i].place for i in which):
        at = place if place in layout.signal_dn else (place[0], "Gr")
        expected.append((max(layout.signal_dn[at], 0.0), layout.variance_dn2[at]))
    errors = reference.errors[which]
    for name, shape in shapes.items():
        row = np.zeros(len(reference.keys))
        row[which] = np.array([shape(s, v) for s, v in expected]) / errors
        size = float(np.linalg.norm(row))
        if size == 0:
            continue
        row /= size
        own = row[which]
        if all(abs(float(own @ other)) <= _SAME for other in kept):
            kept.append(own)
            yield name, row


def _with_time(layout: Layout, reference: Vector, known: NDArray[np.bool_]) -> Array | None:
    """Return the sum over darks of levels that grow with exposure time; None without two times."""
    times = {e.name: e.exposure_time_s for e in layout.exposures if e.kind == "dark"}
    which = [
        i
        for i, key in enumerate(reference.keys)
        if key.statistic == "level" and key.exposure in times and known[i]
    ]
    if len({times[reference.keys[i].exposure] for i in which}) < 2:
        return None
    row = np.zeros(len(reference.keys))
    for channel in {reference.keys[i].channel for i in which}:
        own = [i for i in which if reference.keys[i].channel == channel]
        time = np.array([times[reference.keys[i].exposure] for i in own])
        row[own] = (time - time.mean()) / reference.errors[own]
    size = float(np.linalg.norm(row))
    return row / size if size else None


def _bent_levels(
    layout: Layout, reference: Vector, known: NDArray[np.bool_]
) -> Iterator[tuple[str, Array]]:
    """Yield sums of the levels of flats that bend, or whose gain steps between successive flats.

    What each colour's sensitivity and each channel's ground can follow, base numbers that are
    fitted to the same levels, is projected out.
    """
    lit = {e.name for e in layout.uniform if e.kind == "flat" and e.light}
    which = [
        i
        for i, key in enumerate(reference.keys)
        if (key.statistic, key.scope) == ("level", "exposure") and key.exposure in lit and known[i]
    ]
    if not which:
        return
    places = [reference.keys[i].place for i in which]
    signal = np.array([max(layout.signal_dn[place], 0.0) for place in places])
    channels = np.array([channel for _, channel in places])
    colours = np.array([colour(channel) for channel in channels])
    size = reference.errors[which]
    free = [np.where(colours == own, signal, 0.0) / size for own in sorted(set(colours.tolist()))]
    free += [(channels == own) / size for own in sorted(set(channels.tolist()))]
    base = np.stack(free, 1)
    levels = sorted(set(signal[channels == channels[0]].tolist()))
    shapes = {BENT: signal**2}
    for low, high in pairwise(levels):
        switch = sqrt(max(low, 1.0) * high)
        shapes[f"{STEPPED} {switch:.7g} DN"] = np.where(signal > switch, signal, 0.0)
    kept: list[Array] = []
    for name, shape in shapes.items():
        own = shape / size
        left = own - base @ np.linalg.lstsq(base, own, rcond=None)[0]
        norm = float(np.linalg.norm(left))
        if norm <= _LEAST_BEND * float(np.linalg.norm(own)):
            continue
        row = np.zeros(len(reference.keys))
        row[which] = left / norm
        if all(abs(float(row @ other)) <= _SAME for other in kept):
            kept.append(row)
            yield name, row


def _second_paths(
    layout: Layout, reference: Vector, known: NDArray[np.bool_]
) -> Iterator[tuple[float, Array]]:
    """Yield sums of variances that are steeper above a signal, between successive flats.

    What a line through all levels can follow is projected out.
    """
    which = [
        i
        for i, key in enumerate(reference.keys)
        if (key.statistic, key.scope) == ("pixel_variance", "exposure") and known[i]
    ]
    places = [reference.keys[i].place for i in which]
    signal = np.array([max(layout.signal_dn[place], 0.0) for place in places])
    size = reference.errors[which] * np.array([layout.variance_dn2[place] for place in places])
    line = np.stack([signal / size, 1 / size], 1)
    channel = layout.channels[len(layout.channels) // 2 - 1]
    levels = sorted({layout.signal_dn[e.name, channel] for e in layout.uniform if e.kind == "flat"})
    for low, high in pairwise(levels):
        if low <= 0:
            continue
        switch = sqrt(low * high)
        bent = np.where(signal > switch, signal, 0.0) / size
        bent -= line @ np.linalg.lstsq(line, bent, rcond=None)[0]
        norm = float(np.linalg.norm(bent))
        if norm > _LEAST_BEND * float(np.linalg.norm(line[:, 0])):
            row = np.zeros(len(reference.keys))
            row[which] = bent / norm
            yield switch, row


def _persistent(
    keys: Sequence[Key], rows: Sequence[Array], reference: Vector, known: NDArray[np.bool_]
) -> Array | None:
    """Return the sum of a spread within exposures and of what all exposures share of it."""
    own = [
        row
        for key, row in zip(keys, rows, strict=True)
        if (key.statistic, key.channel, key.detail) == ("variance_spread", "", READ_NOISE)
    ]
    which = [i for i, k in enumerate(reference.keys) if k.statistic == "variance_persistence"]
    which = [i for i in which if known[i]]
    if not own or not which:
        return None
    row = own[0].copy()
    row[which] += 1 / np.sqrt(len(which))
    return np.asarray(row / np.linalg.norm(row))


def _over_channels(
    reference: Vector, known: NDArray[np.bool_]
) -> dict[tuple[str, str, str], list[int]]:
    """Return the numbers of sums over exposures, channels together."""
    groups: dict[tuple[str, str, str], list[int]] = {}
    for i, key in enumerate(reference.keys):
        if not key.exposure and key.channel and known[i]:
            groups.setdefault((key.statistic, key.scope, key.detail), []).append(i)
    return {name: which for name, which in groups.items() if len(which) > 1}
