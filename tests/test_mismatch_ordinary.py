"""Ordinary pixels that differ in how noisy they are, beside few that jump."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.ordinary import Ordinary, ordinary_pixels
from dsis.effects import registry
from mismatch_recordings import camera, recorded

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


@pytest.mark.parametrize("spread", [0.1, 0.2, 0.4])
def test_its_size_is_told_beside_jumps(spread: float) -> None:
    told = [_darks(seed, spread=spread, jumping=0.015).spread() for seed in range(8)]
    values, errors = np.transpose(told)
    assert abs(values.mean() - spread) < 4 * values.std(ddof=1) / len(told) ** 0.5
    assert values.std(ddof=1) == pytest.approx(errors.mean(), rel=4 / (2 * len(told)) ** 0.5)


@pytest.mark.long
def test_spread_is_named_beside_jumps_that_hide_it_and_only_where_it_is() -> None:
    words = registry()
    jumps = words["rts"](pixel_fraction=0.003, amplitude_dn=14.0, switch_probability=0.3)
    for spread in (0.2, 0.0):
        own = (words["read_noise_spread"](log_sigma=spread),) if spread else ()
        recording = recorded(
            camera(jumps, *own), 1, frames=12, rows=96, columns=128, levels=(100.0, 900.0, 3000.0)
        )
        named = find_mismatch(camera(), recording).omitted_physics
        found = {one.effect: one.parameters for one in named}
        assert ("read_noise_spread" in found) is bool(spread)
        assert "rts" in found
        if spread:
            told = found["read_noise_spread"]["log_sigma"]
            assert isinstance(told.value, float)
            assert abs(told.value - spread) < 4 * told.standard_error < 0.05
