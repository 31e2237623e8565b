"""Promise: the fixed pattern is told apart by its parts, and as well as temporal noise allows.

The recordings are made in memory by `Camera.expose` of cameras whose patterns are known fields.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from analysis.photon_transfer import fit_camera
from analysis.photon_transfer.parts import Noise, Pattern
from analysis.photon_transfer.patterns import LEAST_GAIN
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import registry
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.simulate.maps import with_maps
from planted_camera import ONE, Z_MAX, misses, patterned, record

N, M = 64, 96


def with_effects(made: Camera, **effects: dict[str, object]) -> Camera:
    links = tuple(registry()[kind].model_validate(values) for kind, values in effects.items())
    return made.model_copy(update={"effect": links})


def pattern_of(rng: np.random.Generator, sd: dict[str, float]) -> np.ndarray:
    """Return a pattern (row, column) of pixels, rows, columns and a smooth hill."""
    y, x = np.linspace(-1, 1, N)[:, None], np.linspace(-1, 1, M)
    return (
        sd["pixel"] * rng.normal(size=(N, M))
        + sd["row"] * rng.normal(size=(N, 1))
        + sd["column"] * rng.normal(size=(1, M))
        + sd["smooth"] * (x * y + x**2)
    )


@pytest.mark.parametrize("sd", [
    {"pixel": 1.0, "row": 0.0, "column": 0.0, "smooth": 0.0},
    {"pixel": 0.5, "row": 1.0, "column": 0.3, "smooth": 2.0},
    {"pixel": 0.0, "row": 0.2, "column": 0.0, "smooth": 0.5},
])  # fmt: skip
def test_the_estimate_misses_the_pattern_by_what_it_says(sd: dict[str, float]) -> None:
    """Oracle: the pattern itself; averaged over 20 sensors, whose scatter gives the error."""
    rng = np.random.default_rng(1)
    ratios, plain = [], []
    for _ in range(20):
        truth = pattern_of(rng, sd)
        found = Pattern.of(truth + rng.normal(size=truth.shape), Noise(1.0, 0.0, 0.0, 1e6))
        error = float(((found.estimate - truth + truth.mean()) ** 2).mean())
        ratios.append(error - found.left)
        plain.append(error)
    z = np.mean(ratios) / (np.std(ratios, ddof=1) / np.sqrt(20))
    assert abs(z) < Z_MAX
    assert np.mean(plain) < 0.9  # unshrunk it would be the noise: 1


def test_the_parts_have_the_variances_that_were_planted() -> None:
    """Oracle: 100 sensors; temporal noise of rows is known and taken off."""
    rng = np.random.default_rng(2)
    sd = {"pixel": 0.7, "row": 0.4, "column": 0.2, "smooth": 0.0}
    found = []
    for _ in range(100):
        noise = rng.normal(size=(N, M)) + 0.3 * rng.normal(size=(N, 1))
        found.append(Pattern.of(pattern_of(rng, sd) + noise, Noise(1.0, 0.09, 0.0, 1e6)))
    for kind in ("pixel", "row", "column"):
        parts = [getattr(pattern, kind) for pattern in found]
        values = np.array([part.variance for part in parts])
        stated = np.sqrt(np.mean([part.standard_error**2 for part in parts]))
        assert abs(values.mean() - sd[kind] ** 2) < Z_MAX * values.std() / 10, kind
        # The sd of 100 values is known to 7 %.
        assert abs(stated / values.std(ddof=1) - 1) < Z_MAX / np.sqrt(200), kind
        assert np.mean([part.p < 0.001 for part in parts]) > 0.9, kind
    expected = 0.49 / (N * M) + 0.16 / N + 0.04 / M
    means = np.mean([pattern.mean_variance for pattern in found])
    # Of rows mostly: 63 degrees of freedom each, known to 1.8 % in 100 sensors.
    assert abs(means / expected - 1) < Z_MAX * np.sqrt(2 / 63 / 100)


def test_the_error_of_a_small_planes_pixels() -> None:
    """Oracle: 400 sensors of 12 x 16 pixels, of whose degrees of freedom a seventh are lost."""
    rng = np.random.default_rng(5)
    parts = [Pattern.of(rng.normal(size=(12, 16)), Noise(0.2, 0, 0, 1e6)).pixel for _ in range(400)]
    scatter = np.std([part.variance for part in parts], ddof=1)
    stated = np.sqrt(np.mean([part.standard_error**2 for part in parts]))
    # The scatter is known to 1 / sqrt(800), 3.5 %; without the lost ones the error is 20 % less.
    assert abs(stated / scatter - 1) < 4 / np.sqrt(800)


def test_nothing_is_seen_in_noise() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        found = Pattern.of(rng.normal(size=(N, M)), Noise(1.0, 0.0, 0.0, 20.0))
        assert min(p.p for p in (found.pixel, found.row, found.column, found.smooth)) > 1e-4
        assert found.outliers == 0
        assert found.estimate.std() < 0.3  # some of the noise is taken for pattern


def test_a_defect_stays_as_it_was_measured() -> None:
    plane = np.random.default_rng(4).normal(size=(N, M))
    plane[10, 20] = 40.0
    found = Pattern.of(plane, Noise(0.9, 0.0, 0.0, 1e6))
    assert found.outliers == 1
    assert found.estimate[10, 20] == pytest.approx(40.0 - plane.mean())
    assert abs(found.pixel.variance - 0.1) < Z_MAX * found.pixel.standard_error
    with pytest.raises(ValueError, match="2 x 96 pixels are too few"):
        Pattern.of(plane[:2], Noise(1.0, 0.0, 0.0, 8.0))


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_the_model_has_the_pattern_by_its_parts(cfa: Cfa) -> None:
    planted = with_effects(
        ONE.model_copy(update={"cfa": cfa}),
        dsnu={"sigma_dn": 5.0},
        row_fpn={"sigma_dn": 2.0},
        column_fpn={"sigma_dn": 3.0},
        prnu={"sigma_percent": 1.0},
        shading={"falloff_percent": 6.0},
    )
    fit = fit_camera(record(planted, 1, size=(96, 128), frames=8))
    assert {effect.kind for effect in fit.effects} == {effect.kind for effect in planted.effect}
    for name, z in misses(fit, planted).items():
        assert abs(z) < Z_MAX, name


def test_a_tilt_is_no_shading_and_is_said() -> None:
    recording = record(ONE, 2, size=(64, 64), levels=(0.0, 0.0, 500.0, 3000.0, 6000.0))
    tilt = 1 + 0.03 * np.linspace(-1, 1, 64)
    tilted = tuple(
        e if e.kind == "dark" else replace(
            e, stack=(256 + (e.stack.astype(float) - 256) * tilt).round().astype(np.uint16)
        )
        for e in recording.exposures
    )  # fmt: skip
    fit = fit_camera(replace(recording, exposures=tilted))
    assert "shading" not in {effect.kind for effect in fit.effects}
    (remark,) = (r for r in fit.remarks if "gain differs by place" in r)
    value = float(remark.split("smoothly, ")[1].split(" %")[0])
    assert value == pytest.approx(3 / np.sqrt(3), rel=0.05)  # rms of a ramp; two digits are shown


@pytest.mark.parametrize("kind", ["dsnu", "prnu"])
def test_the_same_sensor_again(kind: str) -> None:
    """Oracle: the fields that the first sensor was made of, and Wiener's formula."""
    level, frames, later = (0.0 if kind == "dsnu" else 3000.0), 8, 64
    values: dict[str, object] = {"sigma_dn": 2.0} if kind == "dsnu" else {"sigma_percent": 1.0}
    made = with_effects(ONE, **{kind: values})
    grid = PixelGrid(N, M, Cfa.MONO)
    first = fit_camera(record(made, 5, size=(N, M), levels=(0.0, 0.0, 3000.0, 3000.0)))
    assert first.maps is not None
    again = with_maps(first.camera, first.maps, grid)
    recording = record(again, 6, size=(N, M), levels=(level,), frames=later, sensor_seed=123)
    mean = recording.exposures[0].stack.mean(0)
    signal, truth = (2.0, Draw(99).normal(kind, grid)) if kind == "dsnu" else (
        30.0, Draw(99).normal(kind, grid))  # fmt: skip
    temporal = 1.7 * level + 30.0 + 1 / 12
    # What the first maps held: the mean of 8 darks, or of 8 flats less that of the darks.
    noise = temporal / frames + (0.0 if kind == "dsnu" else (30.0 + 1 / 12) / frames)
    factor = signal**2 / (signal**2 + noise)
    variance = signal**2 + temporal / later
    expected = factor * signal / np.sqrt(variance)
    found = float(np.corrcoef(mean.ravel(), truth.ravel())[0, 1])
    n = grid.rows * grid.columns
    assert abs(np.arctanh(found) - np.arctanh(expected)) < Z_MAX / np.sqrt(n - 3)
    # The fitted variance is in the new sensor's, with its error.
    error = np.sqrt(2 / n * ((signal**2 + noise) ** 2 + variance**2))
    assert abs(mean.var(ddof=1) - variance) < Z_MAX * error


