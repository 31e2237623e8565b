"""Bands of light that few exposures show: what whole frames gain by them, and by nothing else."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.special
from numpy.typing import NDArray

from analysis.mismatch import bandgain
from analysis.mismatch.bandgain import foretold, gain_of_bands, place_of_bands
from analysis.mismatch.phaselaw import moving_on, there

FramesOf = Callable[[str], Iterator[NDArray[np.float64]]]
ROWS, COLUMNS, SD, LIGHT = 96, 32, 2.0, 400.0
SIGNAL = {"dark": 0.0, "flat": LIGHT}


def _layout(frames: int = 8) -> Any:
    return SimpleNamespace(
        rows=ROWS,
        columns=COLUMNS,
        channels=("MONO",),
        uniform=tuple(SimpleNamespace(name=n, numbers=tuple(range(frames))) for n in SIGNAL),
        variance_dn2={(name, "MONO"): SD**2 for name in SIGNAL},
        signal_dn={(name, "MONO"): signal for name, signal in SIGNAL.items()},
    )


LAYOUT = _layout()
DEPTH = np.sqrt(4 / (ROWS * COLUMNS)) * SD / LIGHT  # of bands as large as noise at their place


def _frames(
    depth: float,
    seed: int,
    *,
    cycles: float = 7.3,
    rows_sd: float = 0.0,
    frames: int = 8,
    advance: float | None = None,
) -> FramesOf:
    """Return frames with bands of light, each row of which has an offset of its own.

    `advance`: the share of a turn by which they move on; None: their phase is another in each.
    """
    y = np.arange(ROWS)[:, np.newaxis]

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([seed, name == "dark"])
        fixed = rng.normal(0, SD, (ROWS, COLUMNS))
        start = rng.uniform(0, 1)
        for t in range(frames):
            turn = rng.uniform(0, 1) if advance is None else start + advance * t
            light = SIGNAL[name] * (1 + depth * np.sin(2 * np.pi * (cycles * y / ROWS + turn)))
            offsets = rng.normal(0, rows_sd, (ROWS, 1)) if rows_sd else 0.0
            yield light + offsets + fixed + rng.normal(0, SD, (ROWS, COLUMNS))

    return of


def test_bands_gain_their_odds_less_those_of_all_places() -> None:
    """Of 64 frames of a flat, in the mean of noise and phases: ln I0(2 a |c|) - a^2 each.

    Less ln 2: the phase might have moved on steadily.
    """
    size, frames = 1.2, 64
    rng = np.random.default_rng(1)
    c = size + rng.normal(0, np.sqrt(0.5), (2, 20000)).T @ np.array([1, 1j])
    each = np.log(scipy.special.i0(2 * size * np.abs(c))) - size**2
    layout = _layout(frames)
    gains = [gain_of_bands(layout, _frames(size * DEPTH, k, frames=frames), 7.3) for k in range(8)]
    power = (frames - 1) * size**2
    bins = np.sqrt(2 * np.pi) * np.sqrt(1.5 / power) / np.pi
    expected = (frames - 1) * each.mean() - np.log(ROWS / 2 / bins) - np.log(2)
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

    assert gain_of_bands(_layout(24), of, 3.0) < 2


def test_in_the_dark_there_are_none() -> None:
    dark = SimpleNamespace(**{**vars(LAYOUT), "uniform": LAYOUT.uniform[:1]})
    assert gain_of_bands(dark, _frames(DEPTH, 1), 7.3) == -np.inf
    assert gain_of_bands(_layout(4), _frames(5 * DEPTH, 1, frames=4), 7.3) == -np.inf
    assert gain_of_bands(LAYOUT, _frames(5 * DEPTH, 1), 0.2) == -np.inf


def test_the_slowest_waves_have_no_neighbours_to_stand_out_of() -> None:
    """Of 1/f noise they are the highest, without being bands: but its phase does not move on."""
    for cycles in (1.0, 2.2):
        for seed in range(10):
            of = _frames(2 * DEPTH, seed, cycles=cycles)
            assert gain_of_bands(LAYOUT, of, cycles) < 2
    steady = [_frames(2 * DEPTH, k, frames=16, cycles=2.2, advance=0.27) for k in range(6)]
    assert np.median([gain_of_bands(_layout(16), of, 2.2) for of in steady]) > 4
    assert gain_of_bands(LAYOUT, _frames(5 * DEPTH, 1, cycles=3.2), 3.2) > 10


@pytest.mark.parametrize("advance", [0.27, 0.81])
def test_bands_that_move_on_steadily_gain_more(advance: float) -> None:
    """As all frames of an exposure together do: about a^2 of each, where free phases gain less."""
    size, layout, more = 1.6, _layout(16), []
    for k in range(12):
        steady = _frames(size * DEPTH, k, frames=16, advance=advance)
        free = _frames(size * DEPTH, k, frames=16)
        more.append(gain_of_bands(layout, steady, 7.3) - gain_of_bands(layout, free, 7.3))
    assert np.mean(more) > 4


def test_steady_phases_are_likely_as_an_integral_says() -> None:
    """Over first phases, turns and what frames share, summed by brute force."""
    rng = np.random.default_rng(3)
    numbers, a = np.array([0.0, 1.0, 2.0, 4.0, 5.0]), 1.3
    found = rng.normal(size=(2, 5)).T @ np.array([1, 1j]) * np.sqrt(0.5)
    found += a * np.exp(2j * np.pi * (0.3 * numbers + 0.1))
    shared = np.linspace(-5, 5, 81)
    m = (shared[:, None] + 1j * shared).ravel()
    starts = np.exp(2j * np.pi * np.arange(24) / 24)

    def total(size: float, turn: float, start: complex) -> float:
        rest = found - size * start * np.exp(2j * np.pi * turn * numbers) - m[:, None]
        return float(scipy.special.logsumexp(-(np.abs(rest) ** 2).sum(1)))

    turns = np.arange(48) / 48
    every = [total(a * s, turn, start)
             for s in (0.7, 0.9, 1.1, 1.4) for turn in turns for start in starts]  # fmt: skip
    expected = scipy.special.logsumexp(every) - np.log(len(every)) - total(0.0, 0.0, 1.0)
    own = moving_on([found - found.mean()], [numbers], [a])
    assert own == pytest.approx(expected, abs=0.05)


LOCKED = dict.fromkeys(SIGNAL, (3, 7, 11, 15))


def test_locked_frames_are_foretold_where_the_phase_moves_on() -> None:
    """The four of a flat gain most of 4 a^2; of free phases much less."""
    size, layout = 1.6, _layout(16)
    gains = {}
    for advance in (0.27, None):
        made = (_frames(size * DEPTH, k, frames=16, advance=advance) for k in range(16))
        gains[advance] = np.mean([foretold(layout, of, 7.3, LOCKED).sum() for of in made])
    assert 2 * size**2 < gains[0.27] < 4 * size**2 + 1
    assert gains[None] < 0.8 * gains[0.27]


def test_noise_foretells_nothing() -> None:
    """A ratio of likelihoods exceeds 1 / p in a share p of recordings at most (Markov)."""
    draws, high = 150, 0
    for k in range(draws):
        nats = foretold(_layout(16), _frames(0.0, k, frames=16), 7.3, LOCKED)
        high += nats.sum() > np.log(20)
    assert high <= 0.05 * draws


def test_without_light_or_others_nothing_is_foretold() -> None:
    assert not foretold(_layout(16), _frames(DEPTH, 1, frames=16), 0.2, LOCKED).size
    every = {"flat": tuple(range(8))}
    assert not foretold(LAYOUT, _frames(DEPTH, 1), 7.3, every).size


def test_exposures_that_are_added_gain_what_all_of_them_gain_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The log-likelihood of all projections so far, whole, less that without the last exposure."""
    layout, frames = _layout(16), _frames(1.6 * DEPTH, 5, frames=16, advance=0.27)
    calls: list[int] = []
    whole = bandgain.there_in

    def counted(own: Any, amplitude: float, **how: bool) -> Any:
        calls.append(own.size)
        return whole(own, amplitude, **how)

    monkeypatch.setattr(bandgain, "there_in", counted)
    gains = foretold(layout, frames, 7.3, LOCKED)
    assert calls == [12, 12, 16, 16]  # each exposure anew only where its frames are others

    found = bandgain._found(layout, frames, 7.3)
    assert found is not None
    rest = np.array([n not in LOCKED["flat"] for n in range(16)])
    numbers = np.arange(16.0)
    others = tuple(own[rest] - own[rest].mean(0) for own in found.power.found)
    known = replace(found, power=replace(found.power, found=others))
    bands = bandgain._bands(known, [numbers[rest]] * 2)
    assert bands is not None
    amplitudes = [float(np.sqrt(bands.power * w)) for w in bands.seen.weights]

    def odds(added: int) -> float:
        own = [
            every[:, bands.place] / np.sqrt(noise) if i < added else some[:, 0]
            for i, (every, noise, some) in enumerate(
                zip(found.power.found, bands.noise, bands.seen.found, strict=True)
            )
        ]
        steps = [numbers if i < added else numbers[rest] for i in range(2)]
        free = there(own, amplitudes, kept=False, real=False)
        return float(np.logaddexp(free, moving_on(own, steps, amplitudes)) - np.log(2))

    expected = [odds(1) - odds(0), odds(2) - odds(1)]
    np.testing.assert_allclose(gains, expected, atol=1e-9)


@pytest.mark.parametrize("cycles", [0.8, 1.13, 2.4, 7.3])
def test_where_bands_are_is_told_to_its_error(cycles: float) -> None:
    """From a start on half a cycle, as peaks are, slow bands too: errors are the bound."""
    off = []
    for seed in range(40):
        frames = _frames(3 * DEPTH, seed, cycles=cycles)
        found = place_of_bands(LAYOUT, frames, max(round(2 * cycles) / 2, 1.0))
        if found is not None:  # of less than a cycle the end of what is tried may be likeliest
            off.append((found[0] - cycles) / found[1])
    assert len(off) > (30 if cycles < 1 else 39)
    assert np.mean(np.abs(off) < 1.96) > 0.85  # 95 % of 40, three standard deviations below
    assert abs(np.mean(off)) < 0.6


def test_where_nothing_is_no_place_is_told() -> None:
    assert place_of_bands(LAYOUT, _frames(0.0, 3), 7.0) is None
    assert place_of_bands(_layout(2), _frames(0.0, 3, frames=2), 47.9) is None
