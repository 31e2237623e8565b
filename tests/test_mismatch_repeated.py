"""Offsets that are new in each exposure are no fixed pattern.

Frames are numpy's; nothing of them is made by the effects.
"""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.layout import Layout
from analysis.mismatch.repeated import Repeated, repeats_of
from analysis.mismatch.taking import layout_of
from dsis.cfa import Cfa
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded

ROWS, COLUMNS, FRAMES = 48, 64, 8
NAMES = ("dark-0", "dark-1", "flat-0", "flat-1", "flat-2")
SHAPES = {"dsnu": (ROWS, COLUMNS), "row_fpn": (ROWS, 1), "column_fpn": (1, COLUMNS)}
SIGMA = 1.0
Array = NDArray[np.float64]


def _recording(cfa: Cfa = Cfa.MONO) -> InMemory:
    sizes = {"rows": ROWS, "columns": COLUMNS, "frames": FRAMES}
    return recorded(camera(cfa=cfa.name), 1, levels=FEW_LEVELS, **sizes)


def _layout(cfa: Cfa) -> Layout:
    recording = _recording(cfa)
    numbers = {e.name: tuple(range(len(e.frames))) for e in recording.exposures}
    assert recording.stacks is not None
    stacks = recording.stacks
    return layout_of(recording, numbers, lambda name, which: stacks[name][list(which)])


def _found(patterns: Mapping[str, Array], cfa: Cfa) -> Mapping[str, Repeated]:
    def frames(name: str) -> Iterator[Array]:
        draws = np.random.default_rng(NAMES.index(name))
        gains = 1 + 0.01 * np.random.default_rng(99).standard_normal((ROWS, COLUMNS))
        light = 300.0 * NAMES.index(name) * gains * (1 - 0.1 * np.linspace(-1, 1, COLUMNS) ** 2)
        for _ in range(FRAMES):
            yield light + patterns[name] + 2 * draws.standard_normal((ROWS, COLUMNS))

    return repeats_of(_layout(cfa), frames)


def _of(draw: Callable[[int], Array], kind: str) -> dict[str, Array]:
    return {name: np.broadcast_to(draw(k), SHAPES[kind]) for k, name in enumerate(NAMES)}


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("kind", sorted(SHAPES))
def test_a_fixed_pattern_is_repeated(kind: str, cfa: Cfa) -> None:
    own = SIGMA * np.random.default_rng(7).standard_normal(SHAPES[kind])
    found = _found(_of(lambda _: own, kind), cfa)[kind]
    assert found.pattern == pytest.approx(SIGMA**2, rel=0.5)
    assert abs(found.shared - found.pattern) < 5 * found.error
    assert found.denial is None


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("kind", sorted(SHAPES))
def test_a_pattern_that_is_new_in_each_exposure_is_not(kind: str, cfa: Cfa) -> None:
    draws = np.random.default_rng(8)
    found = _found(_of(lambda _: SIGMA * draws.standard_normal(SHAPES[kind]), kind), cfa)[kind]
    assert abs(found.shared) < 5 * found.error
    assert found.denial is not None
    assert "new in each exposure" in found.denial.why


def test_a_dark_frame_taken_off_before_each_series_is_no_dsnu() -> None:
    """Of 9 frames: a third of the read noise, the same in a series, another in the next."""
    like, draws = _recording(), np.random.default_rng(5)
    assert like.stacks is not None
    stacks = {}
    for exposure in like.exposures:
        signal = exposure.light or 0.0
        own = draws.standard_normal((FRAMES, ROWS, COLUMNS)) * np.sqrt(0.5 * signal + 20)
        taken_off = draws.standard_normal((ROWS, COLUMNS)) * np.sqrt(20 / 9)
        stacks[exposure.name] = np.rint(64 + signal + own - taken_off).astype(np.uint16)
    series = InMemory(like.sensor, like.exposures, ROWS, COLUMNS, like.folder, stacks)
    found = find_mismatch(camera(), series, seed=1, vocabulary=frozenset({"dsnu"}))
    assert not found.omitted_physics
    assert "fixed_pixel_variance" in {one.statistic for one in found.unexplained}
