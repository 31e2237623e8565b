"""Waves at any frequency: how much of their power is kept, and how rare the highest is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import gammaincc
from scipy.stats import norm

from analysis.mismatch.bank.between import Kept, highest, log_chance_of
from dsis.cfa import Cfa
from test_mismatch_waves import COLUMNS, FRAMES, ROWS, noise, summed, wave

SURE = 5.0  # standard errors


@settings(max_examples=25, deadline=None)
@given(across=st.floats(5, 26), down=st.floats(5, 18), sign=st.sampled_from([1, -1]))
def test_what_is_kept_of_a_wave_at_any_frequency(across: float, down: float, sign: int) -> None:
    """Without noise: of bins and halves of them it may be little more than half."""
    own = wave(np.random.default_rng(1), across / COLUMNS, sign * down / ROWS, 1.0)
    kept = Kept(np.fft.rfft2(own - own[0])[1:], 1 / (own[0].size * (FRAMES - 1)))
    fine = np.zeros((2 * ROWS, COLUMNS + 2))
    fine[round(2 * sign * down) % (2 * ROWS), round(2 * across)] = 1.0
    found = highest([kept], fine, COLUMNS, 1)
    y, x = np.mgrid[:ROWS, :COLUMNS]
    carrier = np.exp(-2j * np.pi * (sign * down * y / ROWS + across * x / COLUMNS))
    amplitudes = ((own - own.mean(0)) * carrier).sum((1, 2))
    whole = float((np.abs(amplitudes) ** 2).sum()) / (own[0].size * (FRAMES - 1))
    assert 0.85 < found.power / whole < 1.01
    assert found.across == pytest.approx(across, abs=0.13)
    assert found.down % ROWS == pytest.approx(sign * down % ROWS, abs=0.13)


def test_a_weak_wave_between_bins_is_surer_than_by_bins_alone() -> None:
    rng = np.random.default_rng(2)
    scores = np.array(
        [
            [summed([own], Cfa.MONO, keep=keep).number()[0] for keep in (False, True)]
            for own in (
                noise(rng) + wave(rng, 11.26 / COLUMNS, 9.74 / ROWS, 3.5) for _ in range(20)
            )
        ]
    )
    assert scores[:, 1].mean() > scores[:, 0].mean() + 0.7


@pytest.mark.parametrize("degrees", [1, 4, 19, 60])
def test_the_chance_of_one_wave_is_that_of_many_bins(degrees: int) -> None:
    """Far out a place at any frequency is worth some independent bins, the more the farther."""
    heights = [1 + far / np.sqrt(degrees) for far in (4, 6, 9)]
    worth = []
    for height in heights:
        single = float(gammaincc(degrees, degrees * height))
        worth.append(np.exp(log_chance_of(height, 1.0, degrees)) / single)
    assert worth == sorted(worth)
    assert 2 < worth[0] < worth[-1] < 80


def test_chances_are_chances() -> None:
    heights = np.linspace(0.01, 12, 400)
    logs = np.array([log_chance_of(height, 6000.0, 19) for height in heights])
    assert (logs <= 0).all()
    past = logs[heights > 1.5]
    assert (np.diff(past) <= 1e-12).all()
    assert past[-1] < norm.logsf(15)
