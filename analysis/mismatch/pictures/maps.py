"""Maps of the fixed pattern and of noisy pixels: as recorded, and as both models simulate them."""

from collections.abc import Collection, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.maps import ALONE, MAPS
from analysis.mismatch.bank.surfaces import RING
from analysis.mismatch.evidence import Map, Shown
from analysis.mismatch.layout import Layout
from analysis.mismatch.observe import Observation
from analysis.mismatch.state import State

Array = NDArray[np.float64]
NOISY = "variance"
UNITS = {"offset": "DN", "gain": "%", "time": "DN/s", NOISY: "variance over its mean"}
# What no single exposure shows by itself: channels together may be clear, where each is not.
_MAPS_ALONE = ("fixed_smooth_tilt", "fixed_smooth_falloff", RING, "half_seam",
               "parity", "fixed_edge", "fixed_spectral_peak")  # fmt: skip
KINDS = (*MAPS, *(f"{name} alone" for name in ALONE))


def shown_in(states: Sequence[State], threshold_z: float) -> dict[str, Shown]:
    """Return in which map each statistic that differs departs most, if it does so clearly.

    What the first state shows stays as it shows it.
    """
    found: dict[str, Shown] = {}
    for state in states:
        wanted = {m.statistic for m in state.mismatches} - set(found)
        own: dict[str, Shown] = {}
        for key, z in zip(state.vector.keys, np.abs(state.departures), strict=False):
            best = own.get(key.statistic)
            if key.statistic in wanted and key.scope in KINDS and z > (best.z if best else 0):
                own[key.statistic] = Shown(map_name(key.scope), _axis(key), float(z))
        found |= {
            name: shown
            for name, shown in own.items()
            if shown.z > threshold_z or name.startswith(_MAPS_ALONE)
        }
    return found


def _axis(key: Key) -> Literal["", "rows", "columns"]:
    if key.statistic == "fixed_edge":
        return "rows" if key.detail.startswith("rows") else "columns"
    return "rows" if key.detail == "rows" else "columns" if key.detail == "columns" else ""


def map_name(kind: str) -> str:
    """Return the name in the evidence of a map of the bank: `gain_alone_map` of `gain alone`."""
    return f"{kind.replace(' ', '_')}_map"


def maps(
    layout: Layout,
    names: Collection[str],
    recorded: Observation,
    before: Observation,
    after: Observation | None,
) -> dict[str, tuple[Map, ...]]:
    """Return the maps of these names, one for each channel.

    Simulated maps are those of another sensor of the same statistics.
    """
    found = {
        map_name(kind): tuple(
            Map(
                channel,
                UNITS[kind.split()[0]],
                _image(layout, recorded, channel, kind),
                _image(layout, before, channel, kind),
                None if after is None else _image(layout, after, channel, kind),
                1 if channel == "MONO" else 2,
            )
            for channel in layout.channels
            if (channel, kind) in recorded.images
        )
        for kind in (*KINDS, NOISY)
        if map_name(kind) in names
    }
    return {name: some for name, some in found.items() if some}


def _image(layout: Layout, seen: Observation, channel: str, kind: str) -> Array:
    """Return a map in its unit: a gain in percent of the signal, a growth in DN/s."""
    image, _ = seen.images[channel, kind]
    name = kind.split(maxsplit=1)[0]
    if name == "offset":
        return image
    if name == NOISY:
        total = sum(
            (len(e.numbers) - 1) / layout.variance_dn2[e.name, channel]
            for e in layout.uniform
            if len(e.numbers) > 2
        )
        return 1 + image / total if total else 1 + image
    per = layout.regressors(channel).scales[name]
    return image * (100 / per if name == "gain" else 1 / per)
