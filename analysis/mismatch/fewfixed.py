"""Fixed lines that differ, and greens, which few pixels or few lines make: those stand out."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.robust import FAR_OUT, FEW, typical_square
from analysis.mismatch.bank.seams import SMOOTH_DEGREE, beyond_smooth
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.channel_imbalance import ChannelImbalance
from dsis.effects.tap_mismatch import TapMismatch

Array = NDArray[np.float64]
_LINES: Mapping[str, tuple[str, int]] = {  # the map, and the axis along which lines are averaged
    "row_fpn": ("offset", 1),
    "column_fpn": ("offset", 0),
    "row_prnu": ("gain", 1),
    "column_prnu": ("gain", 0),
}
_MOST = 0.5  # of what is explained, that few may make
_CLEAR = 4.0  # standard deviations of a mean square


def of_few_that_stand_out(state: State, effect: Effect) -> Denial | None:
    """Return how lines or greens that differ are denied by few pixels or lines; None: not.

    Every line draws its offset, or gain, and none is far from all the others. Where pixels that
    stand far out of a map - defects, or sites that focus - are left out of the means of lines, and
    then lines that stand out, nothing that is clear may be left, nor half of what there was. Means
    of greens are moved by the same pixels and lines.
    """
    if isinstance(effect, ChannelImbalance):
        return _of_greens(state, effect.gain_percent)
    if isinstance(effect, TapMismatch) and effect.regions.startswith("even_odd"):
        return _of_greens(state, effect.gain_percent) or _of_parity(state, effect.regions)
    return _of_lines(state, effect.kind) if effect.kind in _LINES else None


def _of_lines(state: State, kind: str) -> Denial | None:
    """Return how lines that differ are denied by few pixels or lines; None: they are not."""
    name, axis = _LINES[kind]
    whole = rest = dof = 0.0
    what = ""
    for _, image, _ in _maps(state, name):
        pixels, stand = _without_pixels(image)
        means = pixels.mean(axis)
        far = _far(beyond_smooth(means))
        lines = beyond_smooth(np.where(far, np.median(means), means))
        what = what or ("pixels" if stand else "lines" if far.any() else "")
        # Pixels that differ make lines differ by chance: what is left is judged by their scatter,
        # which is less than the noise expected where few that are hit make most of that.
        square = _scatter(pixels) / image.shape[axis]
        if not square > 0:
            continue
        whole += float((beyond_smooth(image.mean(axis)) ** 2).sum()) / square
        rest += float((lines[~far] ** 2).sum()) / square
        dof += lines.size - 1 - SMOOTH_DEGREE - far.sum()
    if not what or dof <= 0:
        return None
    left, everything = rest - dof, whole - dof
    if everything <= 0:
        return None
    if left > _MOST * everything or left > _CLEAR * (2 * dof) ** 0.5:
        return None
    return Denial(max(left / everything, 0.0), f"few {what} that stand far out make most of it")


def _maps(state: State, name: str) -> Iterator[tuple[str, Array, float]]:
    """Yield channel, map (row, column) and its noise."""
    for (channel, own), (image, noise) in state.setting.seen.images.items():
        if own == name and min(image.shape) > SMOOTH_DEGREE + 3:
            yield channel, image, noise


def _far(values: Array) -> NDArray[np.bool_]:
    """Return which of many values stand far out of the others, where they are few."""
    apart = values - np.median(values)
    far = np.abs(apart) > FAR_OUT * typical_square(apart) ** 0.5
    return far if far.mean() <= FEW else np.zeros_like(far)


def _without_pixels(image: Array) -> tuple[Array, bool]:
    """Return a map whose few far pixels are as the middle ones of their lines, and if any are."""
    level = np.median(image)
    down, across = (np.median(image, axis, keepdims=True) - level for axis in (1, 0))
    expected = level + down + across
    far = _far(image - expected)
    return np.where(far, expected, image), bool(far.any())


def _scatter(image: Array) -> float:
    """Return the mean square of single pixels of a map (row, column), beyond their lines."""
    own = image - image.mean(0) - image.mean(1, keepdims=True) + image.mean()
    rows, columns = image.shape
    square: float = (own**2).sum() / ((rows - 1) * (columns - 1))
    return square


def _of_parity(state: State, regions: str) -> Denial | None:
    """Return how even and odd lines of a sensor without colours are denied; None: not."""
    whole = rest = 0.0
    for channel, image, _ in _maps(state, "gain"):
        if channel != "MONO":
            return None
        axis = int(regions == "even_odd_rows")
        whole, rest = (
            float(means[1::2].mean() - means[::2].mean())
            for means in (own.mean(axis) for own in (image, _without_pixels(image)[0]))
        )
    if not whole or abs(rest) > _MOST * abs(whole):
        return None
    why = "few pixels that stand far out make even and odd lines differ"
    return Denial(abs(rest / whole), why)


def _of_greens(state: State, percent: float) -> Denial | None:
    """Return how greens that differ by so much are denied by few pixels or lines; None: not."""
    moved: dict[str, float] = {}
    for channel, image, _ in _maps(state, "gain"):
        plain, _ = _without_pixels(image)
        for axis in (0, 1):
            lines = plain.mean(axis)
            far = _far(beyond_smooth(lines))
            level = np.where(far, np.median(lines), lines)
            plain = plain + np.expand_dims(level - lines, axis)
        scale = state.setting.layout.regressors(channel).scales["gain"]
        moved[channel] = float((image - plain).mean()) / scale
    if not {"Gr", "Gb"} <= moved.keys() or not percent:
        return None
    share = abs((moved["Gr"] - moved["Gb"]) / (percent / 100))
    if share <= _MOST:
        return None
    why = "few pixels or lines that stand far out make the greens differ"
    return Denial(max(1 - share, 0.0), why)
