"""Charge that neighbours share beside lines that begin darker: samples remember the one before."""

from analysis.mismatch.candidates.linestart import lines_begin_darker
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.crosstalk import Crosstalk
from dsis.effects.line_settling import LineSettling
from dsis.effects.spatial_filtering import SpatialFiltering

_AS_MUCH = (2 / 3, 1.5)  # of what neighbours share, by which lines begin darker


def begins_darker(state: State, effect: Effect) -> Denial | None:
    """Return how what neighbours share is denied by where lines begin; None: it is not.

    A pixel that gives each of two neighbours a share f, or is smoothed with them, is as alike with
    each as a sample is with the one before of which it has 2 f. Of such a memory, where the
    read-out rests at black before a line, the first sample lacks as much of the light: a shared
    share leaves it as bright, or takes f where there is nothing beyond the edge. Beside lines that
    have not settled nothing is said.
    """
    if not isinstance(effect, Crosstalk | SpatialFiltering):
        return None
    if any(isinstance(own, LineSettling) for own in state.camera.effect):
        return None
    axes = ("rows", "columns") if effect.along == "both" else (effect.along,)
    for axis in axes:
        share = lines_begin_darker(state.clues(), axis, 1)
        if share > 0 and _AS_MUCH[0] < 2 * effect.fraction / share < _AS_MUCH[1]:
            why = f"lines begin darker by {share:.1%}, as samples do that remember the one before"
            return Denial(0.0, why)
    return None
