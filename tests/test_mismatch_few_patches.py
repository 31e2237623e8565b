"""Shadows of dust are no field of gains, and no gains of columns."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from analysis.mismatch.fewpatches import of_few_patches, unlike_drawn
from analysis.mismatch.wholelines import of_parts
from dsis.cfa import Cfa
from dsis.effects import registry

ROWS, COLUMNS = 120, 160
NOISE = 4.0  # DN, at 1000 DN: 0.4 %
FIELD = registry()["smooth_prnu"](sigma_percent=0.2, length_pixels=6.0)
Array = NDArray[np.float64]


def _state(gain: Array, cfa: Cfa, seed: int, noise: float = NOISE) -> Any:
    """Return a state with a map of the gain, DN at 1000."""
    image = 1000 * gain + np.random.default_rng(seed).normal(0, noise, gain.shape)
    sites = {"MONO": (0, 0)} if cfa is Cfa.MONO else {
        "R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)
    }  # fmt: skip
    step = 1 + (len(sites) > 1)
    images = {(c, "gain"): (image[y::step, x::step], noise) for c, (y, x) in sites.items()}
    clues = SimpleNamespace(
        layout=SimpleNamespace(sites=sites, rows=ROWS, columns=COLUMNS),
        image=lambda name: {c: one for (c, kind), one in images.items() if kind == name},
        scale=lambda *_: 1000.0,
    )
    return SimpleNamespace(
        clues=lambda: clues, setting=SimpleNamespace(seen=SimpleNamespace(images=images))
    )


def _dust(seed: int) -> Array:
    rng, found = np.random.default_rng(seed), np.zeros((ROWS, COLUMNS))
    y, x = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    for _ in range(7):
        apart = np.hypot(y - rng.integers(ROWS), x - rng.integers(COLUMNS))
        found -= 0.012 / (1 + np.exp((apart - rng.uniform(4, 8)) / 1.5))
    return found


def _faint(seed: int) -> Array:
    """Return soft shadows far below the noise of a pixel, on a seventh of the sensor."""
    rng, found = np.random.default_rng(seed), np.zeros((ROWS, COLUMNS))
    y, x = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    for _ in range(8):
        apart = np.hypot(y - rng.integers(ROWS), x - rng.integers(COLUMNS))
        found -= rng.uniform(1e-3, 2e-3) / (1 + np.exp((apart - rng.uniform(4, 12)) / 1.5))
    return found


def _smooth(seed: int, length: float) -> Array:
    """Return a normal field; blurred noise, no field of the effect's own law."""
    white = np.random.default_rng(seed).normal(size=(ROWS, COLUMNS))
    field = ndimage.gaussian_filter(white, length, mode="wrap")
    return np.asarray(0.004 * field / field.std())


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_dust_is_no_field(cfa: Cfa, seed: int) -> None:
    said = of_few_patches(_state(_dust(seed), cfa, seed), FIELD)
    assert said is not None
    assert said.share < 0.5
    assert "few patches" in said.why


@pytest.mark.parametrize("sign", [-1, 1])
def test_faint_patches_are_no_field_though_noise_hides_the_sensor_around(sign: int) -> None:
    field = registry()["smooth_prnu"](sigma_percent=0.035, length_pixels=8.0)
    for seed in range(4):
        said = of_few_patches(_state(sign * _faint(seed), Cfa.RGGB, seed, 1.0), field)
        assert said is not None
        assert said.share < 0.5


@pytest.mark.parametrize("noise", [0.2, 1.0, 2.0])
def test_a_faint_normal_field_is_believed(noise: float) -> None:
    field = registry()["smooth_prnu"](sigma_percent=0.06, length_pixels=8.0)
    for seed in range(8):
        state = _state(0.15 * _smooth(seed, 4.0), Cfa.RGGB, seed, noise)
        assert of_few_patches(state, field) is None


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("length", [1.0, 3.0, 8.0])
def test_a_normal_field_is_believed_whatever_its_spectrum(cfa: Cfa, length: float) -> None:
    for seed in range(4):
        assert of_few_patches(_state(_smooth(seed, length), cfa, seed), FIELD) is None


