"""Memory along rows is not named where what neighbours exchange explains as much, or more."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import rank
from analysis.mismatch.memory import Memory
from analysis.mismatch.rank import Ranked, twin

MEMORY = (5.0, 0.0)  # changes of two numbers, in standard deviations


def _ranked(kind: str, gain: float, mean: Sequence[float]) -> Ranked:
    proposal: Any = SimpleNamespace(effect=SimpleNamespace(kind=kind))
    polished: Any = SimpleNamespace(mean=np.array(mean))
    return Ranked(gain, kind, proposal, polished)


@pytest.mark.parametrize(
    ("gain", "mean", "told"),
    [
        (36.0, (5.0, 1.0), False),  # the same numbers, as well
        (20.0, (5.0, 1.0), True),  # worse
        (36.0, (1.0, 9.0), True),  # as well, but others
        (297.0, (1.0, 9.0), False),  # far better, since it explains others too
    ],
)
def test_memory_is_not_told_from_exchange_that_explains_as_much(
    monkeypatch: pytest.MonkeyPatch, gain: float, mean: tuple[float, float], *, told: bool
) -> None:
    null = SimpleNamespace(mean=np.zeros(2), sd=np.ones(2), known=np.ones(2, bool))
    state: Any = SimpleNamespace(null=null, setting=SimpleNamespace(layout=None))
    other = _ranked("crosstalk", gain, mean)
    monkeypatch.setattr(rank, "ranked", lambda *_: [other])
    best = _ranked("readout_memory", 37.0, MEMORY)
    assert twin(state, best, {"crosstalk"}, Memory(), lambda: None) is None  # a rival anyway
    found = twin(state, best, {"readout_memory"}, Memory(), lambda: None)
    assert found is (None if told else other)
