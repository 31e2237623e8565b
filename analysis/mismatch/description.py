"""What of a recording's description its frames contradict: black level, kind, light, colours."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.observe import Observation
from analysis.mismatch.source import Source
from analysis.photon_transfer.described import Described, contradictions
from dsis.cfa import Cfa
from dsis.recording import Recording
from dsis.recording.hygiene import CLIPPED_SHARE

_SURE = 5.0  # standard errors
_GREENS = 0.02  # of their mean, by which two greens differ at most
_FILTERED = 0.1  # of it, by which another colour differs at least: no amplifiers are so unequal


def remarks_on_description(
    recording: Recording, layout: Layout, seen: Observation, source: Source
) -> tuple[str, ...]:
    """Return what the frames that are looked at contradict, in sentences."""
    told = [
        Described.of(
            e.name,
            e.kind,
            e.exposure_time_s,
            recording.exposure(e.name).light,
            [(layout.black_dn + v.level_dn, v.level_error_dn, v.variance_dn2) for v in levels],
        )
        for e in layout.uniform
        for levels in [[seen.levels[e.name, channel] for channel in layout.channels]]
        if max(max(one.clipped_low, one.clipped_high) for one in levels) <= CLIPPED_SHARE
    ]
    return (*contradictions(told, layout.black_dn), *_on_colours(layout, told, source))


def _on_colours(layout: Layout, told: list[Described], source: Source) -> list[str]:
    """Return that a flat of a sensor without colours looks as behind colour filters.

    Two pixels of each 2 x 2 cell on one diagonal are alike, as greens are, and the two others are
    unlike each other, and one of them is unlike greens: columns, rows and checkers are not so.
    """
    flats = [e for e in told if e.kind == "flat"]
    if layout.cfa is not Cfa.MONO or not flats:
        return []
    brightest = max(flats, key=lambda e: e.level_dn)
    darkest = min(told, key=lambda e: e.level_dn)
    cell, variance = _cell(layout, brightest, source)
    if darkest.kind == "dark":
        black, more = _cell(layout, darkest, source)
        cell, variance = cell - black, variance + more
    else:
        cell = cell - layout.black_dn
    unsure = _SURE * sqrt(2 * variance)
    for greens, others in (
        ((cell[0, 0], cell[1, 1]), (cell[0, 1], cell[1, 0])),
        ((cell[0, 1], cell[1, 0]), (cell[0, 0], cell[1, 1])),
    ):
        green = sum(greens) / 2
        apart = max(abs(one - green) for one in others)
        alike = abs(greens[0] - greens[1]) <= _GREENS * green
        unlike = abs(others[0] - others[1]) - unsure > _GREENS * green
        if green > 0 and alike and unlike and apart - unsure > _FILTERED * green:
            shares = " : ".join(f"{value / green:.2f}" for value in cell.reshape(-1))
            says = f"cfa is given as MONO, but the pixels of 2 x 2 cells are as {shares} in "
            return [f"{says}{brightest.name}, as of a mosaic of colour filters."]
    return []


def _cell(layout: Layout, e: Described, source: Source) -> tuple[NDArray[np.float64], float]:
    """Return the means of the four pixels of 2 x 2 cells, (2, 2), and the variance of one."""
    numbers = next(one.numbers for one in layout.uniform if one.name == e.name)
    frames = [
        [[float(frame[y::2, x::2].mean()) for x in (0, 1)] for y in (0, 1)]
        for frame in source.frames(e.name, numbers)
    ]
    samples = layout.rows * layout.columns / 4 * len(frames)
    return np.mean(frames, 0), e.variance_dn2 / samples
