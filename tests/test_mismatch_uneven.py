"""What grows with exposure time in a part of the sensor only is no dark current."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.stats
from scipy.stats import binom

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.candidates.patterns import glowing
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.uneven import _Map, _ratio, uneven
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

TIME_S, NOISE_DN = 0.5, 0.3
RATE = 4.0  # DN / s
DARK_CURRENT = registry()["dark_current"](dn_per_s=RATE)


def _state(
    growth_dn: Any,
    scope: str = "time",
    *others: Any,
    left: tuple[float, float] = (20.0, 0.0),
    seed: int = 1,
    noise: float = NOISE_DN,
) -> Any:
    """Return a state with a map of what grows with time, as it is measured: its mean is zero."""
    images = {}
    for k, channel in enumerate(("R", "B")):
        image = growth_dn + np.random.default_rng([seed, k]).normal(0, noise, (64, 96))
        images[channel, "time"] = (image - image.mean(), noise)
    regressors = SimpleNamespace(scales={"time": TIME_S})
    return SimpleNamespace(
        setting=SimpleNamespace(
            asked_again=False,
            seen=SimpleNamespace(images=images),
            layout=SimpleNamespace(regressors=lambda _: regressors),
        ),
        vector=SimpleNamespace(),
        null=SimpleNamespace(
            keys=(Key("fixed_smooth_variance", scope, "", "R"), Key("fixed_smooth_tilt", scope)),
            departures=lambda _: np.array(left),
        ),
        camera=SimpleNamespace(effect=(DARK_CURRENT, *others)),
    )


def _glow(extent: float) -> Any:
    y, x = np.arange(64)[:, None], np.arange(96)
    shape = np.exp(-np.hypot(y, x) / (extent * 96))
    return shape / shape.mean() * RATE * TIME_S


@pytest.mark.parametrize("extent", [0.1, 0.2])
def test_a_glow_is_no_dark_current(extent: float) -> None:
    said = uneven(_state(_glow(extent)), DARK_CURRENT)
    assert said is not None
    assert said.share < 0.5
    assert "a part of the sensor" in said.why


@pytest.mark.parametrize("growth", [0.0, 0.4 * _glow(0.1)])
def test_dark_current_is_believed_alone_and_beside_a_glow(growth: Any) -> None:
    state = _state(RATE * TIME_S + growth)
    assert uneven(state, registry()["dark_current"](dn_per_s=RATE)) is None


@pytest.mark.parametrize("noise", [1.0, 3.0])
@pytest.mark.parametrize(("extent", "power"), [(0.4, 0.0), (0.2, 2.0), (0.5, 2.0)])
def test_a_glow_that_fades_slowly_grows_all_over_the_sensor(
    extent: float, power: float, noise: float
) -> None:
    """At its far end by a third of its mean, half of a dark current within the error there.

    A half of it beside a dark current that has the other half is a surface, and denies nothing.
    """
    fading = glowing((64, 96), "bottom", extent, power)
    for share, denied in ((0.5, False), (1.0, True)):
        growth = RATE * TIME_S * (1 - share + share * fading / fading.mean())
        said = uneven(_state(growth, noise=noise), DARK_CURRENT)
        assert (said is not None) is denied


def test_what_grows_by_half_of_its_mean_everywhere_is_as_good_as_a_dark_current() -> None:
    fading = glowing((64, 96), "bottom", 0.8)
    assert fading.min() > fading.mean() / 2
    growth = RATE * TIME_S * fading / fading.mean()
    assert uneven(_state(growth, noise=1.0), DARK_CURRENT) is None


def test_a_map_of_means_says_what_the_map_says() -> None:
    """Its products with a smooth shape: the variances of rows, columns and pixels go along."""
    rng = np.random.default_rng(8)
    image = glowing((256, 320), "top_left", 0.3) + rng.normal(0, 0.5, (256, 320))
    fine = _Map(image, 0.25, 0.25 + 320 * 0.001, 0.25 + 256 * 0.0005)
    coarse = fine.coarser()
    assert coarse.image.shape == (64, 80)
    both = [own.products(glowing(own.image.shape, "top_left", 0.6) - 0.1) for own in (fine, coarse)]
    np.testing.assert_allclose(both[1], both[0], rtol=0.05)  # a glow of few squares
    assert coarse.mean_dn2 / coarse.image.size == pytest.approx(fine.mean_dn2 / fine.image.size)


def test_noise_of_whole_rows_is_no_glow() -> None:
    """A row's noise is not averaged along it: what rows differ by says less of a wide glow."""
    rows = np.random.default_rng(11).normal(0, 1.5 * NOISE_DN, (64, 1))
    assert uneven(_state(RATE * TIME_S + rows), DARK_CURRENT) is None
    said = uneven(_state(_glow(0.1) + rows), DARK_CURRENT)
    assert said is not None
    assert said.share < 0.5


