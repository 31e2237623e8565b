"""The median of the measures is numpy's, whatever the values."""

import numpy as np
import pytest

from dsis.measures.median import median


@pytest.mark.parametrize("size", [1, 2, 7, 64, 65, 96, 4096, 4097, 1 << 15])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_median_is_that_of_numpy(size: int, kind: type[np.floating]) -> None:
    random = np.random.default_rng(size)
    normal = random.normal(size=size)
    for values in (
        normal,
        np.rint(3 * normal),  # many are alike
        random.standard_cauchy(size),
        np.where(random.random(size) < 0.01, 1e30, normal),
        np.exp(20 * normal),
        np.zeros(size),
    ):
        own = values.astype(kind)
        assert median(own) == float(np.median(own))


def test_median_of_what_is_not_finite() -> None:
    assert median(np.array([1.0, np.inf, 2.0, -np.inf])) == 1.5
    assert np.isnan(median(np.array([1.0, np.nan, 2.0])))


def test_of_no_values_none_is_in_the_middle() -> None:
    with pytest.raises(ValueError, match="no values"):
        median(np.zeros(0))
