"""A pattern of two signs has one size: of any size in each frame it is another's."""

import numpy as np
import pytest

from analysis.mismatch.anysize import of_any_size

FRAMES, EXPOSURES = 9, 6


def _found(
    law: str, size: float, seed: int, frames: int = FRAMES, *, real: bool
) -> list[np.ndarray]:
    """Return projections of frames beside what each exposure's have in common, noise at 1."""
    rng = np.random.default_rng(seed)
    turn = 1.0 if real else np.exp(0.7j)
    found = []
    for _ in range(EXPOSURES):
        sizes = rng.choice([-1.0, 1.0], frames) if law == "signs" else rng.standard_normal(frames)
        noise = rng.standard_normal((2, frames))
        white = noise[0] if real else (noise[0] + 1j * noise[1]) / np.sqrt(2)
        found.append((3.0 + size * sizes) * turn + white)
    return found


@pytest.mark.parametrize("real", [True, False])
@pytest.mark.parametrize("off", [0.85, 1.0, 1.15])
def test_signs_alone_are_told_from_sizes(real: bool, off: float) -> None:
    """However large, and although the amplitude is known to a seventh only."""
    for seed, size in enumerate((4.0, 8.0, 30.0, 300.0)):
        told = {
            law: of_any_size(
                _found(law, size, seed, real=real), [off * size] * EXPOSURES, real=real
            )
            for law in ("signs", "sizes")
        }
        assert told["signs"] < -10
        assert told["sizes"] > 10


@pytest.mark.parametrize("real", [True, False])
def test_a_weak_pattern_is_denied_by_no_chance(real: bool) -> None:
    """Where noise hides how large it is in a frame it may be either."""
    told = [
        of_any_size(_found("signs", size, seed, real=real), [size] * EXPOSURES, real=real)
        for seed in range(100)
        for size in (0.5, 1.0, 2.0)
    ]
    assert max(told) < 3


@pytest.mark.parametrize("real", [True, False])
@pytest.mark.parametrize("frames", [1, 2, 4])
def test_frames_of_an_exposure_may_all_have_one_sign(frames: int, real: bool) -> None:
    """Then the middle of both signs is none of them."""
    told = [
        of_any_size(_found("signs", size, seed, frames, real=real), [size] * EXPOSURES, real=real)
        for seed in range(50)
        for size in (4.0, 8.0, 30.0)
    ]
    assert max(told) < 3
