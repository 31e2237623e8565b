"""What neighbours share, or a full well, and a second path mask each other in the variances."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.contradicted import refuted
from analysis.mismatch.masked import with_path
from analysis.mismatch.polish import Polished
from analysis.mismatch.segments import second_path
from dsis.effects.brighter_fatter import BrighterFatter
from mismatch_recordings import Array, InMemory, camera, recorded, state_of

LEVELS = (130.0, 620.0, 950.0, 2450.0, 2500.0, 2750.0)
SWITCH, BLACK, SLOPE, READ = 1200.0, 64.0, 0.5, 6.0
SHARE, PATH = 1.0e-5, 220.0
SIZE, FRAMES = 80, 8


def _shared(charge: Array, share: float) -> Array:
    """Return charge of which neighbours have exchanged a share in proportion to it."""
    made = charge.copy()
    for axis in (1, 2):
        flow = share / 2 * np.diff(charge**2, axis=axis)
        first: list[slice] = [slice(None)] * 3
        second = list(first)
        first[axis], second[axis] = slice(-1), slice(1, None)
        made[tuple(first)] += flow
        made[tuple(second)] -= flow
    return made


def _grains(rng: np.random.Generator, level: float, share: float) -> Array:
    """Return noise on top that neighbours have in common, as if they shared it; (frame, y, x)."""
    field = rng.standard_normal((FRAMES, SIZE + 1, SIZE + 1))
    field = field[:, 1:, 1:] + field[:, :-1, 1:] + field[:, 1:, :-1] + field[:, :-1, :-1]
    return np.sqrt(share * SLOPE) * level * field


def _recording(
    seed: int, *, share: float, path_dn2: float, grains: float = 0.0, speckle: float = 0.0
) -> InMemory:
    """Return numpy's own noise: shots, charge that is shared, noise of one path or of two.

    `speckle` is the standard deviation of light from pixel to pixel and frame to frame.
    """
    rng = np.random.default_rng(seed)
    made = recorded(camera(), seed, rows=SIZE, columns=SIZE, frames=FRAMES, levels=LEVELS)
    stacks: dict[str, NDArray[np.uint16]] = {}
    for name, level in [
        ("dark-0", 0.0),
        ("dark-1", 0.0),
        *((f"flat-{i}", own) for i, own in enumerate(LEVELS)),
    ]:
        shape = (FRAMES, SIZE, SIZE)
        light = level * (1 + speckle * rng.standard_normal(shape))
        charge = light + np.sqrt(SLOPE * level) * rng.standard_normal(shape)
        charge = _shared(charge, share) + _grains(rng, level, grains)
        read = READ + (path_dn2 if level > SWITCH else 0.0)
        noisy = BLACK + charge + np.sqrt(read) * rng.standard_normal(shape)
        stacks[name] = np.clip(np.rint(noisy), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, SIZE, SIZE, made.folder, stacks)


def _path(recording: InMemory) -> bool:
    """Return whether a second path is told beside nothing else."""
    return second_path(state_of(recording, camera(segments=((SLOPE, READ, None),)))) is not None


@pytest.mark.parametrize(("path_dn2", "speckle"), [(PATH, 0.0), (0.0, 0.01)])
def test_noise_that_grows_with_the_square_of_the_signal_has_no_switch(
    path_dn2: float, speckle: float
) -> None:
    """Two lines follow any bend; a square beside one has no gap, and one number fewer to fit."""
    assert _path(_recording(6, share=0.0, path_dn2=path_dn2, speckle=speckle)) == (speckle == 0)


def _asked(recording: InMemory) -> tuple[bool, bool, bool]:
    """Return whether shared charge is denied, alone and with a path, and whether both are told."""
    state = state_of(recording, camera(segments=((SLOPE, READ, None),)))
    effect = BrighterFatter(per_dn=SHARE)
    predictor = state.predictor()
    mean = predictor.mean(state.camera.model_copy(update={"effect": (effect,)}))
    fitted = Polished((effect,), 0.0, mean, ({},))
    kind = "brighter_fatter"
    denials = [
        refuted(state, predictor, kind, fitted, left) for left in (frozenset(), {"dual_gain"})
    ]
    return denials[0] is not None, denials[1] is not None, with_path(state, mean) is not None


def test_what_a_second_path_masks_is_not_denied() -> None:
    assert _asked(_recording(1, share=SHARE, path_dn2=PATH)) == (True, False, True)


def test_where_there_is_no_second_path_none_is_said_to_mask_anything() -> None:
    assert _asked(_recording(3, share=SHARE, path_dn2=0.0)) == (False, False, False)


def test_a_second_path_alone_excuses_nothing() -> None:
    assert _asked(_recording(4, share=0.0, path_dn2=PATH)) == (True, True, False)


def test_neighbours_that_share_noise_on_top_have_shared_no_charge() -> None:
    """Covariances grow as those of shared charge do, and variances grow instead of falling."""
    denied, still, masked = _asked(_recording(5, share=0.0, path_dn2=PATH, grains=SHARE / 2))
    assert (denied, still, masked) == (True, True, False)


@pytest.mark.long
@pytest.mark.usefixtures("unproven")
def test_a_full_well_and_a_second_path_are_both_named() -> None:
    """One line through all variances lies above some and below others: the well is below that."""
    levels = (100.0, 350.0, 700.0, 1200.0, 2000.0, 2800.0, 3200.0, 3400.0)
    rng = np.random.default_rng(8)
    model = camera(segments=((0.3, 4.0, None),))
    like = recorded(model, 1, rows=64, columns=64, frames=FRAMES, levels=levels)
    stacks = {}
    for exposure in like.exposures:
        light = exposure.light or 0.0
        slope, read = (0.3, 4.0) if light < 1000 else (1.1, 7.0)
        noise = rng.standard_normal((FRAMES, 64, 64)) * np.sqrt(slope * light + read)
        codes = BLACK + np.minimum(light + noise, 3300.0)
        stacks[exposure.name] = np.rint(codes).astype(np.uint16)
    recording = InMemory(like.sensor, like.exposures, 64, 64, like.folder, stacks)
    words = frozenset({"saturation", "dual_gain", "nonlinearity"})
    found = find_mismatch(model, recording, vocabulary=words)
    named = {one.effect: one.parameters for one in found.omitted_physics}
    assert named.keys() == {"saturation", "dual_gain"}
    for kind, name, true in (
        ("saturation", "full_well_dn", 3300),
        ("dual_gain", "switch_dn", 1000),
    ):
        own = named[kind][name]
        assert abs(float(own.value) - true) < 3 * float(own.standard_error) + 1
