"""Promise: correlations of spikes that hardly ever meet are not judged as if they were normal."""

import numpy as np
import pytest
import scipy.stats

from analysis.mismatch.bank.key import Key
from analysis.mismatch.fewpairs import of_few_pairs

SAMPLES = 4000
KEYS = (
    Key("kurtosis", "exposure", "dark", "MONO"),
    Key("correlation_0_1", "exposure", "dark", "MONO"),
    Key("correlation_0_1", "exposure", "flat", "MONO"),
    Key("line_correlation", "all", "", "MONO", "rows 3"),
    Key("fixed_correlation_0_1", "exposure", "dark", "MONO"),
    Key("row_variance", "exposure", "dark", "MONO"),
)


def masked(kurtosis: float) -> list[bool]:
    values = np.zeros((16, len(KEYS)))
    values[:, 0] = kurtosis
    errors = np.full(len(KEYS), np.sqrt(24 / SAMPLES))
    return of_few_pairs(KEYS, values, errors).tolist()


def test_which_numbers_are_left_out() -> None:
    assert masked(0.5) == [False] * 6
    assert masked(500.0) == [False, True, False, True, False, False]


@pytest.mark.parametrize("share", [0.01, 0.001])
def test_kurtosis_of_a_sum_of_products(share: float) -> None:
    """Simulated sums of products of spiky samples: what is masked is what is far from normal."""
    draws = np.random.default_rng(3)
    spikes = draws.random((2, 1000, SAMPLES)) < share
    x, y = draws.standard_normal((2, 1000, SAMPLES)) * np.where(spikes, 12.0, 1.0)
    kurtosis = float(scipy.stats.kurtosis(x, axis=None))
    sums = (x * y).sum(1)
    expected = (3 + kurtosis) ** 2 / SAMPLES
    found = float(scipy.stats.kurtosis(sums))
    assert found == pytest.approx(expected, rel=0.6, abs=0.5)
    assert masked(kurtosis)[1] == (expected > 1)
