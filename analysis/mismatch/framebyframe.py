"""What an effect that moves whole frames gains, each frame judged by what all others tell of it.

Of what draws one number a frame two locked frames show two numbers, that may be small by chance
where those of all others are not. So each frame is held out in turn (Stone, Journal of the Royal
Statistical Society B 36, 1974): the size is that which makes the others likeliest, the frame's mean
is expected at the mean of the others of its exposure, and it scatters about that by what is new in
each frame, and by the effect or not.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.model import Model
from analysis.mismatch.projections import FramesOf
from dsis.effects import Effect

Array = NDArray[np.float64]
SIZES: Mapping[str, str] = {"flicker": "sigma_percent", "black_level_drift": "sigma_dn"}
"""By effect its size. Flicker grows with the light, a drift is alike in all frames."""
_LEAST = 3  # frames of an exposure
_REPLICATES = 16  # simulated recordings that tell how far means scatter without the effect
_SCALES: Array = np.geomspace(0.125, 8.0, 61)  # of the size that was fitted


@dataclass(frozen=True)
class FrameByFrame:
    """What frames gain by an effect, each told by the others.

    Attributes
    ----------
    gains
        By exposure: (frame,), nats.
    least
        What all frames but one are likelier by at least, at the size that they show, nats.
    """

    gains: list[Array]
    least: float


def frame_by_frame(
    layout: Layout, frames_of: FramesOf, bare: Model, effect: Effect, seed: int
) -> FrameByFrame:
    """Return what frames gain by an effect.

    Parameters
    ----------
    layout, frames_of
        All frames that are asked; exposures of fewer than three, whose frames tell nothing but
        levels, or whose pixels are full, are not.
    bare
        The model without the effect.
    effect
        One of `SIZES`, as it was fitted.
    seed
        Of the simulations.
    """
    dumb = {name for name, _ in layout.still | layout.full}
    asked = [e for e in layout.uniform if len(e.numbers) >= _LEAST and e.name not in dumb]
    size: float = getattr(effect, SIZES[effect.kind])
    replicates = [bare.frames(layout, number, seed) for number in range(_REPLICATES)]
    likely, total = [], np.zeros(_SCALES.size)
    for exposure in asked:
        name, count = exposure.name, len(exposure.numbers)
        new = float(np.mean([_means(made, name).var(ddof=1) for made in replicates]))
        if not new > 0:  # the model's frames are alike: no law tells how far their means scatter
            continue
        signals = [layout.signal_dn[name, channel] for channel in layout.channels]
        reach = float(np.mean(signals)) / 100 if effect.kind == "flicker" else 1.0
        square = new + (_SCALES * size * reach) ** 2
        more, less = np.log(square / new), 1 / new - 1 / square
        means = _means(frames_of, name)
        off = (means - means.mean()) ** 2
        # Of all frames: of their contrasts, for nobody knows the mean.
        total += (off.sum() * less - (count - 1) * more) / 2
        off *= count / (count - 1)  # from the mean of the others, which is as unsure
        likely.append((off[:, np.newaxis] * less - more) / 2)
    others = [total - one for one in likely]
    gains = [_at(one, rest.argmax(1)) for one, rest in zip(likely, others, strict=True)]
    return FrameByFrame(gains, min((float(rest.max(1).min()) for rest in others), default=0.0))


def _at(likely: Array, best: NDArray[np.intp]) -> Array:
    """Return what frames are worth at the size that the others of each tell: (frame,)."""
    return np.asarray(np.take_along_axis(likely, best[:, np.newaxis], 1)[:, 0])


def _means(frames_of: FramesOf, name: str) -> Array:
    return np.array([np.asarray(frame, np.float64).mean() for frame in frames_of(name)])
