"""A slow pattern whose sign flips, in step with the mean of the frame: a part of it moves."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from analysis.mismatch.bank.linemeans import PARTS, Axis
from analysis.mismatch.instance import frequency_of
from analysis.mismatch.state import Setting
from dsis.effects import Effect

Array = NDArray[np.float64]
_SLOW = PARTS / 4  # cycles a frame, of which a part still has most
_CHANCE = 1e-3  # that two causes go together so well
_UNLIKE = 0.3  # of the pattern, by which the mean of the frame may go with it
_LEAST_FREE = 5  # frames beyond the numbers that are fitted


def in_step(setting: Setting, effect: Effect) -> str | None:
    """Return why a bistable pattern of slow waves is none; None: it may be one.

    A pattern of a few waves a frame, whose sign flips, takes the mean of the frame along as far as
    its waves are no whole number. Where the mean goes with the sign by anything else, far beyond
    chance, no such pattern moves, nor does the frame beside it: one cause moves both, as an offset
    of one half of the frame does.

    Parameters
    ----------
    setting
        What was observed.
    effect
        The pattern; of others, and of faster waves, nothing is asked.
    """
    frequency = frequency_of(effect) if effect.kind == "bistable_pattern" else None
    if frequency is None or min(map(abs, frequency)) > 0:
        return None
    fx, fy = frequency
    axis: Axis = "row" if fx == 0 else "column"
    cycles = abs(fy) * setting.layout.rows + abs(fx) * setting.layout.columns
    if not 0 < cycles <= _SLOW:
        return None
    turn = 2 * np.pi * cycles * (np.arange(PARTS) + 0.5) / PARTS
    waves = np.stack([np.cos(turn), np.sin(turn)], 1)
    inner = waves - waves.mean(0)  # seen whatever the frame does as a whole
    means, found = [], []
    for exposure in setting.layout.uniform:
        own = setting.seen.lines.get((exposure.name, axis))
        if own is None or own.frames < 2 or own.fixed.size < PARTS or own.noise_dn2 <= 0:
            continue
        moved = (own.parts - own.parts.mean(0)) / own.noise_dn2**0.5
        means.append(moved.mean(1))
        found.append(
            np.linalg.lstsq(inner, (moved - moved.mean(1, keepdims=True)).T, rcond=None)[0].T
        )
    free = sum(len(one) - 1 for one in means) - 1
    if free < _LEAST_FREE:
        return None
    phases, mean = np.concatenate(found), np.concatenate(means)
    phase = np.linalg.eigh(phases.T @ phases)[1][:, -1]  # of unit amplitude
    sign = phases @ phase
    square = float(sign @ sign)
    expected = float((waves @ phase).mean())
    apart = float(sign @ mean) / square - expected
    rest = mean - (apart + expected) * sign
    error = (float(rest @ rest) / free / square) ** 0.5
    typical = float(((waves @ phase) ** 2).mean()) ** 0.5
    chance = 2 * float(student.sf(abs(apart) / max(error, 1e-12), free))
    if chance > _CHANCE or abs(apart) < _UNLIKE * typical:
        return None
    return "the mean of the frame goes with its sign, as where one part of the frame moves"
