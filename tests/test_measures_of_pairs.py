"""Two frames: their residuals are each other's negative, and the second's says it all."""

import numpy as np
import pytest
import scipy.stats
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.measures import Accumulator
from dsis.measures.first_pass import first_pass, no_change

ROWS, COLUMNS = 96, 130
Array = NDArray[np.float64]


def frames(seed: int, law: str) -> list[Array]:
    rng = np.random.default_rng(seed)
    made = [getattr(rng, law)(size=(ROWS, COLUMNS)) for _ in range(2)]
    return [np.rint(400 + 40 * one) for one in made]


def residual(difference: Array) -> Array:
    """Return a difference of frames less the means of rows and columns."""
    less = difference - difference.mean(1, keepdims=True) - difference.mean(0) + difference.mean()
    return np.asarray(less)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_the_variance_of_each_pixel_is_that_of_two_samples(cfa: Cfa) -> None:
    first, second = frames(1, "standard_normal")
    sums = Accumulator(ROWS, COLUMNS, cfa, 0.0, None)
    for frame in (first, second):
        sums.add(frame.astype(np.float32))
    step = 1 if cfa is Cfa.MONO else 2
    planes = [(second - first)[y::step, x::step] for y in range(step) for x in range(step)]
    found = sums.result().channels
    maps = [channel.variance_map for channel in found.values()]
    for plane in planes:
        kept = np.prod([1 - 1 / size for size in plane.shape])
        expected = residual(plane) ** 2 / 2 / kept
        assert any(np.allclose(expected, own, rtol=1e-5, atol=1e-3) for own in maps)


def test_kurtosis_is_that_of_the_noise() -> None:
    """A difference of two samples has half their excess kurtosis; Laplace's law has 3."""
    for law, excess in (("standard_normal", 0.0), ("laplace", 3.0)):
        first, second = frames(2, law)
        sums = Accumulator(ROWS, COLUMNS, Cfa.MONO, 0.0, None)
        for frame in (first, second):
            sums.add(frame.astype(np.float32))
        estimates = sums.result().channels["MONO"].estimates
        plain = 2 * scipy.stats.kurtosis(residual(second - first), axis=None)
        # Means of n samples that were taken off take 2/n of a fourth cumulant with them.
        plain /= (1 - 2 / ROWS) * (1 - 2 / COLUMNS)
        assert abs(estimates["kurtosis"].value - plain) < 0.02
        assert abs(estimates["kurtosis"].value - excess) < 5 * estimates["kurtosis"].standard_error
        assert not estimates["skewness"].known
        assert not estimates["frame_correlation"].known


def test_a_third_frame_goes_on_where_two_ended() -> None:
    """Sums begun late are those of all frames: the variance map is numpy's."""
    rng = np.random.default_rng(3)
    stack = np.rint(500 + 20 * rng.standard_normal((5, ROWS, COLUMNS)))
    sums = Accumulator(ROWS, COLUMNS, Cfa.MONO, 0.0, None)
    for frame in stack:
        sums.add(frame.astype(np.float32))
    flat = np.stack([residual(frame) for frame in stack])
    kept = (1 - 1 / ROWS) * (1 - 1 / COLUMNS)
    found = sums.result().channels["MONO"].variance_map
    assert np.allclose(found, flat.var(0, ddof=1) / kept, rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize("value", [7.0, 0.5, np.nan, np.inf])
def test_a_first_frame_is_passed_over_as_any_other(value: float) -> None:
    frame = np.random.default_rng(3).integers(10, 90, (70, 9)).astype(np.float32)
    frame[66, 4] = value
    own, changes = no_change(frame), np.empty_like(frame)
    with np.errstate(invalid="ignore"):
        whole = first_pass(frame, frame, np.zeros_like(frame), changes, 1)
    assert own[3:] == whole[3:]
    if np.isfinite(value):
        for mine, other in zip(own[:3], whole[:3], strict=True):
            np.testing.assert_array_equal(mine, other, strict=True)
