"""Gains and the gap closed, from log-likelihoods and numbers that are made up."""

import numpy as np
import pytest

from analysis.mismatch.finding import Gain
from analysis.mismatch.prove import Loglik, gap_closed, heldout_gain
from analysis.mismatch.trial import denied


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

    D0 - Df = 9; D1 - Df is 0, 9 or 9/4 on average, its standard error some sqrt(8 / 300) / 9.
    """
    rng = np.random.default_rng(7)
    n, k = 300, 12
    after = rng.standard_normal((k, n)) * 2
    x = rng.standard_normal(n) * 2
    before = rng.standard_normal((k, n)) * 2 + 6
    sd = np.full((k, n), 2.0)
    assert gap_closed(x, before, after, sd) == pytest.approx(1, abs=0.1)
    assert gap_closed(x + 6, after, after + 3, sd) == pytest.approx(0.75, abs=0.1)
    assert gap_closed(x, before, before, sd) == pytest.approx(0, abs=0.1)
    assert gap_closed(x, rng.standard_normal((k, n)) * 2, after, sd) is None
    assert gap_closed(np.full(n, np.nan), before, after, sd) is None
    assert gap_closed(x, before, after, np.full((k, n), np.nan)) is None


def test_a_right_model_closes_a_gap_however_narrow() -> None:
    """Spreads are known from the simulations themselves, as they are in a diagnosis.

    The recording is one more draw of the final model: all is closed, on average. Measured by
    spreads that they told themselves, simulations would seem 2/7 of a tenth nearer to one another.
    """
    n, k = 400, 8
    rng = np.random.default_rng(10)
    found = []
    for _ in range(40):
        drawn = rng.standard_normal((k + 1, n))
        before = rng.standard_normal((k, n)) + 0.7
        after = drawn[1:]
        sds = [np.delete(after, i, 0).std(0, ddof=1) for i in range(k)]
        sd = np.sqrt((40 + (k - 2) * np.square(sds)) / (40 + k - 2))  # as nulls blend them
        found.append(gap_closed(drawn[0], before, after, sd))
    closed = [one for one in found if one is not None]
    assert len(closed) > 30
    error = np.std(closed) / len(closed) ** 0.5
    assert np.mean(closed) == pytest.approx(1, abs=3 * error)
    assert error < 0.05


@pytest.mark.parametrize("shared", [0.0, 0.9])
def test_no_gap_is_open_by_chance(shared: float) -> None:
    """Of the same law before and after: open in few recordings, however numbers hang together."""
    n, k, recordings = 100, 8, 200
    opened = 0
    for seed in range(recordings):
        rng = np.random.default_rng([8, seed])
        common = rng.standard_normal((2 * k + 1, 1))
        drawn = shared * common + (1 - shared**2) ** 0.5 * rng.standard_normal((2 * k + 1, n))
        found = gap_closed(drawn[0], drawn[1 : k + 1], drawn[k + 1 :], np.ones((k, n)))
        opened += found is not None
    assert opened <= 0.06 * recordings


def test_gap_is_not_that_of_numbers_nearly_without_spread() -> None:
    """A count that nearly always is the same has next to no spread among few simulations.

    Given its spread it weighs as one of 301 numbers, not as all of them.
    """
    rng = np.random.default_rng(9)
    n, k = 301, 8
    sd = np.ones((k, n))
    before, after = rng.standard_normal((k, n)), rng.standard_normal((k, n)) + 2
    x = rng.standard_normal(n) + 2
    for sims in (before, after):
        sims[:, 0] = 1e-9 * np.arange(k)
    x[0] = 1.0
    assert gap_closed(x, before, after, sd) == pytest.approx(1, abs=0.15)


def test_pixels_deny_an_effect_only_where_they_are_a_hundred_times_against_it() -> None:
    """Parameters were fitted to other frames: what hardly shows costs a nat or two in all."""
    assert not denied(Gain(-0.2, (-0.25, -0.15)), 14)
    assert denied(Gain(-0.5, (-0.6, -0.4)), 14)
    assert not denied(Gain(-0.5, (-1.2, 0.2)), 14)
    assert denied(Gain(float("nan"), (float("nan"), float("nan"))), 14)
