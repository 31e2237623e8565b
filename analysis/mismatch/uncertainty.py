"""Parameters and their errors at the end: numbers that move together are not independent.

The score of the final fit is evaluated on every simulation of the final model. Its mean corrects
what the fit does wrong by itself, its covariance gives the sandwich error (Huber 1967).
"""

from collections.abc import Sequence

import numpy as np

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.polish import Free, information, jacobian, moved
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect

_LARGEST = 0.7  # correction of a logarithm


def settled(
    state: State, bare: Camera, proposals: Sequence[Proposal]
) -> tuple[tuple[Effect, ...], tuple[dict[str, float], ...]]:
    """Return effects and standard errors of their free parameters.

    Parameters
    ----------
    state
        The final model, with the effects of `proposals` in it.
    bare
        Its camera without them.
    proposals
        Effects as fitted, and which parameters are free.
    """
    effects = tuple(p.effect for p in proposals)
    free: list[Free] = [
        (i, name, name in p.signed) for i, p in enumerate(proposals) for name in p.free
    ]
    errors: tuple[dict[str, float], ...] = tuple({} for _ in proposals)
    if not free:
        return effects, errors
    predictor = state.predictor()
    mean = state.null.mean
    j = jacobian(predictor, bare, effects, free, mean)
    score, inverse = information(predictor, mean, j)
    known = state.null.known
    rest = np.where(known, state.vector.values - mean, 0.0)
    simulated = np.where(known, np.nan_to_num(state.simulated) - mean, 0.0) @ score.T
    count = len(simulated)
    covariance = np.atleast_2d(np.cov(simulated, rowvar=False)) * (1 + 1 / count)
    sandwich = inverse @ covariance @ inverse
    step = inverse @ (score @ rest)
    for (i, name, signed), delta, variance in zip(free, step, np.diag(sandwich), strict=True):
        error = float(np.sqrt(variance))
        limited = float(delta if signed else np.clip(delta, -_LARGEST, _LARGEST))
        changed = moved(effects, i, name, signed, limited, as_is=True)
        effects = effects if changed is None else changed[0]
        errors[i][name] = error * (1.0 if signed else abs(float(getattr(effects[i], name))))
    return effects, errors
