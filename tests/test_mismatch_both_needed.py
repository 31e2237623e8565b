"""Charge that neighbours share, and a filter: both there, neither explains the other's."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
LEVELS = (100.0, 400.0, 1200.0, 2600.0)
SIGNALS = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": own for i, own in enumerate(LEVELS)}
SLOPE, READ, BLACK = 0.5, 20.0, 64.0
RIVALS = frozenset({"brighter_fatter", "crosstalk", "readout_memory", "spatial_filtering"})


def _mixed(image: Array, share: float) -> Array:
    """Return frames (frame, row, column) whose pixels have a share of their four neighbours."""
    padded = np.pad(image, ((0, 0), (1, 1), (1, 1)), mode="reflect")
    others = padded[:, :-2, 1:-1] + padded[:, 2:, 1:-1] + padded[:, 1:-1, :-2] + padded[:, 1:-1, 2:]
    return np.asarray(image + share * (others - 4 * image))


def _recorded(crosstalk: float, filtering: float, seed: int) -> InMemory:
    recording = recorded(camera(), seed, rows=64, columns=96, levels=LEVELS)
    assert recording.stacks is not None
    rng = np.random.default_rng(seed)
    for name, frames in recording.stacks.items():
        light = SIGNALS[name] + rng.normal(0, (SLOPE * SIGNALS[name]) ** 0.5, frames.shape)
        read = rng.normal(0, READ**0.5, frames.shape)
        codes = np.rint(BLACK + _mixed(_mixed(light, crosstalk) + read, filtering))
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return recording


@pytest.mark.parametrize(
    ("crosstalk", "filtering"),
    [pytest.param(0.042, 0.017, marks=pytest.mark.long), (0.028, 0.0), (0.0, 0.028)],
)
def test_both_are_named_with_their_numbers_and_one_alone_where_there_is_one(
    crosstalk: float, filtering: float
) -> None:
    found = find_mismatch(camera(), _recorded(crosstalk, filtering, 3), seed=1, vocabulary=RIVALS)
    true = {"crosstalk": crosstalk, "spatial_filtering": filtering}
    named = {own.effect: own.parameters["fraction"] for own in found.omitted_physics}
    assert named.keys() == {kind for kind, size in true.items() if size}
    assert not found.unexplained
    for kind, fitted in named.items():
        assert isinstance(fitted.value, float)
        assert abs(fitted.value - true[kind]) < 4 * fitted.standard_error < true[kind]
