"""Bends of the response that a slope of the camera file may feign where no flat tells it."""

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.nonlinearity import Nonlinearity


def untold_slope(state: State, effect: Effect) -> Denial | None:
    """Return how a bend is denied by a slope that nothing tells; None: it is not.

    Base numbers are fitted to darks and flats. Of scenes alone the slope of variance against signal
    stays that of the camera file, and one that is off changes all their variances, as a bend does
    most of them.
    """
    if not isinstance(effect, Nonlinearity):
        return None
    if any(exposure.kind == "flat" for exposure in state.setting.layout.uniform):
        return None
    why = (
        "no flat tells the slope of the camera file, and one that is off changes variances as well"
    )
    return Denial(0.0, why)
