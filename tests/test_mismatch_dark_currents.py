"""Dark currents that differ between pixels: told from hot ones, beside them, and in a user's model.

Recordings are numpy's; nothing of them is made by the effects.
"""

from functools import lru_cache
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.apart import as_far_apart
from analysis.mismatch.candidates.currents import _noisy
from analysis.mismatch.finding import Finding
from analysis.mismatch.prove.marginal import _growth
from dsis.effects.dark_current import DarkCurrent
from dsis.effects.hot_pixels import HotPixels
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES = 96, 128, 8
TIMES_S = {"dark-0": 0.005, "dark-1": 0.05}
SLOPE, INTERCEPT, BLACK = 0.5, 20.0, 64.0
MEAN, SIGMA = 300.0, 0.6  # DN/s
WORDS = frozenset({"dark_current", "hot_pixels", "dsnu", "rts", "poisson_shot_noise", "amp_glow"})


@lru_cache(maxsize=4)
def recording(sigma: float, hot: float, glow: float = 0.0) -> InMemory:
    """Return electrons of light and of log-normal dark currents, some of which are far brighter.

    `glow`, DN/s, is added at the last row and column, and falls by e over 0.3 of a row.
    """
    like = recorded(camera(), 1, rows=ROWS, columns=COLUMNS, levels=(250.0, 900.0, 2600.0))
    law = np.random.default_rng(21)
    shape = ROWS, COLUMNS
    rate = law.lognormal(np.log(MEAN) - sigma**2 / 2, sigma, shape)
    rate += np.where(law.random(shape) < hot, law.exponential(8000, shape), 0)
    away = np.hypot(*np.mgrid[ROWS - 1 : -1 : -1, COLUMNS - 1 : -1 : -1])
    rate += glow * np.exp(-away / (0.3 * COLUMNS))
    stacks = {}
    for exposure in like.exposures:
        signal = (exposure.light or 0.0) + rate * exposure.exposure_time_s
        noise = INTERCEPT**0.5 * law.standard_normal((FRAMES, *shape))
        codes = BLACK + SLOPE * law.poisson(signal / SLOPE, (FRAMES, *shape)) + noise
        stacks[exposure.name] = np.rint(codes).clip(0, 4095).astype(np.uint16)
    return InMemory(like.sensor, like.exposures, ROWS, COLUMNS, like.folder, stacks)


def numbers(found: Finding) -> dict[str, dict[str, tuple[float, float]]]:
    return {
        one.effect: {
            n: (float(p.value), float(p.standard_error)) for n, p in one.parameters.items()
        }
        for one in found.omitted_physics
    }


@pytest.fixture(scope="module")
def spread() -> Finding:
    return find_mismatch(camera(), recording(SIGMA, 0.0), vocabulary=WORDS)


@pytest.fixture(scope="module")
def beside_hot() -> Finding:
    return find_mismatch(camera(), recording(SIGMA, 0.004), vocabulary=WORDS)


@pytest.mark.long
def test_a_spread_is_a_number_of_the_dark_current(spread: Finding) -> None:
    """No hot pixels are named for its tail, and nothing is left."""
    found = numbers(spread)
    assert set(found) == {"dark_current", "poisson_shot_noise"}
    for name, planted in (("dn_per_s", MEAN), ("log_sigma", SIGMA)):
        value, error = found["dark_current"][name]
        assert abs(value - planted) < 4 * error
        assert error < 0.06 * planted
    assert not spread.unexplained


@pytest.mark.long
def test_hot_pixels_beside_a_spread_are_both_found(beside_hot: Finding) -> None:
    """The few hot ones leave the others' spread as it is, and nothing is left."""
    found = numbers(beside_hot)
    assert set(found) - {"poisson_shot_noise"} == {"dark_current", "hot_pixels"}
    value, error = found["dark_current"]["log_sigma"]
    assert abs(value - SIGMA) < 4 * error
    share, error = found["hot_pixels"]["pixel_fraction"]
    assert abs(share - 0.004) < 4 * error
    assert not beside_hot.unexplained


@pytest.mark.long
def test_hot_pixels_that_are_taken_in_first_give_back_what_a_spread_explains() -> None:
    """Measured alone they are half as many again, and less hot: warm ones of the spread are none.

    So they were named, beside a dark current without a spread.
    """
    found = find_mismatch(camera(), recording(0.3, 0.01), vocabulary=WORDS)
    own = numbers(found)
    planted = {
        ("dark_current", "log_sigma"): 0.3,
        ("hot_pixels", "pixel_fraction"): 0.01,
        ("hot_pixels", "mean_dn_per_s"): 8000.0,
    }
    for (kind, name), true in planted.items():
        value, error = own[kind][name]
        assert abs(value - true) < 2 * error < 0.25 * true
    assert not found.unexplained


@pytest.mark.long
def test_equal_dark_currents_have_no_spread() -> None:
    """Hot pixels beside them are hot pixels, and the dark current has one number."""
    found = numbers(find_mismatch(camera(), recording(0.0, 0.004), vocabulary=WORDS))
    assert "log_sigma" not in found["dark_current"]
    assert "hot_pixels" in found


