"""Noise narrower than half a code: what two codes hide, and pixels that differ beside it."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

from analysis.currentspread import current_spread
from analysis.mismatch import find_mismatch
from analysis.mismatch.basefit import Offsets
from analysis.mismatch.bending import bends, bent_by
from analysis.mismatch.polish import with_effects
from analysis.mismatch.rounding import of_two_codes, rounded, unrounded
from analysis.mismatch.undone import WHOLE, halfway, narrow, together, undone
from dsis.effects.dsnu import Dsnu
from dsis.effects.nonlinearity import Nonlinearity
from dsis.effects.quantisation import Quantisation
from mismatch_recordings import camera, recorded, state_of_all

pytestmark = pytest.mark.usefixtures("unproven")

BLACK, WHITE = 8.4, 4095.0
DARK, FLAT = ("dark-0", "MONO"), ("flat-0", "MONO")
SPREAD = Dsnu(sigma_dn=0.1)


def _user(sigma: float) -> Any:
    return camera(segments=((0.05, sigma**2, None),), black=BLACK)


def _layout() -> Any:
    uniform = [Stub(name=name, kind=name[:4]) for name in ("dark-0", "flat-0")]
    size = {"rows": 50, "columns": 80, "channels": ("MONO",)}
    return Stub(uniform=uniform, black_dn=BLACK, white_dn=WHITE, **size)


def _level(mean: float, square: float, error: float = 1e-4) -> Any:
    """Return a recorded level: mean code and variance of codes."""
    own = mean - BLACK
    squares = {"variance_dn2": square, "bulk_dn2": square}
    return Stub(level_dn=own, level_error_dn=error, clipped_low=0.0, **squares)


def _of_two(share: float) -> tuple[float, float]:
    return 8 + share, share * (1 - share)


def _undone(user: Any, place: tuple[str, str], level: Any, effects: Offsets | None = None) -> Any:
    none = effects or Offsets()
    return undone(user, _layout(), {place: level}, (1.0, 0.0), none, spiky=False)


@pytest.mark.parametrize("share", [0.001, 0.05, 0.3, 0.5, 0.9])
def test_two_codes_say_nothing_of_the_noise(share: float) -> None:
    """Their variance is that of a coin: it follows from their mean."""
    before, variance, *_ = unrounded(*_of_two(share), WHITE)
    assert of_two_codes(before, variance, WHITE)
    assert not of_two_codes(BLACK, 0.16, WHITE)


@pytest.mark.parametrize(("sigma", "off"), [(0.1, 0.05), (0.15, -0.2), (0.2, 0.0)])
def test_a_level_of_two_codes_is_where_the_users_noise_puts_it(sigma: float, off: float) -> None:
    """By the share of the upper code, as scipy's normal law has it."""
    level = BLACK + off
    share = float(norm.sf(8.5, level, sigma))
    found = _undone(_user(sigma), DARK, _level(*_of_two(share)))
    assert 8 + share - found.level_dn[DARK] == pytest.approx(level, abs=1e-4)
    assert found.stretch[DARK] == np.inf
    grown = 1 / float(norm.pdf(8.5, level, sigma))  # of the share against the level
    held = off == 0.0  # as given, if its mean code is as recorded
    assert found.wider[DARK] == (np.inf if held else pytest.approx(max(grown, 1.0), rel=1e-3))


def test_where_the_user_has_no_noise_two_codes_say_nothing_of_the_level() -> None:
    found = _undone(_user(1e-6), DARK, _level(*_of_two(0.3)))
    assert found.wider[DARK] == np.inf


def test_noise_that_is_not_well_known_leaves_the_level_as_unsure() -> None:
    """A fifth of the variance: by how much the mean code moves with it, over its own error."""
    sigma, share = 0.2, 0.05
    user = _user(sigma)
    sure = _undone(user, DARK, _level(*_of_two(share))).wider[DARK]
    segment = user.noise.segment[0].model_copy(update={"intercept_se": sigma**2 / 5})
    vague = user.model_copy(update={"noise": user.noise.model_copy(update={"segment": (segment,)})})

    def share_of(level: float, own: float) -> float:
        return float(norm.sf(8.5, level, own) - norm.cdf(7.5, level, own))

    level = float(brentq(lambda at: share_of(at, sigma) - share, 8.0, 8.4))
    moved = share_of(level, sigma * 1.2**0.5) - share
    wanted = sure * np.hypot(1, moved / 1e-4)
    assert _undone(vague, DARK, _level(*_of_two(share))).wider[DARK] == pytest.approx(
        wanted, rel=1e-2
    )


