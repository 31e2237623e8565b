"""Promise: the errors of the measures are right, as simulation shows.

Null errors: over many exposures of the base model (value - null) / error has mean 0 and standard
deviation 1, from 4 frames on. Standard errors: with or without planted noise their rms is the
scatter of the values. `benchmarks/measures.py` does the same with more runs and frames.
"""

from collections.abc import Iterator

import numpy as np
import pytest
import scipy.stats

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import registry
from dsis.grid import PixelGrid
from dsis.measures import MEASURES, Estimate, measure, measure_channels

RUNS = 500
SYSTEMATIC = 0.06  # what an error may be wrong by, beyond what RUNS exposures can tell
ERRORS = 4.0  # of sampling; 350 numbers are looked at
ROWS, COLUMNS, LEVEL_DN = 48, 40, 800.4
BASE = Camera(
    name="base",
    cfa=Cfa.MONO,
    black_level=500.0,
    white_level=65535.0,
    bit_depth=16,
    noise=BaseNoise(segment=(Segment(slope=0.04, intercept=8.0),)),
)
WHITE_DN2 = 0.04 * LEVEL_DN + 8.0 + 1 / 12
TRUTH = {"level": LEVEL_DN, "pixel_variance": WHITE_DN2}
# Exact: its error is a chance of 1e-12.
NOT_SCATTERED = {"code_spacing"}


def exposures(camera: Camera, frames: int, runs: int) -> Iterator[np.ndarray]:
    grid = PixelGrid(ROWS, COLUMNS, camera.cfa)
    clean = np.full(grid.shape, LEVEL_DN, np.float32)
    for run in range(runs):
        temporal, sensor = Draw(run, (f"{frames}",)), Draw(run + 10**6)
        yield np.stack([camera.expose(clean, temporal, sensor, t, grid) for t in range(frames)])


def table(found: list[dict[str, Estimate]], name: str) -> np.ndarray:
    return np.array(
        [
            (m[name].value, m[name].standard_error, m[name].null_value, m[name].null_error)
            for m in found
        ]
    )


def tolerance(values: np.ndarray) -> float:
    """Return by how much a standard deviation of such values may miss, relative."""
    kurtosis = scipy.stats.kurtosis(values)
    return SYSTEMATIC + ERRORS * float(np.sqrt((kurtosis + 2) / (4 * len(values))))


def check_null(found: list[dict[str, Estimate]]) -> None:
    wrong = []
    for name in set(MEASURES) - NOT_SCATTERED:
        rows = table(found, name)
        null = rows[:, 2] if name not in TRUTH else TRUTH[name]
        z = (rows[:, 0] - null) / rows[:, 3]
        if abs(z.mean()) > ERRORS * z.std() / np.sqrt(len(z)):
            wrong.append(f"{name}: mean {z.mean():.3f}")
        if abs(z.std() - 1) > tolerance(z):
            wrong.append(f"{name}: sd {z.std():.3f}")
    assert not wrong


def check_errors(found: list[dict[str, Estimate]], truth: dict[str, float]) -> None:
    wrong = []
    for name in set(MEASURES) - NOT_SCATTERED:
        rows = table(found, name)
        difference = rows[:, 0] - truth.get(name, np.nan_to_num(rows[:, 2]))
        scatter = difference.std()
        if abs(difference.mean()) > ERRORS * scatter / np.sqrt(len(difference)):
            wrong.append(f"{name}: mean {difference.mean() / scatter:.3f} of its scatter")
        ratio = np.sqrt((rows[:, 1] ** 2).mean()) / scatter
        if abs(ratio - 1) > tolerance(difference):
            wrong.append(f"{name}: error / scatter {ratio:.3f}")
    assert not wrong


@pytest.mark.parametrize("frames", [4, 7, 20])
def test_errors_are_right_for_the_base_model(frames: int) -> None:
    found = [measure(stack) for stack in exposures(BASE, frames, RUNS)]
    check_null(found)
    check_errors(found, TRUTH)


