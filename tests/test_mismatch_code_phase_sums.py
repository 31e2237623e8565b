"""Bits of wrong weight make codes wide and narrow in step: histograms of all exposures say so."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.codephase import DETAIL, LABEL, CodePhases
from analysis.mismatch.bank.key import Key
from analysis.mismatch.codegain import gain_of_codes
from analysis.mismatch.untold import untold_order
from dsis.effects import registry
from dsis.measures import Accumulator
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
BASE = camera()


def _edges(period: int, rms: float) -> Array:
    """Return the lower edge of each of 4096 codes whose widths repeat: as foreign as a table."""
    rng = np.random.default_rng(8)
    widths = rng.standard_normal(period)
    widths = 1 + rms * (widths - widths.mean()) / widths.std()
    every = np.tile(widths, 4096 // period)
    return np.asarray(np.concatenate([[0.0], np.cumsum(every)[:-1]]) - 0.5)


def _phases(period: int, rms: float, seed: int, frames: int = 8) -> CodePhases:
    """Return the sums of three flats of numpy's noise, coded here."""
    rng, edges, sums = np.random.default_rng(seed), _edges(period, rms), CodePhases()
    for signal, sd in ((700.0, 9.0), (1500.0, 20.0), (2600.0, 40.0)):
        own = Accumulator(96, 128, white_level=4095.0)
        for _ in range(frames):
            volts = signal + sd * rng.standard_normal((96, 128))
            own.add((np.searchsorted(edges, volts, "right") - 1).astype(np.uint16))
        sums.add(own.result().channels)
    return sums


@pytest.mark.parametrize("period", [2, 4, 8, 16])
def test_widths_that_repeat_stand_out(period: int) -> None:
    """Of 3e5 samples widths of 2 % are known to 0.7 % for 16 codes, far better than each alone."""
    found = _phases(period, 0.02, 1)
    peak = found.peak()
    assert found.number()[0] > 6
    assert peak is not None
    assert 1 / peak.fx == pytest.approx(period)
    assert peak.power == pytest.approx(0.02, rel=0.3)


def test_equal_codes_do_not() -> None:
    scores = [_phases(16, 0.0, seed, frames=3).number()[0] for seed in range(40)]
    assert np.mean(scores) < 1.5
    assert max(scores) < 4.5


def _tailed(seed: int, rms: float = 0.0) -> float:
    """Return the score of a dark and flats whose read noise has tails, and spikes on it."""
    rng, edges, sums = np.random.default_rng(seed), _edges(8, rms), CodePhases()
    shape = 10, 96, 100
    for mean, shot in ((100.0, 0.0), (200.0, 6.3), (600.0, 14.1), (1600.0, 24.5)):
        volts = mean + shot * rng.standard_normal(shape)
        volts += 4 * np.sqrt(3 / 5) * rng.standard_t(5, shape)
        volts += (rng.random(shape) < 2e-4) * rng.exponential(150.0, shape)
        own = Accumulator(*shape[1:], white_level=4095.0)
        for frame in volts:
            own.add((np.searchsorted(edges, frame, "right") - 1).astype(np.uint16))
        sums.add(own.result().channels)
    return sums.number()[0]


def test_of_noise_with_tails_the_core_covers_fewer_codes() -> None:
    """By its variance it covers harmonics that it does not: scores were 2 in the mean, not 0."""
    scores = [_tailed(seed) for seed in range(6)]
    assert np.mean(scores) < 1.0
    assert max(scores) < 3.0
    assert _tailed(7, rms=0.03) > 6  # bits beside it are seen


def test_narrow_noise_and_clipped_codes_say_nothing() -> None:
    rng = np.random.default_rng(1)
    for mean, sd in ((200.0, 0.3), (3.0, 8.0)):
        own, sums = Accumulator(96, 128, white_level=4095.0), CodePhases()
        for _ in range(4):
            own.add(
                np.clip(np.rint(mean + sd * rng.standard_normal((96, 128))), 0, 4095).astype("u2")
            )
        sums.add(own.result().channels)
        assert np.isnan(sums.number()[0])
        assert sums.peak() is None


def test_a_full_well_where_many_codes_are_one_says_nothing() -> None:
    """A quarter of all samples lie within three codes: no converter did that."""
    rng = np.random.default_rng(2)
    own, sums = Accumulator(96, 128, white_level=4095.0), CodePhases()
    for _ in range(8):
        charge = np.minimum(2600 + 40 * rng.standard_normal((96, 128)), 2627.0)
        own.add(np.rint(charge + 0.9 * rng.standard_normal(charge.shape)).astype("u2"))
    sums.add(own.result().channels)
    assert np.isnan(sums.number()[0])


def test_what_codes_gain_is_that_of_uneven_widths_alone() -> None:
    def seen(score: float) -> Any:
        pooled = {"": {LABEL: (score, 1.0)}, "MONO": {}}
        return SimpleNamespace(seen=SimpleNamespace(pooled=pooled))

    assert gain_of_codes(seen(8.0), registry()["adc_dnl"](rms_lsb=0.1)) == pytest.approx(30.0)
    assert gain_of_codes(seen(8.0), registry()["prnu"](sigma_percent=1.0)) == -np.inf
    assert gain_of_codes(seen(np.nan), registry()["adc_dnl"](rms_lsb=0.1)) == -np.inf
    keys = [Key("code_imbalance", "all", "", "MONO", DETAIL), Key("code_imbalance", "exposure")]
    assert untold_order(camera(registry()["adc_dnl"](rms_lsb=0.1)), keys).tolist() == [True, False]


@pytest.mark.long
@pytest.mark.parametrize("rms", [0.042, 0.0])
def test_a_bit_of_wrong_weight_is_named_and_proven(rms: float) -> None:
    """Four hundredths of a code, that repeat every sixteen: no single exposure is sure of them."""
    made = recorded(BASE, 5, rows=64, columns=96, levels=FEW_LEVELS)
    rng, edges, stacks = np.random.default_rng(6), _edges(16, rms), {}
    for e in made.exposures:
        signal, shape = e.light or 0.0, (len(e.frames), made.rows, made.columns)
        volts = 64 + signal + np.sqrt(20 + 0.5 * signal) * rng.standard_normal(shape)
        stacks[e.name] = (np.searchsorted(edges, volts, "right") - 1).astype(np.uint16)
    own = InMemory(made.sensor, made.exposures, made.rows, made.columns, made.folder, stacks)
    found = find_mismatch(BASE, own, seed=1)
    assert [one.effect for one in found.omitted_physics] == (["adc_dnl"] if rms else [])
    assert not found.unexplained
    assert all(one.heldout_gain.ci95[0] > 0 for one in found.omitted_physics)
