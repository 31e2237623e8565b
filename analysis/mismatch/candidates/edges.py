"""Lines that begin, or end, before the read-out has settled."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.clues import Clues
from dsis.effects.line_settling import LineSettling

Array = NDArray[np.float64]
_EDGES = {"left": ("columns", "first"), "right": ("columns", "last"),
          "top": ("rows", "first"), "bottom": ("rows", "last")}  # fmt: skip
_LENGTHS = np.geomspace(1.0, 48.0, 24)  # pixels of the sensor
_CLEAR = 3.0  # standard errors of a decay that is worth a trial
_NUMBERS = {"offset": "offset_dn", "gain": "gain_percent"}


def _settling(clues: Clues) -> Sequence[Proposal]:
    found: list[Proposal] = []
    for edge in _EDGES:
        lengths = _LENGTHS.tolist()
        fits = [_fitted(clues, edge, length) for length in lengths]
        best = int(np.argmax([sum(z**2 for _, z in fit.values()) for fit in fits]))
        start = {
            _NUMBERS[name]: float(np.clip(size, -90, 90)) if name == "gain" else size
            for name, (size, z) in fits[best].items()
            if abs(z) > _CLEAR
        }
        if start:
            found += proposals(
                "line_settling",
                [*start, "length_pixels"],
                list(start),
                **start,
                length_pixels=lengths[best],
                edge=edge,
            )
    return found


def _fitted(clues: Clues, edge: str, length: float) -> dict[str, tuple[float, float]]:
    """Return the size of a decay in each map, DN or per cent, and in standard errors."""
    axis, end = _EDGES[edge]
    found = {}
    for name in _NUMBERS:
        images = clues.image(name)
        top = bottom = 0.0
        for channel, (image, noise) in images.items():
            scale = clues.scale(name, channel) / (100 if name == "gain" else 1)
            line = _places(clues, channel, axis)
            size = clues.layout.columns if axis == "columns" else clues.layout.rows
            distance = line if end == "first" else size - 1 - line
            own = beyond_smooth(image.mean(0 if axis == "columns" else 1))
            own -= beyond_smooth(_had(clues, edge, name, distance)) * scale
            shape = beyond_smooth(np.exp(-distance / length))
            # Lines scatter beyond the noise of their pixels: a decay must stand out of that.
            square = max(noise**2 / (image.size / own.size), float(np.median(own**2)) / 0.455)
            top += scale * float(shape @ own) / square
            bottom += scale**2 * float(shape @ shape) / square
        if bottom > 0:
            found[name] = (top / bottom, top / bottom**0.5)
    return found


def _places(clues: Clues, channel: str, axis: str) -> Array:
    """Return which lines of the sensor a channel's lines are."""
    site = clues.layout.sites[channel][axis == "columns"]
    count = clues.shape(channel)[axis == "columns"]
    return site + (1 if channel == "MONO" else 2) * np.arange(count, dtype=np.float64)


def _had(clues: Clues, edge: str, name: str, distance: Array) -> Array:
    """Return the decay that the camera has already: DN, or per cent."""
    total = np.zeros(distance.size)
    for own in clues.camera.effect:
        if isinstance(own, LineSettling) and own.edge == edge:
            size = own.offset_dn if name == "offset" else own.gain_percent
            total += size * np.exp(-distance / own.length_pixels)
    return total


CANDIDATES = (Candidate("line_settling", ("fixed_edge",), _settling),)
