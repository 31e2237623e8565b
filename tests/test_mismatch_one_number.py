"""A number that alone is far off counts by how it scatters, not by the errors of models."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.stats

from analysis.mismatch.bank.key import Key
from analysis.mismatch.predict import Predictor, Reference
from mismatch_recordings import camera

LAYOUT = SimpleNamespace(rows=64, columns=96)
COUNT = 8


def predictor(departures: dict[int, float]) -> Predictor:
    """Return what judges correlations of some lags, of which some depart, in errors."""
    keys = tuple(Key("line_correlation", "all", detail=f"rows {k}") for k in range(COUNT))
    values = np.array([departures.get(k, 0.0) for k in range(COUNT)])
    null: Any = SimpleNamespace(mean=np.zeros(COUNT), sd=np.ones(COUNT), known=np.ones(COUNT, bool))
    vector: Any = SimpleNamespace(keys=keys, values=values)
    simulations: Any = SimpleNamespace(layout=LAYOUT, of=lambda *_: np.zeros((2, COUNT)))
    return Predictor(simulations, Reference(camera(), null, vector), replicates=2)


def explained(number: int, change: float) -> np.ndarray:
    """Return what a prediction changes: one number."""
    return np.where(np.arange(COUNT) == number, change, 0.0)


@pytest.mark.parametrize("others", [{}, {1: 4.2}, {1: -4.2, 5: 4.9}])
def test_it_is_believed_what_simulations_tell_of_it(others: dict[int, float]) -> None:
    """What is gained is that of Student's law of 15 degrees instead of 6, of what it leaves."""
    own = predictor({2: -10.5, **others})
    change = -10.0
    sd = float(np.hypot(1.0, own.forms[2] * change))
    left = (-10.5 - change) / sd
    laws = [scipy.stats.t(dof) for dof in (6, 15)]
    many, few = (law.logpdf(0) - law.logpdf([10.5, left]) for law in reversed(laws))
    expected = float((many - few) @ [1.0, -1.0])
    assert own.alone(explained(2, change)) == pytest.approx(expected, rel=1e-9)
    assert expected > 5


@pytest.mark.parametrize("others", [{1: 6.0}, {1: -5.5, 3: 4.1}])
def test_others_as_far_off_tell_of_a_model_s_errors(others: dict[int, float]) -> None:
    assert predictor({2: -10.5, **others}).alone(explained(2, -10.0)) == 0


@pytest.mark.parametrize("departures", [{}, {2: 3.9}, {2: 4.5, 3: 4.4}])
def test_what_chance_makes_gains_nothing_besides(departures: dict[int, float]) -> None:
    assert predictor(departures).alone(explained(2, 3.5)) == 0


def test_a_prediction_of_other_numbers_gains_nothing_by_it() -> None:
    assert predictor({2: 9.0}).alone(explained(4, 1.0)) == 0
