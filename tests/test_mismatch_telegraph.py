"""Pixels that jump: laws of single pixels against dense algebra, and populations of the test's."""

from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.pixellaw import of_drifts, of_jumps, of_mixtures, of_spikes, of_variances
from analysis.mismatch.telegraph import Telegraph, could_jump, telegraph
from dsis.cfa import Cfa
from dsis.effects.rts import Rts

FRAMES = 5
# What is left of frames about their mean: an orthonormal basis.
BASIS = np.linalg.qr(np.column_stack([np.ones(FRAMES), np.eye(FRAMES)[:, 1:]]))[0][:, 1:].T
SAMPLES = st.lists(st.floats(-20, 20), min_size=FRAMES, max_size=FRAMES)


def _likely(x: np.ndarray, mean: np.ndarray, variances: np.ndarray) -> float:
    """Return the log-likelihood of frames about their mean."""
    covariance = BASIS @ np.diag(variances) @ BASIS.T
    return float(multivariate_normal.logpdf(BASIS @ x, BASIS @ mean, covariance))


@given(SAMPLES, st.floats(0.5, 4), st.floats(0.5, 15), st.floats(0.02, 0.5))
def test_jumps_are_as_likely_as_all_sequences_say(
    samples: list[float], noise: float, height: float, switching: float
) -> None:
    x, even = np.array(samples), np.full(FRAMES, noise)
    terms = []
    for states in product((0, 1), repeat=FRAMES):
        switches = sum(a != b for a, b in pairwise(states))
        chance = 0.5 * switching**switches * (1 - switching) ** (FRAMES - 1 - switches)
        terms.append(np.log(chance) + _likely(x, height * np.array(states), even))
    wanted = logsumexp(terms) - _likely(x, np.zeros(FRAMES), even)
    found = of_jumps(x[None], np.array([noise]), np.array([height]), np.array([switching]))
    assert found[0, 0, 0] == pytest.approx(wanted, rel=1e-6, abs=1e-6)


@given(SAMPLES, st.floats(0.5, 4), st.floats(0.5, 200), st.floats(1e-3, 0.3))
def test_noisy_frames_are_as_likely_as_all_sequences_say(
    samples: list[float], noise: float, added: float, share: float
) -> None:
    x = np.array(samples)
    terms = []
    for states in product((0, 1), repeat=FRAMES):
        own = np.array(states)
        chance = share ** own.sum() * (1 - share) ** (FRAMES - own.sum())
        terms.append(np.log(chance) + _likely(x, np.zeros(FRAMES), noise + added * own))
    plain, one = _likely(x, np.zeros(FRAMES), np.full(FRAMES, noise)), np.array([noise])
    found = of_spikes(x[None], one, np.array([added]), np.array([share]))
    assert found[0, 0, 0] == pytest.approx(logsumexp(terms) - plain, rel=1e-6, abs=1e-6)
    other = _likely(x, np.zeros(FRAMES), np.full(FRAMES, noise + added))
    varied = of_variances(x[None], one, np.array([added]))
    assert varied[0, 0] == pytest.approx(other - plain, rel=1e-6, abs=1e-6)


@given(SAMPLES, st.floats(0.5, 4), st.floats(0.5, 200))
def test_frames_that_drift_are_as_likely_as_their_covariance_says(
    samples: list[float], noise: float, added: float
) -> None:
    x, number = np.array(samples), np.arange(FRAMES)
    found = of_drifts(x[None], np.array([noise]), np.array([added]))
    for k, course in enumerate([number, np.exp(-4 * number / FRAMES), np.exp(-number)]):
        way = course - course.mean()
        way = way * np.sqrt(added / (way**2).mean())
        plain, own = (
            multivariate_normal.logpdf(BASIS @ x, cov=BASIS @ covariance @ BASIS.T)
            for covariance in (noise * np.eye(FRAMES), noise * np.eye(FRAMES) + np.outer(way, way))
        )
        assert found[0, 0, k] == pytest.approx(own - plain, rel=1e-6, abs=1e-6)


UNLIKELY = st.one_of(st.just(0.0), st.floats(0, 700).map(lambda x: float(np.exp(-x))))


@given(st.lists(st.tuples(UNLIKELY, UNLIKELY), min_size=1, max_size=60), st.integers(0, 60))
def test_products_of_likelihoods_are_sums_of_their_logarithms(
    pixels: list[tuple[float, float]], noisy: int
) -> None:
    own, beside = np.array(pixels).T.copy()
    weight = np.where(np.arange(len(pixels)) < noisy, 1.0, 7.5)
    parts = np.array([1e-4, 0.3, 1.0])
    out = np.empty((1, 3))
    of_mixtures(own[np.newaxis], beside, weight, parts, out)
    likely = np.maximum(beside + parts[:, np.newaxis] * (own - beside), 1e-300)
    assert out[0] == pytest.approx(np.log(likely) @ weight, rel=1e-12, abs=1e-12)


