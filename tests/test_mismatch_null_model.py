"""The null of a diagnosis: rounding undone, family-wise control, frames split without loss."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm
from statsmodels.stats.multitest import multipletests

from analysis.mismatch.bank.scalars import gumbel_score, ratio_root
from analysis.mismatch.null import adjusted
from analysis.mismatch.rounding import rounded, unrounded
from analysis.mismatch.split import LEAST_FRAMES, Split
from dsis.cfa import Cfa
from dsis.recording import RecordedExposure, Recording, Sensor

# notes/camera.md, section 3: smallest and largest variance of a rounded Gaussian as its mean moves.
PUBLISHED = {0.2: (0.0124, 0.2500), 0.3: (0.0956, 0.2517), 0.4: (0.2118, 0.2748),
             0.5: (0.3254, 0.3413), 0.7: (0.5732, 0.5735)}  # fmt: skip


@pytest.mark.parametrize("sigma", PUBLISHED)
def test_rounding_has_the_published_range_of_variances(sigma: float) -> None:
    means = 100 + np.linspace(0, 1, 201)
    found = [sigma**2 + rounded(float(mean), sigma**2, 4095)[1] for mean in means]
    assert min(found) == pytest.approx(PUBLISHED[sigma][0], abs=6e-5)
    assert max(found) == pytest.approx(PUBLISHED[sigma][1], abs=6e-5)


def test_wide_noise_adds_sheppard_s_twelfth() -> None:
    assert rounded(500.3, 9.0, 4095) == (0.0, 1 / 12)
    shift, added = rounded(500.3, 0.9, 4095)  # summed exactly, not by the formula
    assert shift == pytest.approx(0, abs=1e-7)
    assert added == pytest.approx(1 / 12, abs=1e-6)


@given(
    mean=st.floats(60, 61),
    sigma=st.floats(0.2, 3.0),
)
def test_rounding_is_undone(mean: float, sigma: float) -> None:
    shift, added = rounded(mean, sigma**2, 4095)
    back, variance, stretch, _ = unrounded(mean + shift, sigma**2 + added, 4095)
    assert back == pytest.approx(mean, abs=1e-6)
    assert variance == pytest.approx(sigma**2, rel=1e-5)
    assert stretch > 0


@pytest.mark.parametrize("sigma", [1.0, 4.5, 12.0, 60.0])
@pytest.mark.parametrize("above", [-0.5, 0.0, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("at_white", [False, True])
def test_what_an_end_of_the_converter_cuts_off_is_undone(
    sigma: float, above: float, at_white: bool
) -> None:
    """Noise `above` standard deviations from the lowest code or the white level, by scipy."""
    codes = np.arange(4096)
    mean = 4095 - above * sigma if at_white else above * sigma
    edges = np.concatenate([[-np.inf], codes[1:] - 0.5, [np.inf]])
    share = np.diff(norm.cdf(edges, mean, sigma))
    recorded = float(share @ codes)
    square = float(share @ (codes - recorded) ** 2)
    back, variance, stretch, wider = unrounded(recorded, square, 4095)
    assert back == pytest.approx(mean, abs=1e-4 * sigma)
    assert variance == pytest.approx(sigma**2, rel=1e-4)
    assert 1 <= stretch < 20
    assert 0.9 < wider < 8


@given(
    step=st.integers(2, 40),
    part=st.floats(0, 1, exclude_max=True),
    mean=st.floats(0.0, 300.0),
    sigma=st.floats(0.35, 1.5),
)
def test_coarse_rounding_from_any_phase_is_the_law_of_its_codes(
    step: int, part: float, mean: float, sigma: float
) -> None:
    """By scipy.stats, at the ends too; undone where a mean is within."""
    phase, sd = int(part * step), sigma * step
    codes = np.arange(phase, 256, step)
    below = norm.cdf(codes[:-1] + step / 2, mean, sd)
    share = np.diff(np.concatenate([[0.0], below, [1.0]]))
    level = float(share @ codes)
    variance = float(share @ (codes - level) ** 2)
    shift, added = rounded(mean, sd**2, 255, step, phase)
    assert mean + shift == pytest.approx(level, abs=1e-6 * step)
    assert sd**2 + added == pytest.approx(variance, abs=1e-6 * step**2)
    if 7 * sd < mean < 255 - 7 * sd:
        back, before, *_ = unrounded(level, variance, 255, step, phase)
        assert back == pytest.approx(mean, abs=1e-5 * step)
        assert before == pytest.approx(sd**2, rel=1e-5)


@pytest.mark.parametrize(
    ("mean", "sigma"), [(48.243, 0.25), (48.4, 0.3), (48.0, 0.8), (0.0, 4.5), (3.0, 4.5)]
)
def test_errors_of_few_codes_are_those_of_repeated_samples(mean: float, sigma: float) -> None:
    """Spread of what is undone, over those of a normal variate of the recorded variance."""
    rng, n, repeats = np.random.default_rng(3), 20_000, 150
    shift, added = rounded(mean, sigma**2, 4095)
    *_, stretch, wider = unrounded(mean + shift, sigma**2 + added, 4095)
    samples = np.maximum(np.rint(rng.normal(mean, sigma, (repeats, n))), 0)
    own = np.array([unrounded(float(x.mean()), float(x.var()), 4095)[:2] for x in samples])
    normal = (sigma**2 + added) * (2 / n) ** 0.5
    # Of 150 repeats a spread is known to 6 %.
    assert own[:, 1].std(ddof=1) / normal == pytest.approx(stretch, rel=0.2)
    plain = ((sigma**2 + added) / n) ** 0.5
    assert own[:, 0].std(ddof=1) / plain == pytest.approx(wider, rel=0.2)


@given(mean=st.floats(0, 4000), variance=st.floats(0, 4))
def test_any_mean_and_variance_can_be_asked(mean: float, variance: float) -> None:
    """Fixed offsets beside narrow noise leave pairs that no rounded normal noise has."""
    before, noise, stretch, wider = unrounded(mean, variance, 4095)
    assert np.isfinite(before)
    assert np.isfinite(noise)
    assert stretch > 0
    assert wider > 0


def test_a_single_code_says_nothing_of_the_noise() -> None:
    assert unrounded(48.0, 0.0, 4095)[2] == np.inf
    assert unrounded(48.15, 0.1270, 4095)[2] == np.inf  # less than two codes can have


def test_clipping_at_zero_takes_variance_away() -> None:
    shift, added = rounded(0.0, 4.0, 4095)
    draws = np.clip(np.rint(np.random.default_rng(1).normal(0, 2, 400_000)), 0, 4095)
    assert shift == pytest.approx(draws.mean(), abs=5 * 2 / 400_000**0.5)
    assert 4 + added == pytest.approx(draws.var(), rel=5 * (3 / 400_000) ** 0.5)


@pytest.mark.usefixtures("swept")
@given(st.lists(st.floats(1e-9, 1), min_size=1, max_size=30))
def test_equal_weights_are_holm_s_procedure(chances: list[float]) -> None:
    found = adjusted(np.array(chances), np.full(len(chances), 1 / len(chances)))
    np.testing.assert_allclose(found, multipletests(chances, method="holm")[1], rtol=1e-9)


def test_cube_roots_of_mean_squares_are_near_normal() -> None:
    dof = 20
    draws = np.random.default_rng(2).chisquare(dof, 100_000) / dof
    value = np.cbrt(draws)
    _, sd = ratio_root(1.0, dof)
    z = (value - (1 - 2 / (9 * dof))) / sd
    assert abs(z.mean()) < 5 / 100_000**0.5
    assert z.std() == pytest.approx(1, abs=0.01)
    assert abs(float((z**3).mean())) < 0.03  # chi-squared itself: 0.63


@pytest.mark.parametrize("chance", [0.5, 1e-3, 1e-6])
def test_a_gumbel_score_is_the_normal_deviate_of_its_chance(chance: float) -> None:
    scaled = -np.log(-np.log1p(-chance))
    assert gumbel_score(float(scaled)) == pytest.approx(norm.isf(chance), abs=1e-6)


def _recording(frames: list[int]) -> Recording:
    exposures = tuple(
        RecordedExposure(
            f"e{i}", "flat", 0.01 * (i + 1), float(i + 1),
            tuple(Path(str(k)) for k in range(count)),
        )
        for i, count in enumerate(frames)
    )  # fmt: skip
    sensor = Sensor(name="s", cfa=Cfa.MONO, black_level=0, white_level=4095, bit_depth=12)
    return Recording(sensor, exposures, 8, 8, Path())


@given(st.lists(st.integers(1, 120), min_size=1, max_size=12))
def test_every_frame_is_in_one_part(frames: list[int]) -> None:
    recording = _recording(frames)
    split = Split.of(recording)
    for exposure in recording.exposures:
        parts = [part.get(exposure.name, ()) for part in (split.train, split.select, split.locked)]
        assert sorted(sum(parts, ())) == list(range(len(exposure.frames)))
        if len(exposure.frames) >= LEAST_FRAMES:
            share = len(parts[2]) / len(exposure.frames)
            assert 1 / 7 <= share <= 0.35  # locked frames run through the whole exposure
            assert parts[2][0] < len(exposure.frames) / 2 + 1
        elif parts[2] and len(parts[2]) < len(exposure.frames):
            # Of few exposures none would be locked, and never the brightest: of each that has four
            # frames the last is.
            assert len(exposure.frames) >= 4
            assert parts[2] == (len(exposure.frames) - 1,)
            few = [own for own in recording.exposures if len(own.frames) < LEAST_FRAMES]
            brightest = exposure is few[-1]
            assert brightest or len(recording.exposures) < 4 or max(frames) < LEAST_FRAMES
        else:
            assert sum(bool(part) for part in parts) == 1
