"""Lines that begin, or end, before the read-out has settled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.edges import line_square
from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.clues import Clues
from dsis.effects.line_settling import LineSettling

Array = NDArray[np.float64]
_EDGES = {"left": ("columns", "first"), "right": ("columns", "last"),
          "top": ("rows", "first"), "bottom": ("rows", "last")}  # fmt: skip
_LENGTHS = tuple(np.geomspace(1.0, 48.0, 24).tolist())  # pixels of the sensor
_LONGEST = 1 / 8  # of the sensor
_CLEAR = 3.0  # standard errors of a decay that is worth a trial
_NEAR = 0.5  # of what the best decay explains
_NUMBERS = {"offset": "offset_dn", "gain": "gain_percent"}


def _settling(clues: Clues) -> Sequence[Proposal]:
    """Start from the decays that fit the maps best: of long ones both ends are much alike."""
    best = [
        max((_fitted(clues, edge, own) for own in _lengths(clues, edge)), key=_clear)
        for edge in _EDGES
    ]
    most = max(map(_clear, best))
    found: list[Proposal] = []
    for edge, fit in zip(_EDGES, best, strict=True):
        start = {
            _NUMBERS[name]: float(np.clip(size, -90, 90)) if name == "gain" else size
            for name, (size, z) in fit.sizes.items()
            if abs(z) > _CLEAR
        }
        if start and _clear(fit) > _NEAR * most:
            length = {"length_pixels": fit.length, "edge": edge}
            found += proposals(
                "line_settling", [*start, "length_pixels"], list(start), **start, **length
            )
    return found


@dataclass(frozen=True)
class _Fit:
    """A decay: its length in pixels, its size in each map (DN or per cent) and standard errors."""

    length: float
    sizes: dict[str, tuple[float, float]]


def _lengths(clues: Clues, edge: str) -> list[float]:
    """Return the lengths that are tried, pixels: longer ones are smooth surfaces."""
    lines = clues.layout.columns if _EDGES[edge][0] == "columns" else clues.layout.rows
    return [own for own in _LENGTHS if own < max(lines * _LONGEST, 2 * _LENGTHS[0])]


def _clear(fit: _Fit) -> float:
    """Return how much of the maps a decay explains: chi-squared."""
    return sum(z**2 for _, z in fit.sizes.values())


def _fitted(clues: Clues, edge: str, length: float) -> _Fit:
    """Return the decay of a length that fits the maps best."""
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
            own -= beyond_smooth(_had(clues, axis, name, line, size)) * scale
            shape = beyond_smooth(np.exp(-distance / length))
            # Lines scatter beyond the noise of their pixels: a decay must stand out of that.
            square = line_square(own, noise, image.size // own.size)
            top += scale * float(shape @ own) / square
            bottom += scale**2 * float(shape @ shape) / square
        if bottom > 0:
            found[name] = (top / bottom, top / bottom**0.5)
    return _Fit(length, found)


def _places(clues: Clues, channel: str, axis: str) -> Array:
    """Return which lines of the sensor a channel's lines are."""
    site = clues.layout.sites[channel][axis == "columns"]
    count = clues.shape(channel)[axis == "columns"]
    return site + (1 if channel == "MONO" else 2) * np.arange(count, dtype=np.float64)


def _had(clues: Clues, axis: str, name: str, line: Array, size: int) -> Array:
    """Return the decays that the camera has already along an axis: DN, or per cent."""
    total = np.zeros(line.size)
    for own in clues.camera.effect:
        if isinstance(own, LineSettling) and _EDGES[own.edge][0] == axis:
            distance = line if _EDGES[own.edge][1] == "first" else size - 1 - line
            amplitude = own.offset_dn if name == "offset" else own.gain_percent
            total += amplitude * np.exp(-distance / own.length_pixels)
    return total


CANDIDATES = (Candidate("line_settling", ("fixed_edge",), _settling),)