def test_a_dead_pixel_is_said() -> None:
    recording = record(ONE, 3, levels=(0.0, 0.0, 500.0, 3000.0))
    dead = []
    for exposure in recording.exposures:
        stack = exposure.stack.copy()
        stack[:, 5, 6] = recording.exposures[0].stack[0, 5, 6]
        stack[0, 5, 6] += 1
        dead.append(replace(exposure, stack=stack))
    fit = fit_camera(replace(recording, exposures=tuple(dead)))
    said = "\n".join(fit.remarks)
    assert "1 pixel(s) have less than 0.001 of the mean gain" in said
    assert "1 pixel(s) are more than 6 standard deviations off in gain" in said
    assert fit.maps is not None
    assert fit.maps.prnu_gain[5, 6] == np.float32(LEAST_GAIN)
    alive = fit_camera(recording)
    assert not any("pixel(s)" in remark for remark in alive.remarks)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_intervals_cover_the_camera_of_a_sensor_with_a_pattern(cfa: Cfa) -> None:
    """Reduced: 40 sensors; `benchmarks/photon_transfer.py` does 500. z is 4.1 binomial errors."""
    planted = patterned(ONE).model_copy(update={"cfa": cfa})
    inside: dict[str, int] = {}
    for seed in range(40):
        levels = (0.0, 0.0, 200.0, 1100.0, 6000.0, 12000.0)
        recording = record(planted, seed, size=(32, 48), sensor_seed=1000 + seed, levels=levels)
        for name, z in misses(fit_camera(recording, 1), planted).items():
            inside[name] = inside.get(name, 0) + (abs(z) < 1.96)
    assert set(inside) == {"black", "slope 0", "intercept 0", "dsnu", "prnu", "column_fpn"}
    for name, count in inside.items():
        assert stats.binom.cdf(count, 40, 0.95) > 2e-5, f"{name}: {count} of 40"


