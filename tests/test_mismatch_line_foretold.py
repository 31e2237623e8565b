"""What locked frames gain by a line that the others show: by its law, and by noise."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.lineforetold import line_foretold
from analysis.mismatch.phaselaw import there
from analysis.mismatch.projections import Power, projections

FramesOf = Callable[[str], Iterator[NDArray[np.float64]]]
ROWS, COLUMNS, FRAMES, AT = 64, 48, 16, (0.0, 0.25)
SD = {"dark": 1.0, "flat": 6.0}
LOCKED = dict.fromkeys(SD, (3, 7, 11, 15))
SIZE = 2 / np.sqrt(ROWS * COLUMNS)  # amplitude, DN, of as much as the dark's noise at the line


def _layout() -> Any:
    return SimpleNamespace(
        rows=ROWS,
        columns=COLUMNS,
        channels=("MONO",),
        uniform=tuple(SimpleNamespace(name=n, numbers=tuple(range(FRAMES))) for n in SD),
        variance_dn2={(name, "MONO"): sd**2 for name, sd in SD.items()},
        still=frozenset(),
        signal_dn={(name, "MONO"): sd**2 for name, sd in SD.items()},
    )


def _frames(amplitude: float, seed: int, *, kept: bool) -> FramesOf:
    y = np.arange(ROWS)[:, np.newaxis]

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([seed, name == "dark"])
        phase = np.random.default_rng([seed, 9]).uniform(0, 1)  # of all exposures
        for _ in range(FRAMES):
            turn = phase + 0.5 * rng.integers(2) if kept else rng.uniform(0, 1)
            line = amplitude * np.sin(2 * np.pi * (AT[1] * y + turn))
            yield line + rng.normal(0, SD[name], (ROWS, COLUMNS))

    return of


def _gained(amplitude: float, *, kept: bool, asked: bool, draws: int) -> NDArray[np.float64]:
    made = (_frames(amplitude, k, kept=kept) for k in range(draws))
    found = (line_foretold(_layout(), own, AT, LOCKED, kept=asked) for own in made)
    return np.array([own.sum() for own in found])


def test_a_phase_that_is_kept_is_foretold_and_a_free_one_is_not() -> None:
    """Of a phase that is known a dark frame at 2 errors of noise gains a^2 less ln 2: 3.3 nats."""
    kept = np.mean(_gained(2 * SIZE, kept=True, asked=True, draws=12))
    free = np.mean(_gained(2 * SIZE, kept=False, asked=False, draws=12))
    assert 4 * (4 - np.log(2)) * 0.75 < kept < 4 * (4 - np.log(2)) + 2
    assert 0 < free < 0.8 * kept


def test_of_a_line_that_the_dark_alone_shows_the_dark_alone_gains() -> None:
    made = [line_foretold(_layout(), _frames(2 * SIZE, k, kept=True), AT, LOCKED, kept=True)
            for k in range(12)]  # fmt: skip
    dark, flat = np.mean(made, 0)
    assert dark > 10 * abs(flat)


def test_noise_foretells_nothing() -> None:
    """A ratio of likelihoods exceeds 1 / p in a share p of recordings at most (Markov)."""
    for asked in (True, False):
        nats = _gained(0.0, kept=False, asked=asked, draws=120)
        assert (nats > np.log(20)).mean() <= 0.05


def test_all_exposures_together_gain_what_all_frames_say_more_than_the_others() -> None:
    """Both by one call each: the log-likelihood of all frames, and of those that are known."""
    frames, layout = _frames(2 * SIZE, 3, kept=True), _layout()
    own = line_foretold(layout, frames, AT, LOCKED, kept=True)
    power = Power.of(layout, projections(layout, frames, [AT]))
    rest = np.array([k not in LOCKED["dark"] for k in range(FRAMES)])
    others = Power(tuple(f[rest] - f[rest].mean(0) for f in power.found), power.weights)
    sizes = [np.sqrt(others.excess[0] * w) for w in power.weights]
    both = [
        there([f[:, 0] for f in some.found], sizes, kept=True, real=False)
        for some in (power, others)
    ]
    # Noise is told from frequencies around: it may be a little more than 1.
    assert abs(own.sum() - (both[0] - both[1])) < 0.1 * own.sum()


def test_where_all_frames_are_locked_nothing_is_foretold() -> None:
    every = {"flat": tuple(range(FRAMES))}
    frames = _frames(2 * SIZE, 3, kept=True)
    assert not line_foretold(_layout(), frames, AT, every, kept=True).size


def test_beside_a_stronger_line_nothing_is_foretold() -> None:
    """What leaks from half a bin off raises all neighbours: it is no line of its own."""
    y = np.arange(ROWS)[:, np.newaxis]

    def frames(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([4, name == "dark"])
        for _ in range(FRAMES):
            line = np.sin(2 * np.pi * (20.5 / ROWS * y + rng.uniform(0, 1)))
            yield line + rng.normal(0, SD[name], (ROWS, COLUMNS))

    for cycles in (15.0, 17.0, 24.0):
        assert not line_foretold(_layout(), frames, (0.0, cycles / ROWS), LOCKED, kept=False).size
    there = line_foretold(_layout(), frames, (0.0, 20.5 / ROWS), LOCKED, kept=False)
    assert there.sum() > 50
