"""What is not told from a rival is not named: memory from exchange, a bend from a second path."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import ties
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.memory import Memory
from analysis.mismatch.rank import Ranked
from analysis.mismatch.segments import Path
from analysis.mismatch.ties import bends_as_well, twin
from dsis.effects import registry

MEMORY = (5.0, 0.0)  # changes of two numbers, in standard deviations


def _ranked(kind: str, gain: float, mean: Sequence[float], best_of: int = 1) -> Ranked:
    proposal: Any = SimpleNamespace(effect=SimpleNamespace(kind=kind), best_of=best_of)
    polished: Any = SimpleNamespace(mean=np.array(mean))
    return Ranked(gain, kind, proposal, polished)


def _state() -> Any:
    null = SimpleNamespace(mean=np.zeros(2), sd=np.ones(2), known=np.ones(2, bool))
    return SimpleNamespace(null=null, setting=SimpleNamespace(layout=None, large=True))


@pytest.mark.parametrize(
    ("gain", "mean", "told"),
    [
        (36.0, (5.0, 1.0), False),  # the same numbers, as well
        (20.0, (5.0, 1.0), True),  # worse
        (36.0, (2.0, 9.0), True),  # as well, but others
        (297.0, (2.0, 9.0), False),  # far better, since it explains others too
    ],
)
def test_memory_is_not_told_from_exchange_that_explains_as_much(
    monkeypatch: pytest.MonkeyPatch, gain: float, mean: tuple[float, float], *, told: bool
) -> None:
    state = _state()
    other = _ranked("crosstalk", gain, mean)
    monkeypatch.setattr(ties, "ranked", lambda *_: [other])
    best = _ranked("readout_memory", 37.0, MEMORY)
    rivals = {"crosstalk", "spatial_filtering"}  # anyway
    assert twin(state, best, rivals, Memory(), lambda: None) is None
    found = twin(state, best, {"readout_memory"}, Memory(), lambda: None)
    assert found is (None if told else other)


@pytest.mark.parametrize(
    ("gain", "mean", "told"),
    [
        (11.9, (5.0, 1.0), False),
        (13.0, (5.0, 1.0), False),  # a little ahead is no more told than a little behind
        (8.9, (5.0, 1.0), True),
        (15.1, (5.0, 1.0), True),
        (11.9, (0.5, 9.0), True),  # what explains other numbers is no rival
    ],
)
def test_a_bend_and_a_second_path_that_tie_are_told_by_nothing(
    gain: float, mean: tuple[float, float], *, told: bool
) -> None:
    best = _ranked("nonlinearity", 12.0, (4.0, 0.0))
    camera: Any = None
    path = Path(camera, 900.0, 50.0, gain, np.array(mean))
    assert bends_as_well(_state(), best, path) is (None if told else path)
    assert bends_as_well(_state(), best, None) is None


@pytest.mark.parametrize(
    ("kind", "best_of", "tied"),
    [
        ("readout_memory", 64, True),  # 31 + ln 64 = 35.2: which lag it is costs nothing
        ("readout_memory", 1, False),
        ("adc_memory", 64, False),  # no twin: that it is one of many counts
    ],
)
def test_of_twins_the_one_of_many_lags_is_not_behind(
    kind: str, best_of: int, *, tied: bool
) -> None:
    best = _ranked("spatial_filtering", 37.0, MEMORY)
    assert ties.ties(_state(), best, _ranked(kind, 31.0, MEMORY, best_of)) is tied


def test_what_may_be_one_of_two_that_tie_is_no_third() -> None:
    """Tails, or noise that differs from pixel to pixel; jumps explain less of the same."""
    mean = (4.0, 0.0)
    pair = (
        _ranked("heavy_tailed_read_noise", 61.0, mean),
        _ranked("read_noise_spread", 59.0, mean),
    )
    assert ties.akin([pair]) == {"rts", "heavy_tailed_read_noise", "read_noise_spread"}
    filters = (_ranked("readout_memory", 37.0, mean), _ranked("spatial_filtering", 36.0, mean))
    assert "crosstalk" in ties.akin([filters])
    assert ties.akin([]) == frozenset()


def _memory(gain: float, mean: Sequence[float], lag: int) -> Ranked:
    ranked = _ranked("readout_memory", gain, mean)
    effect = registry()["readout_memory"](fraction=0.05, lag_pixels=lag)
    return replace(ranked, proposal=Proposal(effect, ("fraction",)))


def test_memory_of_another_lag_is_told_though_one_ties() -> None:
    """A filter reaches the next sample; what samples two apart have in common it does not make."""
    filters = (_memory(81.0, MEMORY, 1), _ranked("spatial_filtering", 82.0, MEMORY))
    assert "readout_memory" not in ties.akin([filters])
    one, two = (_memory(80.0, MEMORY, lag).proposal.effect for lag in (1, 2))
    assert ties.of_tied_lag([filters], one)
    assert not ties.of_tied_lag([filters], two)
    assert not ties.of_tied_lag([], one)
    assert not ties.of_tied_lag([filters], registry()["spatial_filtering"](fraction=0.1))


def test_what_explains_more_but_nothing_of_the_same_is_no_twin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    other = _ranked("spatial_filtering", 104.0, (0.5, 9.0))
    monkeypatch.setattr(ties, "ranked", lambda *_: [other])
    assert twin(_state(), _ranked("readout_memory", 80.0, MEMORY), {"crosstalk"}, Memory(),
                lambda: None) is None  # fmt: skip


@pytest.mark.parametrize(("gain", "told"), [(23.0, False), (30.0, False), (20.0, True)])
def test_two_paths_apart_are_not_told_from_a_bend_that_has_no_word(
    monkeypatch: pytest.MonkeyPatch, gain: float, *, told: bool
) -> None:
    other = _ranked("nonlinearity", gain, (5.0, 1.0))
    monkeypatch.setattr(ties, "ranked", lambda *_: [other])
    monkeypatch.setattr(ties, "smooth_as_well", lambda *_: False)
    best = _ranked("dual_gain_mismatch", 24.0, MEMORY)
    assert twin(_state(), best, {"nonlinearity"}, Memory(), lambda: None) is None
    found = twin(_state(), best, {"saturation"}, Memory(), lambda: None)
    assert found is (None if told else other)


def test_levels_that_step_where_a_path_begins_are_no_bend(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor the other way round; where both have a word their gains tell, see `ties`."""
    state, both = _state(), ("nonlinearity", "dual_gain_mismatch")
    monkeypatch.setattr(ties, "smooth_as_well", lambda *_: False)
    for named, other in (both, both[::-1]):
        step = _ranked(other, 16.8, (4.0, 2.0))
        monkeypatch.setattr(ties, "ranked", lambda *_, own=step: [own])
        best = _ranked(named, 11.6, (4.5, 0.0))
        assert twin(state, best, {named}, Memory(), lambda: None) is step
        assert twin(state, best, set(both), Memory(), lambda: None) is None
    saturated = (_ranked("dual_gain_mismatch", 20.0, MEMORY), _ranked("saturation", 19.0, MEMORY))
    assert "nonlinearity" not in ties.akin([saturated])
