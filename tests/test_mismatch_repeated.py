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


def _moving(pattern: Array, kind: str, sigma: float, seed: int) -> Mapping[str, Repeated]:
    """Return what is found of a pattern of lines beside noise that lines have in each frame."""

    def frames(name: str) -> Iterator[Array]:
        draws = np.random.default_rng([seed, NAMES.index(name)])
        for _ in range(FRAMES):
            own = 300.0 * NAMES.index(name) + pattern + draws.standard_normal((ROWS, COLUMNS))
            yield own + sigma * draws.standard_normal(SHAPES[kind])

    return repeats_of(_layout(Cfa.MONO), frames)


@pytest.mark.parametrize("kind", ["row_fpn", "column_fpn"])
def test_lines_that_move_deny_no_lines_that_are_fixed(kind: str) -> None:
    """Noise of lines, 6 times a fixed pattern, leaves twice of it in a mean of 8 frames."""
    patterns = [0.5 * np.random.default_rng(k).standard_normal(SHAPES[kind]) for k in range(20)]
    found = [_moving(own, kind, 3.0, k)[kind] for k, own in enumerate(patterns)]
    assert np.mean([own.pattern for own in found]) == pytest.approx(0.25, abs=0.15)
    assert all(own.denial is None for own in found)


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
