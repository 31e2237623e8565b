"""Lines that begin, or end, before the read-out has settled."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.edges import line_square_beside
from analysis.mismatch.bank.seams import Rest, beyond_smooth, centred
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout
from dsis.effects import Effect
from dsis.effects.line_settling import LineSettling

Array = NDArray[np.float64]
_EDGES = {"left": "columns", "right": "columns", "top": "rows", "bottom": "rows"}
_LENGTHS = tuple(np.geomspace(1.0, 48.0, 24).tolist())  # pixels of the sensor
_LONGEST = 1 / 8  # of the sensor
_CLEAR = 3.0  # standard errors of a decay that is worth a trial
_NEAR = 0.5  # of what a decay from the opposite edge explains
_NUMBERS = {"offset": "offset_dn", "gain": "gain_percent"}


def _settling(clues: Clues) -> Sequence[Proposal]:
    """Start from the decays that fit the maps best: of long ones both ends are much alike.

    Offset and gain may come to rest after different lengths, each to be seen in its own map: in
    what no smooth surface has, beside uneven light, and in all of it, where the decay is alone.
    """
    return [one for rest in (beyond_smooth, centred) for one in _of_rest(clues, rest)]


def _of_rest(clues: Clues, rest: Rest) -> list[Proposal]:
    """Return the proposals by what is left of means of lines."""
    best = [
        {
            name: max(fits, key=_clear)
            for name in _NUMBERS
            if (fits := _decays(clues, edge, name, rest))
        }
        for edge in _EDGES
    ]
    worth = [sum(_clear(fit) for fit in own.values()) for own in best]
    found: list[Proposal] = []
    opposites = (worth[1], worth[0], worth[3], worth[2])
    for edge, of_maps, own, opposite in zip(_EDGES, best, worth, opposites, strict=True):
        clear = {name: fit for name, fit in of_maps.items() if abs(fit.z) > _CLEAR}
        if clear and own > _NEAR * opposite:
            # What one map shows may be the other's shadow: each is tried alone, too.
            alone = [{name: fit} for name, fit in clear.items()] if len(clear) > 1 else []
            for some in (clear, *alone):
                found += _settled(edge, some)
    return found


def _settled(edge: str, fits: Mapping[str, "_Fit"]) -> list[Proposal]:
    """Return the proposal of an edge with the decays that its maps show."""
    start = {
        _NUMBERS[name]: float(np.clip(fit.size, -90, 90)) if name == "gain" else fit.size
        for name, fit in fits.items()
    }
    lengths = {"length_pixels": next(iter(fits.values())).length}
    if len(fits) > 1:
        lengths["gain_length_pixels"] = fits["gain"].length
    return proposals(
        "line_settling", [*start, *lengths], list(start), **start, **lengths, edge=edge
    )


@dataclass(frozen=True)
class _Fit:
    """A decay: its length in pixels, its size in a map (DN or per cent) and in errors of that."""

    length: float
    size: float
    z: float


def _decays(clues: Clues, edge: str, name: str, rest: Rest) -> list[_Fit]:
    """Return the decay of each length that fits a map best; none where there is no such map."""
    lengths = _lengths(clues, edge)
    axis = _EDGES[edge]
    top, bottom = np.zeros((2, len(lengths)))
    for channel, (image, noise) in clues.image(name).items():
        scale = clues.scale(name, channel) / (100 if name == "gain" else 1)
        distance = clues.layout.from_edge(channel, edge)
        own = rest(image.mean(0 if axis == "columns" else 1))
        own -= rest(_had(clues, axis, name, channel)) * scale
        shapes = rest(np.exp(-distance[:, np.newaxis] / lengths))
        # Lines scatter beyond the noise of their pixels: a decay must stand out of that.
        across = image.size // own.size
        squares = np.array([line_square_beside(own, shape, noise, across) for shape in shapes.T])
        top += scale * (own @ shapes) / squares
        bottom += scale**2 * (shapes**2).sum(0) / squares
    return [
        _Fit(length, float(t / b), float(t / b**0.5))
        for length, t, b in zip(lengths, top, bottom, strict=True)
        if b > 0
    ]


def _lengths(clues: Clues, edge: str) -> list[float]:
    """Return the lengths that are tried, pixels: longer ones are smooth surfaces."""
    lines = clues.layout.columns if _EDGES[edge] == "columns" else clues.layout.rows
    return [own for own in _LENGTHS if own < _longest(lines)]


def _longest(lines: int) -> float:
    """Return the length from which on a decay is no longer tried, pixels."""
    return float(max(lines * _LONGEST, 2 * _LENGTHS[0]))


def _clear(fit: _Fit) -> float:
    """Return how much of a map a decay explains: chi-squared."""
    return fit.z**2


def _had(clues: Clues, axis: str, name: str, channel: str) -> Array:
    """Return the decays that the camera has already along an axis: DN, or per cent."""
    total = np.zeros(clues.shape(channel)[axis == "columns"])
    for own in clues.camera.effect:
        if isinstance(own, LineSettling) and _EDGES[own.edge] == axis:
            distance = clues.layout.from_edge(channel, own.edge)
            offset = (own.offset_dn, own.length_pixels)
            amplitude, length = offset if name == "offset" else (own.gain_percent, own.gain_length)
            total += amplitude * np.exp(-distance / length)
    return total


_SMOOTH = ("fixed_smooth_variance", "fixed_smooth_tilt")  # of few lines a decay is most of it


def _short(layout: Layout, effect: Effect) -> bool:
    """Return whether a decay is short beside the sensor: long ones are uneven light."""
    if not isinstance(effect, LineSettling):
        return True
    lines = layout.columns if _EDGES[effect.edge] == "columns" else layout.rows
    return max(effect.length_pixels, effect.gain_length) < 2 * _longest(lines)


CANDIDATES = (Candidate("line_settling", ("fixed_edge",), _settling, _SMOOTH, _short),)
