"""Promise: what kernels sum and look up in histograms is what numpy finds."""

import math

import numpy as np
import pytest

from dsis.compiled import pairwise_sum
from dsis.measures.histogram import histogram, limits


def test_sums_add_in_the_order_of_numpy() -> None:
    rng = np.random.default_rng(1)
    for size in (*range(300), 1000, 1023, 4096, 12288, 100001):
        values = rng.normal(size=size) * np.exp(3 * rng.normal(size=size))
        assert pairwise_sum(values) == values.sum()


@pytest.mark.parametrize("size", [0, 1, 7, 8, 9, 127, 128, 129, 1000, 4097])
def test_sums_are_exact_to_rounding(size: int) -> None:
    values = np.random.default_rng(size).normal(size=size) + 1e3
    assert pairwise_sum(values) == pytest.approx(math.fsum(values.tolist()), rel=1e-15)


def test_the_error_of_a_sum_does_not_grow() -> None:
    values = np.full(1_000_000, 0.1)
    assert abs(pairwise_sum(values) - 1e5) < 1e-9  # one by one it is 1e-6 off


@pytest.mark.parametrize("step", [1, 3])
@pytest.mark.parametrize("end", [0, 400])
def test_a_histogram_is_looked_at_in_one_pass(step: int, end: int) -> None:
    codes = step * np.rint(np.random.default_rng(end).normal(50, 8, 5000)).astype(np.int64)
    counts = np.bincount(codes)
    first, last = limits(counts)
    used = np.flatnonzero(counts)
    assert (first, last) == (used[0], used[-1])
    own = counts[first : last + 1]
    own[-1] += end
    shown = histogram(own)
    inner = np.flatnonzero(own)[1:-1] if end else np.flatnonzero(own)
    below = (np.cumsum(own) - own / 2) / own.sum()
    assert shown.total == own.sum()
    assert shown.squares == np.sum(own**2)
    assert shown.clipped == bool(end)
    assert (shown.used, shown.first) == (inner.size, inner[0])
    assert shown.step == np.gcd.reduce(np.diff(inner))
    assert (shown.low, shown.high) == pytest.approx(
        tuple(np.interp((0.25, 0.75), below, np.arange(own.size)))
    )


def test_a_histogram_of_one_code() -> None:
    shown = histogram(np.array([7]))
    assert (shown.total, shown.used, shown.step, shown.low, shown.high) == (7, 0, 0, 0.0, 0.0)
    assert histogram(np.array([3])).used == 1
