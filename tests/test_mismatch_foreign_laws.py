"""Physics that follows a law of its own is still the physics that it is."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]


def _small(true: Camera, seed: int, levels: tuple[float, ...] = FEW_LEVELS) -> InMemory:
    return recorded(true, seed, rows=64, columns=96, levels=levels)


def _found(recording: InMemory, model: Any) -> set[str]:
    found = find_mismatch(model, recording, seed=1)
    return {own.effect for own in found.omitted_physics}


def _warmed(recording: InMemory, dn_per_s: Array, rng: np.random.Generator) -> InMemory:
    """Return a recording of a sensor with a dark current, and the shot noise of that."""
    assert recording.stacks is not None
    stacks = {}
    for exposure in recording.exposures:
        frames = recording.stacks[exposure.name].astype(np.float64)
        charge = dn_per_s * exposure.exposure_time_s
        frames += charge + np.sqrt(0.5 * charge) * rng.standard_normal(frames.shape)
        stacks[exposure.name] = np.clip(np.rint(frames), 0, 4095).astype(np.uint16)
    return replace(recording, stacks=stacks)


@pytest.mark.long
def test_hot_pixels_whose_heights_are_lognormal_are_hot_pixels() -> None:
    """A law with a longer tail: the brightest leaves a fourth moment, and spikes of its shot noise.

    numpy's own: 4 % of the pixels, 300 DN/s in the middle, within a factor of e^0.9.
    """
    rng, recording = np.random.default_rng(4), _small(camera(), 4)
    shape = recording.rows, recording.columns
    rate = np.where(rng.random(shape) < 0.04, 300 * np.exp(0.9 * rng.standard_normal(shape)), 0.0)
    assert _found(_warmed(recording, rate, rng), camera()) == {"hot_pixels"}


def test_a_kink_is_seen_beside_one_flat_below_it() -> None:
    """Five flats above lie on a line that meets that of the one below, and black, at the switch."""
    paths = ((0.5, 20.0, 150.0), (0.5, 60.0, None))
    kinks = registry()["dual_gain_mismatch"](gain_error_percent=4.2, mean="kinks")
    true = camera(kinks, segments=paths)
    found = find_mismatch(camera(segments=paths), _small(true, 5, LEVELS), seed=1)
    (named,) = found.omitted_physics
    assert named.effect == "dual_gain_mismatch"
    error = named.parameters["gain_error_percent"]
    assert isinstance(error.value, float)
    assert abs(error.value - 4.2) < 3.5 * error.standard_error < 0.5
    assert not found.unexplained


@pytest.mark.long
def test_a_second_path_is_seen_beside_crosstalk_that_was_fitted_without_it() -> None:
    """Read noise that begins at a switch makes neighbours less alike there: both or neither."""
    crosstalk = registry()["crosstalk"](fraction=0.064)
    true = camera(crosstalk, cfa="GBRG", segments=((0.45, 15.0, 700.0), (0.45, 165.0, None)))
    model = camera(cfa="GBRG", segments=((0.45, 15.0, None),))
    assert _found(_small(true, 6, (500.0, *FEW_LEVELS[1:])), model) == {
        "crosstalk",
        "dual_gain",
    }
