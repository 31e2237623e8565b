"""Which of its kind an effect is: lines have frequencies of their own, decays their edges."""

from math import sqrt

from analysis.mismatch.layout import Layout
from dsis.effects import Effect
from dsis.effects.line_flicker import LineFlicker
from dsis.effects.line_settling import LineSettling

LINES = frozenset({"periodic_noise", "bistable_pattern"})
Frequency = tuple[float, float]
_SAME = 1.5  # bins: a frequency is known no better than where it stands between two


def frequency_of(effect: Effect | None) -> Frequency | None:
    """Return the frequency of a line, cycles per pixel (x, y); None: the effect is no line."""
    if effect is None or effect.kind not in LINES:
        return None
    found: Frequency = effect.frequency  # type: ignore[attr-defined] # both lines have one
    return found


def of_pixels(frequency: Frequency, most: int = 8) -> bool:
    """Return whether a frequency is that of what repeats over two, four, `most` pixels."""
    return all((most * f) % 1 == 0 for f in frequency)


def unmeasured(frequency: Frequency, layout: Layout) -> float:
    """Return the standard error of a frequency that frames do not measure, cycles per pixel.

    It is anywhere between two of the waves that fit into a frame; what repeats over two, four or
    eight pixels lies where it lies.
    """
    return 0.0 if of_pixels(frequency) else 1 / sqrt(12) / min(layout.rows, layout.columns)


def instance(kind: str, effect: Effect | None) -> str:
    """Return the identity of an effect: its kind, of a line its frequency, of a decay its edge."""
    if isinstance(effect, LineSettling):
        return f"{kind} ({effect.edge})"
    frequency = frequency_of(effect)
    return kind if frequency is None else f"{kind} ({frequency[0]:.5g}, {frequency[1]:.5g})"


def kind_of(name: str) -> str:
    """Return the kind of an identity."""
    return name.partition(" ")[0]


def same_line(one: Frequency, other: Frequency, rows: int, columns: int, step: int = 1) -> bool:
    """Return whether two frequencies are one line of a plane of rows and columns.

    A plane that takes every `step`-th pixel sees frequencies modulo 1 / step; a real wave has the
    frequency -f as well.
    """

    def apart(sign: int, axis: int, size: int) -> float:
        turns = (sign * one[axis] - other[axis]) * step
        return abs(turns - round(turns)) * size

    return any(apart(s, 0, columns) < _SAME and apart(s, 1, rows) < _SAME for s in (1, -1))


def same_place(one: Effect, other: Effect, layout: Layout) -> bool:
    """Return whether two effects are waves of one frequency: bands of light go down the rows."""
    first, second = (_wave(own, layout) for own in (one, other))
    if first is None or second is None:
        return False
    return same_line(first, second, layout.rows, layout.columns)


def _wave(effect: Effect, layout: Layout) -> Frequency | None:
    if isinstance(effect, LineFlicker):
        return 0.0, layout.seen_cycles(effect.cycles_per_frame) / layout.rows
    return frequency_of(effect)
