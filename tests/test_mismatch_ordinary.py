"""Ordinary pixels that differ in how noisy they are, beside few that jump."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.ordinary import Ordinary, ordinary_pixels

SHAPE, FRAMES = (96, 128), 12


def _darks(
    seed: int,
    *,
    spread: float = 0.0,
    jumping: float = 0.0,
    tails: bool = False,
    frames: int = FRAMES,
) -> Ordinary:
    """Return what two darks say whose noise spreads by a log-normal law, some pixels jumping."""
    rng = np.random.default_rng(seed)
    sd = 4 * np.exp(spread * rng.standard_normal(SHAPE))
    jumps = rng.uniform(size=SHAPE) < jumping
    made = {}
    for name in ("dark-0", "dark-1"):
        noise = (
            rng.standard_t(5, (frames, *SHAPE)) if tails else rng.standard_normal((frames, *SHAPE))
        )
        high = np.cumsum(rng.uniform(size=(frames, *SHAPE)) < 0.2, 0) % 2
        made[name] = np.rint(sd * noise + jumps * 14 * high + rng.normal(0, 1, SHAPE))
    uniform = [SimpleNamespace(name=n, kind="dark", numbers=range(frames)) for n in made]
    layout: Any = SimpleNamespace(uniform=uniform, large=False)
    return ordinary_pixels(layout, made.__getitem__)


@pytest.mark.parametrize("jumping", [0.0, 0.015])
def test_noise_that_spreads_is_seen_whatever_few_pixels_do(jumping: float) -> None:
    for seed in range(5):
        assert _darks(seed, spread=0.2, jumping=jumping).differ


@pytest.mark.parametrize("own", [{}, {"jumping": 0.015}, {"tails": True}], ids=str)
def test_white_noise_jumps_and_tails_do_not_make_ordinary_pixels_differ(own: Any) -> None:
    seen = [_darks(seed, **own) for seed in range(20)]
    assert not any(one.differ for one in seen)
    far = np.array([one.alike / one.error for one in seen])
    assert abs(far).max() < 5
    if "jumping" not in own:
        assert abs(far.mean()) < 4 / len(seen) ** 0.5
        assert far.std() == pytest.approx(1, abs=4 / (2 * len(seen)) ** 0.5)


def test_few_frames_and_no_noise_say_nothing() -> None:
    assert not _darks(1, spread=0.4, frames=5).differ
    still: Any = SimpleNamespace(
        uniform=[SimpleNamespace(name="dark", kind="dark", numbers=range(6))], large=False
    )
    assert ordinary_pixels(still, lambda _: np.zeros((6, 8, 8))) == Ordinary()
