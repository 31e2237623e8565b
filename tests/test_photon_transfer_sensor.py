"""Promise: sensor maps, black level and their errors rest on the frames of use and on nothing else.

Each test is one term of a formula that the fit's other tests would hardly miss.
"""

import numpy as np
import pytest

from analysis.photon_transfer import fit_camera
from analysis.photon_transfer.beyond import effects_of
from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.falloff import falloff
from analysis.photon_transfer.parts import Component, Noise, Pattern
from analysis.photon_transfer.patterns import FixedPatterns
from analysis.photon_transfer.pedestal import black_level
from dsis.effects import registry
from planted_camera import ONE, Z_MAX, camera, patterned, record

N, M = 48, 64
DARKS = (0.0, 0.0, 0.0)


def dark_of(level: float, error: float) -> DarkLine:
    return DarkLine(level, error, None, None, 0.0, 1)


def pattern_of(pixel: float = 0.0, row: float = 0.0, column: float = 0.0) -> Pattern:
    """Return a pattern of known variances, on N x M pixels."""
    parts = [Component(value, 0.0, 0.0, value) for value in (pixel, row, column, 0.0)]
    return Pattern(np.zeros((N, M)), 0.0, *parts, 0)


@pytest.mark.parametrize(("kind", "lines"), [("row", N), ("column", M)])
def test_a_bayer_sensors_lines_are_each_in_two_colours(kind: str, lines: int) -> None:
    """Oracle: black is the mean of all 2 N rows, whose variance is one row's over 2 N."""
    names = ("R", "Gr", "Gb", "B")
    darks = dict.fromkeys(names, dark_of(256.0, 1e-6))
    found = black_level(256.0, darks, dict.fromkeys(names, pattern_of(**{kind: 9.0})), [])
    assert found.se_dn == pytest.approx(np.sqrt(9.0 / (2 * lines)), rel=1e-6)
    pixels = black_level(256.0, darks, dict.fromkeys(names, pattern_of(pixel=9.0)), [])
    assert pixels.se_dn == pytest.approx(np.sqrt(9.0 / (4 * N * M)), rel=1e-3)


def test_channels_that_differ_more_than_chance_state_their_scatter() -> None:
    """Oracle: the standard error of a mean, from the scatter of what it is the mean of."""
    levels = np.array([10.0, 11.0, 10.0, 11.0])
    darks = {name: dark_of(v, 0.1) for name, v in zip("RGHB", levels, strict=True)}
    found = black_level(10.0, darks, {}, [])
    assert found.se_dn == pytest.approx(levels.std(ddof=1) / 2)
    assert found.noise_se_dn == pytest.approx(levels.std(ddof=1) / 2)


def test_a_pattern_that_cannot_be_measured_is_said_with_its_reason() -> None:
    narrow = fit_camera(record(ONE, 2, size=(2, 512)))
    assert any("(a channel has 2 rows or columns, 3 are needed)" in r for r in narrow.remarks)


def test_a_channel_with_a_pattern_counts_less() -> None:
    """Oracle: the inverse-variance mean, variances 0.01 + 0.03 and 0.01."""
    patterns = {"R": pattern_of(row=0.03 * N), "B": pattern_of()}
    darks = {"R": dark_of(10.0, 0.1), "B": dark_of(10.1, 0.1)}
    assert black_level(10.0, darks, patterns, []).level_dn == pytest.approx(10.0 / 5 + 10.1 * 4 / 5)


def test_what_was_left_out_of_the_fit_is_in_no_map() -> None:
    """Oracle: the same recording without the flat that clips."""
    levels = (*DARKS, 1000.0, 3000.0, 6000.0)
    plain = fit_camera(record(patterned(ONE), 3, levels=levels))
    clipped = fit_camera(record(patterned(ONE), 3, levels=(*levels, 16000.0)))
    assert any("flat" in remark and "Left out" in remark for remark in clipped.remarks)
    assert plain.maps is not None
    assert clipped.maps is not None
    np.testing.assert_allclose(clipped.maps.prnu_gain, plain.maps.prnu_gain, rtol=1e-6)
    np.testing.assert_allclose(clipped.maps.dsnu_dn, plain.maps.dsnu_dn, atol=1e-6)


