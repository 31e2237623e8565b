"""Frames that move as a whole, and frames whose mean moves because a part of them does."""

from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.stats import beta, chi2

from analysis.mismatch.bank.linemeans import AXES, Axis, LineMeans
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift
from dsis.effects.pink_noise import PinkNoise

Array = NDArray[np.float64]
_PARTS = 4  # of a frame: a wave has two phases, beside what all have
_OF_LIGHT = {"flicker": True, "black_level_drift": False}
_NAMES = {"row": "upper and lower parts", "column": "left and right parts"}
_UNLIKE = 0.3  # of what moves a frame, by which a part may depart from it
_CHANCE = 1e-3  # that parts tell so much of what the whole moves by
_COLUMNS = frozenset({"column_variance", "column_spectrum_peak"})
_MOST = 0.5  # of what moves the mean of a frame, that parts may make


def of_moving_parts(state: State, kind: str, without: Array) -> Denial | None:
    """Return how drift or flicker is denied by parts of frames that move; None: it is not.

    What moves a whole frame, by as much everywhere or in proportion to the light, does not depend
    on how its parts move against each other: rows that move, bands of light, a half that is read by
    an amplifier of its own. So of the variance of frames' means is left, once it was regressed on
    the differences of a few parts, what the whole has: 1 / (1' C^-1 1), C their covariance; by
    chance the share has a beta distribution. Where that is half of what the effect would explain or
    less, and hardly ever by chance, the frame does not move as a whole. Nor where columns that are
    left unexplained are alike over a part of the frame, see `_slow`.

    Parameters
    ----------
    state
        With the effect, or before it is taken in.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in _OF_LIGHT:
        return None
    for axis in AXES:
        own = _moving(state, axis, without, of_light=_OF_LIGHT[kind])
        if own is not None and (denial := _apart(own, axis)) is not None:
            return denial
    coloured = any(m.statistic in _COLUMNS for m in state.mismatches)
    return _slow(own) if own is not None and coloured and not _OF_LIGHT[kind] else None


@dataclass(frozen=True)
class _Parts:
    """How parts of frames move: covariance (part, part), noise of one, and degrees of freedom."""

    covariance: Array
    noise: float
    free: int

    @property
    def whole(self) -> float:
        """Variance of the mean of all parts, beyond noise."""
        return float(self.covariance.mean()) - self.noise / _PARTS


@dataclass(frozen=True)
class _Moving:
    """How parts move in all exposures, weighted as far as the mean does.

    Covariance (part, part), noise of one part, what an effect would explain of the mean's variance,
    and degrees of freedom.
    """

    covariance: Array
    noise: float
    claimed: float
    free: float


def _moving(state: State, axis: Axis, without: Array, *, of_light: bool) -> _Moving | None:
    total, inverse = np.zeros((_PARTS, _PARTS)), 0.0
    noise = claimed = size = 0.0
    for exposure in state.setting.layout.uniform:
        own = _parts(state, exposure.name, axis, of_light=of_light)
        if own is None or own.whole <= 0:
            continue
        scale = float(np.trace(own.covariance))
        weight = own.free * own.whole / scale**2  # as far as the mean moves
        total += weight * own.covariance
        noise += weight * own.noise
        claimed += weight * own.whole * _unexplained(state, exposure.name, without)
        size += weight * scale
        inverse += (weight * scale) ** 2 / own.free
    free = size**2 / inverse if inverse else 0.0  # Satterthwaite (1946)
    return _Moving(total, noise, claimed, free) if claimed > 0 and free >= _PARTS else None


def _apart(own: _Moving, axis: Axis) -> Denial | None:
    """Return how frames that move are denied by parts that move against each other; None: not."""
    total, noise, free = own.covariance, own.noise, own.free
    unlike = _UNLIKE**2 * max(float(total.mean()) - noise / _PARTS, 0.0)
    one, apart = np.ones(_PARTS), total + unlike * np.eye(_PARTS)
    left = 1 / float(one @ np.linalg.solve(apart, one))
    usual = left * free / (free - _PARTS + 1) - (noise + unlike) / _PARTS
    chance = beta.cdf(left / float(apart.mean()), (free - _PARTS + 1) / 2, (_PARTS - 1) / 2)
    if usual > _MOST * own.claimed or chance > _CHANCE:
        return None
    why = f"{_NAMES[axis]} move against each other, and take the mean of the frame along"
    return Denial(max(usual / own.claimed, 0.0), why)


def _slow(own: _Moving) -> Denial | None:
    """Return how drift is denied by slow waves across columns; None: it is not.

    Noise of a read-out that goes from column to column has no less power at no frequency, in the
    mean of a frame, than in waves of half a cycle and of one, if it falls with frequency as 1/f
    noise does, or is white. Where these would move the mean by half as much as the effect, and are
    hardly ever noise of single pixels, the frame may not move as a whole.
    """
    waves = fft.dct(np.eye(_PARTS), axis=0, norm="ortho")[1:3]
    power, noise = float(np.mean([one @ own.covariance @ one for one in waves])), own.noise
    made, free = (power - noise) / _PARTS, len(waves) * own.free
    by_chance = noise > 0 and float(chi2.sf(free * power / noise, free)) > _CHANCE
    if made < _MOST * own.claimed or by_chance:
        return None
    why = "columns are alike over parts of the frame, and move its mean as well"
    return Denial(max(1 - made / own.claimed, 0.0), why)


def _parts(state: State, exposure: str, axis: Axis, *, of_light: bool) -> _Parts | None:
    """Return how parts of the frames of an exposure move; as shares of their light, or in DN."""
    own = state.setting.seen.lines.get((exposure, axis))
    channels, signals = state.setting.layout.channels, state.calibrated.fit.signal_dn
    light = float(np.mean([signals[exposure, c] for c in channels])) if of_light else 1.0
    if own is None or own.frames < 2 or own.fixed.size < own.parts.shape[1] or light <= 0:
        return None
    parts = _merged(own)
    mean = parts.mean(0)
    unit = light + (mean - mean.mean()) if of_light else np.ones(_PARTS)
    moved = (parts - mean) / np.maximum(unit, _UNLIKE * light)
    covariance = moved.T @ moved / (own.frames - 1)
    noise = own.noise_dn2 * _PARTS / own.fixed.size / light**2
    return _Parts(covariance, noise, own.frames - 1) if covariance.any() else None


def _merged(own: LineMeans) -> Array:
    """Return the means of few parts of each frame: (frame, part), DN."""
    return np.asarray(own.parts.reshape(own.frames, _PARTS, -1).mean(2))


def _unexplained(state: State, exposure: str, without: Array) -> float:
    """Return which share of how far frames' means move is not explained without the effect."""
    seen: list[float] = []
    made: list[float] = []
    for key, value, mean, known in zip(
        state.vector.keys, state.vector.values, without, state.null.known, strict=True
    ):
        of_frames = key.statistic == "frame_variance" and key.exposure == exposure
        if of_frames and known and not key.detail and np.isfinite(mean):
            seen.append(float(value) ** 3 - 1)
            made.append(float(mean) ** 3 - 1)
    whole = float(np.mean(seen)) if seen else 0.0
    return float(np.clip(1 - np.mean(made) / whole, 0.0, 1.0)) if whole > 0 else 1.0


def of_pink_noise(state: State, effect: Effect) -> Denial | None:
    """Return how drift is denied by 1/f noise that the camera has; None: it is not.

    That noise is one series in each frame, and ends at waves of two frames' length; a read-out goes
    on from frame to frame. Its variance is shared by ln(N / 2) + 0.58 natural intervals of
    frequency, of N pixels; each further one has as much, and between two frames' length and all n
    frames, with the trend that is left below, lie about ln(n / 2) + 1/3. Where these make half of
    the drift, frames may not move by themselves.
    """
    pink = [e.sigma_dn for e in state.camera.effect if isinstance(e, PinkNoise)]
    if not isinstance(effect, BlackLevelDrift) or not pink or not effect.sigma_dn:
        return None
    layout = state.setting.layout
    frames = max(len(e.numbers) for e in layout.uniform)
    within = log(layout.rows * layout.columns / 2) + np.euler_gamma
    made = max(pink) ** 2 / within * max(log(frames / 2) + 1 / 3, 0.0)
    if made < _MOST * effect.sigma_dn**2:
        return None
    why = "1/f noise that goes on from frame to frame moves their means by as much"
    return Denial(max(1 - made / effect.sigma_dn**2, 0.0), why)
