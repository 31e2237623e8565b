"""Fixed deviations of lines: what frames that others foretell gain by them, and all frames."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from analysis.mismatch.bank.linemeans import LineMeans
from analysis.mismatch.fixedforetold import _shared, _with_own, odds_of_lines
from analysis.mismatch.rank import SURE_GAIN, TOLD_APART

Array = NDArray[np.float64]
LINES = 120
FRAMES, LOCKED = (8, 6, 12), (2, 2, 3)
NOISE_DN2 = (0.02, 0.05, 0.2)  # of a line's mean in one frame
SIGNAL_DN = np.array([0.0, 400.0, 2000.0])


def _lines(series: Array, noise: float) -> LineMeans:
    """Return the lines of frames: (frame, line)."""
    frames = len(series)
    return LineMeans(
        frames, series.mean(0), series.mean(0), series.var(0, ddof=1), noise, np.zeros((frames, 1))
    )


def _recorded(seed: int, fixed: Any) -> tuple[list[LineMeans], list[LineMeans]]:
    """Return lines of all frames, and of those that are not locked; `fixed` by the signal, DN."""
    rng = np.random.default_rng(seed)
    whole, some = [], []
    for count, locked, noise, signal in zip(FRAMES, LOCKED, NOISE_DN2, SIGNAL_DN, strict=True):
        series = rng.normal(0, noise**0.5, (count, LINES)) + fixed(signal)
        whole.append(_lines(series, noise))
        some.append(_lines(series[locked:], noise))
    return whole, some


def test_odds_are_those_of_normal_laws() -> None:
    """Of the means of locked and other frames, one line at a time."""
    pattern = np.random.default_rng(1).normal(0, 0.05, LINES)
    whole, some = _recorded(2, lambda _: pattern)
    size = np.full(3, 0.05)
    odds = odds_of_lines(whole, some, SIGNAL_DN, size, (1e-3, 1e-9))
    moving = np.array([own.moving.mean() for own in whole])
    counts = np.array([*(f - k for f, k in zip(FRAMES, LOCKED, strict=True)), *LOCKED])
    signal = np.tile(SIGNAL_DN, 2)
    without = np.diag(np.tile(moving, 2) / counts) + 1e-3 + 1e-9 * np.outer(signal, signal)
    beside = without + 0.05**2
    same = np.kron(np.ones((2, 2)), np.eye(3))
    locked = [(w.frames * w.fixed - s.frames * s.fixed) / (w.frames - s.frames)
              for w, s in zip(whole, some, strict=True)]  # fmt: skip
    seen = np.stack([*(own.fixed for own in some), *locked]).T
    own = np.stack([same, same * np.outer(signal, signal)])
    by_itself = [_with_own(seen.T, one, own) for one in (beside, without)]
    every, first = slice(None), slice(3)
    for covariances, which, expected in (
        ((beside, without), every, odds.all),
        ((beside, without), first, odds.all - odds.added),
        (by_itself, every, odds.own),
    ):
        laws = [
            multivariate_normal(cov=c[which, which]).logpdf(seen[:, which]) for c in covariances
        ]
        np.testing.assert_allclose(laws[0] - laws[1], expected, atol=1e-9)


def test_what_exposures_have_alone_is_the_likeliest() -> None:
    """Of lines with an offset of their own in each exposure, drawn anew: its variance, within 3 %.

    Many lines of little noise: the error of a variance of 3 x 40000 draws is 0.4 %.
    """
    rng = np.random.default_rng(5)
    drawn = rng.normal(0, 0.3, (3, 40_000))
    seen = np.tile(drawn, (2, 1)) + rng.normal(0, 0.05, (6, 40_000))
    own = np.kron(np.ones((2, 2)), np.eye(3))[np.newaxis]
    found = _with_own(seen, np.eye(6) * 0.05**2, own)
    np.testing.assert_allclose(found, 0.09 * own[0] + 0.05**2 * np.eye(6), rtol=0.03)


@pytest.mark.parametrize("deviation", [np.full(3, 0.1), 1e-4 * SIGNAL_DN])
def test_a_pattern_that_each_exposure_draws_anew_is_not_fixed(deviation: Array) -> None:
    """Its frames repeat it, and locked frames are foretold; other exposures are not."""
    by_signal = dict(zip(SIGNAL_DN.tolist(), deviation.tolist(), strict=True))
    for seed in range(30):
        rng = np.random.default_rng([seed, 2])
        lines = _recorded(
            seed, lambda signal, draw=rng: draw.normal(0, by_signal[float(signal)], LINES)
        )
        assert odds_of_lines(*lines, SIGNAL_DN, deviation, (0.0, 0.0)).own.sum() < TOLD_APART


@pytest.mark.parametrize("deviation", [np.full(3, 0.1), 2e-4 * SIGNAL_DN])
def test_what_is_there_gains_and_what_is_not_loses(deviation: Array) -> None:
    """An offset, and a gain: 7 nats take an effect into a search."""
    by_signal = dict(zip(SIGNAL_DN.tolist(), deviation.tolist(), strict=True))
    gains, losses = [], []
    for seed in range(30):
        lines = np.random.default_rng([seed, 1]).normal(0, 1, LINES)
        there = _recorded(seed, lambda signal, own=lines: own * by_signal[float(signal)])
        odds = odds_of_lines(*there, SIGNAL_DN, deviation, (0.0, 0.0))
        gains.append([odds.all.sum(), odds.own.sum()])
        none = _recorded(1000 + seed, lambda _: 0.0)
        losses.append(odds_of_lines(*none, SIGNAL_DN, deviation, (0.0, 0.0)).all.sum())
    assert np.min(gains) > 7
    assert max(losses) < 0


def test_gains_that_the_brightest_flat_shows_best_are_foretold() -> None:
    """Of 11 standard errors, 4 of 5: what its own gain explains as well is asked for odds of 20."""
    signal, noise = np.array([0.0, 3500.0, 10_000.0]), (0.05, 0.22, 0.55)
    deviation = 2.5e-5 * signal
    found = []
    for seed in range(50):
        rng = np.random.default_rng([seed, 3])
        lines, whole, some = rng.normal(0, 1, LINES), [], []
        for count, locked, own, size in zip(FRAMES, LOCKED, noise, deviation, strict=True):
            series = rng.normal(0, own**0.5, (count, LINES)) + lines * size
            whole.append(_lines(series, own))
            some.append(_lines(series[locked:], own))
        odds = odds_of_lines(whole, some, signal, deviation, (0.0, 0.0))
        found.append((odds.all.sum(), odds.own.sum()))
    everything, alone = np.array(found).T
    assert ((everything > SURE_GAIN + 1) & (alone >= TOLD_APART)).sum() >= 40
    assert (alone > SURE_GAIN + 1).sum() <= 20  # asked of that alone


def test_where_no_frame_is_locked_nothing_is_told() -> None:
    whole, _ = _recorded(3, lambda _: 0.0)
    odds = odds_of_lines(whole, whole, SIGNAL_DN, np.full(3, 0.05), (0.0, 0.0))
    assert odds.added.size == odds.all.size == odds.own.size == 0


def test_what_lines_move_by_leaves_what_they_share_as_it_is() -> None:
    """Ratios of fixed variances are net of movement: lines that move more share no less."""
    whole, _ = _recorded(4, lambda _: 0.0)
    still = [replace(own, moving=0 * own.moving) for own in whole]
    noise = np.array([own.noise_dn2 / own.frames for own in whole])
    grown = 1 + (0.09 + 1e-8 * SIGNAL_DN**2) / noise
    assert _shared(whole, grown, SIGNAL_DN) == pytest.approx((0.09, 1e-8))
    assert _shared(still, grown, SIGNAL_DN) == pytest.approx((0.09, 1e-8))


def test_of_darks_alone_an_own_gain_says_nothing() -> None:
    """Signals are 0, and lines noisy: odds are numbers all the same."""
    whole, some = _recorded(7, lambda _: 0.0)
    loud = [
        [replace(own, fixed=100 * own.fixed, moving=1e4 * own.moving) for own in those]
        for those in (whole, some)
    ]
    found = odds_of_lines(*loud, np.zeros(3), np.full(3, 0.05), (0.0, 0.0))
    assert all(np.isfinite(one).all() for one in (found.added, found.all, found.own))
