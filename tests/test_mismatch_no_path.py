"""Second read-out paths that frames, samples far out, or a bend of another law only feign."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.nopath import no_path
from mismatch_recordings import camera, responding

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
LEVELS = (400.0, 1000.0, 1600.0, 2200.0, 2800.0, 3200.0, 3700.0)
FULL = 2900.0


def _state(left: dict[str, float], off: list[float]) -> Any:
    """Return a state whose variances are off by so many standard deviations with the path."""
    keys = tuple(Key("pixel_variance", "exposure", f"flat-{i}", "MONO", "") for i in range(4))
    return SimpleNamespace(
        mismatches=[SimpleNamespace(statistic=name, z=z) for name, z in left.items()],
        vector=SimpleNamespace(keys=keys, values=np.array(off) * 0.01),
        null=SimpleNamespace(mean=np.zeros(4), sd=np.full(4, 0.01), known=np.ones(4, bool)),
    )


WITHOUT = np.array([0.0, 0.0, -0.5, -0.5])  # off by 50 there without the path


@pytest.mark.parametrize(
    ("left", "off", "denied"),
    [
        ({}, [0.5, -1.0, 1.0, 0.0], False),
        ({"frame_noise": 27.0}, [0.5, -1.0, 1.0, 0.0], True),
        ({"frame_noise": 4.5}, [0.5, -1.0, 1.0, 0.0], False),
        ({"kurtosis": 64.0}, [0.5, -1.0, 1.0, 0.0], True),
        ({"kurtosis": -64.0}, [0.5, -1.0, 1.0, 0.0], False),
        ({"pixel_variance": 40.0}, [0.5, -1.0, -40.0, 0.0], True),
        ({"pixel_variance": 9.0}, [0.5, -1.0, 9.0, 0.0], False),  # of 59
    ],
)
def test_a_path_explains_variances_of_all_frames_and_samples(
    left: dict[str, float], off: list[float], denied: bool
) -> None:
    assert (no_path(_state(left, off), WITHOUT) is not None) == denied


def _soft(charge: Array) -> Array:
    """Return what is left of charge at a full well that is reached slowly."""
    return np.asarray(charge * (1 + (np.maximum(charge, 0) / FULL) ** 4) ** -0.25)


@pytest.mark.long
def test_a_second_path_that_goes_takes_the_mismatch_of_its_gain_along() -> None:
    """All levels bend toward a limit: a path, and its gain, are tried on the way."""
    words = frozenset({"dual_gain", "dual_gain_mismatch", "saturation"})
    recording = responding(3, LEVELS, _soft)
    found = find_mismatch(camera(segments=((0.5, 6.0, None),)), recording, seed=1, vocabulary=words)
    assert not {own.effect for own in found.omitted_physics} & {"dual_gain", "dual_gain_mismatch"}
