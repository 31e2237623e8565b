"""Whether variances lie on a line against signal: a photon transfer curve without a bend."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Place
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_LEAST_LEVELS = 4  # two of which a line takes
_NONE = 2.0  # of chi-squared: 1 nat
_BENDING = frozenset({"dual_gain", "dual_gain_mismatch", "nonlinearity", "saturation"})


def misfits(
    state: State, factor: Callable[[Place, float], float], *, beside: bool = False
) -> tuple[float, float]:
    """Return chi-squared of variances about lines, as they are and times a factor.

    A line is that of a channel: variance against signal, weighted by how well variances are known.
    `factor` gives that of a place, or the default it is handed; `beside`: see `curves`.
    """
    before = after = 0.0
    for signal, variance, weight, places in curves(state, beside=beside):
        factors = np.array([factor(at, 1.0) for at in places])
        before += misfit(signal, variance, weight)
        after += misfit(signal, variance * factors, weight)
    return before, after


def bent(state: State) -> bool:
    """Return whether the model's own variances are off a line: they misfit it by 1 nat or more."""
    expected = state.calibrated.fit.expected_dn2
    found = (
        misfit(signal, np.array([expected[at] for at in places]), weight)
        for signal, _, weight, places in curves(state)
    )
    return sum(found) > _NONE


def straight_beside(state: State, kind: str) -> bool:
    """Return whether variances of the model lie on a line but for what an effect takes of them."""
    if any(own.kind in _BENDING - {kind} for own in state.camera.effect):
        return False
    line = state.calibrated.fit.line_dn2
    return sum(misfit(x, line(x), weight) for x, _, weight, _ in curves(state)) <= _NONE


def upwards(state: State) -> bool:
    """Return whether variances bend upwards: what is added to lines goes with the square."""
    score = 0.0
    for signal, variance, weight, _ in curves(state):
        root = np.sqrt(weight) / variance
        scaled = signal / max(float(signal.max()), 1e-300)
        square = polynomial(scaled, variance, root, 2)[0][2]
        score += float(square) * float((root**2).sum()) ** 0.5
    return score > 0


def curves(
    state: State, *, beside: bool = False
) -> Iterator[tuple[Array, Array, Array, list[Place]]]:
    """Yield signals, variances, weights of their logarithms and places of each channel.

    `beside`: variances as they would be without the effects of the model, which bend them. None of
    places where there would be no noise.
    """
    levels, signals = state.setting.seen.levels, state.calibrated.fit.signal_dn
    bends = _bends(state) if beside and state.camera.effect else {}
    uniform = {e.name for e in state.setting.layout.uniform}
    for channel in state.setting.layout.channels:
        places = [
            at
            for at, own in levels.items()
            if at[0] in uniform and at[1] == channel and at in signals
            if own.variance_dn2 * bends.get(at, 1.0) > 0
        ]
        if len(places) >= _LEAST_LEVELS:
            yield (
                np.array([signals[at] for at in places]),
                np.array([levels[at].variance_dn2 * bends.get(at, 1.0) for at in places]),
                np.array([levels[at].dof / 2 for at in places]),
                places,
            )


def _bends(state: State) -> dict[Place, float]:
    """Return what makes variances what they would be without the effects of a model, by place.

    Its own line and segments, and what the recording has beyond all it expects.
    """
    fit, levels = state.calibrated.fit, state.setting.seen.levels
    found: dict[Place, float] = {}
    for i, key in enumerate(state.vector.keys):
        if key.statistic != "pixel_variance" or key.place not in fit.signal_dn:
            continue
        line = float(fit.line_dn2(np.array([fit.signal_dn[key.place]]))[0])
        rest = float(np.exp(state.vector.values[i] - state.null.mean[i]))
        if state.null.known[i] and key.place in levels and levels[key.place].variance_dn2 > 0:
            found[key.place] = max(line, 0.0) * rest / levels[key.place].variance_dn2
    return found


def misfit(signal: Array, variance: Array, weight: Array) -> float:
    """Return chi-squared of variances about the line through them; `weight` of their logarithms."""
    root = np.sqrt(weight) / variance
    _, found = polynomial(signal, variance, root, 1)
    return float((((variance - found) * root) ** 2).sum())


def polynomial(signal: Array, variance: Array, root: Array, degree: int) -> tuple[Array, Array]:
    """Return the terms of a polynomial of variances against signal, and what it makes of these.

    By least squares, `root` one over the standard deviation of each.
    """
    design = np.stack([signal**k for k in range(degree + 1)], 1)
    terms = np.linalg.lstsq(design * root[:, np.newaxis], variance * root, rcond=None)[0]
    return np.asarray(terms), np.asarray(design @ terms)
