"""How far a parameter hangs on the form of a law that the recording does not tell."""

from analysis.mismatch.layout import Layout
from dsis.effects import Effect
from dsis.effects.brighter_fatter import BrighterFatter

_OF_SHARE = 10 / 3  # times the share of a neighbour, see `form_of`


def form_of(effect: Effect, name: str, layout: Layout) -> float:
    """Return the standard error of a parameter relative to it, for the form of its law.

    Of the brighter-fatter effect charge is exchanged once in the model, after it was collected. In
    a sensor that goes on while it comes in: of a wave that loses the share x of its power to first
    order 1 - x + 2 x^2 / 3 is left then, the integral of exp(-2 x t), where the model has
    1 - x + x^2 / 4 (Astier et al., A&A 629, 2019). With x = 8 a S in the mean of all waves the rate
    a differs by (2/3 - 1/4) 8 a S = 10/3 a S of itself, S the brightest flat's signal: as much is
    its error.
    """
    if not isinstance(effect, BrighterFatter) or name != "per_dn":
        return 0.0
    flats = {e.name for e in layout.uniform if e.kind == "flat"}
    most = max((dn for (where, _), dn in layout.signal_dn.items() if where in flats), default=0.0)
    return _OF_SHARE * effect.per_dn * most