def test_read_noise_that_all_levels_hide_is_as_given_and_is_so_again() -> None:
    """A start from the same result, and one from a camera with an effect that is gone."""
    user = camera(segments=((0.001, 0.15**2, None),), black=8.3)
    dim = recorded(user, 3, rows=64, columns=96, levels=(0.1, 0.2))
    state = state_of_all(dim, user)
    first = state.calibrated
    assert first.fit.pieces[0].intercept == pytest.approx(0.15**2)
    again = state.setting.calibrated(user, near=first)
    assert again.model.camera.black_level == pytest.approx(first.model.camera.black_level)
    own = with_effects(user, [SPREAD])
    assert own is not None
    beside = state.setting.calibrated(own)
    assert beside.bent.variance_dn2
    assert not state.setting.calibrated(user, near=beside).bent.variance_dn2
    assert find_mismatch(user, dim, seed=1).verdict in ("match", "parameters")


def test_what_pixels_scatter_by_is_no_error_of_a_given_level() -> None:
    """Offsets put each pixel on one code or the next: a mean of 4000 is known to 0.008."""
    sigma, off = 0.1, 0.02
    share = float(norm.sf(8.5, BLACK, sigma))
    level = _level(*_of_two(share + off + 0.01))
    more = level.variance_dn2 - _of_two(share + 0.01)[1]
    held = _undone(_user(sigma), DARK, level, Offsets({DARK: off}, {DARK: more}))
    assert held.level_dn[DARK] == pytest.approx(level.level_dn, abs=1e-6)  # the level is as given
    moved = _undone(_user(sigma), DARK, _level(*_of_two(share + 0.01)))
    assert moved.level_dn[DARK] < level.level_dn - off - 1e-3


def test_what_effects_add_is_taken_off_before_narrow_noise_is_unrounded() -> None:
    """Rounding is no sum: the same comes out for noise alone as for noise with an effect."""
    sigma, more = 0.3, 0.02
    shift, added = rounded(BLACK, sigma**2, WHITE)
    plain = _undone(_user(sigma), DARK, _level(BLACK + shift, sigma**2 + added))
    effects = Offsets({DARK: 0.01}, {DARK: more})
    bent = _level(BLACK + shift + 0.01, sigma**2 + added + more)
    found = _undone(_user(sigma), DARK, bent, effects)
    assert found.variance_dn2[DARK] - plain.variance_dn2[DARK] == pytest.approx(more, abs=1e-9)
    assert found.level_dn[DARK] - plain.level_dn[DARK] == pytest.approx(0.01, abs=1e-9)
    assert bent.variance_dn2 - found.variance_dn2[DARK] == pytest.approx(sigma**2, abs=1e-6)


def test_of_wide_noise_rounding_and_effects_are_a_sum() -> None:
    effects = Offsets({FLAT: 0.5}, {FLAT: 3.0})
    found = _undone(_user(2.0), FLAT, _level(400.2, 40.0), effects)
    assert found.level_dn[FLAT] == pytest.approx(0.5)
    assert found.variance_dn2[FLAT] == pytest.approx(3 + 1 / 12)


def test_beside_narrow_noise_what_spreads_pixels_bends_levels() -> None:
    steps, bend = Quantisation(step_dn=4), Nonlinearity(percent_full_scale=1.0)
    assert narrow({DARK: _level(8.4, 0.2)}, WHOLE, spiky=False)
    assert not narrow({DARK: _level(8.4, 0.4), FLAT: _level(8.4, 0.0)}, WHOLE, spiky=False)
    for dn2, beside_steps in ((0.2, True), (7.0, True), (8.0, False)):  # 0.45 of 4 DN squared
        assert narrow({DARK: _level(8.4, dn2)}, (4.0, 0.0), spiky=False) == beside_steps
    spikes = _level(8.4, 6.0)
    spikes.bulk_dn2 = 0.2
    assert narrow({DARK: spikes}, WHOLE, spiky=True)
    assert not narrow({DARK: spikes}, WHOLE, spiky=False)
    assert not bends([SPREAD])
    assert bends([SPREAD], narrow=True)
    assert not bends([steps], narrow=True)
    assert bent_by([SPREAD, steps, bend], spiky=False) == (steps, bend)
    assert bent_by([SPREAD, steps, bend], spiky=False, narrow=True) == (SPREAD, steps, bend)


