"""Samples that remember the one before, and begin at black, are no charge that neighbours share."""

import numpy as np
import pytest

from analysis.mismatch.darkstart import begins_darker
from dsis.effects import Effect, registry
from mismatch_recordings import InMemory, camera, recorded, state_of_all

SHARE, LEVELS = 0.025, (300.0, 900.0, 2500.0)
CROSSTALK = registry()["crosstalk"](fraction=SHARE / 2, along="rows")
FILTER = registry()["spatial_filtering"](fraction=SHARE / 2, along="rows")
SETTLING = registry()["line_settling"](edge="left", gain_percent=-2.5, length_pixels=1.0)


def _remembering(share: float) -> InMemory:
    """Return numpy's own recording of charge of which a share is read with the next sample.

    Before a line there is none; read noise comes after it.
    """
    recording = recorded(camera(), 3, frames=6, levels=LEVELS)
    assert recording.stacks is not None
    rng = np.random.default_rng(3)
    signals = {name: frames.mean() - 64 for name, frames in recording.stacks.items()}
    for name, frames in recording.stacks.items():
        signal = max(signals[name], 0.0)
        charge = signal + rng.normal(0, (0.5 * signal) ** 0.5, frames.shape)
        before = np.concatenate([np.zeros_like(charge[:, :, :1]), charge[:, :, :-1]], 2)
        read = (1 - share) * charge + share * before + rng.normal(0, 20**0.5, frames.shape)
        recording.stacks[name] = np.rint(64 + read).clip(0, 4095).astype(np.uint16)
    return recording


@pytest.mark.parametrize("effect", [CROSSTALK, FILTER], ids=lambda own: own.kind)
def test_lines_that_begin_darker_by_what_is_shared_deny_that_it_is_shared(effect: Effect) -> None:
    state = state_of_all(_remembering(SHARE), camera())
    said = begins_darker(state, effect)
    assert said is not None
    assert "lines begin darker by 2.5%" in said.why
    twice = effect.model_copy(update={"fraction": SHARE})  # by another amount: another's
    assert begins_darker(state, twice) is None
    settling = state_of_all(_remembering(SHARE), camera(SETTLING))
    assert begins_darker(settling, effect) is None  # that may be why


def test_charge_that_is_shared_leaves_the_first_column_as_bright() -> None:
    state = state_of_all(recorded(camera(CROSSTALK), 4, frames=6, levels=LEVELS), camera())
    assert begins_darker(state, CROSSTALK) is None
    assert begins_darker(state_of_all(_remembering(0.0), camera()), CROSSTALK) is None
