"""Bends of the response that nothing but variances of scenes shows."""

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.nonlinearity import Nonlinearity


def untold_slope(state: State, effect: Effect) -> Denial | None:
    """Return how a bend is denied where no flat shows it; None: it is not.

    Levels of flats bend with their light. Of scenes alone variances are known, to which the slope
    is fitted, and what they leave may have as many reasons as a scene has.
    """
    if not isinstance(effect, Nonlinearity):
        return None
    if any(exposure.kind == "flat" for exposure in state.setting.layout.uniform):
        return None
    return Denial(0.0, "no flat shows a bend, and variances of scenes alone may have other reasons")
