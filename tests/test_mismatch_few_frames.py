"""Means of few frames: their mean square is chi-squared, and is judged as that."""

from functools import cache
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
LAYOUT = SimpleNamespace(rows=64, columns=96)


@cache
def moment(dof: int, power: int) -> float:
    """Return the mean of a power of the cube root of a mean square of white noise: an integral."""
    chi2 = scipy.stats.chi2(dof)
    return float(chi2.expect(lambda x: np.cbrt(x / dof) ** power))


def roots(variances: np.ndarray) -> np.ndarray:
    """Return the means of cube roots of mean squares, as simulations have them."""
    return np.asarray(moment(DOF, 1) * np.cbrt(variances))


def predictor(squares: np.ndarray, statistic: str = "frame_variance") -> Predictor:
    """Return what judges mean squares of frame means, in units of white noise: (exposure,)."""
    keys = tuple(Key(statistic, "exposure", name, "MONO", "") for name in NAMES)
    sd = np.sqrt(moment(DOF, 2) - roots(np.ones(3)) ** 2)
    null: Any = SimpleNamespace(mean=roots(np.ones(3)), sd=sd, known=np.ones(len(NAMES), bool))
    vector: Any = SimpleNamespace(keys=keys, values=np.cbrt(squares))
    simulations: Any = SimpleNamespace(layout=LAYOUT, of=lambda *_: np.ones((2, len(NAMES))))
    return Predictor(simulations, Reference(camera(), null, vector), replicates=2)


@pytest.mark.parametrize("squares", [(0.8, 1.3, 6.3), (1.1, 2.0, 25.0), (0.05, 0.6, 0.9)])
@pytest.mark.parametrize("grown", [(1.0, 1.5, 3.0), (1.0, 2.0, 9.0)])
def test_the_gain_of_frames_that_wander_is_that_of_chi_squared(
    squares: tuple[float, ...], grown: tuple[float, ...]
) -> None:
    """Squares of 5 degrees of freedom over their expectation are chi-squared, by definition."""
    seen, expected = np.array(squares), np.array(grown)
    own = predictor(seen)
    gain = own.loglik(roots(expected)) - own.loglik(roots(np.ones(3)))
    law = scipy.stats.chi2(DOF)
    exact = (law.logpdf(DOF * seen / expected) - np.log(expected) - law.logpdf(DOF * seen)).sum()
    # The allowance for the change's form costs some of it.
    assert gain == pytest.approx(exact, rel=0.1, abs=0.4)


def test_chance_prefers_frames_that_do_not_wander() -> None:
    """By Kullback (1951) a wrong variance costs ((q - 1 - ln q) / 2 nats a degree of freedom."""
    rng = np.random.default_rng(1)
    gains, grown = [], np.array([1.0, 2.0, 3.0])
    for _ in range(400):
        own = predictor(rng.chisquare(DOF, len(NAMES)) / DOF)
        gains.append(own.loglik(roots(grown)) - own.loglik(roots(np.ones(3))))
    q = 1 / grown
    cost = float((q - 1 - np.log(q)).sum()) * DOF / 2
    assert np.mean(gains) == pytest.approx(-cost, rel=0.15)
    assert np.mean(np.exp(gains)) < 1.3  # likelihood ratios have mean 1 under chance


def test_what_many_pixels_make_keeps_its_heavy_tails() -> None:
    far = predictor(np.array([1.0, 1.0, 1e3]), "row_variance")
    assert far.loglik(np.cbrt([1.0, 1.0, 1e3])) - far.loglik(np.ones(3)) < 30


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_a_little_wander_is_not_preferred_to_none(dof: int) -> None:
    """A model with frames that vary a little more than they do gains nothing on average."""
    one, square = moment(dof, 1), moment(dof, 2)
    names = tuple(f"flat-{i}" for i in range(12))
    keys = tuple(Key("frame_variance", "exposure", name, "MONO", "") for name in names)
    sd = np.full(len(names), np.sqrt(square - one**2))
    mean, known = np.full(len(names), one), np.ones(len(names), bool)
    rng, gains = np.random.default_rng(2), []
    simulations: Any = SimpleNamespace(layout=LAYOUT, of=lambda *_: np.ones((2, len(names))))
    for _ in range(200):
        null: Any = SimpleNamespace(mean=mean, sd=sd, known=known)
        vector: Any = SimpleNamespace(keys=keys, values=np.cbrt(rng.chisquare(dof, 12) / dof))
        own = Predictor(simulations, Reference(camera(), null, vector), replicates=2)
        gains.append([own.loglik(mean * np.cbrt(q)) - own.loglik(mean) for q in (1.2, 1.5, 2.0)])
    assert (np.mean(gains, 0) < 0.1).all()
