"""A large recording, thinned: what is enough to find which physics is missing.

Whether an effect is there at all, and how strong it is, is judged on all development frames; the
many trials on the way are made on some exposures, evenly spaced, and some frames of each.
"""

from collections.abc import Sequence
from dataclasses import replace

from analysis.mismatch.layout import Layout, Taken

_FRAMES = 16  # of an exposure, in a row: enough for what frames have in common
_STACK = 6  # frames from which an exposure shows more than a pair does
_EXPOSURES = 14  # of fewer frames


def thinned(layout: Layout) -> Layout:
    """Return the layout with some of its exposures and frames; all stacks and kinds are kept."""
    few = [e for e in layout.exposures if len(e.numbers) < _STACK and e.kind != "scene"]
    darks, flats = ([e for e in few if e.kind == kind] for kind in ("dark", "flat"))
    darks.sort(key=lambda e: (e.exposure_time_s, e.name))
    flats.sort(key=lambda e: (layout.signal_dn[e.name, layout.channels[0]], e.name))
    third = _EXPOSURES // 3
    taken = {*_some(darks, third), *_some(flats, _EXPOSURES - min(third, len(darks)))}
    left_out = {e.name for e in few} - taken
    return replace(
        layout,
        exposures=tuple(
            replace(e, numbers=e.numbers[:_FRAMES])
            for e in layout.exposures
            if e.name not in left_out
        ),
    )


def _some(exposures: Sequence[Taken], most: int) -> list[str]:
    """Return names of at most so many exposures, the first and the last among them."""
    if len(exposures) <= most:
        return [e.name for e in exposures]
    step = (len(exposures) - 1) / max(most - 1, 1)
    return [exposures[round(i * step)].name for i in range(most)]
