"""A patch that stands out of a map: dust, a blot, a cluster of pixels that collect less."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.parts import parts
from analysis.mismatch.bank.patches import OUTLYING_PATCH, outlying
from mismatch_recordings import COLUMNS, FEW_LEVELS, FRAMES, ROWS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
ROW, COLUMN, RADIUS = 61, 37, 6.0


def _disc(shape: tuple[int, int]) -> NDArray[np.bool_]:
    y, x = np.ogrid[: shape[0], : shape[1]]
    return np.asarray(np.hypot(y - ROW, x - COLUMN) < RADIUS)


def _white(seed: int, shape: tuple[int, int] = (ROWS, COLUMNS)) -> Array:
    return np.random.default_rng(seed).normal(0, 1, shape)


def _score(image: Array) -> float:
    return parts(image, 1.0).numbers[OUTLYING_PATCH][0]


@pytest.mark.parametrize("shape", [(48, 64), (90, 117), (96, 128), (240, 320)])
def test_of_white_noise_it_is_a_normal_score(shape: tuple[int, int]) -> None:
    scores = np.array([_score(_white(seed, shape)) for seed in range(100)])
    assert abs(scores.mean()) < 0.5
    assert 0.7 < scores.std() < 1.3
    assert scores.max() < 4


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_disc_that_stands_out_is_seen_where_it_is(sign: int) -> None:
    """0.9 of a pixel's noise over 113 pixels: 9.6 standard errors for who knows the disc."""
    image = _white(3) + 0.9 * sign * _disc((ROWS, COLUMNS))
    assert _score(image) > 3.5
    own = parts(image, 1.0)
    found = outlying(own.pixels, own.square)
    assert found is not None
    _, top, left, size = found
    assert top <= ROW < top + size
    assert left <= COLUMN < left + size


def test_what_is_no_patch_does_not_stand_out() -> None:
    rng = np.random.default_rng(5)
    lines = _white(5) + rng.normal(0, 1, (ROWS, 1)) + rng.normal(0, 1, COLUMNS)
    lean = _white(6) + np.linspace(-2, 2, ROWS)[:, None] * np.linspace(-1, 1, COLUMNS)
    spot = _white(7)
    spot[ROW, COLUMN] += 300
    cells = rng.normal(0, 0.5, (ROWS // 4, COLUMNS // 4)).repeat(4, 0).repeat(4, 1)
    for image in (lines, lean, spot, _white(8) + cells):
        assert _score(image) < 4


@pytest.mark.long
@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_a_speck_of_dust_is_located_and_named_nothing(cfa: str) -> None:
    """Of the light 0.4 % are missing over 113 pixels; no effect of the vocabulary does that."""
    recording = recorded(camera(cfa=cfa), 5, levels=FEW_LEVELS)
    rng, shadow = np.random.default_rng(5), _disc((ROWS, COLUMNS))
    stacks = dict(recording.stacks or {})
    for i, level in enumerate(FEW_LEVELS):
        dim = stacks[f"flat-{i}"] - 0.004 * level * shadow
        dithered = np.floor(dim + rng.random((FRAMES, ROWS, COLUMNS)))
        stacks[f"flat-{i}"] = dithered.clip(0, 4095).astype(np.uint16)
    found = find_mismatch(camera(cfa=cfa), replace(recording, stacks=stacks), seed=1)
    assert not found.omitted_physics
    (patch,) = (m for m in found.unexplained if m.statistic == OUTLYING_PATCH)
    assert patch.where.rows is not None
    assert patch.where.columns is not None
    assert patch.where.rows[0] <= ROW <= patch.where.rows[1]
    assert patch.where.columns[0] <= COLUMN <= patch.where.columns[1]
