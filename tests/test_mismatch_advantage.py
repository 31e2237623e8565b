"""Odds of two effects, from what recordings with either gain by them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import ties
from analysis.mismatch.advantage import odds
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


@pytest.mark.parametrize("copies", [1, 7])
@pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
def test_numbers_that_are_one_count_once(copies: int, share: float) -> None:
    """Of independent normal numbers the odds are those of the likelihood."""
    ahead = share * APART * copies
    found = odds(_state(copies), _ranked(ONE, copies), _ranked(OTHER, copies), ahead)
    assert found == pytest.approx(share * APART, rel=0.12)


def test_what_is_further_ahead_than_it_should_be_is_as_likely_as_it_can_be() -> None:
    state, pair = _state(1), (_ranked(ONE, 1), _ranked(OTHER, 1))
    assert odds(state, *pair, 3 * APART) > odds(state, *pair, APART)
    assert odds(state, *pair, 0.0) == pytest.approx(0.0, abs=0.04 * APART)
    assert odds(state, *pair, -APART) == pytest.approx(-APART, rel=0.12)


def test_few_simulations_are_never_as_sure() -> None:
    """With 15 degrees of freedom ten standard deviations are no 50 nats."""
    ahead = 9 * APART
    many, few = (odds(_state(1, n), _ranked(ONE, 1), _ranked(OTHER, 1), ahead) for n in (MANY, 16))
    assert few < many / 2


@pytest.mark.parametrize(
    ("ahead", "copies", "large", "tied"),
    [
        (2.9, 1, False, True),  # within odds of 20, however they are counted
        (9.0, 1, False, False),
        (9.0, 7, False, True),  # seven numbers that are one
        (9.0, 7, True, False),  # of a large recording simulations take too long
        (26.0, 7, False, False),
    ],
)
def test_effects_tie_where_chance_may_have_put_one_ahead(
    ahead: float, copies: int, large: bool, tied: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ties, "alike", lambda *_: True)
    monkeypatch.setattr(ties, "smooth_as_well", lambda *_: False)
    state, best, other = _state(copies), _ranked(ONE, copies), _ranked(OTHER, copies)
    other.gain = best.gain - ahead
    state.setting.large = large
    assert ties.ties(state, best, other) is tied
