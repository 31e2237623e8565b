"""Bands of light that few exposures show: what whole frames gain by them, and by nothing else."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.special
from numpy.typing import NDArray

from analysis.mismatch.bandgain import gain_of_bands

FramesOf = Callable[[str], Iterator[NDArray[np.float64]]]
ROWS, COLUMNS, SD, LIGHT = 96, 32, 2.0, 400.0
SIGNAL = {"dark": 0.0, "flat": LIGHT}
LAYOUT: Any = SimpleNamespace(
    rows=ROWS,
    columns=COLUMNS,
    channels=("MONO",),
    uniform=tuple(SimpleNamespace(name=name) for name in SIGNAL),
    variance_dn2={(name, "MONO"): SD**2 for name in SIGNAL},
    signal_dn={(name, "MONO"): signal for name, signal in SIGNAL.items()},
)
DEPTH = np.sqrt(4 / (ROWS * COLUMNS)) * SD / LIGHT  # of bands as large as noise at their place


def _frames(
    depth: float, seed: int, *, cycles: float = 7.3, rows_sd: float = 0.0, frames: int = 8
) -> FramesOf:
    """Return frames with bands of light, each row of which has an offset of its own."""
    y = np.arange(ROWS)[:, np.newaxis]

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([seed, name == "dark"])
        fixed = rng.normal(0, SD, (ROWS, COLUMNS))
        for _ in range(frames):
            turn = rng.uniform(0, 1)
            light = SIGNAL[name] * (1 + depth * np.sin(2 * np.pi * (cycles * y / ROWS + turn)))
            offsets = rng.normal(0, rows_sd, (ROWS, 1)) if rows_sd else 0.0
            yield light + offsets + fixed + rng.normal(0, SD, (ROWS, COLUMNS))

    return of


def test_bands_gain_their_odds_less_those_of_all_places() -> None:
    """Of 64 frames of a flat, in the mean of noise and phases: ln I0(2 a |c|) - a^2 each."""
    size, frames = 1.2, 64
    rng = np.random.default_rng(1)
    c = size + rng.normal(0, np.sqrt(0.5), (2, 20000)).T @ np.array([1, 1j])
    each = np.log(scipy.special.i0(2 * size * np.abs(c))) - size**2
    gains = [gain_of_bands(LAYOUT, _frames(size * DEPTH, k, frames=frames), 7.3) for k in range(8)]
    power = (frames - 1) * size**2
    bins = np.sqrt(2 * np.pi) * np.sqrt(1.5 / power) / np.pi
    expected = (frames - 1) * each.mean() - np.log(ROWS / 2 / bins)
    scatter = np.sqrt(frames / len(gains)) * each.std()
    # Twelve bins beside it say how much noise is there, to a twentieth.
    assert np.mean(gains) == pytest.approx(expected, abs=3 * scatter + 3 + 0.05 * power)


@pytest.mark.parametrize("rows_sd", [0.0, 1.0])
def test_noise_and_offsets_of_rows_gain_nothing(rows_sd: float) -> None:
    """The clearest of 47 places: a gain of 3 is chance in one recording of twenty."""
    high = 0
    for k in range(30):
        of = _frames(0.0, k, rows_sd=rows_sd)
        high += max(gain_of_bands(LAYOUT, of, place) for place in (2.0, 5.5, 7.3, 20.0, 31.0)) > 0
    assert high <= 4


def test_slow_waves_are_no_bands() -> None:
    """Of 1/f noise down the rows all of the lowest waves are high."""
    k = np.arange(1, 12)

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([5, name == "dark"])
        turns = 2 * np.pi * np.arange(ROWS)[:, np.newaxis] * k / ROWS
        for _ in range(24):
            parts = 1.5 * rng.normal(size=(2, k.size)) / np.sqrt(k)
            lines = (np.cos(turns) * parts[0] + np.sin(turns) * parts[1]).sum(1, keepdims=True)
            yield SIGNAL[name] + lines + rng.normal(0, SD, (ROWS, COLUMNS))

    assert gain_of_bands(LAYOUT, of, 3.0) < 2


def test_in_the_dark_there_are_none() -> None:
    dark = SimpleNamespace(**{**vars(LAYOUT), "uniform": LAYOUT.uniform[:1]})
    assert gain_of_bands(dark, _frames(DEPTH, 1), 7.3) == -np.inf
    assert gain_of_bands(LAYOUT, _frames(5 * DEPTH, 1, frames=4), 7.3) == -np.inf
    assert gain_of_bands(LAYOUT, _frames(5 * DEPTH, 1), 0.2) == -np.inf


def test_the_slowest_waves_have_no_neighbours_to_stand_out_of() -> None:
    """Of 1/f noise they are the highest, without being bands."""
    for cycles in (1.0, 2.2):
        of = _frames(5 * DEPTH, 1, cycles=cycles)
        assert gain_of_bands(LAYOUT, of, cycles) == -np.inf
    assert gain_of_bands(LAYOUT, _frames(5 * DEPTH, 1, cycles=3.2), 3.2) > 10