def test_the_error_of_this_sensors_black_level_leaves_its_pattern_out() -> None:
    """Slopes and intercepts rest on it: flats hold the same pattern as darks."""
    fit = fit_camera(record(patterned(ONE), 1, size=(32, 48)))
    plain = fit_camera(record(ONE, 1, size=(32, 48)))
    assert fit.black_noise_se_dn == pytest.approx(plain.black_noise_se_dn, rel=0.1)
    assert fit.black_se_dn is not None
    # Columns of 3 DN: 48 of them.
    assert fit.black_se_dn > 0.7 * 3 / np.sqrt(48)
    assert plain.black_se_dn is not None
    assert plain.black_se_dn < 1.5 * (plain.black_noise_se_dn or 0)
    assert fit.segments.lines[0].intercept_se_dn2 == pytest.approx(
        plain.segments.lines[0].intercept_se_dn2, rel=0.3
    )


def test_flats_of_which_most_pixels_are_dark_are_no_camera() -> None:
    recording = record(ONE, 1, levels=(0.0, 0.0, 500.0, 1100.0, 3000.0), size=(N, M))
    lit = np.random.default_rng(1).random((N, M)) < 0.3
    dark = recording.exposures[0].stack
    masked = tuple(
        e if e.kind == "dark" else replace(e, stack=np.where(lit, e.stack, dark + e.stack % 3))
        for e in recording.exposures
    )
    fit = fit_camera(replace(recording, exposures=masked))
    with pytest.raises(InputError, match=r"prnu\.sigma_percent: was measured as 1\d\d"):
        _ = fit.camera
