"""Promise: counts of pixels that stand out are as likely as Poisson's law says."""

import numpy as np
import pytest
from scipy.stats import nbinom, norm, poisson

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.parts import STANDING_OUT, counted, parts, rooted
from analysis.mismatch.bank.together import TOGETHER, together
from analysis.mismatch.counted import Counted, expected_of

PIXELS = 12288
ELSEWHERE = 1e-3


def _keys(*maps: str, channels: tuple[str, ...] = ("R", "B")) -> tuple[Key, ...]:
    keys = [Key("fixed_pixel_variance", "time", "", channels[0], "")]
    for name in maps:
        keys += [Key("outlying_pixels", name, "", c, "") for c in channels]
        keys += [Key("outlying_pixels", name, "", c, f"{limit:g}")
                 for c in channels for limit in STANDING_OUT]  # fmt: skip
        if len(channels) > 1:
            keys += [Key("outlying_pixels", name, "", "", f"{limit:g}, {TOGETHER}")
                     for limit in STANDING_OUT]  # fmt: skip
    return tuple(keys)


def _values(counts: Counted, size: int, beyond: tuple[float, ...], *, mean: bool) -> np.ndarray:
    values = np.full(size, np.nan)
    numbers = np.arange(2000)
    roots = [
        poisson.pmf(numbers, m) @ rooted(numbers) if mean else float(rooted(m)) for m in beyond
    ]
    values[counts.which] = roots
    return values


@pytest.mark.parametrize("mean", [0.0, 0.02, 0.7, 3.0, 39.0, 41.0, 400.0])
def test_a_mean_count_is_found_from_the_mean_of_roots(mean: float) -> None:
    numbers = np.arange(2000)
    root = float(poisson.pmf(numbers, mean) @ rooted(numbers))
    assert expected_of(np.array([root]))[0] == pytest.approx(mean, rel=2e-3, abs=1e-3)


def test_counts_are_as_likely_as_those_of_their_law() -> None:
    keys = _keys("time")
    counts = Counted(keys, PIXELS)
    seen, expected = (7.0, 3.0, 1.0), (9.0, 2.0, 0.5)
    normal = PIXELS * norm.sf(STANDING_OUT)
    values = _values(counts, len(keys), seen, mean=False)
    means = {name: _values(counts, len(keys), own, mean=True)
             for name, own in (("now", tuple(normal)), ("other", expected))}  # fmt: skip
    now = counts.loglik(values, means["now"], means["now"], 0.3, 8)
    other = counts.loglik(values, means["other"], means["now"], 0.3, 8)
    bins = np.array([4.0, 2.0, 1.0])  # between limits no pixel counts twice
    by_normal = -np.diff(normal, append=0.0)
    law = np.array([7.0, 1.5, 0.5])
    excess = (law - by_normal) / 8 + (0.3 * (law - by_normal)) ** 2
    shape = law**2 / excess
    any_law = 1 / ((bins + 1) * (bins + 2))
    for found, pmf in (
        (now, poisson.pmf(bins, by_normal)),
        (other, nbinom.pmf(bins, shape, shape / (shape + law))),
    ):
        expected_loglik = np.log((1 - ELSEWHERE) * pmf + ELSEWHERE * any_law).sum()
        assert found == pytest.approx(expected_loglik, abs=0.05)


def test_what_counts_say_is_said_once() -> None:
    keys = _keys("offset", "offset alone", "time")
    counts = Counted(keys, PIXELS)
    which = [keys[i] for i in counts.which]
    assert {(key.scope, key.channel) for key in which} == {("offset", ""), ("time", "")}
    assert len(which) == 2 * len(STANDING_OUT)
    outlying = [key.statistic == "outlying_pixels" for key in keys]
    assert counts.said.tolist() == outlying
    assert sum(counts.repeated) == sum(outlying) - len(which)


def test_one_channel_is_counted_itself() -> None:
    counts = Counted(_keys("time", channels=("MONO",)), PIXELS)
    assert len(counts.which) == len(STANDING_OUT)
    none = Counted((Key("level", "exposure", "dark", "MONO", ""),), PIXELS)
    assert none.loglik(np.zeros(1), np.zeros(1), np.zeros(1), 0.3, 2) == 0.0
    assert not none.said.any()


def test_channels_of_a_mosaic_are_counted_together() -> None:
    rng = np.random.default_rng(4)
    sites = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}
    split = {}
    for number, name in enumerate(sites):
        image = rng.normal(0, 1, (48, 64))
        image[5, : number + 1] = 9.0
        split[name] = parts(image, 1.0)
    found = together(split, dict.fromkeys(sites, 1.0), sites)
    value = found[f"outlying_pixels of 5, {TOGETHER}"][0]
    assert round(float(counted(np.array(value)))) == 1 + 2 + 3 + 4
