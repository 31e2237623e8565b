"""Odds of two effects, from what recordings with either gain by them."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm

from analysis.mismatch import advantage, ties
from analysis.mismatch.advantage import odds
from analysis.mismatch.predict import Predictor, Reference
from analysis.mismatch.vector import Vector
from exposing import effect

NUMBERS, MANY = 6, 4000
ONE, OTHER = effect("dsnu", sigma_dn=1.0), effect("prnu", sigma_percent=1.0)
MEANS = {"dsnu": np.full(NUMBERS, 3.0), "prnu": np.linspace(6.0, 0.0, NUMBERS)}


class Gaussian:
    """Predicts numbers of unit variance; it takes them to be independent."""

    def __init__(self, values: np.ndarray | None = None) -> None:
        self.values = values

    def beside(self, numbers: np.ndarray) -> "Gaussian":
        return Gaussian(numbers)

    def gain(self, mean: np.ndarray) -> float:
        assert self.values is not None
        return -float(((self.values - mean) ** 2).sum()) / 2


def _ranked(own: Any, copies: int) -> Any:
    mean = 7.0 + np.repeat(MEANS[own.kind], copies)
    return SimpleNamespace(
        kind=own.kind,
        gain=30.0,
        proposal=SimpleNamespace(effect=own, best_of=1),
        polished=SimpleNamespace(mean=mean),
        mean=mean,
        told_from="",
    )


def _state(copies: int, replicates: int = MANY) -> Any:
    """Return a state whose recordings have each number `copies` times."""
    drawn = np.random.default_rng(4).normal(size=(replicates, NUMBERS))
    return SimpleNamespace(
        setting=SimpleNamespace(large=False),
        simulated=7.0 + np.repeat(drawn, copies, 1),
        null=SimpleNamespace(mean=7.0),
        predictor=Gaussian,
    )


APART = float(((MEANS["dsnu"] - MEANS["prnu"]) ** 2).sum()) / 2  # Kullback-Leibler divergence
BETWEEN = float((MEANS["dsnu"] ** 2 - MEANS["prnu"] ** 2).sum()) / 2


def _odds(copies: int, share: float, replicates: int = MANY) -> tuple[float, float]:
    """Return the odds of a recording that the first explains better by a share of `APART`."""
    apart = MEANS["dsnu"] - MEANS["prnu"]
    own = apart * (BETWEEN + share * APART) / (2 * APART)  # along what both differ by
    state = _state(copies, replicates)
    state.predictor = lambda: Gaussian(7.0 + np.repeat(own, copies))
    return odds(state, _ranked(ONE, copies), _ranked(OTHER, copies))


@pytest.mark.parametrize("copies", [1, 7])
@pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
def test_numbers_that_are_one_count_once(copies: int, share: float) -> None:
    """Of independent normal numbers the odds are those of the likelihood."""
    ahead, likelier = _odds(copies, share)
    assert ahead == pytest.approx(share * APART * copies)
    assert likelier == pytest.approx(share * APART, rel=0.12)


def test_what_is_further_ahead_than_it_should_be_is_as_likely_as_it_can_be() -> None:
    assert _odds(1, 3.0)[1] > _odds(1, 1.0)[1]
    assert _odds(1, 0.0)[1] == pytest.approx(0.0, abs=0.05 * APART)
    assert _odds(1, -1.0)[1] == pytest.approx(-APART, rel=0.12)


def test_few_simulations_are_never_as_sure() -> None:
    """With 15 degrees of freedom ten standard deviations are no 50 nats."""
    assert _odds(1, 9.0, 16)[1] < _odds(1, 9.0)[1] / 2


def test_gains_that_scatter_more_are_less_likely_at_their_mean(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The logarithm of a ratio of normal densities, whatever their widths."""
    rng = np.random.default_rng(2)
    with_best, with_other = rng.normal(4, 1, MANY), rng.normal(-10, 6, MANY)
    monkeypatch.setattr(advantage, "_advantages", lambda *_: (with_best, with_other))
    values = np.array([0.0])

    class Numbers:
        def gain(self, mean: np.ndarray) -> float:
            return float((mean - values)[0])

    state: Any = SimpleNamespace(predictor=Numbers)
    pair: list[Any] = [SimpleNamespace(mean=np.array([m])) for m in (4.0, 0.0)]
    exact = norm.logpdf(4, 4, 1) - norm.logpdf(4, -10, 6)
    assert odds(state, *pair)[1] == pytest.approx(exact, rel=0.05)


def _tied(ahead: float, copies: int, monkeypatch: pytest.MonkeyPatch, *, more: float = 0.0) -> bool:
    """Return whether effects tie of which one is ahead by numbers, and by frames besides."""
    monkeypatch.setattr(ties, "alike", lambda *_: True)
    monkeypatch.setattr(ties, "smooth_as_well", lambda *_: False)
    best, other = _ranked(ONE, copies), _ranked(OTHER, copies)
    other.gain = best.gain - ahead - more
    apart = MEANS["dsnu"] - MEANS["prnu"]
    own = apart * (BETWEEN + ahead / copies) / (2 * APART)
    state = _state(copies)
    state.predictor = lambda: Gaussian(7.0 + np.repeat(own, copies))
    return ties.ties(state, best, other)


@pytest.mark.parametrize(
    ("ahead", "copies", "tied"),
    [
        (2.9, 1, True),  # within odds of 20, however they are counted
        (9.0, 1, False),
        (9.0, 7, True),  # seven numbers that are one
        (26.0, 7, False),
    ],
)
def test_effects_tie_where_chance_may_have_put_one_ahead(
    ahead: float, copies: int, tied: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _tied(ahead, copies, monkeypatch) is tied


def test_what_frames_say_besides_is_no_chance_of_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _tied(4.0, 7, monkeypatch, more=2.9)
    assert not _tied(4.0, 7, monkeypatch, more=3.1)


def test_of_a_large_recording_gains_are_taken_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ties, "alike", lambda *_: True)
    monkeypatch.setattr(ties, "smooth_as_well", lambda *_: False)
    best, other = _ranked(ONE, 7), _ranked(OTHER, 7)
    other.gain = best.gain - 9.0
    state = _state(7)
    state.setting.large = True
    assert not ties.ties(state, best, other)


def test_numbers_of_another_recording_leave_unknown_ones_as_they_are() -> None:
    known: Any = SimpleNamespace(vector=Vector((), np.array([1.0, 2.0]), np.ones(2)))
    own: Any = object.__new__(Predictor)
    own.reference = Reference(cast("Any", None), cast("Any", None), known.vector)
    other = own.beside(np.array([5.0, np.nan]))
    assert other.reference.vector.values.tolist() == [5.0, 2.0]
    assert own.reference.vector.values.tolist() == [1.0, 2.0]
