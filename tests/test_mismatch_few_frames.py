"""Means of few frames: their mean square is chi-squared, and is judged as that."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.stats

from analysis.mismatch.bank.key import Key
from analysis.mismatch.predict import Predictor, Reference
from mismatch_recordings import camera

FRAMES = 6
DOF = FRAMES - 1
NAMES = ("flat-0", "flat-1", "flat-2")


def predictor(squares: np.ndarray, statistic: str = "frame_variance") -> Predictor:
    """Return what judges mean squares of frame means, in units of white noise: (exposure,)."""
    keys = tuple(Key(statistic, "exposure", name, "MONO", "") for name in NAMES)
    sd = np.full(len(NAMES), np.sqrt(2 / (9 * DOF)))
    null: Any = SimpleNamespace(mean=np.ones(len(NAMES)), sd=sd, known=np.ones(len(NAMES), bool))
    vector: Any = SimpleNamespace(keys=keys, values=np.cbrt(squares))
    simulations: Any = SimpleNamespace(of=lambda *_: np.ones((2, len(NAMES))))
    return Predictor(simulations, Reference(camera(), null, vector), replicates=2)


@pytest.mark.parametrize("squares", [(0.8, 1.3, 6.3), (1.1, 2.0, 25.0), (0.05, 0.6, 0.9)])
@pytest.mark.parametrize("grown", [(1.0, 1.5, 3.0), (1.0, 2.0, 9.0)])
def test_the_gain_of_frames_that_wander_is_that_of_chi_squared(
    squares: tuple[float, ...], grown: tuple[float, ...]
) -> None:
    """Squares of 5 degrees of freedom over their expectation are chi-squared, by definition."""
    seen, expected = np.array(squares), np.array(grown)
    own = predictor(seen)
    gain = own.loglik(np.cbrt(expected)) - own.loglik(np.ones(len(NAMES)))
    law = scipy.stats.chi2(DOF)
    exact = (law.logpdf(DOF * seen / expected) - np.log(expected) - law.logpdf(DOF * seen)).sum()
    # The allowance for the change's form costs some of it.
    assert gain == pytest.approx(exact, rel=0.1, abs=0.4)


def test_chance_prefers_frames_that_do_not_wander() -> None:
    """By Kullback (1951) a wrong variance costs ((q - 1 - ln q) / 2 nats a degree of freedom."""
    rng = np.random.default_rng(1)
    gains = []
    for _ in range(400):
        own = predictor(rng.chisquare(DOF, len(NAMES)) / DOF)
        gains.append(own.loglik(np.cbrt([1.0, 2.0, 3.0])) - own.loglik(np.ones(len(NAMES))))
    q = 1 / np.array([1.0, 2.0, 3.0])
    cost = float((q - 1 - np.log(q)).sum()) * DOF / 2
    assert np.mean(gains) == pytest.approx(-cost, rel=0.15)
    assert np.mean(np.exp(gains)) < 1.3  # likelihood ratios have mean 1 under chance


def test_what_many_pixels_make_keeps_its_heavy_tails() -> None:
    far = predictor(np.array([1.0, 1.0, 1e3]), "row_variance")
    assert far.loglik(np.cbrt([1.0, 1.0, 1e3])) - far.loglik(np.ones(3)) < 30