def test_other_effects_are_not_asked() -> None:
    state = _state(_dust(1), Cfa.MONO, 1)
    assert of_few_patches(state, registry()["prnu"](sigma_percent=0.4)) is None


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("kind", ["column_prnu", "row_prnu"])
def test_columns_whose_parts_differ_do_not_differ(kind: str, cfa: Cfa) -> None:
    for seed in (1, 2, 3):
        said = of_parts(_state(3 * _dust(seed), cfa, seed), kind)
        assert said is not None
        assert said.share < 0.5


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("spread", [5e-4, 2e-3])
def test_whole_columns_that_differ_are_believed(cfa: Cfa, spread: float) -> None:
    for seed in range(10):
        lines = np.random.default_rng(seed).normal(0, spread, COLUMNS)
        gain = np.tile(lines, (ROWS, 1)) + 0.3 * _dust(seed)
        assert of_parts(_state(gain, cfa, seed), "column_prnu") is None


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_columns_that_differ_as_their_neighbours_do_are_none_by_themselves(cfa: Cfa) -> None:
    for seed in (1, 2, 3):
        lines = ndimage.gaussian_filter1d(np.random.default_rng(seed).normal(size=COLUMNS), 3.0)
        said = of_parts(_state(np.tile(0.005 * lines, (ROWS, 1)), cfa, seed), "column_prnu")
        assert said is not None
        assert "neighbours" in said.why


@pytest.mark.parametrize("rows", [48, 84])
def test_a_blot_on_the_middle_of_few_rows_is_no_columns(rows: int) -> None:
    """Planes of 24 and 42 rows, both halves of which see it; columns of as few are believed."""
    top = (ROWS - rows) // 2
    for seed in range(4):
        rng = np.random.default_rng(seed)
        apart = np.hypot(np.arange(ROWS)[:, None] - ROWS / 2, np.arange(COLUMNS) - 70)
        for gain, told in (
            (-0.1 * np.exp(-((apart / 5) ** 2)), True),
            (np.tile(rng.normal(0, 1e-3, COLUMNS), (ROWS, 1)), False),
        ):
            state = _state(gain, Cfa.RGGB, seed)
            images = state.setting.seen.images
            for key, (image, noise) in list(images.items()):
                images[key] = (image[top // 2 : top // 2 + rows // 2], noise)
            assert (of_parts(state, "column_prnu") is not None) == told


def _offsets(pattern: Array, seed: int, *noises: float) -> Any:
    """Return a state with maps of offsets of these noises: beside gains, and alone."""
    names = ("offset", "offset alone")
    rng, images = np.random.default_rng(seed), {}
    for name, noise in zip(names, noises, strict=True):
        images["MONO", name] = (pattern + rng.normal(0, noise, pattern.shape), noise)
    return SimpleNamespace(setting=SimpleNamespace(seen=SimpleNamespace(images=images)))


def _trails(seed: int) -> Array:
    """Return trails below few pixels, which decay over some rows."""
    rng, found = np.random.default_rng(seed), np.zeros((ROWS, COLUMNS))
    for _ in range(8):
        y, x = rng.integers(ROWS - 20), rng.integers(COLUMNS)
        found[y:, x] += rng.uniform(3, 6) * np.exp(-np.arange(ROWS - y) / 6)
    return found


def test_trails_are_no_columns_though_a_map_is_too_noisy_to_show_them() -> None:
    for seed in range(4):
        said = of_parts(_offsets(_trails(seed), seed, 2.0, 0.4), "column_fpn")
        assert said is not None
        assert "few parts" in said.why
        assert of_parts(_offsets(_trails(seed), seed, 0.4, 0.4), "column_fpn") is not None


def test_columns_that_one_map_shows_whole_are_believed() -> None:
    for seed in range(10):
        lines = np.tile(np.random.default_rng(seed).normal(0, 0.1, COLUMNS), (ROWS, 1))
        assert of_parts(_offsets(lines, seed, 2.0, 0.4), "column_fpn") is None
        state = _offsets(lines, seed, 0.6, 0.4)
        image, noise = state.setting.seen.images["MONO", "offset alone"]
        state.setting.seen.images["MONO", "offset alone"] = (image + _trails(seed), noise)
        assert of_parts(state, "column_fpn") is None


@pytest.mark.parametrize(
    ("shown", "draws", "denied"), [(0.9, 0, False), (0.7, 8, False), (0.3, 64, True)]
)
def test_fields_are_drawn_until_it_is_clear(shown: float, draws: int, denied: bool) -> None:
    image = np.random.default_rng(0).normal(size=(24, 32))
    shares = iter([shown, *np.random.default_rng(1).normal(1.0, 0.05, draws)])
    denial = unlike_drawn(image, FIELD, lambda *_: float(next(shares)), "few")
    assert (denial is not None) is denied
    assert next(shares, None) is None  # as many as that were asked for
