"""What the search remembers of effects that it tried."""

from collections.abc import Iterable
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


@pytest.fixture(autouse=True)
def nothing_is_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rank, "alike", lambda *_: False)


def _tried(off: str, kinds: Iterable[str], memory: Memory) -> list[Any]:
    """Return what is tried where a statistic is off; what is predicted is a proposal's gain."""
    state: Any = SimpleNamespace(
        mismatches=[SimpleNamespace(statistic=off)],
        clues=lambda _: None,
        predictor=lambda _: SimpleNamespace(
            loglik=lambda mean: float(mean[0]), gain=lambda mean, _of_pixels: float(mean[0])
        ),
        null=SimpleNamespace(mean=np.zeros(1)),
        setting=SimpleNamespace(screening=1),
    )
    return rank._tried(state, kinds, memory, lambda: None, (), (), lambda _: True)


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
        "means_of",
        lambda _s, some, *_: [
            np.array([gains[getattr(one.effect, "regions", "shading")]]) for one in some
        ],
    )
    memory = Memory()
    for now in ("left_right", "even_odd_rows", "left_right"):
        offered[:] = [now]
        found = _tried("half_seam", candidates, memory)
    assert [kind for _, kind, _ in found] == ["shading", "tap_mismatch"]


def test_beside_what_gains_much_only_what_gained_enough_is_tried_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gains = {"row_noise": 200.0, "crosstalk": 90.0, "flicker": 50.0, "prnu": 3.0, "rts": 1.0}
    calls, tried = ("row_variance",), []

    def propose(kind: str) -> Any:
        def proposed(_clues: Any) -> list[Any]:
            tried.append(kind)
            return [_proposal("row_noise", sigma_dn=gains[kind])]

        return SimpleNamespace(calls=calls, hints=(), propose=proposed)

    monkeypatch.setattr(rank, "CANDIDATES", {kind: propose(kind) for kind in gains})
    monkeypatch.setattr(
        rank, "means_of", lambda _s, some, *_: [np.array([p.effect.sigma_dn]) for p in some]
    )
    memory = Memory()

    def look(*without: str) -> list[str]:
        tried.clear()
        kinds = gains.keys() - set(without)
        _tried(calls[0], kinds, memory)
        return sorted(tried)

    assert look() == sorted(gains)  # none was tried before
    assert look("row_noise") == ["crosstalk", "flicker"]
    gains |= {"crosstalk": 40.0, "flicker": 10.0}  # less than before: what gained 3 still may wait
    assert look("row_noise") == ["crosstalk", "flicker"]
    assert look("row_noise", "crosstalk") == sorted(gains.keys() - {"row_noise", "crosstalk"})
    memory.gains.clear()  # something was dropped
    assert look("row_noise") == sorted(gains.keys() - {"row_noise"})
