"""A large recording is looked at in stages: few frames for what is strong, more for the rest."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.thinned import STAGES, stages, thinned, with_all_frames
from dsis.cfa import Cfa


def _layout(*frames: tuple[str, int]) -> Layout:
    """Return a layout with exposures of a kind and a number of frames; flats grow brighter."""
    taken = tuple(
        Taken(f"{kind}-{i:02}", kind, 0.01 * (1 + i), None, tuple(range(count)))
        for i, (kind, count) in enumerate(frames)
    )
    signal = {(e.name, "MONO"): float(i * (e.kind == "flat")) for i, e in enumerate(taken)}
    return Layout(taken, 480, 640, Cfa.MONO, 10.0, 4095.0, signal, dict.fromkeys(signal, 1.0))


EMVA = _layout(*[("dark", 2)] * 22, *[("flat", 2)] * 22, ("dark", 40), ("flat", 40))


def test_each_stage_looks_at_more_and_asks_for_less() -> None:
    (few, first), (more, second) = stages(EMVA)
    assert first > second
    numbers = {e.name: set(e.numbers) for e in more.exposures}
    assert all(set(e.numbers) < numbers[e.name] or len(e.numbers) == 2 for e in few.exposures)
    assert {e.name for e in few.exposures} & numbers.keys()


@given(
    st.lists(st.tuples(st.sampled_from(["dark", "flat"]), st.integers(2, 40)), min_size=2),
    st.sampled_from(STAGES),
)
def test_stacks_the_ends_and_all_kinds_stay(frames: list[tuple[str, int]], stage: Any) -> None:
    layout = _layout(*frames)
    left = {e.name: e for e in thinned(layout, stage).exposures}
    assert {e.kind for e in left.values()} == {e.kind for e in layout.exposures}
    for e in layout.exposures:
        if len(e.numbers) >= 6:
            assert left[e.name].numbers == e.numbers[: stage.frames]
    for kind in ("dark", "flat"):
        few = [e.name for e in layout.exposures if e.kind == kind and len(e.numbers) < 6]
        if few:
            assert few[0] in left
        if len(few) > 1:
            assert few[-1] in left


@pytest.mark.parametrize(
    ("frames", "count"),
    [
        ([("dark", 4), ("flat", 4)], 1),  # nothing to leave out
        ([("dark", 8), ("flat", 8)], 2),  # the second stage takes all
    ],
)
def test_a_stage_that_would_look_at_the_same_is_left_out(
    frames: list[tuple[str, int]], count: int
) -> None:
    layout = _layout(*frames)
    found = stages(layout)
    assert len(found) == count
    assert found[-1] == (layout, STAGES[-1].least)


def test_whole_frames_are_of_the_last_look_and_all_of_them() -> None:
    """Their numbers are those that are read: a phase that moves on is told by them."""
    own = {e.name: e.numbers for e in with_all_frames(EMVA).exposures}
    assert own.keys() == {e.name for e in stages(EMVA)[-1][0].exposures}
    assert all(own[e.name] == e.numbers for e in EMVA.exposures if e.name in own)
    assert max(len(numbers) for numbers in own.values()) == 40
