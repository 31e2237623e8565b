"""A field of gains, denied: by few patches, lines or frequencies, or new noise of neighbours."""

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.fewedges import of_outermost_lines
from analysis.mismatch.fewpatches import of_few_patches
from analysis.mismatch.fewwaves import of_few_waves
from analysis.mismatch.likepatches import as_patches
from analysis.mismatch.newgrains import of_new_grains
from analysis.mismatch.state import State
from dsis.effects import Effect


def no_field(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied; None: it is not, or is another effect."""
    return (
        of_new_grains(state, effect)
        or of_few_patches(state, effect)
        or as_patches(state, effect)
        or of_few_waves(state, effect)
        or of_outermost_lines(state, effect)
    )
