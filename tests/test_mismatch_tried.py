"""What the search remembers of effects that it tried."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import rank
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.memory import Memory
from dsis.effects import registry


def _proposal(kind: str, **values: Any) -> Proposal:
    return Proposal(registry()[kind](**values), tuple(values))


def test_what_halves_gained_is_remembered_though_even_rows_were_tried_since(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gains, offered = {"left_right": 50.0, "even_odd_rows": 0.0, "shading": 60.0}, ["left_right"]

    def taps(_clues: Any) -> list[Any]:
        return [_proposal("tap_mismatch", gain_percent=1, regions=one) for one in offered]

    candidates = {
        "tap_mismatch": SimpleNamespace(calls=("half_seam",), hints=(), propose=taps),
        "shading": SimpleNamespace(
            calls=("half_seam",),
            hints=(),
            propose=lambda _: [_proposal("shading", falloff_percent=1)],
        ),
    }
    monkeypatch.setattr(rank, "CANDIDATES", candidates)
    monkeypatch.setattr(
        rank,
        "_means",
        lambda _s, some, *_: [
            np.array([gains[getattr(one.effect, "regions", "shading")]]) for one in some
        ],
    )
    monkeypatch.setattr(rank, "alike", lambda *_: False)
    state: Any = SimpleNamespace(
        mismatches=[SimpleNamespace(statistic="half_seam")],
        clues=lambda _: None,
        predictor=lambda _: SimpleNamespace(
            loglik=lambda mean: float(mean[0]), gain=lambda mean, _: float(mean[0])
        ),
        null=SimpleNamespace(mean=np.zeros(1)),
        setting=SimpleNamespace(screening=1),
    )
    memory = Memory()
    for now in ("left_right", "even_odd_rows", "left_right"):
        offered[:] = [now]
        found = rank._tried(state, candidates, memory, lambda: None, (), (), lambda _: True)
    assert [kind for _, kind, _ in found] == ["shading", "tap_mismatch"]
