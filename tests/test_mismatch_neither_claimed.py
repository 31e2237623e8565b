"""Of two effects that frames show alike neither is claimed, nor what makes the same, and worse."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import choice
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.rowtold import AS_WELL

BANDS, WAVE, DRIFT = np.array([1.0, 0.9, 0.0]), np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def _ranked(kind: str, gain: float, mean: np.ndarray) -> Any:
    proposal = SimpleNamespace(effect=SimpleNamespace(kind=kind))
    return SimpleNamespace(
        kind=kind,
        name=kind,
        gain=gain,
        mean=mean,
        proposal=proposal,
        polished=SimpleNamespace(mean=mean),
    )


def _listed(asked: object) -> bool:
    """Return whether an argument is the list of ranked effects."""
    return isinstance(asked, list)


@pytest.mark.parametrize(
    ("why", "left"),
    [(f"{AS_WELL} 1/f noise", "black_level_drift"), ("of another", "periodic_noise")],
)
def test_a_stand_in_is_not_claimed_for_two_that_frames_show_alike(
    why: str, left: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = [
        _ranked("row_banding", 60.0, BANDS),
        _ranked("periodic_noise", 36.0, WAVE),
        _ranked("black_level_drift", 8.0, DRIFT),
    ]

    def ranked(_state: Any, kinds: Any, *rest: Any) -> list[Any]:
        apart = rest[3]
        alike = [one for one in found if any(one.mean @ other > 1 for other in apart)]
        return [one for one in found if one.kind in kinds and one not in alike][:1]

    def denied(_state: Any, _lines: Any, best: Any, *_: Any) -> Denial | None:
        return Denial(0.0, why) if best.kind == "row_banding" else None

    monkeypatch.setattr(choice, "ranked", ranked)
    monkeypatch.setattr(choice, "unlike_frames", denied)
    for told in ("refuted", "displaced", "twin"):
        monkeypatch.setattr(choice, told, lambda *_: None)
    for order in ("as_shown", "in_form", "plainest"):
        monkeypatch.setattr(choice, order, lambda *asked: next(filter(_listed, asked)))
    search: Any = object.__new__(choice.Choice)
    search.__dict__.update(
        vocabulary=frozenset(one.kind for one in found), named=[], refused={}, settled=[], tied={},
        lines=None, memory=None, step=None, camera=None, setting=None,
    )  # fmt: skip
    monkeypatch.setattr(choice, "replicates_for", lambda *_: 2)
    monkeypatch.setattr(choice.Choice, "_shown", lambda *_: -np.inf)
    state: Any = SimpleNamespace(predictor=lambda _count: None)
    assert [one.kind for one in search._decided(state)] == [left]
