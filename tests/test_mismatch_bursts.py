"""Bursts in single lines, and noise that is cut off, feign tails of single samples."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.burst import Bursts, bursts_of
from analysis.mismatch.feignedtails import clamped
from analysis.mismatch.layout import Layout
from analysis.mismatch.taking import layout_of
from dsis.cfa import Cfa
from dsis.effects import registry
from mismatch_recordings import (
    FEW_LEVELS,
    TWO_LEVELS,
    InMemory,
    camera,
    recorded,
    state_of,
)

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES = 64, 80, 12
SURE = 5.0  # standard errors
Array = NDArray[np.float64]


def _layout(cfa: Cfa = Cfa.MONO) -> Layout:
    sizes = {"rows": ROWS, "columns": COLUMNS, "frames": FRAMES}
    recording = recorded(camera(cfa=cfa.name), 1, levels=FEW_LEVELS, **sizes)
    numbers = {e.name: tuple(range(len(e.frames))) for e in recording.exposures}
    assert recording.stacks is not None
    stacks = recording.stacks
    return layout_of(recording, numbers, lambda name, which: stacks[name][list(which)])


def _found(noise: Array, cfa: Cfa = Cfa.MONO) -> Bursts:
    quiet = np.random.default_rng(0).standard_normal(noise.shape)

    def frames(name: str) -> Iterator[Array]:
        yield from 500 + (noise if name == "dark-0" else quiet)

    return bursts_of(_layout(cfa), frames)


def _noise(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal((FRAMES, ROWS, COLUMNS))


@pytest.mark.parametrize("freedom", [4.5, 8.0])
def test_tails_of_single_samples_are_no_bursts(freedom: float) -> None:
    tails = np.random.default_rng(2).standard_t(freedom, (FRAMES, ROWS, COLUMNS))
    found = _found(tails)
    assert found.tails > 0.5
    assert abs(found.bursts) < SURE * found.error
    assert found.denial("heavy_tailed_read_noise") is None


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_lines_of_other_noise_have_the_tails_of_their_variances(cfa: Cfa) -> None:
    """A tenth of all rows of single frames with 9 times the variance: 3 var(v) / mean(v)^2.

    Tails have less: the mean of 12 frames, which is taken off, has noise of all of them.
    """
    rng, noise = np.random.default_rng(3), _noise(4)
    noisy = rng.random((FRAMES, ROWS, 1)) < 0.1
    found = _found(noise * np.where(noisy, 3.0, 1.0), cfa)
    share = noisy.mean() if cfa is Cfa.MONO else 0.1
    expected = 3 * share * (1 - share) * 8**2 / (1 + 8 * share) ** 2
    assert found.bursts == pytest.approx(expected, rel=0.15 if cfa is Cfa.MONO else 0.4)
    assert 0.7 * found.bursts < found.tails < found.bursts
    denial = found.denial("impulse")
    assert denial is not None
    assert "beside each other" in denial.why
    assert found.denial("row_noise") is None


@pytest.mark.parametrize("beside", ["rows that move", "a glow", "noisy columns"])
def test_tails_beside_lines_that_move_or_are_always_noisier_are_no_bursts(beside: str) -> None:
    rng = np.random.default_rng(7)
    tails = rng.standard_t(6.0, (FRAMES, ROWS, COLUMNS))
    if beside == "rows that move":
        tails += rng.standard_normal((FRAMES, ROWS, 1))
    elif beside == "a glow":
        tails *= 1 + 2 * np.exp(-np.arange(COLUMNS) / 8)
    else:
        tails *= np.exp(0.5 * rng.standard_normal((1, 1, COLUMNS)))
    found = _found(tails)
    assert found.tails > 0.5
    assert found.denial("heavy_tailed_read_noise") is None


def _changed(recording: InMemory, name: str, stack: Array) -> InMemory:
    assert recording.stacks is not None
    made = np.clip(np.rint(stack), 0, 4095).astype(np.uint16)
    return replace(recording, stacks={**recording.stacks, name: made})


@pytest.mark.long
def test_interference_in_short_bursts_is_no_heavy_tailed_noise() -> None:
    """It has no word; what noise its rows have is left open."""
    rng, recording = np.random.default_rng(5), recorded(camera(), 6, levels=TWO_LEVELS)
    assert recording.stacks is not None
    for name, frames in list(recording.stacks.items()):
        stack = frames.astype(np.float64)
        for frame in stack:
            first = int(rng.integers(0, frame.shape[0] - 3))
            along = np.arange(3 * frame.shape[1]).reshape(3, -1)
            wave = np.cos(2 * np.pi * (0.3127 * along + rng.random()))
            frame[first : first + 3] += (rng.random() < 0.3) * 40.0 * wave
        recording = _changed(recording, name, stack)
    found = find_mismatch(camera(), recording, seed=1)
    assert not found.omitted_physics
    assert found.verdict == "unexplained"


@pytest.mark.parametrize("cut", [True, False])
def test_what_is_cut_off_at_black_shows_no_tails(cut: bool) -> None:
    """A clamp at black leaves half a normal law of darks; tails show where there is light too.

    Of a camera that has them, all of whose darks are cut off or none.
    """
    tails = registry()["impulse"](per_megapixel_frame=300.0, mean_dn=200.0)
    true = camera() if cut else camera(tails)
    recording = recorded(true, 7, levels=FEW_LEVELS)
    assert recording.stacks is not None
    for name in ("dark-0", "dark-1") if cut else ():
        recording = _changed(recording, name, np.maximum(recording.stacks[name], 64.0))
    model, without = (state_of(recording, own) for own in (camera(tails), camera()))
    denial = clamped(model, "impulse", without.null.mean)
    assert (denial is not None) == cut
    assert clamped(model, "row_noise", without.null.mean) is None
