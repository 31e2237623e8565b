"""What the bank's sums gather: waves between bins, memories, steps, falls, bright pixels."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm, poisson

from analysis.mismatch.bank.coherent import SpectrumSums
from analysis.mismatch.bank.home import LAG, homes, one_sided
from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.parts import STANDING_OUT, parts
from analysis.mismatch.bank.seams import WHOLE
from analysis.mismatch.bank.surfaces import RING
from analysis.mismatch.bank.together import TOGETHER
from dsis.cfa import Cfa
from dsis.measures import Accumulator

Array = NDArray[np.float64]
ROWS, COLUMNS, FRAMES = 48, 64, 12
SURE = 5.0  # standard errors


def _spectra(stacks: list[Array], variances: list[float]) -> SpectrumSums:
    """Return the sums over exposures (frame, row, column) of a mono sensor."""
    sums = SpectrumSums((ROWS, COLUMNS))
    for stack, variance in zip(stacks, variances, strict=True):
        measured = Accumulator(ROWS, COLUMNS, Cfa.MONO, 0.0, 65535.0)
        for frame in stack:
            measured.add(frame)
        sums.add(measured.result().channels["MONO"], len(stack), variance, 100.0)
    return sums


def _white(rng: np.random.Generator, sigma: float = 1.0) -> Array:
    return 1000 + rng.normal(0, sigma, (FRAMES, ROWS, COLUMNS))


def _sinusoid(rng: np.random.Generator, fx: float, fy: float, amplitude: float) -> Array:
    y, x = np.mgrid[:ROWS, :COLUMNS]
    phases = rng.uniform(0, 2 * np.pi, (FRAMES, 1, 1))
    return amplitude * np.sin(2 * np.pi * (fx * x + fy * y) + phases)


@settings(max_examples=8)
@given(across=st.floats(6, 24), down=st.floats(6, 18), seed=st.integers(0, 2**16))
def test_a_sinusoid_between_bins_is_seen_where_it_is(across: float, down: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    # A power of 36 in a bin: 6 in the worst one.
    amplitude = 2 * sqrt(36 / (ROWS * COLUMNS))
    wave = _sinusoid(rng, across / COLUMNS, down / ROWS, amplitude)
    sums = _spectra([_white(rng) + wave], [1.0])
    assert sums.numbers()["spectral_peak"][0] > SURE
    peak = sums.peak()
    assert peak is not None
    assert peak.fx * COLUMNS == pytest.approx(across, abs=0.5)
    assert peak.fy * ROWS == pytest.approx(down, abs=0.5)


@pytest.mark.parametrize("seed", range(4))
def test_a_checkerboard_alternates_exactly(seed: int) -> None:
    """Noise of the bins beside it must not say that its phase drifts along a line."""
    rng = np.random.default_rng(seed)
    board = 0.1 * (-1.0) ** np.add.outer(np.arange(ROWS), np.arange(COLUMNS))
    signs = rng.choice([-1.0, 1.0], (FRAMES, 1, 1))
    peak = _spectra([_white(rng) + signs * board], [1.0]).peak()
    assert peak is not None
    assert (peak.fx, abs(peak.fy)) == (0.5, 0.5)


def test_the_largest_peak_of_white_noise_is_as_rare_as_it_says() -> None:
    rng = np.random.default_rng(5)
    found = [_spectra([_white(rng)], [1.0]).numbers() for _ in range(60)]
    for name in ("spectral_peak", "row_spectrum_peak"):
        scores = np.array([one[name][0] for one in found])
        # Blocks and single bins are tried at once, so scores lie above the normal's, by less than
        # the four-fold chance that makes.
        for score in (0.5, 1.0, 2.0):
            rare = min(4 * norm.sf(score), 1.0)
            assert (scores > score).mean() < rare + SURE * sqrt(rare * (1 - rare) / 60) + 1e-9


def test_a_memory_is_gathered_from_bright_exposures_as_well_as_from_dark_ones() -> None:
    rng, fraction, lag = np.random.default_rng(2), 0.05, 3
    stacks, variances = [], [1.0, 10_000.0]
    for variance in variances:
        noise = rng.normal(0, sqrt(variance), (FRAMES, ROWS, COLUMNS + lag))
        stacks.append(1000 + noise[..., lag:] + fraction * noise[..., :-lag])
    dark_only = _spectra(stacks[:1], variances[:1]).numbers()["line_correlation along rows 3"]
    value, sd = _spectra(stacks, variances).numbers()["line_correlation along rows 3"]
    # Circular: of COLUMNS products lag are of the noise with itself across the edge.
    assert value == pytest.approx(fraction * (1 - lag / COLUMNS), abs=SURE * sd)
    assert sd == pytest.approx(dark_only[1] / sqrt(2))


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_a_step_between_halves_stands_where_its_contrast_is(axis: str) -> None:
    rng, step = np.random.default_rng(3), 0.2
    image = rng.normal(0, 1, (ROWS, COLUMNS))
    half = image[ROWS // 2 :] if axis == "rows" else image[:, COLUMNS // 2 :]
    half += step
    found = parts(image, 1.0).numbers
    expected = step / 2 * sqrt(ROWS * COLUMNS)
    assert found[f"half_seam of {axis}, {WHOLE}"][0] == pytest.approx(expected, abs=SURE)
    # A step's share along a straight line is 3/4 of its power.
    tilt = found[f"fixed_smooth_tilt of {axis}"][0]
    assert tilt == pytest.approx(sqrt(0.75) * expected, abs=SURE)
    assert abs(found["fixed_smooth_falloff"][0]) < SURE


def test_a_fall_to_the_corners_is_no_tilt() -> None:
    y, x = np.linspace(-1, 1, ROWS) * ROWS, np.linspace(-1, 1, COLUMNS) * COLUMNS
    fall = -(y[:, None] ** 2 + x**2) / (ROWS**2 + COLUMNS**2)
    noise = np.random.default_rng(4).normal(0, 1, (ROWS, COLUMNS))
    found = parts(noise + fall, 1.0).numbers
    expected = -fall.std() * sqrt(fall.size)
    assert found["fixed_smooth_falloff"][0] == pytest.approx(expected, abs=SURE)
    assert max(abs(found[f"fixed_smooth_tilt of {axis}"][0]) for axis in ("rows", "columns")) < SURE


def test_a_ring_is_seen_beside_all_that_leans_and_bows() -> None:
    """Of unit noise its number is the norm of what s (1 - s) has beyond degree 2, and else 0."""
    y, x = (np.linspace(-1, 1, size)[:, None] for size in (ROWS, COLUMNS))
    s = ((y * ROWS) ** 2 + (x.T * COLUMNS) ** 2) / (ROWS**2 + COLUMNS**2)
    ring, bowed = 3 * s * (1 - s), 2 * s - y + 3 * x.T + y**2
    noise = np.random.default_rng(5).normal(0, 1, (ROWS, COLUMNS))
    design = np.stack([np.ones_like(s), y + 0 * s, x.T + 0 * s, y**2 + 0 * s, x.T**2 + 0 * s,
                       y * x.T]).reshape(6, -1).T  # fmt: skip
    flat = ring.ravel()
    beyond = flat - design @ np.linalg.lstsq(design, flat, rcond=None)[0]
    sizes = [parts(noise + more, 1.0).numbers[RING][0] for more in (bowed, ring + bowed)]
    assert abs(sizes[0]) < SURE
    assert sizes[1] == pytest.approx(np.linalg.norm(beyond), abs=SURE)


def test_bright_pixels_are_counted() -> None:
    image = np.random.default_rng(6).normal(0, 1, (ROWS, COLUMNS))
    image[5, 7] = image[40, 20] = 40.0
    found = parts(image, 1.0).numbers
    sigma = sqrt(1 + 2 * 40**2 / image.size)  # the map's own spread
    for limit in STANDING_OUT:
        value = found[f"outlying_pixels of {limit:g}"][0]
        count = round((value / 2) ** 2 - 3 / 8)
        mean = image.size * norm.sf(limit * sigma)
        assert count - 2 <= poisson.isf(1e-6, mean)
        assert count >= 2


def test_each_effect_has_a_home_alike_on_mono_and_mosaic() -> None:
    mono = [Key("row_variance", "contrast", "", "", "constant"),
            Key("row_variance", "contrast", "", "", "with the signal alone"),
            Key("line_correlation", "all", "", "MONO", "rows 4"),
            Key("half_seam", "gain alone", "", "MONO", "rows"),
            Key("half_seam", "offset alone", "", "MONO", "rows")]  # fmt: skip
    assert homes(mono, ("MONO",)) == [1.0, 0.0, LAG, 1.0, 0.0]
    mosaic = [Key("row_variance", "contrast", "", "", "constant"),
              Key("row_variance", "contrast", "", "", "constant in all channels"),
              Key("line_correlation", "all", "", "Gr", "rows 4"),
              Key("line_correlation", "all", "", "", "rows 4"),
              Key("half_seam", "gain alone", "", "", f"rows, {TOGETHER}"),
              Key("spectral_peak", "all", "", "R"),
              Key("spectral_peak", "all")]  # fmt: skip
    assert homes(mosaic, ("R", "Gr", "Gb", "B")) == [0.0, 1.0, 0.0, LAG, 1.0, 0.0, 1.0]
    alone = [Key("spectral_peak", "contrast", "", "", "all"), Key("spectral_peak", "all", "", "R")]
    assert homes(alone, ("R", "Gr", "Gb", "B")) == [1.0, 0.0]
    assert one_sided(mono[0])
    assert not one_sided(mono[2])
