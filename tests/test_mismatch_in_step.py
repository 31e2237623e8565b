"""Slow patterns whose sign flips, and halves of frames that take the frame's mean along."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.linemeans import PARTS, LineMeans
from analysis.mismatch.instep import in_step
from dsis.effects import registry

ROWS = 96
FRAMES = (12, 6, 5, 5)
NOISE_DN = (0.2, 0.4, 0.6, 0.9)  # of a row
HEIGHT = (np.arange(ROWS) + 0.5) / ROWS
Array = NDArray[np.float64]


def _setting(seed: int, moves: Any) -> Any:
    """Return a setting whose rows are moved; `moves(rng, frames)`: (frame, row), DN."""
    rng, lines = np.random.default_rng(seed), {}
    for k, (count, noise) in enumerate(zip(FRAMES, NOISE_DN, strict=True)):
        rows = moves(rng, count) + rng.normal(0, noise, (count, ROWS))
        parts = rows.reshape(count, PARTS, -1).mean(2)
        lines[f"F{k}", "row"] = LineMeans(
            count, rows.mean(0), rows.mean(0), rows.var(0), noise**2, parts
        )
    uniform = [SimpleNamespace(name=f"F{k}") for k in range(len(FRAMES))]
    return SimpleNamespace(
        layout=SimpleNamespace(uniform=uniform, rows=ROWS, columns=80),
        seen=SimpleNamespace(lines=lines),
    )


def _signs(rng: Any, frames: int) -> Array:
    return np.asarray(rng.choice([-1.0, 1.0], (frames, 1)))


def _pattern(cycles: float, kind: str = "bistable_pattern") -> Any:
    return registry()[kind](amplitude_dn=1.0, frequency=(0.0, cycles / ROWS))


@pytest.mark.parametrize("share", [0.35, 0.5])
@pytest.mark.parametrize("cycles", [0.7, 1.0, 1.2])
def test_a_part_of_the_frame_is_no_pattern(share: float, cycles: float) -> None:
    def part(_: Any, frames: int) -> Array:
        return np.asarray((-1.0) ** np.arange(frames)[:, None] * (share > HEIGHT))

    for seed in range(4):
        said = in_step(_setting(seed, part), _pattern(cycles))
        assert said is not None
        assert "one part" in said


@pytest.mark.parametrize("cycles", [0.5, 0.8, 1.0, 2.4])
@pytest.mark.parametrize("drift", [0.0, 0.4, 2.0])
def test_slow_patterns_are_believed_beside_drift(cycles: float, drift: float) -> None:
    for seed in range(8):
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi)
        wave = np.cos(2 * np.pi * cycles * HEIGHT + phase)

        def moves(rng: Any, frames: int, wave: Array = wave) -> Array:
            return np.asarray(_signs(rng, frames) * wave + drift * rng.normal(size=(frames, 1)))

        assert in_step(_setting(seed, moves), _pattern(cycles)) is None


def test_fast_patterns_and_others_are_not_asked() -> None:
    setting = _setting(1, lambda _, n: (-1.0) ** np.arange(n)[:, None] * (HEIGHT < 0.5))
    assert in_step(setting, _pattern(20.0)) is None
    assert in_step(setting, _pattern(1.0, "periodic_noise")) is None
