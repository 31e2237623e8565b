"""What further frames add to the odds of an effect: honest under chance, and near the best."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.given import CHANCE, Numbers, ratio

Array = NDArray[np.float64]
COUNT = 40  # numbers
BEFORE, ALL = 6, 8  # frames
NAMES = ["one"] * COUNT
SHOWN = np.arange(COUNT) < 4  # by these the effect is seen
TRIALS = 250


def means(rng: np.random.Generator, recordings: int) -> tuple[Array, Array]:
    """Return means over all frames, and over those before, of independent normal numbers."""
    frames = rng.normal(size=(recordings, ALL, COUNT))
    return frames.mean(1), frames[:, :BEFORE].mean(1)


def certain(
    strength: float,
    seed: int,
    *,
    simulations: int,
    there: bool,
    chosen: bool = False,
    odd: float = 0.0,
) -> Array:
    """Return whether each trial's recording is certain, and its nats: (2, trial).

    Chosen: the effect is what the frames before happen to show, as a fit to their noise is. Odd: by
    how much one of the frames before is off in what shows the effect.
    """
    rng = np.random.default_rng(seed)
    found = np.zeros((2, TRIALS))
    for trial in range(TRIALS):
        shift = strength / np.sqrt(ALL * SHOWN.sum()) * SHOWN
        of_one = zip(means(rng, 1), (ALL, BEFORE), strict=True)
        recorded = [x[0] + shift * there + odd / frames * SHOWN for x, frames in of_one]
        sign = np.sign(recorded[1]) if chosen else np.ones(COUNT)
        parts = []
        for x, frames, own in zip(means(rng, simulations), (ALL, BEFORE), recorded, strict=True):
            errors = np.full(COUNT, 1 / np.sqrt(frames))
            parts.append(Numbers(own, x + sign * shift, x, errors))
        told = ratio(*parts, NAMES, np.ones(COUNT, bool))
        assert told is not None
        found[:, trial] = told.certain, told.nats
    return found


@pytest.mark.parametrize("simulations", [5, 16])
@pytest.mark.parametrize("chosen", [False, True])
@pytest.mark.parametrize("strength", [1.0, 3.0, 10.0])
def test_chance_is_certain_as_rarely_as_said(
    simulations: int, chosen: bool, strength: float
) -> None:
    alarms = certain(strength, 1, simulations=simulations, there=False, chosen=chosen)[0].mean()
    assert alarms <= CHANCE + 3 * (CHANCE * (1 - CHANCE) / TRIALS) ** 0.5


@pytest.mark.parametrize("odd", [15.0, 40.0])
def test_a_frame_before_that_stands_out_says_nothing_of_further_ones(odd: float) -> None:
    """They are as they would be without it: chance is certain as rarely as ever."""
    alarms = certain(3.0, 1, simulations=16, there=False, odd=odd)[0].mean()
    assert alarms <= CHANCE + 3 * (CHANCE * (1 - CHANCE) / TRIALS) ** 0.5


def test_what_is_there_is_found() -> None:
    """At z = 10 of all frames, a quarter of them shows z = 5; the best test then misses 0.1 %."""
    assert certain(10.0, 2, simulations=16, there=True)[0].mean() > 0.98


@pytest.mark.long
def test_nats_are_those_of_the_further_frames() -> None:
    """z of two of eight frames: the expected log-likelihood ratio is z^2 / 2 (Kullback 1951)."""
    z = 3.0
    nats = certain(2 * z, 3, simulations=64, there=True)[1]
    assert nats.mean() == pytest.approx(z**2 / 2, rel=0.2)
