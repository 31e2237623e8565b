"""Gains that neighbours share: the effect, the numbers that see it, and that it is named."""

import sys
from pathlib import Path
from types import SimpleNamespace as Stub
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planter.light import blots

from analysis.mismatch import Finding, find_mismatch
from analysis.mismatch.bank.parts import parts
from analysis.mismatch.bank.patches import SIZES, names
from analysis.mismatch.bank.together import TOGETHER, together
from analysis.mismatch.candidates.fields import CANDIDATES, fields
from analysis.mismatch.clues import Clues
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect, Exposure
from dsis.grid import PixelGrid
from exposing import effect
from mismatch_recordings import TWO_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

SURE = 5.0  # standard errors
WORDS = frozenset(
    {"smooth_prnu", "prnu", "shading", "tap_mismatch", "crosstalk", "spatial_filtering",
     "line_settling", "row_prnu", "column_prnu"}
)  # fmt: skip


def _gains(one: Effect, grid: PixelGrid, seed: int = 0) -> np.ndarray:
    """Return what an effect adds to gains of 1."""
    image = np.ones(grid.shape, np.float32)
    exposure = Exposure(
        grid, 0, Draw(0), Draw(seed), image, camera().read_out, earlier=lambda _: image
    )
    return one.apply(image, exposure).astype(np.float64) - 1


def _field(length: float, shape: tuple[int, int], seed: int, percent: float = 10.0) -> np.ndarray:
    one = effect("smooth_prnu", sigma_percent=percent, length_pixels=length)
    return _gains(one, PixelGrid(*shape, Cfa.MONO), seed)


def _covariances(field: np.ndarray, lags: list[tuple[int, int]]) -> list[float]:
    n, m = field.shape
    return [float((field[: n - y, : m - x] * field[y:, x:]).mean()) for y, x in lags]


LAGS = [(0, 0), (0, 1), (1, 0), (2, 2), (0, 5), (6, 3), (12, 0)]


@pytest.mark.parametrize("length", [1.5, 4.0, 9.0])
def test_covariances_are_the_closed_form(length: float) -> None:
    """Less the mean over the sensor, whose variance is the mean covariance of its pixels."""
    shape = (60, 90)
    found = np.array([_covariances(_field(length, shape, k), LAGS) for k in range(60)])
    y, x = (np.arange(1 - size, size) for size in shape)
    pairs = np.outer(shape[0] - np.abs(y), shape[1] - np.abs(x)) / (shape[0] * shape[1]) ** 2
    of_mean = float((pairs * np.exp(-np.hypot(y[:, None], x) / length)).sum())
    expected = np.exp(-np.array([np.hypot(*lag) for lag in LAGS]) / length) - of_mean
    errors = found.std(0, ddof=1) / np.sqrt(len(found))
    # In the middle, which pairs of large lags have more of, the mean has more of the field.
    assert np.all(np.abs(found.mean(0) - 0.01 * expected) < SURE * errors + 2e-4)


@pytest.mark.parametrize("length", [2.0, 6.0])
def test_the_planters_blots_are_the_same_physics(length: float) -> None:
    found = np.array([_covariances(blots(k, (60, 90), length), LAGS) for k in range(40)])
    expected = np.exp(-np.array([np.hypot(*lag) for lag in LAGS]) / length)
    errors = found.std(0, ddof=1) / np.sqrt(len(found))
    assert np.all(np.abs(found.mean(0) - expected) < SURE * errors + 0.02)


@settings(max_examples=20, deadline=None)
@given(
    rows=st.integers(8, 60),
    columns=st.integers(8, 60),
    first=st.tuples(st.integers(0, 6), st.integers(0, 6)),
    length=st.floats(0.3, 200.0),
    cfa=st.sampled_from([Cfa.MONO, Cfa.RGGB, None]),
    seed=st.integers(0, 2**31),
)
def test_a_crop_has_the_bytes_of_the_whole(
    rows: int, columns: int, first: tuple[int, int], length: float, cfa: Cfa | None, seed: int
) -> None:
    one = effect("smooth_prnu", sigma_percent=2.0, length_pixels=length)
    whole = _gains(one, PixelGrid(rows, columns, cfa), seed)
    y, x = first
    part = PixelGrid(rows - y, columns - x, cfa, y, x, rows, columns)
    np.testing.assert_array_equal(_gains(one, part, seed), whole[y:, x:])
    np.testing.assert_array_equal(_gains(one, PixelGrid(rows, columns, cfa), seed), whole)
    assert abs(whole.mean()) < 1e-6
    assert np.isfinite(whole).all()


def test_a_field_changes_smoothly_with_its_length() -> None:
    """So that a fit on counted draws sees what the length does, and no new draw."""
    one, other, apart = (_field(length, (96, 128), 3) for length in (7.9, 8.1, 12.0))
    assert (one - other).std() < 0.05 * one.std()
    assert (one - apart).std() < 0.5 * one.std()


def test_numbers_of_patches_are_normal_where_nothing_is_shared() -> None:
    rng = np.random.default_rng(1)
    found = [parts(rng.normal(0, 2.0, (96, 128)), 2.0).numbers for _ in range(200)]
    for name in names():
        values, errors = np.array([one[name] for one in found]).T
        bias = 2 * errors[0] ** 2  # of a cube root: Wilson and Hilferty's 2 / (9 dof)
        assert abs(values.mean() - 1) < SURE * errors[0] / np.sqrt(200) + bias
        assert values.std() == pytest.approx(errors[0], rel=SURE / np.sqrt(400))


