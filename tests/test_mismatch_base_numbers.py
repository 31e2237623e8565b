"""Numbers that a user gives speak for the effect beside which they are right."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import basenumbers
from analysis.mismatch.rank import Ranked
from analysis.mismatch.ties import by_numbers
from dsis.camera import BaseNoise, Segment

GIVEN = BaseNoise(segment=(Segment(slope=0.40, intercept=5.0),))
BESIDE = {"spatial_filtering": 0.4002, "crosstalk": 0.3923, "readout_memory": 0.3923}
ERROR = 0.0005


def _ranked(kind: str, gain: float) -> Ranked:
    proposal: Any = SimpleNamespace(effect=SimpleNamespace(kind=kind))
    polished: Any = SimpleNamespace(mean=np.zeros(2), effects=(kind,))
    return Ranked(gain, kind, proposal, polished)


def _calibrated(slope: float) -> Any:
    piece = SimpleNamespace(
        slope=slope, slope_error=ERROR, intercept=5.0, intercept_error=float("nan")
    )
    return SimpleNamespace(fit=SimpleNamespace(pieces=[piece]))


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the order of two that tie, by what slope fits without them, and what was given."""
    monkeypatch.setattr(basenumbers, "joined", lambda _camera, effects, _given: effects[0])

    def order(
        alone: float,
        *,
        given: BaseNoise = GIVEN,
        twin: bool = False,
        there: tuple[Any, ...] = (),
        other: str = "crosstalk",
    ) -> list[str] | None:
        setting = SimpleNamespace(given=0, calibrated=lambda kind, _near: _calibrated(BESIDE[kind]))
        state: Any = SimpleNamespace(
            camera=SimpleNamespace(effect=there), setting=setting, calibrated=_calibrated(alone)
        )
        best, rival = _ranked(other, 40.0), _ranked("spatial_filtering", 39.5)
        found = by_numbers(state, given, [best] if twin else [best, rival], rival)
        assert found is None or found[0].gain == 40.0
        return None if found is None else [one.kind for one in found]

    return order


def test_that_with_which_numbers_hold_goes_first(told: Any) -> None:
    assert told(0.3923) == ["spatial_filtering", "crosstalk"]


def test_a_memory_may_lessen_variances_as_a_filter_does(told: Any) -> None:
    """Numbers that hold beside a filter do so beside a sample that gives what the next one gets."""
    assert told(0.3923, other="readout_memory") is None
    kept = BaseNoise(segment=(Segment(slope=0.3923, intercept=5.0),))
    assert told(0.4002, given=kept, other="readout_memory") == [
        "readout_memory",
        "spatial_filtering",
    ]


def test_numbers_that_hold_anyway_may_have_been_measured_with_either(told: Any) -> None:
    fitted = BaseNoise(segment=(Segment(slope=0.3923, intercept=5.0),))
    assert told(0.3923, given=fitted) is None


def test_numbers_that_are_wrong_beside_both_say_nothing(told: Any) -> None:
    wrong = BaseNoise(segment=(Segment(slope=0.43, intercept=5.0),))
    assert told(0.3923, given=wrong) is None


def test_what_may_not_be_named_leaves_a_tie(told: Any) -> None:
    assert told(0.3923, twin=True) is None


def test_numbers_with_errors_of_their_own_say_less(told: Any) -> None:
    unsure = BaseNoise(segment=(Segment(slope=0.40, intercept=5.0, slope_se=0.01),))
    assert told(0.3923, given=unsure) is None


def test_of_a_rival_that_is_named_already_nothing_is_said(told: Any) -> None:
    assert told(0.3923, there=(SimpleNamespace(kind="spatial_filtering"),)) is None
