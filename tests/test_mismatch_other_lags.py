"""Memory of one lag is no memory where more is left at other lags."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.otherlags import other_lags

LAGS = 16


def _state(own: float, others: float, axis: str) -> tuple[Any, np.ndarray, np.ndarray]:
    """Return a state whose rows are alike at lag 7, and at four other lags of an axis."""
    details = [f"{name} {lag}" for name in ("rows", "columns") for lag in range(1, LAGS + 1)]
    keys = [Key("line_correlation", "all", "", "", detail) for detail in details]
    chance = np.random.default_rng(1).standard_normal(len(keys))
    seen, without = chance.copy(), np.zeros(len(keys))
    seen[details.index("rows 7")] += own
    for lag in (4, 8, 9, 12):
        seen[details.index(f"{axis} {lag}")] += others
    mean = without.copy()
    mean[details.index("rows 7")] = own
    null = SimpleNamespace(known=np.ones(len(keys), bool), sd=np.ones(len(keys)), mean=without)
    vector = SimpleNamespace(keys=keys, values=seen)
    return SimpleNamespace(vector=vector, null=null, mismatches=()), mean, without


@pytest.mark.parametrize(
    ("own", "others", "axis", "denied"),
    [
        (16.0, 0.0, "rows", False),
        (16.0, 5.0, "rows", False),  # 4 x 25 of 256
        (16.0, 10.0, "rows", True),
        (6.0, 0.0, "rows", False),
        (6.0, 10.0, "columns", False),  # of other lines it says nothing
        (-16.0, -10.0, "rows", True),
    ],
)
def test_memory_is_denied_by_what_is_left_at_other_lags(
    own: float, others: float, axis: str, *, denied: bool
) -> None:
    state, mean, without = _state(own, others, axis)
    assert (other_lags(state, "readout_memory", mean, without) is not None) is denied
    assert other_lags(state, "crosstalk", mean, without) is None


def test_of_memory_that_no_lag_shows_nothing_is_said() -> None:
    state, _, without = _state(0.0, 10.0, "rows")
    assert other_lags(state, "readout_memory", without, without) is None
    assert other_lags(state, "readout_memory", without + 0.3, without) is None
