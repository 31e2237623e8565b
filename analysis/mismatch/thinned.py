"""A large recording, thinned: what is enough to find which physics is missing.

Whether an effect is there at all, and how strong it is, is judged on all development frames; the
many trials on the way are made on some exposures, evenly spaced, and some frames of each.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.rank import SURE_GAIN

_STACK = 6  # frames from which an exposure shows more than a pair does


@dataclass(frozen=True)
class Stage:
    """How much of a recording a search looks at.

    Attributes
    ----------
    frames
        Of an exposure, in a row, at most: enough for what frames have in common.
    exposures
        Of fewer frames than a stack, at most.
    least
        Gain of log-likelihood below which no effect is taken in: more frames will tell.
    """

    frames: int
    exposures: int
    least: float


STAGES = (Stage(6, 6, 30.0), Stage(12, 10, SURE_GAIN))


def stages(layout: Layout) -> list[tuple[Layout, float]]:
    """Return what a search looks at, one after the other, and the least gain that counts there."""
    found = [(thinned(layout, stage), stage.least) for stage in STAGES]
    return [one for one, later in zip(found, [*found[1:], None], strict=True)
            if later is None or one[0] != later[0]]  # fmt: skip


def thinned(layout: Layout, stage: Stage) -> Layout:
    """Return the layout with some of its exposures and frames; all stacks and kinds are kept."""
    few = [e for e in layout.exposures if len(e.numbers) < _STACK and e.kind != "scene"]
    darks, flats = ([e for e in few if e.kind == kind] for kind in ("dark", "flat"))
    darks.sort(key=lambda e: (e.exposure_time_s, e.name))
    flats.sort(key=lambda e: (layout.signal_dn[e.name, layout.channels[0]], e.name))
    third = stage.exposures // 3
    taken = {*_some(darks, third), *_some(flats, stage.exposures - min(third, len(darks)))}
    left_out = {e.name for e in few} - taken
    return replace(
        layout,
        exposures=tuple(
            replace(e, numbers=e.numbers[: stage.frames])
            for e in layout.exposures
            if e.name not in left_out
        ),
    )


def with_all_frames(layout: Layout) -> Layout:
    """Return the exposures that the last look is at, each with all frames."""
    names = {e.name for e in stages(layout)[-1][0].exposures}
    return replace(layout, exposures=tuple(e for e in layout.exposures if e.name in names))


def _some(exposures: Sequence[Taken], most: int) -> list[str]:
    """Return names of at most so many exposures, the first and the last among them."""
    if len(exposures) <= most:
        return [e.name for e in exposures]
    step = (len(exposures) - 1) / max(most - 1, 1)
    return [exposures[round(i * step)].name for i in range(most)]
