"""What a camera's own effects add to the level and the variance of every exposure."""

from collections.abc import Iterable, Sequence
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.bulk import Bulk
from analysis.mismatch.basefit import Offsets
from analysis.mismatch.layout import Layout, Place, Taken
from analysis.mismatch.model import Model, each
from dsis.compiled import kernel
from dsis.effects import Effect
from dsis.effects.quantisation import Quantisation

_BENT = frozenset({"level", "pixel_variance"})
_SAMPLES = 6e6  # of which both are known well enough, in all replicates
_REPLICATES = 3
_FRAMES = 8  # of an exposure: more show neither better
_PARTS = 4  # of a recording, simulated side by side
Pair = tuple[float, float]
"""Level and variance."""


def bends(effects: Iterable[Effect], *, narrow: bool = False) -> bool:
    """Return whether effects change levels or variances; of coarse codes that is known exactly.

    Where noise is `narrow` beside a code, whatever spreads pixels changes how they are rounded.
    """
    others = [e for e in effects if not isinstance(e, Quantisation)]
    return bool(others) if narrow else any(e.changes & _BENT for e in others)


def bent_by(effects: Iterable[Effect], *, spiky: bool, narrow: bool = False) -> tuple[Effect, ...]:
    """Return the effects that are simulated to know what they add; see `bending_offsets`."""
    bending = _BENT | {"kurtosis"} if spiky else _BENT
    return tuple(e for e in effects if narrow or isinstance(e, Quantisation) or e.changes & bending)


def bending_offsets(
    model: Model,
    layout: Layout,
    seed: int,
    jobs: int,
    *,
    spiky: bool = False,
    narrow: bool = False,
) -> Offsets:
    """Return what the camera's own effects add to level and variance, by simulation.

    Only effects that change either are simulated, with and without: the draws are the same. Where
    recordings are `spiky`, the variance of the many counts as well, which tails change; where
    noise is `narrow`, see `bends`, all effects count.
    """
    bent = bent_by(model.camera.effect, spiky=spiky, narrow=narrow)
    codes = tuple(e for e in bent if isinstance(e, Quantisation))
    if len(codes) == len(bent):
        return Offsets()
    cameras = [model.camera.model_copy(update={"effect": own}) for own in (bent, codes)]
    samples = sum(min(len(e.numbers), _FRAMES) for e in layout.uniform)
    samples *= layout.rows * layout.columns
    replicates = min(_REPLICATES, 1 + int(_SAMPLES // samples))

    parts = [layout.uniform[i::_PARTS] for i in range(_PARTS)]
    work = [(replicate, part) for replicate in range(replicates) for part in parts]
    models = [model.with_camera(camera) for camera in cameras]
    pairs = each(partial(_levels, models, layout, seed, spiky=spiky), work, jobs)

    def change(which: int) -> dict[Place, float]:
        found: dict[Place, list[float]] = {}
        for with_effects, without in pairs:
            for place, one in with_effects.items():
                found.setdefault(place, []).append(one[which] - without[place][which])
        return {place: float(np.mean(changes)) for place, changes in found.items()}

    return Offsets(change(0), change(1), bulk_dn2=change(2) if spiky else {})


def _levels(
    models: Sequence[Model],
    layout: Layout,
    seed: int,
    work: tuple[int, Sequence[Taken]],
    *,
    spiky: bool,
) -> list[dict[Place, tuple[float, ...]]]:
    """Return level and variances of one simulated recording of each model.

    Exposure by exposure: what is drawn for one model is at hand for the next.
    """
    replicate, exposures = work
    frames_of = [model.frames(layout, replicate, seed) for model in models]
    found: list[dict[Place, tuple[float, ...]]] = [{} for _ in models]
    for e in exposures:
        for own, of in zip(found, frames_of, strict=True):
            frames: Iterable[NDArray[np.generic]] = islice(of(e.name), _FRAMES)
            many = Bulk.of(layout, e.name) if spiky else None
            pairs = _pairs(layout, frames if many is None else many.watching(frames))
            for channel, pair in pairs.items():
                bulk = () if many is None else (many.variance_dn2(channel, pair[1]),)
                own[e.name, channel] = (*pair, *bulk)
    return found


def _pairs(layout: Layout, frames: Iterable[NDArray[np.generic]]) -> dict[str, Pair]:
    """Return level and pixel variance (means of lines taken off) of each channel."""
    stack = list(frames)
    step = 1 if len(layout.sites) == 1 else 2
    found = {}
    for channel, (y, x) in layout.sites.items():
        planes = [np.ascontiguousarray(f[y::step, x::step], np.float32) for f in stack]
        mean: NDArray[np.float64] = np.zeros(planes[0].shape)
        for plane in planes:
            mean += plane
        mean /= len(planes)
        squares = sum(_squares_within(plane, mean) for plane in planes)
        n, m = mean.shape
        dof = (len(stack) - 1) * (n - 1) * (m - 1)
        found[channel] = (float(mean.mean()) - layout.black_dn, squares / dof)
    return found


@kernel
def _squares_within(frame: NDArray[np.float32], mean: NDArray[np.float64]) -> float:
    """Return the sum of squares of a frame less the mean frame, means of lines taken off."""
    rows, columns = frame.shape
    by_column = np.zeros(columns)
    squares, by_row, whole = 0.0, 0.0, 0.0
    for y in range(rows):
        line, means = frame[y], mean[y]
        total, own = 0.0, 0.0
        for x in range(columns):
            d = line[x] - means[x]
            own += d * d
            total += d
            by_column[x] += d
        squares += own
        by_row += total * total
        whole += total
    across = 0.0
    for x in range(columns):
        across += by_column[x] * by_column[x]
    squares += float(whole) * whole / (rows * columns) - by_row / columns - across / rows
    return float(squares)
