"""Promise: the limits that decide what a fit uses, and the errors it states, are the right ones."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.photon_transfer import fit_camera
from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.levels import levels_of
from analysis.photon_transfer.lines import line_through
from analysis.photon_transfer.segments import fit_segments
from analysis.photon_transfer.statistics import expose_statistics
from dsis.camera import camera_values
from dsis.cfa import Cfa
from dsis.effects import registry
from dsis.measures import measure_exposure
from planted_camera import (
    LEVELS_DN,
    ONE,
    Z_MAX,
    Recording,
    Sensor,
    camera,
    misses,
    points_of,
    record,
)


def test_a_level_whose_noise_reaches_the_full_well_is_left_out() -> None:
    """8800 DN lies below 9000, by 1.6 standard deviations: a twentieth of its pixels are full."""
    recording = record(ONE, 6, levels=(*LEVELS_DN[:-1], 8800.0, 13000.0, 14000.0))
    full = tuple(
        replace(e, stack=np.minimum(e.stack, np.uint16(256 + 9000))) for e in recording.exposures
    )
    fit = fit_camera(replace(recording, exposures=full))
    reasons = {level.statistics.light: level.left_out for level in fit.levels}
    assert "the charge is full" in reasons[8800.0]
    assert not reasons[6000.0]
    for name, z in misses(fit, ONE).items():
        assert abs(z) < Z_MAX, name


@pytest.mark.parametrize(("current", "grows"), [(2.9, False), (3.1, True)])
def test_a_dark_current_of_less_than_three_errors_is_none(current: float, grows: bool) -> None:
    recording = record(ONE, 1, levels=(0.0, 0.0, 0.0, 500.0))
    measured = [s for e in recording.exposures for s in expose_statistics(recording, e)]
    dark = DarkLine(256.0, 0.1, current, 1.0, 0.0, 1)
    levels = levels_of(measured, {"MONO": dark}, 240.0)
    for level in levels[:3]:
        time_s = level.statistics.exposure_time_s
        assert level.x_dn == (current * time_s if grows else 0.0)


def test_the_interval_of_a_faint_switch_holds_it() -> None:
    """Steps of 3 errors of a level: the best gap is often not the right one.

    300 runs, at least 95 % of them; 3 binomial errors are allowed.
    """
    x = np.array([0.0, 50, 150, 400, 800, 1500, 3000, 6000, 12000, 20000])
    true, relative, runs = 1100.0, 0.02, 300
    step = 3 * relative * (2.18 * 1500 + 23)
    expected = 2.18 * x + 23.0 + step * (x > true)
    rng, held = np.random.default_rng(1), 0
    for _ in range(runs):
        drawn = expected * rng.gamma(relative**-2, relative**2, x.size)
        (switch,) = fit_segments(points_of(drawn, x, relative), 2).switches
        held += switch.low_dn < true <= switch.high_dn
    assert held >= runs * 0.95 - 3 * np.sqrt(runs * 0.95 * 0.05)


@pytest.mark.parametrize("kind", ["row", "column"])
def test_the_error_of_a_mean_under_line_noise(kind: str) -> None:
    """Oracle: analysis of variance written with numpy; without lines the mean square of pixels.

    The variance of a grand mean is the mean square of its lines over all samples.
    """
    effect = registry()[f"{kind}_noise"].model_validate({"sigma_dn": 6.0})
    recording = record(ONE.model_copy(update={"effect": (effect,)}), 1, levels=(400.0,), frames=6)
    (found,) = expose_statistics(recording, recording.exposures[0])
    stack = recording.exposures[0].stack.astype(float)
    frames, rows, columns = stack.shape
    z = stack - stack.mean(0)
    z -= z.mean((1, 2), keepdims=True)
    lines = z.mean(2 if kind == "row" else 1)
    size, count = (columns, rows) if kind == "row" else (rows, columns)
    square = size * (lines**2).sum() / ((frames - 1) * (count - 1))
    assert found.level_se_dn == pytest.approx(np.sqrt(square / stack.size), rel=1e-9)
    pixels = z - z.mean(2, keepdims=True) - z.mean(1, keepdims=True)
    pixel = (pixels**2).sum() / ((frames - 1) * (rows - 1) * (columns - 1))
    own = found.row_variance_dn2 if kind == "row" else found.column_variance_dn2
    assert own == pytest.approx((square - pixel) / size, rel=1e-9)


@pytest.mark.parametrize("black_se", [0.1, 2.0])
def test_the_black_levels_error_is_in_the_intercept(black_se: float) -> None:
    """Where no dark is fitted, black moves every x alike: the intercept by slope times as much."""
    x = np.array([50.0, 150, 400, 800, 1500, 3000, 6000])
    points = points_of(2.18 * x + 23.0, x, 0.01)
    plain, moved = line_through(points, 0.0), line_through(points, black_se)
    added = moved.intercept_se_dn2**2 - plain.intercept_se_dn2**2
    assert added == pytest.approx((2.18 * black_se) ** 2, rel=1e-3)
    assert moved.slope_se_dn == pytest.approx(plain.slope_se_dn, rel=1e-3)


@pytest.mark.parametrize(("step", "phase"), [(6, 5), (3, 0)])
def test_codes_in_steps_from_a_phase_on(step: int, phase: int) -> None:
    """Their step is measured; its square over 12 is no read noise, their phase no black level."""
    made = camera((None, 1.7, 30.0), white_level=16383.0)
    recording = record(made, 6, levels=(*LEVELS_DN, 15000.0))
    stepped = tuple(
        replace(e, stack=(np.rint((e.stack - phase) / step) * step + phase).astype(np.uint16))
        for e in recording.exposures
    )
    fit = fit_camera(replace(recording, exposures=stepped))
    found = camera_values(fit.camera)["effect"][-1]
    expected = {"kind": "quantisation", "step_dn": float(step), "phase_dn": phase}
    assert found == {name: value for name, value in expected.items() if value}
    for name, z in misses(fit, made).items():
        assert abs(z) < Z_MAX, name


def test_codes_in_steps_that_do_not_reach_the_white_level() -> None:
    """Multiples of 4 end at 16380 of 16383: what is clipped there is as clipped as any."""
    made = camera((None, 1.7, 30.0), white_level=16383.0)
    recording = record(made, 6, levels=(*LEVELS_DN, 15000.0, 15900.0, 18000.0))
    stepped = tuple(
        replace(e, stack=(np.minimum(np.rint(e.stack / 4), 4095) * 4).astype(np.uint16))
        for e in recording.exposures
    )
    fit = fit_camera(replace(recording, exposures=stepped))
    reasons = {level.statistics.light: level.left_out for level in fit.levels}
    assert "at the white level" in reasons[15900.0]
    assert "at the white level" in reasons[18000.0]
    assert not reasons[15000.0]
    assert fit.saturation_dn is None
    assert fit.full_well_dn == 16380.0 - fit.black_dn
    assert fit.white_level == 16383.0
    for name, z in misses(fit, made).items():
        assert abs(z) < Z_MAX, name


@pytest.mark.parametrize(("offset", "says"), [
    (-250, "the nominal black level 240 DN is wrong, and"),
    (60, "the nominal black level 240 DN is wrong or a dark current adds to it"),
])  # fmt: skip
def test_a_clipped_dark_that_the_nominal_black_forbids(offset: int, says: str) -> None:
    """Some samples at code 0, and a mean too low for a pedestal of 240 DN, or too high."""
    recording = record(ONE, 1)
    changed = []
    for e in recording.exposures:
        stack = np.maximum(e.stack.astype(int) + offset, 0)
        if e.kind == "dark":
            stack[0, 0, :3] = 0
        changed.append(replace(e, stack=stack.astype(np.uint16)))
    fit = fit_camera(replace(recording, exposures=tuple(changed)))
    assert any(says in remark for remark in fit.remarks)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GRBG])
def test_the_sums_of_whole_numbers_agree_with_the_measures(cfa: Cfa) -> None:
    """Oracle: `dsis.measures`, which sums deviations from the first frame in floating point."""
    effect = registry()["row_noise"].model_validate({"sigma_dn": 6.0})
    made = camera((None, 1.7, 30.0), cfa=cfa).model_copy(update={"effect": (effect,)})
    exposure = record(made, 3, levels=(700.0,), frames=6).exposures[0]
    recording = Recording(Sensor("s", cfa, 0.0, 16383.0, 14), (exposure,))
    other = measure_exposure(exposure.stack, cfa)
    for found in expose_statistics(recording, exposure):
        channel = other.channels[found.channel]
        assert found.level_dn == pytest.approx(channel.estimates["level"].value, rel=1e-9)
        assert found.row_variance_dn2 == pytest.approx(
            channel.estimates["row_variance"].value, rel=1e-6
        )
        pairs = channel.pair_variance
        assert found.pair_variance_dn2 == pytest.approx(pairs.uncorrected.value, rel=1e-6)
        assert found.removed_dn2 == pytest.approx(pairs.removed.value, rel=1e-6)


@pytest.mark.parametrize("black", [256.1, 256.25, 256.4])
def test_a_black_level_that_rounding_hides_has_rounding_in_its_error(black: float) -> None:
    """Noise of 0.15 codes: the mean code is up to a quarter off, whatever the number of samples."""
    quiet = camera((None, 0.02, 0.0225), black_level=black)
    fit = fit_camera(record(quiet, 1, size=(96, 128)))
    assert fit.black_noise_se_dn is not None
    assert abs(fit.black_dn - black) < 3 * fit.black_noise_se_dn
