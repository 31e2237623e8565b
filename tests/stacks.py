"""Stacks of frames of Gaussian noise, rounded to codes, for the tests of measures."""

import numpy as np

from dsis.measures import Channel, Estimate, measure_exposure

Z_MAX = 5.0
SIGMA = 6.0


def noise(frames: int, rows: int, columns: int, seed: int = 0) -> np.ndarray:
    return SIGMA * np.random.default_rng(seed).normal(size=(frames, rows, columns))


def recorded(signal: np.ndarray | float) -> np.ndarray:
    return np.rint(np.asarray(signal)).astype(np.uint16)


def one(stack: np.ndarray, **options: object) -> Channel:
    return measure_exposure(stack, **options).channels["MONO"]


def near(found: Estimate, truth: float) -> bool:
    return abs(found.value - truth) < Z_MAX * found.standard_error
