"""Gains and the gap closed, from log-likelihoods and numbers that are made up."""

import numpy as np
import pytest

from analysis.mismatch.prove import Loglik, gap_closed, heldout_gain


def test_intervals_cover() -> None:
    """Normal gains of two frames each in eight exposures: 95 % intervals in 95 % of draws.

    400 draws: 88 % is five standard errors below 95 %.
    """
    rng = np.random.default_rng(4)
    names = [f"e{i}" for i in range(8)]
    zero = Loglik({n: np.zeros(2) for n in names}, dict.fromkeys(names, 0.0))
    covered = 0
    for k in range(400):
        gains = {n: 2 + 2 * rng.standard_normal(2) for n in names}
        low, high = heldout_gain(zero, Loglik(gains, dict.fromkeys(names, 0.0)), seed=k).ci95
        covered += low < 2 < high
    assert covered / 400 > 0.88


def test_one_locked_frame_tells_no_interval() -> None:
    one = {"a": np.array([1.0])}
    gain = heldout_gain(Loglik({"a": np.zeros(1)}, {"a": 0.0}), Loglik(one, {"a": 0.0}), seed=1)
    assert gain.ci95 == (-np.inf, np.inf)


def test_gap_closed() -> None:
    """Normal measures, 300 of them, off by 3 standard deviations before: closed forms.

    D0 - Df = 9; D1 - Df is 0, 9 or 9/4 on average, its standard error some sqrt(8 / 300) / 9 and
    the shared spread estimate's: 0.05 in all.
    """
    rng = np.random.default_rng(7)
    n, k = 300, 12
    after = rng.standard_normal((k, n)) * 2
    x = rng.standard_normal(n) * 2
    before = rng.standard_normal((k, n)) * 2 + 6
    assert gap_closed(x, before, after) == pytest.approx(1, abs=0.25)
    assert gap_closed(x + 6, after, after + 3) == pytest.approx(0.75, abs=0.25)
    assert gap_closed(x, before, before) == pytest.approx(0, abs=0.25)
    assert gap_closed(x, rng.standard_normal((k, n)) * 2, after) is None
    assert gap_closed(np.full(n, np.nan), before, after) is None
