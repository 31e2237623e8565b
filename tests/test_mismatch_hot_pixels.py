"""Promise: few hot pixels are named, by the law of single pixels, and seen in locked frames."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import binom, exponnorm, norm

from analysis.currentlaw import Binned, Body
from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.parts import STANDING_OUT, rooted
from analysis.mismatch.bank.together import TOGETHER
from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.hotlaw import HotLaw, _Pixels, hot_laws
from analysis.mismatch.prove.hot import Hot, expected_rate, hot_of
from dsis.effects import registry

SHAPE, NOISE_DN = (48, 64), 0.4
CHANNELS = ("R", "Gr", "Gb", "B")
SURE = 4.0  # standard errors
KEYS = tuple(
    Key("outlying_pixels", "time", "", "", f"{limit:g}, {TOGETHER}") for limit in STANDING_OUT
)


def _maps(seed: int, share: float, mean_dn: float) -> dict[str, tuple[np.ndarray, float]]:
    """Return maps of four channels as numpy draws them."""
    rng = np.random.default_rng(seed)
    hot = lambda: (rng.random(SHAPE) < share) * rng.exponential(max(mean_dn, 1e-9), SHAPE)  # noqa: E731
    return {c: (rng.normal(0, NOISE_DN, SHAPE) + hot(), NOISE_DN) for c in CHANNELS}


def _laws(maps: dict[str, tuple[np.ndarray, float]]) -> list[HotLaw]:
    return hot_laws(maps, {name: np.zeros(SHAPE, bool) for name in maps})


@pytest.mark.parametrize(("share", "mean"), [(0.01, 0.5), (0.2, 2.0), (0.003, 8.0)])
def test_the_density_is_that_of_a_normal_variate_and_an_exponential_one(
    share: float, mean: float
) -> None:
    values = np.linspace(-4, 12, 33)
    each = (Binned(values[i : i + 1], np.ones(1)) for i in range(values.size))
    pixels = (_Pixels(one, NOISE_DN, Body()) for one in each)
    width = 1.1
    ones = [np.array([one]) for one in (share, mean * NOISE_DN, width)]
    found = np.array([own.loglik(*ones).item() for own in pixels])
    tail = exponnorm(mean / width, 0, width)
    centre = -share * (tail.sf(0) - 0.5) * np.sqrt(2 * np.pi) * width  # where half lie below 0
    expected = (1 - share) * norm.pdf(values, centre, width) + share * tail.pdf(values)
    np.testing.assert_allclose(found, np.log(expected), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("share", "mean_dn"), [(0.004, 1.0), (0.01, 2.0), (0.003, 40.0), (0.05, 0.4)]
)
def test_intervals_hold_what_was_planted(share: float, mean_dn: float) -> None:
    seeds, held = 12, np.zeros(2)
    for seed in range(seeds):
        law = _laws(_maps(seed, share, mean_dn))[0]
        assert law.gain > 2
        held[0] += abs(law.share - share) < 1.96 * law.share_error
        held[1] += abs(law.mean - mean_dn) < 1.96 * law.mean_error
    assert held.min() >= binom.ppf(0.001, seeds, 0.95)


@pytest.mark.long
def test_noise_alone_gains_what_a_parameter_gains_by_chance() -> None:
    gains = [_laws(_maps(seed, 0.0, 0.0))[0].gain for seed in range(20)]
    # Of a share at its bound, and a mean that then says nothing: chi-squared of two at most.
    assert np.mean(gains) < 1.0 + SURE / np.sqrt(len(gains))
    assert max(gains) < 6


def test_two_pixels_in_twelve_thousand_are_enough() -> None:
    maps = _maps(3, 0.0, 0.0)
    maps["B"][0][20, 30] += 8 * NOISE_DN
    maps["Gr"][0][7, 11] += 6 * NOISE_DN
    laws = _laws(maps)
    assert laws[0].gain > 15
    # Few that are hot, or many warm ones of which two are seen, are nearly as likely: 1.92 less
    # at the ends of a 95 % interval.
    ends = [law.gain - laws[0].gain for law in laws[1:]]
    assert len(ends) == 2
    assert all(-1.93 <= end <= 0 for end in ends)
    assert max(law.share for law in laws) > 10 * min(law.share for law in laws)


def test_what_is_left_out_says_nothing() -> None:
    maps = _maps(3, 0.0, 0.0)
    maps["B"][0][20, 30] += 12 * NOISE_DN
    out = {name: np.zeros(SHAPE, bool) for name in maps}
    assert hot_laws(maps, out)[0].gain > 15
    out["B"][20, 30] = True
    assert hot_laws(maps, out)[0].gain < 6


@pytest.mark.parametrize("noises", [5, 10])
def test_a_glow_is_no_hot_pixel(noises: int) -> None:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    maps = _maps(3, 0.0, 0.0)
    glow = noises * NOISE_DN * np.exp(-np.hypot(y, x) / 8)
    maps = {channel: (image + glow, noise) for channel, (image, noise) in maps.items()}
    assert _laws(maps)[0].gain < 6


def _clues(
    maps: dict[str, tuple[np.ndarray, float]],
    noisy: tuple[int, int] | None = None,
    name: str = "time",
    times: tuple[float, ...] = (0.5,),
    kind: str = "dark",
    far_out: float = 0.0,
    spread: float = 1.0,
) -> Any:
    """Return clues of exposures of 8 frames, of .5 s, one pixel of which is noisy, if any.

    `far_out` pixels are expected far out of a map; `spread` is that of the pixels' variances.
    """
    variances = np.random.default_rng(0).normal(0, 1, SHAPE)
    if noisy is not None:
        variances[noisy] = 100.0
    images = {name: maps, "variance": dict.fromkeys(maps, (variances, spread))}
    variance = 8 * NOISE_DN**2
    return SimpleNamespace(
        image=lambda own: images.get(own, {}),
        scale=lambda _name, _channel: 0.5,
        camera=SimpleNamespace(effect=()),
        fit=SimpleNamespace(line_dn2=lambda signal: variance + 0.1 * signal),
        vector=SimpleNamespace(keys=KEYS),
        null=SimpleNamespace(mean=np.full(len(KEYS), rooted(far_out))),
        layout=SimpleNamespace(
            rows=2 * SHAPE[0],
            columns=2 * SHAPE[1],
            uniform=[
                SimpleNamespace(
                    name=kind, kind=kind, numbers=tuple(range(8)), exposure_time_s=time_s
                )
                for time_s in times
            ],
            still={},
            variance_dn2={(kind, channel): variance for channel in maps},
        ),
    )


@pytest.mark.parametrize("name", ["time", "offset"])
def test_a_proposal_has_the_law_per_second_and_is_fitted_no_more(name: str) -> None:
    first, *_ = CANDIDATES["hot_pixels"].propose(_clues(_maps(1, 0.01, 2.0), name=name))
    value = first.effect.model_dump()
    assert first.free == ()
    assert first.price == 2
    assert first.of_pixels is not None
    assert first.of_pixels > 100
    for parameter, planted in (("pixel_fraction", 0.01), ("mean_dn_per_s", 4.0)):
        assert abs(value[parameter] - planted) < SURE * first.errors[parameter]


def test_an_offset_beside_other_times_is_no_charge() -> None:
    hot = CANDIDATES["hot_pixels"]
    assert not hot.propose(_clues(_maps(1, 0.01, 2.0), name="offset", times=(0.01, 0.5)))
    assert not hot.propose(_clues(_maps(1, 0.01, 2.0), name="offset", times=(0.0,)))
    assert not hot.propose(_clues(_maps(1, 0.01, 2.0), name="offset", kind="flat"))


def test_what_the_camera_expects_far_out_is_told_by_counts() -> None:
    """The law is told from normal noise, which a camera with hot pixels of its own has not."""
    for one in CANDIDATES["hot_pixels"].propose(_clues(_maps(1, 0.01, 2.0), far_out=3.0)):
        assert one.of_pixels is None


def test_maps_that_say_nothing_have_no_law() -> None:
    maps = _maps(1, 0.01, 2.0)
    assert not hot_laws(maps, {name: np.ones(SHAPE, bool) for name in maps})
    still = {name: (np.zeros(SHAPE), noise) for name, (_, noise) in maps.items()}
    assert not hot_laws(still, {name: np.zeros(SHAPE, bool) for name in still})


def test_a_pixel_that_jumps_is_no_hot_one() -> None:
    maps = _maps(3, 0.0, 0.0)
    maps["B"][0][20, 30] += 12 * NOISE_DN
    hot = CANDIDATES["hot_pixels"]
    assert hot.propose(_clues(maps))
    assert not any((one.of_pixels or 0) > 6 for one in hot.propose(_clues(maps, (20, 30))))
    # Whatever the spikes have made of the spread that is given with the map.
    spiky = hot.propose(_clues(maps, (20, 30), spread=30.0))
    assert not any((one.of_pixels or 0) > 6 for one in spiky)


@pytest.mark.parametrize(("share", "mean", "sd"), [(0.01, 1.0, 0.3), (0.2, 0.5, 1.0)])
def test_the_charge_of_a_pixel_is_its_mean_given_what_was_seen(
    share: float, mean: float, sd: float
) -> None:
    for seen in (-1.0, 0.0, 0.7, 2.0, 6.0):

        def density(rate: float, seen: float = seen) -> float:
            return share / mean * np.exp(-rate / mean) * norm.pdf(seen, rate, sd)

        top = quad(lambda rate: rate * density(rate), 0, 20, points=[max(seen, 0.0)])[0]
        whole = quad(density, 0, 20, points=[max(seen, 0.0)])[0]
        expected = top / (whole + (1 - share) * norm.pdf(seen, 0, sd))
        found = float(expected_rate(np.array([seen]), sd, share, mean)[0])
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_hot_pixels_of_training_frames_are_known_in_others() -> None:
    share, mean_dn_per_s, times = 0.005, 20.0, np.array([0.01, 0.5])
    rng = np.random.default_rng(2)
    rate = (rng.random(SHAPE) < share) * rng.exponential(mean_dn_per_s, SHAPE)
    charge = times[:, None, None] * rate
    charge -= charge.mean((1, 2), keepdims=True)
    seen = charge + rng.normal(0, NOISE_DN, charge.shape)
    weights = np.full(2, NOISE_DN**-2)
    told = Hot(share, mean_dn_per_s, times, weights).estimate(seen)
    before, after = ((charge[1] - own) ** 2 for own in (0.0, told[1]))
    assert after.sum() < 0.1 * before.sum()
    nothing = Hot(share, mean_dn_per_s, times, np.zeros(2)).estimate(seen)
    assert not nothing.any()


def test_of_the_effects_the_brightest_hot_pixels_are_asked() -> None:
    make = registry()["hot_pixels"]
    values = ((0.01, 2.0), (0.001, 9.0), (0.0, 99.0))
    some = [make(pixel_fraction=share, mean_dn_per_s=mean) for share, mean in values]
    some.append(registry()["dsnu"](sigma_dn=1.0))
    found = hot_of(some, np.ones(1), np.ones(1))
    assert found is not None
    assert (found.share, found.mean_dn_per_s) == (0.001, 9.0)
    assert hot_of(some[2:], np.ones(1), np.ones(1)) is None