def test_errors_are_right_for_each_channel_of_a_mosaic() -> None:
    camera = BASE.model_copy(update={"cfa": Cfa.GRBG})
    found = [
        channel
        for stack in exposures(camera, 6, RUNS // 4)
        for channel in measure_channels(stack, Cfa.GRBG).values()
    ]
    check_null(found)
    check_errors(found, TRUTH)


@pytest.mark.parametrize("frames", [5, 16])
def test_errors_are_right_under_row_noise_flicker_and_fixed_gain(frames: int) -> None:
    rng = np.random.default_rng(frames)
    effects = registry()
    camera = BASE.model_copy(
        update={
            "effect": (
                effects["row_noise"](sigma_dn=2.0),
                effects["column_noise"](sigma_dn=1.5),
                effects["prnu"](sigma_percent=0.5),
            )
        }
    )
    found = []
    for stack in exposures(camera, frames, RUNS):
        # Whole codes, so that the density of codes stays what the converter makes it.
        flicker = np.rint(3.0 * rng.normal(size=(frames, 1, 1)))
        found.append(measure(stack + flicker.astype(np.float32)))
    prnu = (0.005 * LEVEL_DN) ** 2
    truth = TRUTH | {
        "row_variance": 4.0,
        "column_variance": 2.25,
        "frame_variance": 9.0 + 1 / 12,
        "fixed_pixel_variance": prnu,
    }
    check_errors(found, truth)


def scatter_ratio(found: list[Estimate], truth: float) -> tuple[float, np.ndarray]:
    """Return stated error over scatter, and how the values miss the truth."""
    missed = np.array([one.value for one in found]) - truth
    stated = np.sqrt(np.mean([one.standard_error**2 for one in found]))
    return float(stated / missed.std()), missed


def test_the_error_of_skewness_knows_skewed_noise() -> None:
    """0.3 electrons: without the covariance with the variance the error is far too large."""
    rng = np.random.default_rng(8)
    electrons, gain = 0.3, 40
    found = [
        measure(gain * rng.poisson(electrons, (16, ROWS, COLUMNS)).astype(np.uint16))["skewness"]
        for _ in range(RUNS // 2)
    ]
    ratio, missed = scatter_ratio(found, electrons**-0.5)
    assert abs(missed.mean()) < ERRORS * missed.std() / np.sqrt(len(missed))
    assert abs(ratio - 1) < tolerance(missed)


def test_the_error_of_frame_correlation_knows_correlated_pixels() -> None:
    """A 3 x 3 mean: sum of rho^2 is (1 + 2 (4/9 + 1/9))^2 = 4.46, the error 2.1 times as large."""
    rng = np.random.default_rng(9)
    found = []
    for _ in range(RUNS // 2):
        white = rng.normal(0, 60, (12, ROWS + 2, COLUMNS + 2))
        lines = white[:, :-2] + white[:, 1:-1] + white[:, 2:]
        smooth = (lines[:, :, :-2] + lines[:, :, 1:-1] + lines[:, :, 2:]) / 9
        found.append(measure(np.rint(900 + smooth).astype(np.uint16))["frame_correlation"])
    ratio, missed = scatter_ratio(found, 0.0)
    assert abs(missed.mean()) < ERRORS * missed.std() / np.sqrt(len(missed))
    assert abs(ratio - 1) < tolerance(missed)


def test_few_frames_cannot_hide_a_drift() -> None:
    """An error taken from 4 frames alone would never let a frame variance stand out."""
    rng = np.random.default_rng(1)
    for stack in exposures(BASE, 4, 20):
        moved = stack + np.array([0, 30, -20, 10], np.float32)[:, None, None]
        found = measure(moved + rng.normal(size=(4, 1, 1)).astype(np.float32))["frame_variance"]
        assert found.departure > 5
        assert found.value / found.standard_error < 2
