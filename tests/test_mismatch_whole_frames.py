"""Frames that move as a whole, and frames of which parts move."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.linemeans import AXES, line_means
from analysis.mismatch.wholeframes import of_moving_parts, of_pink_noise
from dsis.cfa import Cfa
from dsis.measures import Accumulator
from exposing import effect

ROWS, COLUMNS = 40, 48
FRAMES = (14, 5, 5, 4)
NOISE_DN = (4.0, 6.0, 9.0, 12.0)
SIGNAL_DN = (0.0, 500.0, 1000.0, 2000.0)
HEIGHT = np.linspace(-0.5, 0.5, ROWS)
Array = NDArray[np.float64]
Moves = Callable[[Any, int, float], Array]
"""(rng, frames, signal) -> (frame, row), DN."""


def _state(
    seed: int, cfa: Cfa, *moves: Moves, known: float = 0.0, columns: Moves | None = None
) -> Any:
    """Return a state whose frames are moved; `known`: the share that is explained already.

    `columns` moves columns, which are left unexplained.
    """
    sites = {"MONO": (0, 0)} if cfa is Cfa.MONO else {
        "R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)
    }  # fmt: skip
    rng, lines, keys = np.random.default_rng(seed), {}, []
    for k, (count, noise, signal) in enumerate(zip(FRAMES, NOISE_DN, SIGNAL_DN, strict=True)):
        moved = sum(one(rng, count, signal) for one in moves)[..., np.newaxis]
        if columns is not None:
            moved = moved + columns(rng, count, signal)[:, np.newaxis]
        frames = 1000 + signal + moved + rng.normal(0, noise, (count, ROWS, COLUMNS))
        sums = Accumulator(ROWS, COLUMNS, cfa)
        for frame in frames:
            sums.add(np.floor(frame + 0.5).astype(np.uint16))
        found = sums.result().channels
        for axis in AXES:
            lines[f"F{k}", axis] = line_means(found, sites, (ROWS, COLUMNS), count, axis)
        keys.append(Key("frame_variance", "in all channels", f"F{k}", ""))
    uniform = [SimpleNamespace(name=f"F{k}") for k in range(len(FRAMES))]
    signals = {(f"F{k}", c): own for k, own in enumerate(SIGNAL_DN) for c in sites}
    return SimpleNamespace(
        setting=SimpleNamespace(
            seen=SimpleNamespace(lines=lines),
            layout=SimpleNamespace(uniform=uniform, channels=tuple(sites)),
        ),
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn=signals)),
        mismatches=[SimpleNamespace(statistic="column_variance")] * (columns is not None),
        vector=SimpleNamespace(keys=keys, values=np.full(len(keys), 3.0)),
        null=SimpleNamespace(known=np.ones(len(keys), bool)),
        expected=np.full(len(keys), np.cbrt(1 + 26 * known)),
    )


def _denied(state: Any, kind: str) -> bool:
    return of_moving_parts(state, kind, state.expected) is not None


def _drift(size: float) -> Moves:
    return lambda rng, n, _: size * rng.normal(size=(n, 1)) * np.ones(ROWS)


def _flicker(share: float) -> Moves:
    """Return light that flickers, of which the lower rows have half more than the upper."""
    return lambda rng, n, s: share * s * rng.normal(size=(n, 1)) * (1 + 0.4 * HEIGHT)


def _half(step: float, share: float = 0.5) -> Moves:
    """Return a step that alternates in a share of the rows."""
    return lambda _, n, __: step * (-1.0) ** np.arange(n)[:, None] * (share > HEIGHT + 0.5)


def _columns(size: float, power: float) -> Moves:
    """Return columns whose noise falls with a power of the frequency, from two frames' length."""

    def moves(rng: Any, n: int, _: float) -> Array:
        falls = np.append(0.0, np.arange(1.0, COLUMNS + 1) ** (-power / 2))
        parts = rng.normal(size=(2, n, COLUMNS + 1))
        series = np.fft.irfft((parts[0] + 1j * parts[1]) * falls, 2 * COLUMNS)[:, :COLUMNS]
        return size * series / (2 * (falls**2).sum()) ** 0.5 * 2 * COLUMNS / 2**0.5

    return moves


