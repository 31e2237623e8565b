"""Promise: correlations of spikes that hardly ever meet are not judged as if they were normal."""

import numpy as np
import pytest
import scipy.stats

from analysis.mismatch.bank.key import Key
from analysis.mismatch.fewpairs import widening

SAMPLES = 4000
KEYS = (
    Key("kurtosis", "exposure", "dark", "MONO"),
    Key("correlation_0_1", "exposure", "dark", "MONO"),
    Key("correlation_0_1", "exposure", "flat", "MONO"),
    Key("line_correlation", "all", "", "MONO", "rows 3"),
    Key("fixed_correlation_0_1", "exposure", "dark", "MONO"),
    Key("row_variance", "exposure", "dark", "MONO"),
    Key("carry_over", "all", "", "MONO", "rows, sine over 16 codes"),
)


def wide(kurtosis: float, recorded: float = 0.0) -> list[float]:
    values = np.zeros((16, len(KEYS)))
    values[:, 0] = kurtosis
    errors = np.full(len(KEYS), np.sqrt(24 / SAMPLES))
    own = np.zeros(len(KEYS))
    own[0] = recorded
    return widening(KEYS, values, errors, own).tolist()


def test_which_numbers_are_judged_with_care_and_which_not_at_all() -> None:
    assert wide(0.5) == [1.0] * 7
    own = 503 / SAMPLES**0.5
    assert wide(500.0) == pytest.approx([1.0, own, 1.0, np.inf, 1.0, 1.0, np.inf])
    assert wide(0.5, recorded=500.0) == wide(500.0)  # the model does not know of them yet
    assert wide(500.0, recorded=0.5) == wide(500.0)


def test_what_a_few_pairs_of_spikes_bring_by_chance_is_within_the_widened_spread() -> None:
    """Sums of products of samples of which some hundred are spikes: pairs are Poisson's."""
    draws = np.random.default_rng(5)
    share, height = 0.004, 40.0
    spikes = draws.random((2, 4000, SAMPLES)) < share
    x, y = draws.standard_normal((2, 4000, SAMPLES)) + height * spikes
    x, y = x - x.mean(1, keepdims=True), y - y.mean(1, keepdims=True)
    kurtosis = float(scipy.stats.kurtosis(x, axis=None))
    z = (x * y).sum(1) / (x * y).sum(1).std()
    factor = wide(kurtosis)[1]
    assert factor > 2
    assert np.mean(np.abs(z) > 4.5) > 100 * 2 * scipy.stats.norm.sf(4.5)  # no normal law
    assert np.mean(np.abs(z) / factor > 4.5) <= 1 / 4000


@pytest.mark.parametrize("share", [0.01, 0.001])
def test_kurtosis_of_a_sum_of_products(share: float) -> None:
    """Simulated sums of products of spiky samples: what is widened is what is far from normal."""
    draws = np.random.default_rng(3)
    spikes = draws.random((2, 1000, SAMPLES)) < share
    x, y = draws.standard_normal((2, 1000, SAMPLES)) * np.where(spikes, 12.0, 1.0)
    kurtosis = float(scipy.stats.kurtosis(x, axis=None))
    sums = (x * y).sum(1)
    expected = (3 + kurtosis) ** 2 / SAMPLES
    found = float(scipy.stats.kurtosis(sums))
    assert found == pytest.approx(expected, rel=0.6, abs=0.5)
    assert (wide(kurtosis)[1] > 1) == (expected > 1)
    assert wide(kurtosis)[1] == pytest.approx(max(expected, 1.0) ** 0.5 if expected > 1 else 1.0)
