"""Cameras and shots for simulated recordings, and what their frames should hold."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import Effect
from dsis.recording import Recording
from dsis.simulate import Shot, dark, flat, simulate

Z_MAX = 5.0
ROWS, COLUMNS = 64, 96
BLACK, WHITE = 64.0, 4095.0
SLOPE, INTERCEPT = 0.5, 30.0
SITES = [(0, 0), (0, 1), (1, 0), (1, 1)]


def camera_of(cfa: Cfa = Cfa.RGGB, effects: Sequence[Effect] = (), black: float = BLACK) -> Camera:
    noise = BaseNoise(segment=(Segment(slope=SLOPE, intercept=INTERCEPT),))
    camera = Camera(
        name="test", cfa=cfa, black_level=black, white_level=WHITE, bit_depth=12, noise=noise
    )
    return camera.model_copy(update={"effect": tuple(effects)})


def stack(recording: Recording, name: str) -> np.ndarray:
    return np.stack(list(recording.frames(recording.exposure(name)))).astype(np.float64)


def site(frames: np.ndarray, place: tuple[int, int]) -> np.ndarray:
    return frames[..., place[0] :: 2, place[1] :: 2]


def variance_dn2(level: float) -> float:
    """Base model and rounding (Sheppard)."""
    return SLOPE * level + INTERCEPT + 1 / 12


SHOTS = (
    dark("dark", frames=6, exposure_time_s=0.01),
    flat("low", 50.0, frames=6, exposure_time_s=0.01, light=10.0),
    flat("colours", [[900, 400], [410, 200]], frames=6, exposure_time_s=0.02, light=20.0),
)


def recorded(
    folder: Path, shots: Sequence[Shot], cfa: Cfa = Cfa.RGGB, effects: Sequence[Effect] = ()
) -> Recording:
    """Return a recording of another camera: other black level, seed and noise."""
    camera = camera_of(cfa, effects, black=100.0)
    return simulate(camera, shots, ROWS, COLUMNS, folder, seed=77)