def _waves(size: float, cycles: float) -> Moves:
    return lambda rng, n, _: size * np.cos(2 * np.pi * (cycles * HEIGHT + rng.random((n, 1))))


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_rows_that_move_by_themselves_are_no_drift(cfa: Cfa, share: float) -> None:
    for seed in range(3):
        assert _denied(_state(seed, cfa, _half(2.0, share)), "black_level_drift")


def test_rows_that_move_by_themselves_are_no_flicker() -> None:
    for seed in range(3):
        assert _denied(_state(seed, Cfa.MONO, _half(6.0)), "flicker")


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("size", [0.1, 0.5, 20.0])
def test_drift_is_believed(cfa: Cfa, size: float) -> None:
    for seed in range(4):
        assert not _denied(_state(seed, cfa, _drift(size)), "black_level_drift")


@pytest.mark.parametrize("share", [2e-4, 1e-3, 0.05])
def test_flicker_of_uneven_light_is_believed(share: float) -> None:
    for seed in range(4):
        assert not _denied(_state(seed, Cfa.RGGB, _flicker(share)), "flicker")


@pytest.mark.parametrize("cycles", [0.6, 1.7])
def test_drift_is_believed_beside_waves(cycles: float) -> None:
    for seed in range(4):
        state = _state(seed, Cfa.MONO, _drift(1.0), _waves(1.0, cycles))
        assert not _denied(state, "black_level_drift")


def test_what_is_explained_already_need_not_be() -> None:
    """Waves take the mean along; drift is a fifth of it, and all that is left to explain."""
    moves = _waves(2.0, 0.6), _drift(0.5)
    bare = [_denied(_state(seed, Cfa.MONO, *moves), "black_level_drift") for seed in range(6)]
    known = [
        _denied(_state(seed, Cfa.MONO, *moves, known=0.8), "black_level_drift") for seed in range(6)
    ]
    assert any(bare)
    assert not any(known)


def test_other_effects_are_not_asked() -> None:
    assert not _denied(_state(1, Cfa.MONO, _half(2.0)), "row_noise")


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("power", [0.9, 1.1, 1.5])
def test_slow_noise_of_columns_is_no_drift(cfa: Cfa, power: float) -> None:
    """As of a sensor that is read column by column, whose amplifier has 1/f noise."""
    states = [_state(s, cfa, _drift(0.0), columns=_columns(3.0, power)) for s in range(8)]
    assert sum(_denied(state, "black_level_drift") for state in states) >= 6  # of few frames
    for state in states:
        state.mismatches = []  # where columns are explained nothing is said of them
        assert not _denied(state, "black_level_drift")


def test_drift_is_believed_beside_noise_of_columns() -> None:
    for seed in range(4):
        for columns in (_columns(1.0, 0.0), _columns(0.5, 1.0)):
            state = _state(seed, Cfa.MONO, _drift(1.0), columns=columns)
            assert not _denied(state, "black_level_drift")


def _beside_pink(drift: float, pink: float, frames: int) -> bool:
    layout = SimpleNamespace(rows=64, columns=96, uniform=[SimpleNamespace(numbers=range(frames))])
    effects = [effect("pink_noise", sigma_dn=pink)] if pink else []
    state: Any = SimpleNamespace(
        camera=SimpleNamespace(effect=effects), setting=SimpleNamespace(layout=layout)
    )
    return of_pink_noise(state, effect("black_level_drift", sigma_dn=drift)) is not None


@pytest.mark.parametrize("frames", [6, 16])
def test_1_f_noise_that_goes_on_from_frame_to_frame_is_no_drift(frames: int) -> None:
    """A series over all frames, against one of the same power that ends at two frames' length."""
    rng, size, draws = np.random.default_rng(3), 64 * 96, 200
    falls = np.append(0.0, np.arange(1.0, 4 * frames * size + 1) ** -0.5)
    parts = rng.normal(size=(2, draws, 64 * frames + 1))  # slower than a 64th of a frame suffices
    slow = np.fft.irfft((parts[0] + 1j * parts[1]) * falls[: 64 * frames + 1], 128 * frames)
    means = slow.reshape(draws, 8, 16 * frames)[:, 0].reshape(draws, frames, 16).mean(2)
    unit = 4 * (1 / np.arange(1, size)).sum() / (128 * frames) ** 2  # of two frames' length
    wander = float((means.var(1, ddof=1) / unit).mean()) ** 0.5
    assert _beside_pink(wander, 1.0, frames)
    assert not _beside_pink(3 * wander, 1.0, frames)
    assert not _beside_pink(wander, 0.0, frames)
