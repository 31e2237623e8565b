"""A line that planes of a mosaic see has several frequencies: all are looked at before none is."""

from types import SimpleNamespace as Stub
from typing import Any

import pytest

from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.candidates.temporal import frequencies
from analysis.mismatch.clues import NO_LINE

KIND, LINE, OTHER = "bistable_pattern", (0.0, 0.25), (0.5, 0.25)


def _proposed(*settled: tuple[str, tuple[float, float]]) -> list[tuple[float, float]]:
    """Return where a pattern is proposed by the strongest line of planes, at (0, 1 / 2)."""
    place = ("flat-0", "R")
    clues: Any = Stub(
        places=[place],
        seen=Stub(
            levels={place: Stub(variance_dn2=4.0)},
            peaks={("R", "spectrum"): Peak(0.0, 0.5, 60.0)},
            pooled={},
        ),
        layout=Stub(rows=64, columns=96, channels=("R",)),
        shape=lambda _: (32, 48),
        amplitude=lambda *_: (0.0, 1.0),
        value=lambda *_: 0.0,
        settled=settled,
    )
    clues.seen.pooled = {"R": {"alternation_variance of cells": (0.0, 1.0)}}
    return [(abs(fx), abs(fy)) for fx, fy, _ in frequencies(clues, KIND)]


@pytest.mark.parametrize("kind", [KIND, "periodic_noise"])
def test_the_other_frequency_of_a_line_is_looked_at(kind: str) -> None:
    """Frames that show no wave of 1 / 2 cycle across say nothing of the one without."""
    assert set(_proposed()) == {LINE, OTHER}
    assert set(_proposed((NO_LINE, OTHER))) == {LINE}
    assert set(_proposed((NO_LINE, LINE))) == {OTHER}
    assert _proposed((NO_LINE, LINE), (NO_LINE, OTHER)) == []
    named = _proposed((kind, LINE))  # of this kind it needs no trial, at any of them
    assert named == [] if kind == KIND else set(named) == {LINE, OTHER}
