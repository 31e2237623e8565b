"""Codes that a digital gain or a table leaves out are no widths that scatter.

Recordings are numpy's noise, coded here; nothing of them is made by the effects.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from dsis.measures import Codes
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
BLACK, SLOPE, INTERCEPT = 64.0, 0.5, 40.0  # DN, DN, DN^2
LEVELS = (250.0, 900.0, 2600.0)
BASE = camera(segments=((SLOPE, INTERCEPT, None),), black=BLACK)


def coded(
    converted: Callable[[Array], Array],
    levels: tuple[float, ...] = LEVELS,
    line: tuple[float, float] = (SLOPE, INTERCEPT),
) -> InMemory:
    """Return noise of a base model, its voltages (DN above black) made codes."""
    draws = np.random.default_rng(5)
    like = recorded(BASE, 1, rows=96, columns=96, levels=levels)
    assert like.stacks is not None
    stacks = {}
    for exposure in like.exposures:
        signal = exposure.light or 0.0
        noise = draws.standard_normal(like.stacks[exposure.name].shape)
        voltage = signal + noise * np.sqrt(line[0] * signal + line[1])
        stacks[exposure.name] = np.clip(converted(voltage), 0, 4095).astype(np.uint16)
    return replace(like, stacks=stacks)


def multiplied(voltage: Array) -> Array:
    """Ten codes become eleven: one of these never occurs."""
    return np.floor(np.rint(voltage / 1.1 + 1000) * 1.1 + 0.5) - 1100 + BLACK


def companded(voltage: Array) -> Array:
    """Codes of a square root, as a table returns them to proportion."""
    root = np.rint(4 * np.sqrt(np.maximum(voltage + BLACK, 0)))
    return np.rint((root / 4) ** 2)


def scattered(rms: float) -> Callable[[Array], Array]:
    edges = np.cumsum(np.random.default_rng(3).normal(1, rms, 4200))
    edges = np.maximum.accumulate(edges - np.arange(4200) * (edges[-1] / 4200 - 1) - 0.5)

    def converted(voltage: Array) -> Array:
        return np.searchsorted(edges, voltage + BLACK).astype(np.float64)

    return converted


@pytest.mark.parametrize("converted", [multiplied, companded])
def test_absent_codes_stay_unexplained(converted: Callable[[Array], Array]) -> None:
    found = find_mismatch(BASE, coded(converted), seed=1, vocabulary=frozenset({"adc_dnl"}))
    assert found.omitted_physics == ()
    assert "code_imbalance" in {one.statistic for one in found.unexplained}
    assert any("adc_dnl: codes between others never occur" in one for one in found.remarks)


@pytest.mark.long
def test_widths_that_scatter_are_named_absent_codes_among_them() -> None:
    """Of a normal law a code in twenty has no width where they scatter by 0.6."""
    recording = coded(scattered(0.6))
    found = find_mismatch(BASE, recording, seed=1, vocabulary=frozenset({"adc_dnl"}))
    assert [one.effect for one in found.omitted_physics] == ["adc_dnl"]


def test_middle_of_a_histogram() -> None:
    """The middle nine tenths of the samples; on a lattice, of its codes alone."""
    counts = np.full(300, 900)
    counts[::7] = 0
    own = Codes.of(50, counts).middle
    assert own is not None
    assert (own.first, own.last, own.step) == (65, 335, 1)
    assert own.codes == 271
    assert own.absent.tolist() == [c for c in range(65, 336) if (c - 50) % 7 == 0]
    coarse = np.zeros(3000, np.int64)
    coarse[::3] = 900
    own = Codes.of(50, coarse).middle
    assert own is not None
    assert own.step == 3
    assert own.absent.size == 0
    assert Codes.of(50, np.full(300, 40)).middle is None  # absent by chance, it could be


@pytest.mark.parametrize("seed", range(5))
def test_the_inner_half_of_a_broad_histogram_tells_absent_codes(seed: int) -> None:
    """Noise of 240 DN in 42 000 samples: at 5 % of them are eight a code."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(30_000.0, 240.0, 42_000)
    codes = np.floor(np.rint(noise / 1.5) * 1.5 + 0.5).astype(np.int64)
    lowest = int(codes.min())
    own = Codes.of(lowest, np.bincount(codes - lowest)).middle
    assert own is not None
    assert own.first == pytest.approx(30_000 - 0.6745 * 240, abs=6)
    assert own.absent.tolist() == [c for c in range(own.first, own.last + 1) if c % 3 == 1]
    plain = np.rint(noise).astype(np.int64)
    lowest = int(plain.min())
    own = Codes.of(lowest, np.bincount(plain - lowest)).middle
    assert own is not None
    assert own.absent.size == 0


@pytest.mark.parametrize("apart", [8.0, 12.0])
def test_between_two_levels_no_code_is_absent(apart: float) -> None:
    """Halves whose levels differ by many standard deviations of noise."""
    rng = np.random.default_rng(1)
    level = np.where(np.arange(160_000) % 2 == 0, 20_000.0, 20_000.0 + apart * 100.0)
    codes = np.rint(rng.normal(level, 100.0)).astype(np.int64)
    lowest = int(codes.min())
    own = Codes.of(lowest, np.bincount(codes - lowest)).middle
    assert own is None or own.absent.size < 8
    stepped = np.rint(codes / 12.0).astype(np.int64) * 12  # wide gaps between codes that are common
    own = Codes.of(int(stepped.min()) - 1, np.bincount(stepped - stepped.min() + 1)).middle
    assert own is None or own.step == 12