def test_maps_have_the_covariance_that_products_assume() -> None:
    """Row, column and pixel noise: squares in units of it are chi-squared, and the mean's too."""
    rng, shape = np.random.default_rng(5), (24, 32)
    squares, means = [], []
    wave = np.cos(np.arange(24) / 3)[:, np.newaxis] * np.sin(np.arange(32) / 5 + 1)
    wave = wave + 0.3 * np.arange(24)[:, np.newaxis] / 24
    for _ in range(600):
        rows, columns = rng.normal(0, 0.5, (24, 1)), rng.normal(0, 0.2, 32)
        image = rng.normal(0, 1.0, shape) + rows + columns
        own = _Map(image, 1.0, 1 + 32 * 0.25, 1 + 24 * 0.04)
        square, along = own.products(wave)
        squares.append(along / square**0.5)
        means.append(image.mean() * (image.size / own.mean_dn2) ** 0.5)
    for own in (squares, means):
        assert abs(np.var(own) - 1) < 5 * (2 / 600) ** 0.5


@pytest.mark.parametrize(("extent", "denied"), [(0.1, True), (1.5, False)])
def test_before_all_frames_are_asked_only_a_likelier_glow_denies(
    extent: float, denied: bool
) -> None:
    state = _state(RATE * TIME_S if not denied else _glow(extent))
    state.setting.asked_again = True
    assert (uneven(state, DARK_CURRENT) is not None) is denied


def _few(share: float, rate: float, seed: int) -> Any:
    """Return the growth of few pixels, DN, that is `rate` on average."""
    own = np.random.default_rng(seed).exponential(1.0, (64, 96))
    own *= np.random.default_rng([seed, 1]).random((64, 96)) < share
    return own / own.mean() * rate * TIME_S


@pytest.mark.parametrize("seed", range(5))
def test_few_pixels_that_grow_are_no_dark_current(seed: int) -> None:
    growth = _few(0.02, RATE, seed)
    for others in ((), (registry()["hot_pixels"](pixel_fraction=0.002, mean_dn_per_s=30.0),)):
        said = uneven(_state(growth, "time", *others, left=(0.0, 0.0), seed=seed), DARK_CURRENT)
        assert said is not None
        assert "most pixels grow" in said.why
        assert said.share < 0.2


@pytest.mark.parametrize("seed", range(5))
def test_a_dark_current_is_believed_beside_hot_pixels(seed: int) -> None:
    hot = registry()["hot_pixels"](pixel_fraction=0.02, mean_dn_per_s=2 * RATE / 0.02)
    growth = RATE * TIME_S + _few(0.02, 2 * RATE, seed)
    assert uneven(_state(growth, "time", hot, left=(0.0, 0.0), seed=seed), DARK_CURRENT) is None


@pytest.mark.parametrize(("errors", "denied"), [(2.0, True), (6.0, False)])
def test_beside_pixels_that_stand_out_most_must_grow_for_certain(
    errors: float, denied: bool
) -> None:
    """Few may have all of the mean: two errors of the median are no dark current, six are."""
    growth = errors * NOISE_DN * (np.pi / 2 / (2 * 64 * 96)) ** 0.5
    weak = registry()["dark_current"](dn_per_s=growth / TIME_S)
    hot = registry()["hot_pixels"](pixel_fraction=1e-9, mean_dn_per_s=1.0)  # it is no glow
    for statistic, said in (("fixed_pixel_variance", False), ("outlying_pixels", denied)):
        state = _state(growth, "time", hot, left=(9.0, 0.0))
        state.null.keys = (Key(statistic, "time", "", "R"), Key("fixed_smooth_tilt", "time"))
        found = uneven(state, weak)
        assert (found is not None and "most pixels grow" in found.why) is said


def test_another_effect_or_one_that_has_its_mean_denies_nothing() -> None:
    assert uneven(_state(_glow(0.1)), registry()["row_noise"](sigma_dn=1.0)) is None
    assert uneven(_state(_glow(0.1)), None) is None
    named = registry()["amp_glow"](dn_per_s=3.0)
    assert uneven(_state(_glow(0.1), "time", named), DARK_CURRENT) is None


def test_the_least_of_sixteen_parts_is_low_by_chance() -> None:
    """Even, ten errors of a part high: the lowest of them denies nothing."""
    growth = 10 * NOISE_DN / (64 * 96 / 16 * 2) ** 0.5
    assert uneven(_state(growth), registry()["dark_current"](dn_per_s=growth / TIME_S)) is None