SHAPE, STACK = (72, 96), 8
SURE = 7.0  # nats
NOISE = (2.0, 2.0, 3.0, 6.0)  # DN, of four exposures: two darks, two flats


@cache  # two promises are about a noise that spreads
def _recorded(seed: int, kind: str, **how: float) -> Telegraph | None:
    """Return what is told of frames whose single pixels are noisy in one way."""
    layout, stacks = _frames(seed, kind, **how)
    return telegraph(layout, stacks.__getitem__)


@cache
def _frames(seed: int, kind: str, **how: float) -> tuple[Layout, dict[str, list[np.ndarray]]]:
    rng = np.random.default_rng(seed)
    pixels = SHAPE[0] * SHAPE[1]
    stacks = {}
    taken = []
    height = np.zeros(pixels)
    some = rng.random(pixels) < how.get("share", 0.0)
    height[some] = how.get("amplitude", 0.0)
    if kind != "equal":
        height[some] *= rng.exponential(size=int(some.sum()))
    spread = np.exp(how.get("log_sigma", 0.0) * rng.normal(size=pixels))
    warmed = np.where(rng.random(pixels) < 0.01, rng.exponential(20.0, pixels), 0.0)
    for i, sd in enumerate(NOISE):
        shot = np.sqrt(sd**2 - NOISE[0] ** 2)
        state = rng.random(pixels) < 0.5
        frames = []
        memory = how.get("memory", 0.0)
        white = rng.normal(size=pixels) if memory else np.zeros(pixels)
        for k in range(STACK):
            state ^= rng.random(pixels) < how.get("switching", 0.5)
            white = memory * white + np.sqrt(1 - memory**2) * rng.normal(size=pixels)
            read = NOISE[0] * spread * white
            if kind == "many tails":  # of pixels that differ, too
                read *= np.sqrt(3 / rng.chisquare(5, pixels))
            if kind == "tails":
                read = NOISE[0] * rng.standard_t(5, pixels) * np.sqrt(3 / 5)
            if kind == "spikes":
                hit = rng.random(pixels) < 2e-3
                read[hit] += rng.exponential(20.0, int(hit.sum()))
            if kind == "warming":
                read += warmed * (0.7 + how["by"] * k / STACK)
            if kind == "settling":
                read -= warmed * how["by"] * np.exp(-k / 2)
            signal = 100.0 * i + height * state + read + shot * rng.normal(size=pixels)
            frames.append(np.rint(signal + 64).reshape(SHAPE))
        stacks[f"e{i}"] = frames
        taken.append(Taken(f"e{i}", "flat" if i > 1 else "dark", 0.01 * (1 + i), None,
                           tuple(range(STACK))))  # fmt: skip
    return Layout(tuple(taken), *SHAPE, Cfa.MONO, 64.0, 4095.0, {}, {}), stacks


@pytest.mark.parametrize("seed", range(4))
def test_a_population_that_jumps_is_told_with_its_numbers(seed: int) -> None:
    how = {"share": 0.008, "amplitude": 12.0, "switching": 0.15}
    told = _recorded(seed, "telegraph", **how)
    assert told is not None
    assert told.gain > 10
    assert not told.equal
    assert abs(told.share - how["share"]) < 3.5 * told.share_error
    assert abs(told.amplitude_dn - how["amplitude"]) < 3.5 * told.amplitude_error_dn
    assert abs(told.switching - how["switching"]) < 3.5 * told.switching_error
    assert told.share_error < how["share"]
    assert told.amplitude_error_dn < how["amplitude"] / 2
    assert told.spread < SURE
    assert told.jumping > SURE


@pytest.mark.parametrize("seed", range(2))
def test_jumps_of_one_height_that_stand_apart_need_not_be_few(seed: int) -> None:
    """Frames show each of them, where of as many exponential ones most are small."""
    how = {"share": 0.035, "amplitude": 25.0, "switching": 0.25}
    told = _recorded(seed, "equal", **how)
    assert told is not None
    assert told.equal
    assert told.few
    assert told.gain > 100
    assert abs(told.share - how["share"]) < 3.5 * told.share_error
    assert abs(told.amplitude_dn - how["amplitude"]) < 3.5 * told.amplitude_error_dn
    many = _recorded(seed, "equal", **{**how, "share": 0.1})
    assert many is not None
    assert not many.few
    drawn = _recorded(seed, "telegraph", **how)
    assert drawn is not None
    assert not drawn.equal
    assert not drawn.gain > 0