@pytest.mark.long
def test_a_glow_beside_a_spread_leaves_it_its_mean() -> None:
    """What levels show of both is parted: pixels stay as far apart while the mean is fitted."""
    planted = {"dark_current": ("dn_per_s", MEAN), "amp_glow": ("dn_per_s", 700.0)}
    words = frozenset({"dark_current", "amp_glow", "poisson_shot_noise"})
    found = find_mismatch(camera(), recording(SIGMA, 0.0, 700.0), vocabulary=words)
    own = numbers(found)
    assert own.keys() - {"poisson_shot_noise"} == planted.keys()
    for kind, (name, true) in planted.items():
        value, error = own[kind][name]
        assert abs(value - true) < 4 * error < 0.4 * true
    assert not found.unexplained


@pytest.mark.long
@pytest.mark.parametrize("users", [0.0, 0.3])
def test_a_users_other_spread_is_a_wrong_number(users: float) -> None:
    """Nothing is omitted but counted photons: the model has the current, otherwise apart."""
    model = camera(DarkCurrent(dn_per_s=MEAN, log_sigma=users))
    found = find_mismatch(model, recording(SIGMA, 0.0), vocabulary=WORDS)
    assert {one.effect for one in found.omitted_physics} <= {"poisson_shot_noise"}
    (wrong,) = [e for e in found.parameter_errors if e.parameter.endswith("dark_current.log_sigma")]
    assert wrong.model == users
    assert abs(wrong.recorded - SIGMA) < 4 * wrong.standard_error
    assert {m.statistic for m in found.unexplained} <= {"skewness"}  # of counted photons


@pytest.mark.long
def test_a_users_other_mean_is_a_wrong_number_and_the_spread_about_it_is_right() -> None:
    """Pixels are 0.7 apart about the user's mean, and 0.6 about the recorded one, as they say."""
    model = camera(DarkCurrent(dn_per_s=0.8 * MEAN, log_sigma=SIGMA))
    words = frozenset({"dark_current", "poisson_shot_noise"})
    found = find_mismatch(model, recording(SIGMA, 0.0), vocabulary=words)
    (wrong,) = found.parameter_errors
    assert wrong.parameter == "effect.dark_current.dn_per_s"
    assert abs(wrong.recorded - MEAN) < 4 * wrong.standard_error < 0.1 * MEAN
    assert not found.unexplained


@pytest.mark.long
def test_dark_currents_far_apart_have_a_median_far_below_their_mean() -> None:
    """Most pixels grow by a quarter of the mean, and that is as the law has it."""
    found = numbers(find_mismatch(camera(), recording(1.6, 0.0), vocabulary=WORDS))
    value, error = found["dark_current"]["log_sigma"]
    assert abs(value - 1.6) < 4 * error + 0.05 * 1.6


def test_another_mean_leaves_pixels_as_far_apart() -> None:
    """Their standard deviation is what maps show: d sqrt(exp(s^2) - 1)."""
    before = DarkCurrent(dn_per_s=60.0, log_sigma=0.4)
    after = as_far_apart(before, before.model_copy(update={"dn_per_s": 40.0}))
    assert isinstance(after, DarkCurrent)

    def deviation(own: DarkCurrent) -> float:
        return own.dn_per_s * float(np.sqrt(np.expm1(own.log_sigma**2)))

    assert deviation(after) == pytest.approx(deviation(before))
    plain = DarkCurrent(dn_per_s=40.0)
    assert as_far_apart(DarkCurrent(dn_per_s=60.0), plain) is plain
    hot = HotPixels(pixel_fraction=0.1, mean_dn_per_s=3.0)
    assert as_far_apart(before, hot) is hot
    assert as_far_apart(None, plain) is plain


@pytest.mark.parametrize("frames", [2, 7])
def test_a_hot_pixel_is_no_noisier_than_its_charge(frames: int) -> None:
    """Of two frames, as standards ask for, there are variances too: hot pixels are not left out."""
    dark, times, grown = 10.0, 40, 90.0
    law = np.random.default_rng(3)
    variances = dark * law.chisquare(frames - 1, (times, 40, 40)) / (frames - 1)
    # 90 DN of charge by a slope of 1 DN are ten times the dark's variance.
    variances[:, 5, 5] *= 1 + grown / dark
    total = ((frames - 1) / dark * (variances / dark - 1)).sum(0)
    rate = np.zeros((40, 40))
    rate[5, 5] = grown
    uniform = [
        Stub(name=f"dark-{i}", numbers=tuple(range(frames)), exposure_time_s=1.0)
        for i in range(times)
    ]
    clues: Any = Stub(
        image=lambda _: {"MONO": (total, 1.0)},
        fit=Stub(line_dn2=lambda signal: dark + signal),
        layout=Stub(
            uniform=uniform, still={}, variance_dn2={(e.name, "MONO"): dark for e in uniform}
        ),
    )
    assert not _noisy(clues, "MONO", rate)[5, 5]


def test_variance_grows_with_charge_as_ordinary_pixels_show() -> None:
    """Shot noise of a slope of 0.5 DN, of 5000 pixels that differ by some DN."""
    law = np.random.default_rng(4)
    pattern = law.gamma(2, 4, 5000) - 8
    scale = np.sqrt(10 + 0.5 * pattern)
    squares = ((scale * law.standard_normal((40, 5000))) ** 2).astype(np.float32)
    assert _growth(squares, pattern, 10.0) == pytest.approx(0.5, rel=0.1)
