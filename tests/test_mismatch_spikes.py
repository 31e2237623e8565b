"""Spikes of hundreds of standard deviations: base numbers and codes are those of the many."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.bulk import LOSS, Bulk
from analysis.mismatch.observe import observe
from analysis.mismatch.recalibrate import calibrate
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.effects import registry
from dsis.measures import Accumulator, Estimate
from mismatch_recordings import camera, recorded

ROWS, COLUMNS, FRAMES = 32, 48, 8
SIGMA = 3.0
PLANES = {"MONO": (slice(None), slice(None))}
IMPULSE = registry()["impulse"](per_megapixel_frame=500.0, mean_dn=1500.0)


def _noise(rng: np.random.Generator) -> NDArray[np.float64]:
    return rng.normal(100, SIGMA, (FRAMES, ROWS, COLUMNS)).round()


def _bulk(frames: NDArray[np.float64]) -> Bulk:
    sums = Bulk(PLANES, {"MONO": SIGMA**2})
    assert len(list(sums.watching(frames))) == len(frames)
    return sums


def test_the_variance_of_the_many_is_unbiased_and_its_error_known() -> None:
    rng = np.random.default_rng(1)
    found = np.array([_bulk(_noise(rng)).variance_dn2("MONO") for _ in range(200)])
    true = SIGMA**2 + 1 / 12
    error = true * np.sqrt(2 * LOSS / ((FRAMES - 1) * (ROWS - 1) * (COLUMNS - 1)))
    assert abs(found.mean() - true) < 4 * error / 200**0.5
    assert found.std() == pytest.approx(error, rel=0.2)


def test_lines_that_move_as_one_are_no_noise_of_pixels() -> None:
    rng = np.random.default_rng(2)
    frames = _noise(rng) + rng.normal(0, 2, (FRAMES, ROWS, 1)).round()
    assert _bulk(frames).variance_dn2("MONO") == pytest.approx(SIGMA**2, rel=0.05)


def test_spikes_are_left_out_and_counted() -> None:
    rng = np.random.default_rng(3)
    frames = _noise(rng)
    hit = rng.random(frames.shape) < 0.01
    frames[hit] += 500
    found = _bulk(frames)
    assert found.variance_dn2("MONO") == pytest.approx(SIGMA**2, rel=0.05)
    # Both differences of a frame see it; two spikes in a row may cancel.
    assert found.far("MONO") == pytest.approx(2 * 0.01 * 0.99, rel=0.2)


def test_base_numbers_beside_spikes_are_those_of_the_many() -> None:
    true = camera(IMPULSE)
    recording = recorded(true, 6)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    dark = seen.levels["dark-0", "MONO"]
    assert dark.variance_dn2 > 10 * 20.0  # of the spikes
    (piece,) = calibrate(true, layout, seen, None, seed=1, jobs=1).fit.pieces
    assert abs(piece.intercept - 20.0) < 4 * piece.intercept_error < 4.0
    assert abs(piece.slope - 0.5) < 4 * piece.slope_error < 0.1


def test_rare_spikes_are_named_alone_with_their_numbers() -> None:
    found = find_mismatch(camera(), recorded(camera(IMPULSE), 6), seed=2)
    assert [effect.effect for effect in found.omitted_physics] == ["impulse"]
    for name, true in (("per_megapixel_frame", 500.0), ("mean_dn", 1500.0)):
        fitted = found.omitted_physics[0].parameters[name]
        assert isinstance(fitted.value, float)
        assert abs(fitted.value - true) < 4 * fitted.standard_error < 2 * true


@pytest.mark.parametrize("uneven", [False, True])
def test_widths_of_codes_are_told_beside_spikes(uneven: bool) -> None:
    """Their variance is no width of the noise that smooths the histogram."""
    rng = np.random.default_rng(4)
    exact = rng.normal(100, SIGMA, (64, 96, 128))
    hit = rng.random(exact.shape) < 5e-4
    spiked = exact + np.where(hit, rng.exponential(1000, exact.shape), 0.0)
    plain, beside = (_imbalance(values, uneven) for values in (exact, spiked))
    assert (beside.value > 10 * beside.null_error) == uneven
    assert beside.value == pytest.approx(plain.value, rel=0.1, abs=plain.null_error)


def _imbalance(exact: NDArray[np.float64], uneven: bool) -> Estimate:
    """Return what is measured where every other code is a tenth wider, its neighbours narrower."""
    codes = np.floor(exact + 0.1 * (np.floor(exact) % 2)) if uneven else np.floor(exact)
    sums = Accumulator(96, 128, camera().cfa, 0.0, 65535.0)
    for frame in codes:
        sums.add(np.clip(frame, 0, 65535).astype(np.float32))
    return sums.result().channels["MONO"].estimates["code_imbalance"]
