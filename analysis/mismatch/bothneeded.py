"""Two effects that make neighbours alike, both there: fitted one by one neither is right."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.fitted import MAKE_ALIKE
from analysis.mismatch.named import SHAPES
from analysis.mismatch.polish import polish
from analysis.mismatch.rank import SURE_GAIN, Ranked
from analysis.mismatch.state import State
from dsis.effects import Effect

_CLEAR = 3.0  # standard errors


def both_needed(state: State, fitted: Sequence[Ranked]) -> tuple[Ranked, Ranked] | None:
    """Return the best of ranked effects and a rival, as they are beside each other.

    Charge that is shared makes neighbours alike in light alone, a filter in the dark too: where a
    sensor has both, each alone explains some of what both do, and leaves the rest by its law. One
    after the other is no way: alone the first is fitted too large. None where fitted together they
    do not gain over each what an effect that is taken in gains, or one of them is not clear.
    """
    best, *others = fitted
    rivals = (one for one in others if one.kind in MAKE_ALIKE and one.kind != best.kind)
    other = next(rivals, None) if best.kind in MAKE_ALIKE else None
    if other is None or max(len(own.polished.effects) for own in (best, other)) > 1:
        return None
    starts = [replace(own.proposal, effect=own.polished.effects[0]) for own in (best, other)]
    predictor = state.predictor()
    together = polish(predictor, state.camera, starts)
    if together is None or not all(map(_clear, starts, together.effects, together.errors)):
        return None
    gain = predictor.gain(together.mean)
    alone = max(predictor.gain(own.mean) for own in (best, other))
    if gain - alone - other.proposal.price < SURE_GAIN:
        return None
    first, second = (
        replace(own, gain=gain, polished=replace(together, effects=(effect,), errors=(errors,)))
        for own, effect, errors in zip(
            (best, other), together.effects, together.errors, strict=True
        )
    )
    return first, second


def _clear(start: Proposal, effect: Effect, errors: Mapping[str, float]) -> bool:
    """Return whether the sizes of an effect are clearly not none."""
    sizes = [name for name in start.free if name not in SHAPES]
    return bool(sizes) and all(
        abs(float(getattr(effect, name))) > _CLEAR * errors[name] for name in sizes
    )
