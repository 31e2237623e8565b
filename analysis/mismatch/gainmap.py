"""The gain's map beside what is known to be uneven: what no effect explains of it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.maps import PatternSums
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout, Taken
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, Image, ReadOut, Stage
from dsis.grid import PixelGrid

Array = NDArray[np.float64]
_MOST = 8  # levels, of which a line and what bends it are as well known as of more


def gains_beside(clues: Clues, effects: Sequence[Effect]) -> Array | None:
    """Return the gain's map, %, less what effects make of even light; None: there is no map.

    Of a mosaic it is that of all channels, each less its mean: (row, column). Charge that is shared
    makes lines at an edge differ, of all that neighbours share there is one side only.
    """
    layout, images = clues.layout, clues.image("gain")
    if set(images) != set(layout.sites):
        return None
    grid, step = layout.grid, 1 + (len(layout.sites) > 1)
    if not any(_moves(own) for own in effects):
        return _whole(clues, images, {})
    made = {}
    for taken in _some(layout):
        even = np.zeros(grid.shape, np.float32)
        for channel, (y, x) in layout.sites.items():
            even[y::step, x::step] = max(layout.signal_dn[taken.name, channel], 0.0)
        time_s, read_out = taken.exposure_time_s, clues.camera.read_out
        made[taken.name] = layout.seen(mean_frame(even, effects, grid, read_out, time_s))
    return _whole(clues, images, made)


def _whole(
    clues: Clues, images: Mapping[str, tuple[Array, float]], made: Mapping[str, Image]
) -> Array:
    """Return the map of all channels, %, less that of noiseless frames that were made."""
    layout, step = clues.layout, 1 + (len(clues.layout.sites) > 1)
    whole = np.zeros((layout.rows, layout.columns))
    for channel, (image, _) in images.items():
        y, x = layout.sites[channel]
        own = image
        if made:
            sums = PatternSums(layout.regressors(channel), (image.shape[0], image.shape[1]))
            for name in sorted(sums.regressors.rows.keys() & made.keys()):
                frame = np.ascontiguousarray(made[name][y::step, x::step], np.float64)
                sums.add(name, frame, 1.0, 1)
            own = image - sums.maps()["gain"][0]
        whole[y::step, x::step] = (own - own.mean()) * 100 / clues.scale("gain", channel)
    return whole


def _some(layout: Layout) -> Sequence[Taken]:
    """Return the exposures that tell what effects make of light: all darks, and flats of many.

    All, where fewer do not tell what grows with light from what grows with exposure time.
    """
    darks = [own for own in layout.uniform if own.kind == "dark"]
    flats = [own for own in layout.uniform if own.kind != "dark"]
    flats.sort(key=lambda own: layout.signal_dn[own.name, layout.channels[0]])
    some = darks + flats[:: max(len(flats) // _MOST, 1)]
    of_some = replace(layout, exposures=tuple(some))
    tell = all(of_some.regressors(c).names == layout.regressors(c).names for c in layout.channels)
    return some if tell else layout.uniform


def _moves(effect: Effect) -> bool:
    """Return whether an effect may make something of even light that has an expected shape."""
    return not effect.drawn and effect.stage is not Stage.CODE


def mean_frame(
    light: Image, effects: Sequence[Effect], grid: PixelGrid, read_out: ReadOut, time_s: float
) -> Image:
    """Return what effects make of light without noise, DN: float32 (row, column).

    What is drawn at random has no expected shape, and codes hide small ones. Light is steady.
    """
    image = arriving = light
    for own in sorted(effects, key=lambda one: (one.stage, one.rank, one.kind)):
        if not _moves(own):
            continue
        alike = partial(_alike, image)
        exposure = Exposure(
            *(grid, 0, Draw(0), Draw(0), light, read_out, alike, time_s),
            arriving=partial(_itself, arriving),
        )
        image = own.apply(image, exposure)
        if own.stage is Stage.LIGHT:
            light = arriving = image
        elif own.responds:
            arriving = own.apply(arriving, exposure)
    return image


def _itself(image: Image) -> Image:
    return image


def _alike(image: Image, _: int) -> Image:
    """Return the frame before, which is as this one."""
    return image