def test_halfway_is_the_mean_and_together_the_sum() -> None:
    first = Offsets({DARK: 1.0}, {DARK: 2.0}, {DARK: 1.5}, wider={DARK: 1.1})
    second = Offsets({DARK: 3.0}, {DARK: 8.0})
    middle, both = halfway(first, second), together(first, second)
    assert (middle.level_dn[DARK], middle.variance_dn2[DARK]) == (2.0, 5.0)
    assert (both.level_dn[DARK], both.variance_dn2[DARK]) == (4.0, 10.0)
    assert middle.stretch == both.stretch == first.stretch


def test_codes_that_hide_noise_leave_dark_current_no_more_than_all() -> None:
    """What shot noise would be is more than the noise that is left of it."""
    rng = np.random.default_rng(3)
    image = 5 + rng.exponential(1.0, (48, 64)) + 0.2 * rng.standard_normal((48, 64))
    found = current_spread(
        [(image, 0.2, np.zeros(image.shape, bool))], float(image.mean()), 0.0, 9.0
    )
    assert found is not None
    assert found.log_sigma > 0


def test_read_noise_of_darks_that_hide_it_is_as_given_where_flats_allow_it() -> None:
    """Flats extrapolate to 0.07 +- 0.012 DN^2, say, where 0.04 is right."""
    user = camera(segments=((0.085, 0.2**2, None),), black=95.651)
    for seed in range(3):
        made = recorded(user, seed, rows=48, columns=64, levels=(34.0, 260.0, 2000.0))
        own = state_of_all(made, user).calibrated
        assert own.fit.pieces[0].intercept == pytest.approx(0.04)
        assert own.model.camera.black_level == pytest.approx(95.651, abs=1e-6)
    wrong = camera(segments=((0.085, 5.0, None),), black=95.651)  # which flats do not allow
    assert state_of_all(made, wrong).calibrated.held is None


@pytest.mark.parametrize(
    ("sigma", "off", "spread"),
    [(0.1, 0.2, False), (0.15, 0.4, False), (0.25, 0.4, True), (0.3, 0.2, True), (0.2, 0.5, True)],
)
def test_a_camera_that_is_right_is_right_beside_coarse_codes(
    sigma: float, off: float, spread: bool
) -> None:
    """As of cameras of 8 bits: read noise of a tenth to a third of a code, darks between codes."""
    effects = (SPREAD,) if spread else ()
    user = camera(*effects, segments=((0.05, sigma**2, None),), black=8.0 + off)
    levels = (2.0, 10.0, 60.0, 200.0)
    found = find_mismatch(user, recorded(user, 3, rows=64, columns=96, levels=levels), seed=1)
    assert found.verdict == "match"


@pytest.mark.long
def test_a_wave_that_rounding_weakens_is_told_as_it_was_before() -> None:
    """Of noise of 0.3 codes about a whole code 0.66 of a small wave is left: numpy's own frames."""
    levels, amplitude = (40.0, 160.0), 0.04
    user = camera(segments=((0.4, 0.09, None),), black=200.0)
    recording = recorded(user, 1, rows=64, columns=96, frames=16, levels=levels)
    assert recording.stacks is not None
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:64, :96]
    for name, frames in recording.stacks.items():
        level = 0.0 if name.startswith("dark") else levels[int(name[-1])]
        noise = np.sqrt(0.09 + 0.4 * level) * rng.standard_normal(frames.shape)
        phase = 2 * np.pi * (0.19 * x + 0.11 * y + rng.random((len(frames), 1, 1)))
        codes = np.rint(200.0 + level + amplitude * np.cos(phase) + noise)
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    (one,) = find_mismatch(user, recording, seed=1).omitted_physics
    assert one.effect == "periodic_noise"
    told = one.parameters["amplitude_dn"]
    assert abs(told.value - amplitude) < 3 * told.standard_error < amplitude / 4