@pytest.mark.parametrize("seed", range(4))
def test_jumps_of_one_height_are_told_from_exponential_ones(seed: int) -> None:
    """Numbers of the other law would be three times the share, and half the height."""
    how = {"share": 0.008, "amplitude": 12.0, "switching": 0.3}
    told = _recorded(seed, "equal", **how)
    assert told is not None
    assert told.equal
    assert told.values["heights"] == "equal"
    assert abs(told.share - how["share"]) < 3.5 * told.share_error
    assert abs(told.amplitude_dn - how["amplitude"]) < 3.5 * told.amplitude_error_dn
    assert abs(told.switching - how["switching"]) < 3.5 * told.switching_error


@pytest.mark.parametrize(
    ("kind", "how"),
    [("alike", {}), ("tails", {}), ("spikes", {}), ("spread", {"log_sigma": 0.3}),
     ("spread", {"log_sigma": 0.8}), ("many tails", {"log_sigma": 0.4}),
     ("warming", {"by": 1.0}), ("settling", {"by": 0.7}), ("settling", {"by": -0.3})],
)  # fmt: skip
@pytest.mark.parametrize("seed", range(3))
def test_pixels_that_are_noisy_otherwise_do_not_jump(
    kind: str, how: dict[str, float], seed: int
) -> None:
    told = _recorded(seed, kind, **how)
    assert told is None or max(told.gain, told.jumping) < np.log(20)
    if kind in ("alike", "tails"):
        assert told is None or told.spread < SURE


@pytest.mark.parametrize("log_sigma", [0.15, 0.3, 0.8])
@pytest.mark.parametrize("seed", range(3))
def test_a_read_noise_that_spreads_is_told_from_jumps_of_few_or_many(
    log_sigma: float, seed: int
) -> None:
    told = _recorded(seed, "spread", log_sigma=log_sigma)
    assert told is not None
    assert told.spread > SURE
    assert told.jumping < SURE


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_of_many_pixels_sums_tell_more(share: float) -> None:
    told = _recorded(1, "telegraph", share=share, amplitude=8.0, switching=0.2)
    assert told is not None
    assert told.gain == -np.inf
    assert told.spread < SURE  # many jump: their noise does not spread by itself
    assert told.jumping > SURE  # but sizes are told by sums


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_all_pixels_that_is_alike_in_time_does_not_jump(seed: int) -> None:
    told = _recorded(seed, "alike", memory=0.3)
    assert told is None or told.jumping < SURE


def test_codes_that_stand_still_tell_nothing() -> None:
    taken = Taken("dark", "dark", 0.01, 0.0, tuple(range(STACK)))
    layout = Layout((taken,), *SHAPE, Cfa.MONO, 64.0, 4095.0, {}, {})
    assert telegraph(layout, lambda _: [np.full(SHAPE, 64.0)] * STACK) is None


def test_coarse_codes_tell_nothing() -> None:
    rng = np.random.default_rng(1)
    frames = [np.rint(rng.normal(64, 0.4, SHAPE)) for _ in range(STACK)]
    taken = Taken("dark", "dark", 0.01, 0.0, tuple(range(STACK)))
    layout = Layout((taken,), *SHAPE, Cfa.MONO, 64.0, 4095.0, {}, {})
    assert telegraph(layout, lambda _: frames) is None
    whole = WholeFrames(layout, lambda _: frames)
    effect = Rts(pixel_fraction=0.01, amplitude_dn=3.0)
    assert whole.gain(effect) == -np.inf
    assert whole.measured(effect) is None


@pytest.mark.parametrize(
    ("kind", "how"),
    [
        ("alike", {}),
        ("spread", {"log_sigma": 0.3}),
        ("telegraph", {"share": 0.008, "amplitude": 12.0, "switching": 0.15}),
        ("telegraph", {"share": 0.004, "amplitude": 5.0, "switching": 0.4}),
        ("telegraph", {"share": 0.002, "amplitude": 9.0, "switching": 0.3}),
        ("equal", {"share": 0.008, "amplitude": 12.0, "switching": 0.3}),
        ("equal", {"share": 0.0007, "amplitude": 41.0, "switching": 0.3}),
        ("telegraph", {"share": 0.008, "amplitude": 50.7, "switching": 0.5}),
        ("telegraph", {"share": 0.001, "amplitude": 60.0, "switching": 0.3}),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_frames_are_asked_in_full_where_pixels_could_jump(
    kind: str, how: dict[str, float], seed: int
) -> None:
    """What a first look leaves out no second one would find."""
    least = 5.1
    layout, stacks = _frames(seed, kind, **how)
    told = _recorded(seed, kind, **how)
    assert told is not None
    could = could_jump(layout, stacks.__getitem__, least)
    assert could or told.gain < least or told.jumping < np.log(20)
    if kind == "spread":
        assert not could
