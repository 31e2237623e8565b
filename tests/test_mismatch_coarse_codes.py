"""Coarse codes shape the noise: what would explain its shape is not named for them."""

import pytest
from scipy.stats import norm

from analysis.mismatch import find_mismatch
from dsis.effects import Effect, registry
from mismatch_recordings import camera, recorded, setting_of, state_of

pytestmark = pytest.mark.usefixtures("unproven")

STEP, INTERCEPT = 8.0, 10.0  # DN and DN^2
LEVELS = (300.0, 900.0, 2600.0)
TAILS = frozenset({"heavy_tailed_read_noise", "read_noise_spread", "impulse"})
CODES = registry()["quantisation"](step_dn=STEP)


def _excess_kurtosis(mean_dn: float, sd_dn: float) -> float:
    """Return that of a normal variate which is rounded to the steps, in closed form."""
    codes = [STEP * k for k in range(40)]
    share = norm.cdf([c + STEP / 2 for c in codes], mean_dn, sd_dn)
    share -= norm.cdf([c - STEP / 2 for c in codes], mean_dn, sd_dn)
    mean = float(share @ codes)
    second, fourth = (float(share @ [(c - mean) ** k for c in codes]) for k in (2, 4))
    return fourth / second**2 - 3


@pytest.mark.parametrize("there", [False, True])
def test_tails_that_rounding_makes_are_not_named(*, there: bool) -> None:
    """At a black level of 64 DN, the middle of a step, few samples leave their code.

    With its codes in the model the same noise is as it should be.
    """
    assert _excess_kurtosis(64.0, INTERCEPT**0.5) > 1
    true = camera(CODES, segments=((0.5, INTERCEPT, None),))
    model = true if there else camera(segments=((0.5, INTERCEPT, None),))
    recording = recorded(true, 4, rows=64, columns=64, levels=LEVELS)
    found = find_mismatch(model, recording, seed=1, vocabulary=TAILS)
    assert not found.omitted_physics
    left = {one.statistic for one in found.mismatches}
    assert ("kurtosis" in left) == ("code_spacing" in left) == (not there)


@pytest.mark.long
def test_tails_beside_coarse_codes_that_the_model_has_are_named() -> None:
    tails = registry()["heavy_tailed_read_noise"](tail_df=5.0)
    parts = ((0.5, 150.0, None),)  # wider than a step: there tails are seen
    recording = recorded(
        camera(CODES, tails, segments=parts), 4, rows=64, columns=64, levels=LEVELS
    )
    found = find_mismatch(camera(CODES, segments=parts), recording, seed=1, vocabulary=TAILS)
    assert [one.effect for one in found.omitted_physics] == ["heavy_tailed_read_noise"]
    unmodelled = camera(segments=parts)  # steps finer than the noise leave its shape
    found = find_mismatch(unmodelled, recording, seed=1, vocabulary=TAILS)
    assert [one.effect for one in found.omitted_physics] == ["heavy_tailed_read_noise"]


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (registry()["spatial_filtering"](fraction=0.04),),
        (registry()["row_noise"](sigma_dn=1.2),),
        (registry()["spatial_filtering"](fraction=0.04), registry()["row_noise"](sigma_dn=1.2)),
    ],
)
def test_read_noise_is_told_of_what_coarse_codes_leave_of_all_noise(
    effects: tuple[Effect, ...],
) -> None:
    """A filter takes a quarter of it, before codes round what is left.

    Offsets of rows move pixels of a row towards another code, and are no noise of pixels.
    """
    true = camera(CODES, *effects, segments=((0.5, INTERCEPT, None),))
    recording = recorded(true, 7, rows=96, columns=128, levels=LEVELS)
    users = camera(CODES, *effects, segments=((0.5, 1.3 * INTERCEPT, None),))
    (piece,) = setting_of(recording).calibrated(users).fit.pieces
    assert abs(piece.intercept - INTERCEPT) < 4 * piece.intercept_error
    assert piece.intercept_error < 0.02 * INTERCEPT


@pytest.mark.parametrize("start", [0.5, 3.0])
def test_of_a_strong_filter_before_coarse_codes_it_is_told_wherever_one_starts(
    start: float,
) -> None:
    """Where a third is left of it, half a step wide before: it was 9 to 11, as the user's was."""
    strong = registry()["spatial_filtering"](fraction=0.1)
    true = camera(CODES, strong, segments=((0.5, INTERCEPT, None),))
    recording = recorded(true, 7, rows=96, columns=128, levels=LEVELS)
    users = camera(CODES, strong, segments=((0.5, start * INTERCEPT, None),))
    (piece,) = setting_of(recording).calibrated(users).fit.pieces
    assert piece.intercept == pytest.approx(INTERCEPT, rel=0.015)


def test_what_coarse_codes_add_is_no_shot_noise() -> None:
    """Half a step above a code every dark pixel is on either of two, whatever its noise."""
    true = camera(
        registry()["quantisation"](step_dn=16.0, phase_dn=8.0), segments=((0.5, 9.0, None),)
    )
    recording = recorded(true, 8, rows=64, columns=64, levels=(30.0, 900.0))
    state = state_of(recording, true)
    dn2 = {
        exposure: level.variance_dn2 for (exposure, _), level in state.setting.seen.levels.items()
    }
    assert dn2["dark-0"] > 50.0
    shares = {exposure: state.clues().shot_share((exposure, "MONO")) for exposure in dn2}
    assert shares["dark-0"] == shares["dark-1"] == 0.0
    for exposure, signal_dn in (("flat-0", 30.0), ("flat-1", 900.0)):
        assert shares[exposure] == pytest.approx(0.5 * signal_dn / dn2[exposure], rel=0.15)
