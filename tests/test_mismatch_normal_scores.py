"""Normal scores: scipy's, byte for byte, and ends where they end."""

import numpy as np
from scipy.special import ndtri

from analysis.mismatch.prove.scores import normal_scores

_TAIL = 0.13533528323661269189


def test_scores_are_those_of_scipy() -> None:
    rng = np.random.default_rng(1)
    near = np.array([_TAIL, 1 - _TAIL, 0.5])
    far = 10 ** rng.uniform(-8.9, 0, 10_000)
    edges = np.concatenate([near, np.nextafter(near, 0), np.nextafter(near, 1), far, 1 - far])
    for chances in (rng.random((90, 110)), edges):
        np.testing.assert_array_equal(normal_scores(chances), ndtri(chances), strict=True)


def test_scores_end_at_six_and_nan_stays() -> None:
    ends = ndtri([1e-9, 1 - 1e-9])
    np.testing.assert_array_equal(
        normal_scores(np.array([0.0, 1.0, np.nan])), [*ends, np.nan], strict=True
    )
