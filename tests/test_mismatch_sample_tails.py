"""Rare faults are no heavy tails: of these, most that is far out is only moderately so."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm, t

from analysis.mismatch.sampletails import Ring, ring_of
from dsis.effects.heavy_tailed_read_noise import HeavyTailedReadNoise
from dsis.effects.impulse import Impulse

Array = NDArray[np.float64]
SHAPE = (8, 90, 110)
SPREAD = 4.0  # codes
READ = SPREAD**2


def _layout(white: float = 4095.0, large: bool = False) -> Any:
    exposures = [SimpleNamespace(name="dark", kind="dark", numbers=tuple(range(SHAPE[0])))]
    exposures[0].exposure_time_s = 0.01
    sites = {"MONO": (0, 0)}
    return SimpleNamespace(uniform=exposures, sites=sites, white_dn=white, large=large)


def _ring(noise: Array, **layout: Any) -> Ring:
    codes = np.rint(200 + SPREAD * noise)

    def frames(name: str) -> Iterator[Array]:
        assert name == "dark"
        yield from codes

    return ring_of(_layout(**layout), frames)


def _student(df: float) -> HeavyTailedReadNoise:
    return HeavyTailedReadNoise(tail_df=df)


@pytest.mark.parametrize("df", [3.2, 5.0, 8.0])
def test_heavy_tails_have_the_samples_that_student_s_law_has(df: float) -> None:
    """As many beyond 3.5 quartile deviations as scipy's law has, but for the mean frame.

    Less it, samples of pixels with one far out differ more: some move, and quartiles lie wider.
    """
    rng = np.random.default_rng(4)
    ring = _ring(rng.standard_t(df, SHAPE))
    scale = t.isf(0.25, df) / norm.isf(0.25)
    expected = 2 * (t.sf(3.5 * scale, df) - t.sf(7 * scale, df))
    assert ring.samples == np.prod(SHAPE)
    assert ring.seen / ring.samples == pytest.approx(expected, rel=0.3)
    assert ring.denial(_student(df), READ) is None


@pytest.mark.parametrize("seed", range(3))
def test_bits_that_flip_are_no_tails(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(SHAPE)
    noise[rng.random(SHAPE) < 1e-4] += 32.0  # a bit of 128 codes
    ring = _ring(noise)
    denial = ring.denial(_student(3.4), READ)
    assert denial is not None
    assert "rare faults" in denial.why
    assert ring.denial(_student(60.0), READ) is None  # which foretells hardly any
    assert ring.denial(Impulse(per_megapixel_frame=100.0, mean_dn=128.0), READ) is None


def test_a_mixture_of_two_normal_laws_is_believed() -> None:
    """A hundredth with twice the noise: another law, but tails all the same."""
    rng = np.random.default_rng(9)
    wide = rng.random(SHAPE) < 0.01
    ring = _ring(rng.standard_normal(SHAPE) * np.where(wide, 3.0, 1.0))
    assert ring.denial(_student(6.0), READ) is None


def test_nothing_is_said_of_large_clipped_or_coarse_recordings() -> None:
    noise = np.random.default_rng(2).standard_normal(SHAPE)
    assert _ring(noise, large=True) == Ring()
    assert _ring(noise, white=205.0) == Ring()
    assert _ring(noise * 0.2) == Ring()
    assert Ring().denial(_student(3.0), READ) is None


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("df", [2.5, 4.0, 6.0])
def test_tails_of_noise_that_has_others_beside_it_are_not_denied(df: float, share: float) -> None:
    """Rows that move, or photons of a dark current, hide what is moderately far."""
    rng = np.random.default_rng(7)
    tails = rng.standard_t(df, SHAPE) * ((df - 2) / df * share) ** 0.5
    ring = _ring(tails + rng.normal(0, (1 - share) ** 0.5, SHAPE))
    assert ring.denial(_student(df), share * READ) is None
    rows = _ring(rng.standard_normal(SHAPE) + rng.normal(0, 3.0, (SHAPE[0], SHAPE[1], 1)))
    assert rows.variance_dn2 == pytest.approx(READ, rel=0.05)  # rows are taken off


@pytest.mark.parametrize("seed", range(3))
def test_tails_of_both_sides_are_no_spikes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.standard_t(8.0, SHAPE)
    ring = _ring(noise)
    denial = ring.even("impulse", frozenset())
    assert denial is not None
    assert "below" in denial.why
    assert ring.even("heavy_tailed_read_noise", frozenset()) is None
    assert ring.even("impulse", frozenset({"heavy_tailed_read_noise"})) is None
    noise[rng.random(SHAPE) < 2e-4] += 15.0  # beside tails spikes are told by what is far above
    assert _ring(noise).even("impulse", frozenset()) is None


@pytest.mark.parametrize("height", [3.0, 8.0, 60.0])
@pytest.mark.parametrize("share", [3e-5, 1e-3, 0.01])
def test_spikes_of_normal_noise_are_on_one_side(height: float, share: float) -> None:
    rng = np.random.default_rng(int(height))
    hit = rng.random(SHAPE) < share
    ring = _ring(rng.standard_normal(SHAPE) + hit * rng.exponential(height, SHAPE))
    assert ring.even("impulse", frozenset()) is None
