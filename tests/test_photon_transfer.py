"""Promise: `fit_camera` recovers the camera that a recording was made with."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from analysis.photon_transfer import fit_camera
from analysis.photon_transfer.recorded import channel_names
from analysis.photon_transfer.rounding import rounded_moments, unrounded
from analysis.photon_transfer.statistics import expose_statistics
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects import registry
from planted_camera import LEVELS_DN, ONE, TWO, Z_MAX, Recording, Sensor, camera, misses, record


def test_statistics_are_those_of_numpy() -> None:
    """Oracle: the definitions, written with numpy on the whole stack."""
    recording = record(camera((None, 1.7, 30.0), cfa=Cfa.GBRG), 3, levels=(0.0, 700.0), frames=5)
    exposure = recording.exposures[1]
    names = channel_names(Cfa.GBRG)
    assert names == (("Gb", "B"), ("R", "Gr"))
    for found in expose_statistics(recording, exposure):
        i, j = next((i, j) for i in (0, 1) for j in (0, 1) if names[i][j] == found.channel)
        plane = exposure.stack[:, i::2, j::2].astype(np.float64)
        n = plane[0].size
        z = plane - plane.mean(0) - (plane.mean((1, 2)) - plane.mean())[:, None, None]
        assert found.level_dn == pytest.approx(plane.mean(), rel=1e-12)
        assert found.variance_dn2 == pytest.approx((z**2).sum() / (4 * (n - 1)), rel=1e-9)
        d = np.stack([plane[1] - plane[0], plane[3] - plane[2]])
        assert found.pair_variance_dn2 == pytest.approx((d**2).mean() / 2, rel=1e-9)
        assert found.removed_dn2 == pytest.approx((d.mean((1, 2)) ** 2).mean() / 2, rel=1e-9)
        fixed = plane.mean(0).var(ddof=1) - found.variance_dn2 / 5
        assert found.fixed_dn2 == pytest.approx(fixed, abs=1e-9)


def test_two_frames_give_equation_1_with_the_change_removed() -> None:
    exposure = record(ONE, 4, levels=(0.0, 900.0), frames=2).exposures[1]
    shifted = exposure.stack.copy()
    shifted[1] += 40  # the light changed between the frames
    recording = Recording(Sensor("s", Cfa.MONO, 0, 65535, 16), (replace(exposure, stack=shifted),))
    (found,) = expose_statistics(recording, recording.exposures[0])
    (plain,) = expose_statistics(recording, exposure)
    n = found.pixels
    assert found.variance_dn2 == pytest.approx(plain.variance_dn2, rel=1e-9)
    assert found.pair_variance_dn2 - found.removed_dn2 == pytest.approx(
        found.variance_dn2 * (n - 1) / n, rel=1e-9
    )
    error = np.sqrt(2 * plain.variance_dn2 / n)  # of the difference of two frame means
    assert abs(np.sqrt(2 * found.removed_dn2) - 40.0) < Z_MAX * error


@pytest.mark.parametrize("effect", [None, "row_noise", "column_noise"])
def test_error_of_the_variance_is_right(effect: str | None) -> None:
    """Oracle: the scatter of 150 repetitions; its own relative error is 1 / sqrt(300) = 6 %."""
    extra = () if effect is None else (registry()[effect].model_validate({"sigma_dn": 6.0}),)
    made = ONE.model_copy(update={"effect": extra})
    found = []
    for seed in range(150):
        recording = record(made, seed, levels=(400.0,), size=(32, 32))
        found.append(expose_statistics(recording, recording.exposures[0])[0])
    scatter = np.std([s.variance_dn2 for s in found], ddof=1)
    stated = np.sqrt(np.mean([s.variance_se_dn2**2 for s in found]))
    assert abs(stated / scatter - 1) < 4 / np.sqrt(300)


@given(mean=st.floats(-3, 3), sd=st.floats(0.3, 1.2))
@settings(max_examples=60, deadline=None)
def test_rounding_is_undone(mean: float, sd: float) -> None:
    """Oracle: sums over the probabilities of the codes."""
    codes = np.arange(-20, 21)
    share = np.diff(stats.norm.cdf(np.append(codes, 21) - 0.5, mean, sd))
    level = float((share * codes).sum())
    variance = float((share * codes**2).sum() - level**2)
    assert rounded_moments(mean, sd) == pytest.approx((level, variance), abs=1e-6)
    found = unrounded(level, 0.001, variance, 0.001)
    if found.recovered:
        assert found.level_dn == pytest.approx(mean, abs=1e-4)
        assert found.variance_dn2 == pytest.approx(sd**2, abs=1e-4)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("made", [ONE, TWO], ids=["one segment", "two segments"])
def test_intervals_cover_the_planted_camera(made: Camera, cfa: Cfa) -> None:
    """Reduced: 40 runs; `benchmarks/photon_transfer.py` does 500. z is 4.1 binomial errors."""
    runs, planted = 40, made.model_copy(update={"cfa": cfa})
    inside: dict[str, int] = {}
    right = 0
    for seed in range(runs):
        fit = fit_camera(record(planted, seed, size=(32, 48)))
        if len(fit.segments.lines) != len(planted.noise.segment):
            continue
        right += 1
        for name, z in misses(fit, planted).items():
            inside[name] = inside.get(name, 0) + (abs(z) < 1.96)
        for switch in fit.segments.switches:
            inside["switch"] = inside.get("switch", 0) + (switch.low_dn < 800 <= switch.high_dn)
    assert right >= 0.95 * runs
    for name, count in inside.items():
        assert stats.binom.cdf(count, right, 0.95) > 2e-5, f"{name}: {count} of {right}"


def test_dark_current_and_black_level_at_zero_time() -> None:
    recording = record(ONE, 8, levels=(0.0,) * 5 + (500.0, 2000.0, 6000.0), dark_dn_per_s=300.0)
    fit = fit_camera(recording)
    dark = fit.channels["MONO"].dark
    assert dark is not None
    assert dark.current_dn_per_s is not None
    assert dark.current_se_dn_per_s is not None
    assert abs(dark.current_dn_per_s - 300.0) < Z_MAX * dark.current_se_dn_per_s
    assert abs(fit.black_dn - 256.0) < Z_MAX * (fit.black_se_dn or 0)
    for name, z in misses(fit, ONE).items():
        assert abs(z) < Z_MAX, name


def test_noise_of_a_third_of_a_code() -> None:
    made = camera((None, 0.02, 0.1), black_level=64.3, white_level=4095.0, bit_depth=12)
    levels = (0.0, 0.0, 5.2, 20.1, 80.7, 300.0, 900.0, 2500.0)
    fit = fit_camera(record(made, 5, levels=levels, frames=8, size=(96, 96)))
    for name, z in misses(fit, made).items():
        assert abs(z) < Z_MAX, name
    assert any("rounding" in remark for remark in fit.remarks)


def test_charge_that_fills_below_the_white_level_is_seen() -> None:
    recording = record(ONE, 6, levels=(*LEVELS_DN, 13000.0, 14000.0, 15000.0))
    full = []
    for exposure in recording.exposures:
        stack = np.minimum(exposure.stack, np.uint16(256 + 9000))
        full.append(replace(exposure, stack=stack))
    fit = fit_camera(replace(recording, exposures=tuple(full)))
    assert fit.saturation_dn == pytest.approx(9000.0, abs=1.0)
    assert fit.full_well_reached
    assert fit.camera.saturation_dn == fit.saturation_dn
    assert abs(misses(fit, ONE)["slope 0"]) < Z_MAX


def test_a_variance_that_is_not_straight_is_said_and_its_errors_widened() -> None:
    recording = record(ONE, 7, size=(96, 96))
    shaken = []
    for number, exposure in enumerate(recording.exposures):
        mean = exposure.stack.mean(0)
        wide = mean + (exposure.stack - mean) * (1 + 0.1 * (-1) ** number)
        shaken.append(replace(exposure, stack=np.rint(wide).astype(np.uint16)))
    fit = fit_camera(replace(recording, exposures=tuple(shaken)))
    plain = fit_camera(recording)
    assert fit.segments.scatter > 0.05
    assert any("not on straight lines" in remark for remark in fit.remarks)
    assert fit.segments.lines[0].slope_se_dn > 3 * plain.segments.lines[0].slope_se_dn
    assert plain.segments.scatter == 0


def test_channels_that_differ_are_said() -> None:
    alike = fit_camera(record(camera((None, 1.7, 30.0), cfa=Cfa.RGGB), 1))
    assert alike.homogeneity_p > 1e-3
    made = record(camera((None, 1.7, 30.0), cfa=Cfa.RGGB), 1)
    other = record(camera((None, 2.1, 30.0), cfa=Cfa.RGGB), 2)
    mixed = []
    for a, b in zip(made.exposures, other.exposures, strict=True):
        stack = a.stack.copy()
        stack[:, 1::2, 1::2] = b.stack[:, 1::2, 1::2]
        mixed.append(replace(a, stack=stack))
    fit = fit_camera(replace(made, exposures=tuple(mixed)))
    assert fit.homogeneity_p < 1e-3
    assert any("channels' lines differ" in remark for remark in fit.remarks)
    blue = fit.channels["B"].lines[0]
    assert blue is not None
    assert abs(blue.slope_dn - 2.1) < Z_MAX * blue.slope_se_dn


def test_a_converter_that_clips_first_gives_a_lower_limit() -> None:
    fit = fit_camera(record(ONE, 6, levels=(*LEVELS_DN, 15900.0, 18000.0)))
    assert not fit.full_well_reached
    assert fit.saturation_dn is None
    assert fit.full_well_dn == 16383.0 - fit.black_dn
    (well,) = (q for q in fit.quantities if q.name == "full_well")
    assert "converter clips first" in well.means
    assert any("converter clips" in remark for remark in fit.remarks)
    (figure,) = (q for q in fit.channels["MONO"].figures if q.name == "mu_e.sat")
    assert "lower limit" in figure.means


def test_progress_counts_exposures() -> None:
    calls: list[tuple[int, int, str]] = []
    recording = record(ONE, 1)
    fit_camera(recording, threads=2, progress=lambda *call: calls.append(call))
    assert [done for done, _, _ in calls] == list(range(1, len(LEVELS_DN) + 1))
    assert {total for _, total, _ in calls} == {len(LEVELS_DN)}
    assert {name for _, _, name in calls} == {e.name for e in recording.exposures}


@pytest.mark.parametrize("kind", ["row", "column"])
def test_noise_of_lines_is_said(kind: str) -> None:
    effect = registry()[f"{kind}_noise"].model_validate({"sigma_dn": 6.0})
    made = ONE.model_copy(update={"effect": (effect,)})
    fit = fit_camera(record(made, 1))
    (remark,) = (r for r in fit.remarks if "noise of" in r and "is in the intercept" in r)
    assert f"{kind} noise of" in remark
    # 48 rows or 64 columns, 3 degrees of freedom each: known to 1 / sqrt(2 * 3 * 47).
    value = float(remark.split("noise of ")[1].split(" DN")[0])
    assert abs(value / 6 - 1) < Z_MAX / np.sqrt(2 * 3 * 47)