def test_too_few_patches_have_no_number() -> None:
    found = parts(np.random.default_rng(2).normal(0, 1, (48, 64)), 1.0).numbers
    known = [np.isfinite(found[name][0]) for name in names()]
    assert known == [size < 16 for size in SIZES]


def test_colours_show_together_what_each_hides() -> None:
    rng = np.random.default_rng(3)
    field = 8 * _field(8.0, (192, 256), 4)
    sites = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}
    own = {
        name: parts(rng.normal(0, 8.0, (96, 128)) + field[y::2, x::2], 8.0)
        for name, (y, x) in sites.items()
    }
    joint = together(own, dict.fromkeys(sites, 1.0), sites)
    name = f"fixed_patch_variance of {SIZES[0]} pixels"

    def z(number: tuple[float, float]) -> float:
        return (number[0] - 1) / number[1]

    summed = sum(z(one.numbers[name]) for one in own.values()) / 2
    assert z(joint[f"{name}, {TOGETHER}"]) > 1.3 * summed > 2


def _clues(gain: np.ndarray, noise: float, *effects: Effect, top: float = 1000.0) -> Any:
    rows, columns = gain.shape
    regressors = Stub(scales={"gain": top})
    layout: Any = Stub(
        rows=rows,
        columns=columns,
        cfa=Cfa.MONO,
        sites={"MONO": (0, 0)},
        regressors=lambda _channel: regressors,
    )
    seen: Any = Stub(images={("MONO", "gain"): (gain, noise)})
    nothing: Any = None
    return Clues(layout, seen, nothing, nothing, nothing, camera(*effects))


@pytest.mark.parametrize("length", [2.0, 5.0, 10.0])
def test_proposals_start_from_the_spectrum_of_the_gain(length: float) -> None:
    """White gains, noise, uneven light and pixels far out are set apart."""
    rng = np.random.default_rng(5)
    shape = (192, 256)
    tilt = np.linspace(-2, 2, shape[1])
    white = rng.normal(0, 0.5, shape)
    white[rng.integers(0, 192, 20), rng.integers(0, 256, 20)] += 40
    gain = 10 * (_field(length, shape, 6, 0.4) * 100 + tilt + white)  # per cent of 1000 DN
    (found,) = CANDIDATES[0].propose(_clues(gain, 2.0))
    values = found.effect.model_dump()
    assert found.free == ("sigma_percent", "length_pixels")
    assert values["sigma_percent"] == pytest.approx(0.4, rel=0.25)
    assert values["length_pixels"] == pytest.approx(length, rel=0.5)
    known = effect("smooth_prnu", sigma_percent=0.4, length_pixels=length)
    for rest in CANDIDATES[0].propose(_clues(gain, 2.0, known)):
        assert rest.effect.model_dump()["sigma_percent"] < 0.2


def test_of_a_weak_field_several_lengths_are_proposed() -> None:
    """Its long waves are few: noise of pixels may then look like the shortest of all."""
    rng = np.random.default_rng(8)
    shape = (96, 128)
    near = 0
    for k in range(10):
        gain = 10 * (_field(4.0, shape, k, 0.1) * 100 + rng.normal(0, 0.4, shape))
        lengths = [
            one.effect.model_dump()["length_pixels"]
            for one in CANDIDATES[0].propose(_clues(gain, 1.0))
        ]
        assert len(lengths) <= 4
        near += any(4.0 / 2.5 < one < 4.0 * 2.5 for one in lengths)
    assert near >= 9


def test_without_a_map_of_gains_nothing_is_proposed() -> None:
    clues = _clues(np.zeros((96, 128)), 1.0)
    clues.seen.images.clear()
    assert not fields(clues)
    assert not CANDIDATES[0].propose(clues)


@pytest.mark.parametrize("shape", [(4, 4), (5, 40), (64, 5)])
def test_few_rows_or_columns_hold_no_frequency_of_a_field(shape: tuple[int, int]) -> None:
    clues = _clues(np.random.default_rng(3).normal(size=shape), 1.0)
    assert not fields(clues)
    assert not CANDIDATES[0].propose(clues)


@pytest.mark.parametrize(("length", "sane"), [(10.0, True), (40.0, False), (0.5, False)])
def test_a_field_as_long_as_the_sensor_is_uneven_light(length: float, sane: bool) -> None:
    layout: Any = Stub(rows=96, columns=128)
    one = effect("smooth_prnu", sigma_percent=1.0, length_pixels=length)
    assert CANDIDATES[0].sane(layout, one) == sane


def _found(true: Camera, seed: int, words: frozenset[str] = WORDS) -> Finding:
    recording = recorded(true, seed, rows=64, columns=96, levels=TWO_LEVELS)
    return find_mismatch(camera(cfa=true.cfa), recording, seed=1, vocabulary=words)


@pytest.mark.long
def test_in_a_mosaic_it_is_named_with_its_numbers() -> None:
    own = {"sigma_percent": 0.16, "length_pixels": 3.0}
    found = _found(camera(effect("smooth_prnu", **own), cfa="RGGB"), 9)
    (named,) = found.omitted_physics
    assert named.effect == "smooth_prnu"
    assert not found.unexplained
    for name, value in own.items():
        fitted = named.parameters[name]
        assert abs(fitted.value - value) < 4 * fitted.standard_error  # type: ignore[operator] # one number


def test_without_its_word_nothing_else_is_named() -> None:
    true = camera(effect("smooth_prnu", sigma_percent=0.12, length_pixels=4.0))
    found = _found(true, 9, WORDS - {"smooth_prnu"})
    assert not {one.effect for one in found.omitted_physics} - {"prnu"}
    assert any(m.statistic == "fixed_patch_variance" for m in found.unexplained)
