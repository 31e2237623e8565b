"""Darks and scenes alone: scenes tell the slope of variance against signal."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from analysis.mismatch import find_mismatch
from analysis.mismatch.observe import observe
from analysis.mismatch.recalibrate import calibrate
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from mismatch_recordings import COLUMNS, ROWS, InMemory, camera, recorded

SLOPE, READ, BLACK = 0.6, 3.0, 64.0
Array = NDArray[np.float64]


def _picture(seed: int) -> Array:
    """Return smooth surfaces with edges, DN above black: (row, column)."""
    rng = np.random.default_rng(seed)
    smooth = gaussian_filter(rng.normal(size=(ROWS, COLUMNS)), 12.0)
    picture = 500 * np.exp(12 * smooth)
    picture[20:60, 30:80] *= 1.8
    return np.minimum(picture, 3000.0)


def _recorded(cfa: str, seed: int) -> InMemory:
    """Return numpy's own recording: shot noise in proportion to the picture, normal read noise."""
    blank = np.zeros((ROWS, COLUMNS), np.float32)
    made = recorded(camera(cfa=cfa), seed, levels=(), scene=blank)
    assert made.stacks is not None
    rng = np.random.default_rng(seed)
    one = made.exposures[-1]
    exposures = list(made.exposures[:-1])
    for number in range(3):
        name = f"scene-{number}"
        exposures.append(replace(one, name=name))
        made.stacks[name] = made.stacks["scene"]
    for exposure in exposures:
        frames = made.stacks[exposure.name]
        light = _picture(seed + int(exposure.name[-1])) if exposure.kind == "scene" else blank
        codes = light + rng.normal(0, 1, frames.shape) * np.sqrt(SLOPE * light + READ**2)
        made.stacks[exposure.name] = np.rint(BLACK + codes).clip(0, 4095).astype(np.uint16)
    del made.stacks["scene"]
    return replace(made, exposures=tuple(exposures))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("given", [0.5, 0.6, 0.66])
@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_scenes_tell_the_slope(cfa: str, given: float, seed: int) -> None:
    """Whatever the camera file says, and though each row is steadied by its own contrast."""
    recording = _recorded(cfa, seed)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    model = camera(cfa=cfa, segments=((given, READ**2, None),))
    (piece,) = calibrate(model, layout, seen, None, seed=1, jobs=1).fit.pieces
    assert abs(piece.slope - SLOPE) < 4 * piece.slope_error < 0.02
    assert abs(piece.intercept - READ**2) < 4 * piece.intercept_error


def test_a_wrong_slope_is_a_wrong_number_and_nothing_else() -> None:
    recording = _recorded("MONO", 5)
    found = find_mismatch(camera(segments=((0.64, READ**2, None),)), recording, seed=2)
    assert [error.parameter for error in found.parameter_errors] == ["noise.slope"]
    assert not found.omitted_physics
    assert not found.unexplained
