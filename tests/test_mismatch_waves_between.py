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
    even = [np.ones((ROWS, COLUMNS))]
    kept = Kept.of(
        list(np.fft.rfft2(own - own[0])[1:]), 1 / (own[0].size * (FRAMES - 1)), 1.0, even
    )
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


@pytest.mark.parametrize("amplitude", [0.6, 1.5, 4.0])
def test_a_checkerboard_is_none_of_the_waves_about_it(amplitude: float) -> None:
    """Of whatever strength: about places that are high by chance it must not be seen."""
    board = (-1.0) ** np.add.outer(np.arange(ROWS), np.arange(COLUMNS))
    for seed in range(8):
        rng = np.random.default_rng(seed)
        stack = noise(rng) + amplitude * rng.choice([-1, 1], (FRAMES, 1, 1)) * board
        assert summed([stack], Cfa.MONO, keep=True).number()[0] < 3.5


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("uneven", ["middle", "fall", "left"])
def test_of_many_frames_uneven_noise_is_no_wave(uneven: str, cfa: Cfa) -> None:
    """Few bins see most of the middle of the sensor: so much for each frame."""
    y, x = (np.linspace(-1, 1, size) for size in (ROWS, COLUMNS))
    square = np.add.outer(y**2, x**2)
    variance = {
        "middle": 1 + 2 * np.exp(-4 * square),
        "fall": 1 - 0.3 * square,
        "left": np.where(x < -0.8, 4.0, 1.0) + 0 * square,
    }[uneven]
    rng = np.random.default_rng(5)
    stacks = [1000 + np.sqrt(variance) * rng.normal(0, 1, (60, ROWS, COLUMNS)) for _ in range(10)]
    assert summed(stacks, cfa, keep=True).number()[0] < 3.0
