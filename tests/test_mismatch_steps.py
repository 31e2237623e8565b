"""Steps of codes that are no whole number are told by the codes that they leave out."""

from fractions import Fraction
from math import floor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates.steps import absent, fractional_step
from analysis.mismatch.rounding import rounded, unrounded
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Exposure, registry
from dsis.effects.quantisation import last_step, whole_codes
from dsis.grid import PixelGrid
from dsis.measures import Middle
from mismatch_recordings import camera
from test_mismatch_absent_codes import BASE, BLACK, INTERCEPT, coded, companded, multiplied

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]


def _middle(codes: set[int], first: int, last: int) -> Middle:
    left_out = [code for code in range(first, last + 1) if code not in codes]
    return Middle(first, last, 1, np.array(left_out, np.int64))


def _stepped(step: Fraction, phase: Fraction, most: int) -> set[int]:
    """Return whole codes of exact steps, halves rounded up."""
    numbers = range(int(most / step) + 2)
    return {floor(phase + step * n + Fraction(1, 2)) for n in numbers}


@settings(max_examples=50)
@given(
    st.fractions(min_value=Fraction(21, 20), max_value=6, max_denominator=30),
    st.fractions(min_value=0, max_value=Fraction(15, 16), max_denominator=16),
    st.lists(st.integers(10, 8_000), min_size=2, max_size=6, unique=True),
)
def test_a_step_is_told_by_the_codes_it_leaves_out(
    step: Fraction, share: Fraction, levels: list[int]
) -> None:
    codes = _stepped(step, step * share, 10_000)
    middles = [_middle(codes, level, level + 40 + level // 60) for level in levels]
    never = absent(middles)
    found = fractional_step(middles, never)
    if found is None:  # too few codes are left out of exposures that lie far apart
        assert len(never) < 8 * len(levels)
        return
    seen = {c for one in middles for c in range(one.first, one.last + 1)}
    made = {round(found[1] + found[0] * n) for n in range(int(10_000 / found[0]) + 2)}
    assert len((made & seen) ^ (codes & seen)) <= 0.01 * len(seen)


@pytest.mark.parametrize(("step", "phase"), [(1.5, 0.0), (1.1, 0.0), (2.5, 0.0), (1.5, 1.0)])
def test_plain_steps_are_told_as_they_are(step: float, phase: float) -> None:
    codes = _stepped(Fraction(step).limit_denominator(10), Fraction(phase), 4000)
    middles = [_middle(codes, level, level + 60) for level in (60, 500, 1100, 3000)]
    found = fractional_step(middles, absent(middles))
    assert found is not None
    assert found[0] == step
    made = {round(found[1] + step * n) for n in range(3000)}
    assert made & set(range(60, 3060)) == codes & set(range(60, 3060))


@pytest.mark.parametrize("step", [1.1, 1.25, 1.5, 1.75, 2.5, 1.37, 157 / 128, 293 / 256])
def test_the_steps_of_the_effect_itself_are_told(step: float) -> None:
    """Its halves go to even: they fit at the ratio itself and nowhere beside it."""
    codes = {int(code) for code in whole_codes(np.arange(4000), step, 0.0)}
    middles = [_middle(codes, level, level + 60) for level in (64, 500, 1100, 3000)]
    assert fractional_step(middles, absent(middles)) == (step, 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_few_codes_that_are_missing_are_no_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    codes = set(range(4000)) - set(rng.choice(np.arange(700, 2900), 12, replace=False).tolist())
    middles = [_middle(codes, level, level + 700) for level in (700, 1400, 2200)]
    assert len(absent(middles)) >= 8
    assert fractional_step(middles, absent(middles)) is None


def test_codes_of_a_table_or_of_chance_have_no_step() -> None:
    root = {round((n / 4) ** 2) for n in range(300)}
    rng = np.random.default_rng(1)
    chance = {int(code) for code in np.flatnonzero(rng.random(5000) < 0.6)}
    for codes in (root, chance):
        middles = [_middle(codes, level, level + 60) for level in (700, 1100, 3000)]
        assert len(absent(middles)) > 50
        assert fractional_step(middles, absent(middles)) is None
    assert fractional_step([], frozenset()) is None


@pytest.mark.parametrize(("step", "phase"), [(1.5, 0.0), (2.5, 0.4), (1.1, 0.2), (3.0, 1.0)])
@pytest.mark.parametrize("sigma", [0.6, 1.4, 6.0])
def test_moments_of_whole_codes_of_steps(step: float, phase: float, sigma: float) -> None:
    """Against drawn noise, coded here: what rounding adds, and how it is undone."""
    rng = np.random.default_rng(2)
    mean, drawn = 800.3, rng.standard_normal(2_000_000)
    drawn = mean + sigma * (drawn - drawn.mean()) / drawn.std()
    codes = np.rint(phase + step * np.rint((drawn - phase) / step))
    shift, added = rounded(mean, sigma**2, 4095.0, step, phase)
    assert codes.mean() == pytest.approx(mean + shift, abs=0.01)
    assert codes.var() == pytest.approx(sigma**2 + added, rel=0.005)
    before, variance, *errors = unrounded(mean + shift, sigma**2 + added, 4095.0, step, phase)
    assert np.isfinite(errors).all()
    assert before == pytest.approx(mean, abs=1e-3)
    assert variance == pytest.approx(sigma**2, rel=0.01)


def test_the_last_step_is_that_of_the_ratio() -> None:
    """Floats make 3899.9999 of 4095 / 1.05, which is 3900."""
    assert last_step(4095.0, 1.05, 0.0) == 3900
    assert last_step(4095.0, 4.0, 1.0) == 1023
    assert last_step(4095.0, 1.1, 0.0) == 3722


@pytest.mark.parametrize(("step", "phase"), [(1.5, 0.0), (1.1, 0.25), (2.5, 1.0)])
def test_the_effect_gives_whole_codes_of_its_steps(step: float, phase: float) -> None:
    effect = registry()["quantisation"](step_dn=step, phase_dn=phase)
    own, grid = camera(black=64.3), PixelGrid(40, 50, Cfa.MONO)
    volts = np.random.default_rng(3).uniform(-20, 3000, (40, 50)).astype(np.float32)
    draw = Draw(1)
    exposure = Exposure(grid, 0, draw, draw, volts, own.read_out, lambda image, _: image)
    codes = effect.apply(volts, exposure) + np.float32(64.3)
    number = np.rint((volts.astype(np.float64) + 64.3 - phase) / step)
    expected = np.rint(phase + step * np.maximum(number, 0))
    assert np.mean(np.abs(codes - expected) < 1e-3) > 0.999  # float32 at the edges of steps


@pytest.mark.long
def test_a_digital_gain_is_named_as_steps_of_codes() -> None:
    """Ten codes become eleven: of numpy's noise, coded here, one in eleven never occurs."""
    found = find_mismatch(BASE, coded(multiplied), seed=1)
    (named,) = found.omitted_physics
    assert named.effect == "quantisation"
    assert named.parameters["step_dn"].value == pytest.approx(1.1, abs=1e-4)
    assert not found.unexplained
    intercept = found.camera.noise.segment[0].intercept
    assert intercept == pytest.approx(INTERCEPT, rel=0.02)


def test_codes_of_a_table_are_no_digital_gain() -> None:
    found = find_mismatch(BASE, coded(companded), seed=1)
    assert "quantisation" not in {one.effect for one in found.omitted_physics}


def test_what_coarse_codes_make_of_narrow_noise_is_no_second_path() -> None:
    """Noise of half a code to six codes, in steps of 4: without a word for them it is left open."""
    own = camera(segments=((0.08, 0.25, None),), black=BLACK)
    levels = (33.0, 150.0, 500.0, 1000.0, 2000.0)

    def fours(voltage: Array) -> Array:
        return 4 * np.rint((voltage + BLACK) / 4)

    recording = coded(fours, levels, (0.08, 0.25))
    found = find_mismatch(own, recording, seed=1, vocabulary=frozenset({"dual_gain"}))
    assert found.omitted_physics == ()
    assert {"code_spacing", "pixel_variance"} <= {one.statistic for one in found.unexplained}
