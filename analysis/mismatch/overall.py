"""What maps over all exposures show: their statistics, and waves that stand still in them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.maps import ALONE
from analysis.mismatch.bank.parts import Parts, parts
from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.scalars import Number
from analysis.mismatch.bank.standing import NAME as FIXED_WAVE
from analysis.mismatch.bank.standing import standing
from analysis.mismatch.bank.together import together
from analysis.mismatch.bank.waves import WaveSums
from analysis.mismatch.layout import Layout
from analysis.mismatch.summed import ChannelSums

Array = NDArray[np.float64]


def maps_of(
    layout: Layout, sums: Mapping[str, ChannelSums], waves: WaveSums
) -> tuple[
    dict[tuple[str, str], Mapping[str, Number]],
    dict[tuple[str, str], tuple[Array, float]],
    dict[tuple[str, str], Peak],
]:
    """Return the statistics of all maps, the maps with their noise, and waves that stand in them.

    `waves` are those of the whole sensor that move.
    """
    numbers: dict[tuple[str, str], Mapping[str, Number]] = {}
    images: dict[tuple[str, str], tuple[Array, float]] = {}
    split: dict[str, dict[str, Parts]] = {}
    sharp: dict[str, dict[str, float]] = {}
    for name, own in sums.items():
        for kind, (image, noise) in own.patterns.maps().items():
            images[name, kind] = (image, noise)
            part = parts(image, noise)
            numbers[name, kind] = part.numbers
            split.setdefault(kind, {})[name] = part
            sharp.setdefault(kind, {})[name] = own.patterns.regressors.sharpness(kind, noise)
        images[name, "variance"] = (own.variances.total, own.variances.squares**0.5)
    for kind, by_channel in split.items():
        if len(by_channel) == len(layout.sites) > 1:
            numbers["", kind] = together(by_channel, sharp[kind], layout.sites)
    fixed: dict[tuple[str, str], Peak] = {}
    for one in ALONE:
        kind = one if f"{one} alone" not in split else f"{one} alone"
        planes = {name: part.pixels for name, part in split.get(kind, {}).items()}
        if len(planes) != len(layout.sites):
            continue
        where = "" if len(planes) > 1 else layout.channels[0]
        number, peak = standing(planes, sharp[kind], layout.sites, waves)
        numbers[where, kind] = {**numbers[where, kind], FIXED_WAVE: number}
        if peak is not None:
            fixed[where, f"{FIXED_WAVE}, {kind}"] = peak
    return numbers, images, fixed