def test_dark_current_is_no_light() -> None:
    """Counted as light - half as much again as there is - it would dilute the gains by a third."""
    kinds = (("prnu", {"sigma_percent": 2.0}), ("dark_current", {"dn_per_s": 500.0}))
    made = ONE.model_copy(
        update={"effect": tuple(registry()[k].model_validate(values) for k, values in kinds)}
    )
    levels = (*DARKS, *(3000.0,) * 6)
    fit = fit_camera(record(made, 4, levels=levels, time_per_dn=1e-3))
    (found,) = (effect for effect in fit.effects if effect.kind == "prnu")
    # The current's own error moves the light by less: it is known to 1 %.
    assert abs(found.value - 2.0) < Z_MAX * found.standard_error + 0.02


def test_the_noise_of_the_darks_is_no_gain() -> None:
    """Two darks under many flats: most of the noise in a gain is theirs."""
    noisy = camera((None, 0.01, 400.0))
    fit = fit_camera(record(noisy, 5, levels=(0.0, *(3000.0,) * 8)))
    assert "prnu" not in {effect.kind for effect in fit.effects}


@pytest.mark.parametrize("line", ["row", "column"])
def test_noise_of_lines_is_no_fixed_pattern_of_lines(line: str) -> None:
    noise = registry()[f"{line}_noise"].model_validate({"sigma_dn": 5.0})
    fit = fit_camera(record(ONE.model_copy(update={"effect": (noise,)}), 6))
    assert f"{line}_fpn" not in {effect.kind for effect in fit.effects}


def shaded(rng: np.random.Generator, f: float, sd: float) -> tuple[np.ndarray, Pattern]:
    y, x = np.arange(N) - (N - 1) / 2, np.arange(M) - (M - 1) / 2
    squared = (y[:, None] ** 2 + x**2) / ((N / 2) ** 2 + (M / 2) ** 2)
    light = (1 - f * squared) * (1 + sd * rng.normal(size=(N, 1)) + sd * rng.normal(size=(1, M)))
    light += 1e-3 * rng.normal(size=(N, M))
    gain = light / light.mean()
    return gain, Pattern.of(gain, Noise(1e-6, 0.0, 0.0, 1e6))


def test_shading_is_found_with_its_error() -> None:
    """Oracle: half of the light lost in the corners, in 100 sensors of rows that differ."""
    rng, f, sensors = np.random.default_rng(7), 0.5, 100
    z = []
    for _ in range(sensors):
        found = falloff([shaded(rng, f, 0.01)], [(slice(None), slice(None))], (N, M))
        assert found is not None
        z.append((found[0] - f) / found[1])
    assert abs(np.mean(z)) < Z_MAX / np.sqrt(sensors)
    # The error rests on squares of lines that differ by place as well: it may be too large.
    assert 0.6 < np.std(z, ddof=1) < 1 + Z_MAX / np.sqrt(2 * sensors)


def test_rows_that_two_colours_share_are_counted_once() -> None:
    """Oracle: the scatter of 200 sensors; counted twice, errors would be 0.71 of it."""
    rng, sensors = np.random.default_rng(8), 200
    values, errors = [], []
    for _ in range(sensors):
        rows = 3.0 * rng.normal(size=(2 * N, 1)) + rng.normal(size=(2 * N, 2 * M))
        planes = {f"{i}{j}": rows[i::2, j::2] for i in (0, 1) for j in (0, 1)}
        dark = {n: Pattern.of(plane, Noise(1e-3, 0, 0, 1e6)) for n, plane in planes.items()}
        effects = effects_of(None, FixedPatterns(dark, {}, None, None, 0), 1)
        (found,) = (effect for effect in effects if effect.kind == "row_fpn")
        values.append(found.value)
        errors.append(found.standard_error)
    stated = np.sqrt(np.mean(np.square(errors)))
    assert abs(stated / np.std(values, ddof=1) - 1) < Z_MAX / np.sqrt(2 * sensors)
    assert abs(np.mean(values) - 3.0) < Z_MAX * stated / np.sqrt(sensors)