def test_beside_a_surface_a_weak_dark_current_is_not_told() -> None:
    """Channels together show the surface; that every part grows, nothing does."""
    growth = NOISE_DN / (64 * 96 / 16 * 2) ** 0.5
    weak = registry()["dark_current"](dn_per_s=growth / TIME_S)
    assert uneven(_state(growth, left=(0.0, 5.0)), weak) is not None


def _weak(z: float, shape: Any, seed: int) -> Any:
    """Return what a map says whose mean grows by so many standard errors, no surface sure."""
    growth = z * NOISE_DN / (64 * 96 * 2) ** 0.5
    one = registry()["dark_current"](dn_per_s=growth / TIME_S)
    return uneven(_state(growth * shape, left=(2.0, 2.0), seed=seed), one)


@pytest.mark.parametrize(("extent", "z"), [(0.1, 6.0), (0.3, 6.0), (0.3, 12.0)])
def test_a_weak_glow_is_taken_for_a_dark_current_no_oftener_than_its_odds(
    extent: float, z: float
) -> None:
    glow = _glow(extent) / _glow(extent).mean()
    wrong = sum(_weak(z, glow, seed) is None for seed in range(60))
    assert wrong <= binom.isf(1e-3, 60, 1 / 20)


def test_a_dark_current_is_told_as_soon_as_a_glow_would_show() -> None:
    assert sum(_weak(12.0, np.ones((64, 96)), seed) is None for seed in range(40)) >= 36
    assert sum(_weak(2.0, np.ones((64, 96)), seed) is None for seed in range(40)) <= 4


@pytest.mark.parametrize("scatter", [1.5, 3.0])
def test_pixels_that_differ_in_dark_current_are_its_noise(scatter: float) -> None:
    """Of a dark current that is as sure beside them: as often believed as without.

    Both maps differ alike: they tell what one does.
    """
    told = 0
    for seed in range(40):
        own = np.random.default_rng([seed, 9]).normal(size=(64, 96))
        growth = scatter * 12 * NOISE_DN / (64 * 96) ** 0.5
        differing = NOISE_DN * (scatter**2 - 1) ** 0.5 * own
        one = registry()["dark_current"](dn_per_s=growth / TIME_S)
        told += uneven(_state(growth + differing, left=(2.0, 2.0), seed=seed), one) is None
    assert told >= 34


@pytest.mark.parametrize(
    ("square", "along", "precision"), [(3.0, 1.0, 30.0), (20.0, 24.0, 8.0), (0.5, -3.0, 100.0)]
)
def test_odds_are_the_mean_of_the_likelihood_over_the_growth(
    square: float, along: float, precision: float
) -> None:
    """By numbers, of a normal variate of mean 1."""
    normal = scipy.stats.norm(1, precision**-0.5)
    mean, _ = scipy.integrate.quad(
        lambda a: normal.pdf(a) * np.exp(a * along - a**2 * square / 2), -4, 6, points=[1.0]
    )
    assert _ratio(square, along, precision) == pytest.approx(np.log(mean), abs=1e-6)


def test_a_glow_that_has_no_word_stays_unexplained() -> None:
    glow = registry()["amp_glow"](dn_per_s=420.0, place="top_left", extent=0.15)
    words = VOCABULARY - {"amp_glow"}
    recording = recorded(camera(glow), 7, rows=64, columns=96, levels=FEW_LEVELS)
    found = find_mismatch(camera(), recording, seed=3, vocabulary=words)
    assert found.verdict == "unexplained"
    assert any(m.statistic.startswith("fixed_smooth") for m in found.unexplained)


@pytest.mark.parametrize("hot", [0.0, 200.0])
@pytest.mark.parametrize(("tail", "denied"), [(False, False), (True, True)])
def test_a_glow_that_is_named_may_have_a_tail_where_the_map_has_one(
    tail: bool, denied: bool, hot: float
) -> None:
    """An exponential glow of 60 DN/s beside a dark current of 4, or 1 / r without one.

    Hot pixels, which are no glow, say nothing of it.
    """
    y, x = np.arange(64)[:, None], np.arange(96)
    distance = np.hypot(y, x) / (0.08 * 96)
    shape = 1 / (1 + distance) if tail else np.exp(-distance)
    glow = registry()["amp_glow"](dn_per_s=60.0, place="top_left", extent=0.08)
    rng = np.random.default_rng(9)
    spots = np.where(rng.random(shape.shape) < 0.003, rng.exponential(hot, shape.shape), 0.0)
    said = uneven(_state(60.0 * TIME_S * shape + spots, "time", glow), DARK_CURRENT)
    assert (said is not None) == denied
    if said is not None:
        assert "falls off more slowly" in said.why
