"""Lines that only many frames together show: what they gain, in closed form and beside noise."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.special
from numpy.typing import NDArray

from analysis.mismatch import phaselaw
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.phaselaw import there
from dsis.effects.bistable_pattern import BistablePattern
from dsis.effects.dsnu import Dsnu
from dsis.effects.periodic_noise import PeriodicNoise

Complex = NDArray[np.complex128]
FramesOf = Callable[[str], Iterator[NDArray[np.float64]]]
ROWS, COLUMNS, SD = 48, 64, 2.0
PATTERN = np.sqrt(4 / (ROWS * COLUMNS)) * SD  # amplitude of a cosine as large as noise at its line
LAYOUT: Any = SimpleNamespace(
    rows=ROWS,
    columns=COLUMNS,
    channels=("MONO",),
    uniform=(SimpleNamespace(name="dark"), SimpleNamespace(name="flat")),
    variance_dn2={(name, "MONO"): SD**2 for name in ("dark", "flat")},
    still=frozenset(),
    signal_dn={("dark", "MONO"): 0.0, ("flat", "MONO"): 400.0},
)


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize("amplitude", [0.5, 1.5, 4.0])
def test_two_frames_gain_what_their_difference_does(kept: bool, amplitude: float) -> None:
    """What both share drops out of the difference, and of the odds: d has noise of variance 2."""
    found = np.array([0.7 + 0.2j, -1.9 - 1.1j])
    difference = found[0] - found[1]
    turns = np.exp(2j * np.pi * np.arange(400) / 400)
    likely = []
    for strength in phaselaw._STRENGTHS:
        size = strength * amplitude
        pairs = size * (turns[:, np.newaxis] - turns)  # of any two phases
        if kept:  # of one phase and two signs: half of the pairs are alike
            pairs = np.stack([0 * turns, 2 * size * turns])
        likely.append(np.mean(np.exp(-(np.abs(difference - pairs) ** 2) / 2)))
    expected = np.log(np.mean(likely)) + abs(difference) ** 2 / 2
    gained = there([found], [amplitude], kept=kept, real=False)
    assert gained == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("kept", [True, False])
def test_odds_of_a_line_are_one_in_the_mean_of_noise(kept: bool) -> None:
    """So a gain of x is chance in no more than exp(-x) of recordings (Markov)."""
    rng = np.random.default_rng(1)
    gains = []
    for _ in range(300):
        noise = rng.normal(0, np.sqrt(0.5), (2, 6, 2)) @ np.array([1, 1j])
        fixed = 5 * rng.normal(size=(2, 1))
        gains.append(there(list(noise + fixed), [0.8, 0.4], kept=kept, real=False))
    odds = np.exp(gains)
    assert abs(odds.mean() - 1) < 4 * odds.std() / np.sqrt(odds.size)
    assert np.mean(np.array(gains) > 2) < np.exp(-2)


def test_real_patterns_gain_what_signs_do() -> None:
    """Of real numbers of variance 1, the shared part known: ln cosh(a c) - a^2 / 2."""
    rng = np.random.default_rng(2)
    c = 1.3 * rng.choice([-1.0, 1.0], 4000) + rng.normal(size=4000)
    gained = there([c + 0j], [1.3], kept=True, real=True)
    strengths = 1.3 * phaselaw._STRENGTHS[:, np.newaxis]
    sums = (np.log(np.cosh(strengths * c)) - strengths**2 / 2).sum(1)
    expected = scipy.special.logsumexp(sums) - np.log(sums.size)
    assert gained == pytest.approx(expected, rel=0.01)


def _frames(
    frequency: tuple[float, float], amplitude: float, seed: int, *, free: bool, frames: int = 8
) -> FramesOf:
    """Return frames of a dark with a line and of a flat with a tenth of it, of the same noise."""
    y, x = np.arange(ROWS)[:, np.newaxis], np.arange(COLUMNS)

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([seed, len(name), name == "dark"])
        fixed = rng.normal(0, 5 * SD, (ROWS, COLUMNS))
        for _ in range(frames):
            phase = rng.uniform(0, 1) if free else 0.5 * rng.integers(2)
            wave = np.cos(2 * np.pi * (frequency[0] * x + frequency[1] * y + phase))
            yield 100 + fixed + amplitude * wave + rng.normal(0, SD, (ROWS, COLUMNS))

    return of


def _line(kind: str, frequency: tuple[float, float]) -> PeriodicNoise | BistablePattern:
    if kind == "periodic_noise":
        return PeriodicNoise(kind="periodic_noise", amplitude_dn=1.0, frequency=frequency)
    return BistablePattern(kind="bistable_pattern", amplitude_dn=1.0, frequency=frequency)


def test_a_line_gains_its_odds_less_those_of_all_places_where_it_could_be() -> None:
    """Of 192 frames in which a line has the noise's power at its frequency.

    Each is worth a^2 less what the phase takes: in the mean of noise and phases ln I0(2 a |c|) -
    a^2, which is summed here over draws of its own.
    """
    at, size = (0.2, 0.3), 1.0
    rng = np.random.default_rng(3)
    c = size + rng.normal(0, np.sqrt(0.5), (2, 20000)).T @ np.array([1, 1j])
    each = np.log(scipy.special.i0(2 * size * np.abs(c))) - size**2
    line = _line("periodic_noise", at)
    gains = np.array(
        [WholeFrames(LAYOUT, _frames(at, PATTERN * size, k, free=True, frames=96)).gain(line)
         for k in range(8)]
    )  # fmt: skip
    expected = 190 * each.mean()  # of each of two exposures one frame tells what is fixed
    scatter = np.sqrt(190 / gains.size) * each.std()
    # Laplace: the frames know the place to sqrt(3 / (2 E)) / pi bins, E their power over noise's.
    places = np.log(ROWS * COLUMNS / 2) - np.log(2 * np.pi * 1.5 / 190 / np.pi**2)
    assert gains.mean() == pytest.approx(expected - places, abs=3 * scatter + 2)


def test_where_no_line_is_none_gains() -> None:
    for k in range(40):
        whole = WholeFrames(LAYOUT, _frames((0.2, 0.3), 0.0, k, free=True))
        for kind in ("periodic_noise", "bistable_pattern"):
            assert whole.gain(_line(kind, (0.2, 0.3))) < 2
    assert whole.gain(Dsnu(kind="dsnu", sigma_dn=1.0)) == -np.inf


@pytest.mark.parametrize("at", [(0.25, 0.0), (0.25, 0.25)])
def test_what_may_be_either_at_pixels_own_frequencies_is_no_interference(
    at: tuple[float, float],
) -> None:
    """Of signs that frames do not tell from phases: interference would be there by chance."""
    undecided = 0
    for k in range(12):
        whole = WholeFrames(LAYOUT, _frames(at, 1.3 * PATTERN, k, free=False))
        pattern, wave = _line("bistable_pattern", at), _line("periodic_noise", at)
        if whole.denial(pattern) is not None:
            continue  # weak ones are not seen at all
        assert whole.denial(wave) is not None
        assert whole.gain(pattern) > whole.gain(wave)
        undecided += "by chance" in str(whole.denial(wave))
    assert undecided >= 2


def test_clear_interference_at_pixels_own_frequencies_is_interference() -> None:
    whole = WholeFrames(LAYOUT, _frames((0.25, 0.25), 4 * PATTERN, 1, free=True))
    assert whole.denial(_line("periodic_noise", (0.25, 0.25))) is None
    assert whole.denial(_line("bistable_pattern", (0.25, 0.25))) is not None


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_line_stands_beside_the_noise_of_its_own_frequencies(share: float) -> None:
    """Where neighbours are alike, noise of high frequencies is less than white."""
    at = (0.4, 0.45)
    y, x = np.arange(ROWS)[:, np.newaxis], np.arange(COLUMNS)

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([9, name == "dark"])
        for _ in range(12):
            noise = rng.normal(0, np.sqrt(share) * SD, (ROWS, COLUMNS))  # there, the rest elsewhere
            wave = np.cos(2 * np.pi * (at[0] * x + at[1] * y + rng.uniform(0, 1)))
            yield 100 + np.sqrt(share) * 1.6 * PATTERN * wave + noise

    gain = WholeFrames(LAYOUT, of).gain(_line("periodic_noise", at))
    assert gain > 5  # the same of both: the line is as clear beside its noise
