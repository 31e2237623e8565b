"""Single electrons in little read noise: a skew is proven wherever the comb's teeth lie."""

import numpy as np
import pytest

from analysis.mismatch.prove import heldout_gain, loglik_of
from analysis.mismatch.prove.teeth import blurred, teeth_of
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import (
    FEW_LEVELS,
    InMemory,
    camera,
    held_of,
    recorded,
    signals,
)

GAIN = 3.78  # DN per electron


def _counting(read_dn2: float, seed: int, *, skewed: bool = True) -> InMemory:
    """Return numpy's own recording of whole electrons, or of Gaussian charge."""
    plain = camera(segments=((GAIN, read_dn2, None),))
    made = recorded(plain, seed, levels=FEW_LEVELS)
    rng = np.random.default_rng(seed)
    stacks = {}
    for name, stack in made.stacks.items() if made.stacks else ():
        level = float(signals()[name][0, 0])
        mean = level / GAIN
        charge = (
            rng.poisson(mean, stack.shape) if skewed else rng.normal(mean, mean**0.5, stack.shape)
        )
        noisy = 64.0 + GAIN * charge + read_dn2**0.5 * rng.standard_normal(stack.shape)
        stacks[name] = np.clip(np.rint(noisy), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, made.rows, made.columns, made.folder, stacks)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("read_dn2", [0.28, 6.0])
def test_counted_electrons_gain_in_little_read_noise_as_in_much(seed: int, read_dn2: float) -> None:
    """Teeth 0.5 DN wide, about levels that wander by 0.2 DN, had cost 30 nats a frame."""
    base = camera(segments=((GAIN, read_dn2, None),))
    counting = camera(registry()["poisson_shot_noise"](), segments=((GAIN, read_dn2, None),))
    for skewed in (True, False):
        held = held_of(_counting(read_dn2, seed, skewed=skewed))
        without, beside = (loglik_of(held, own, signals(), seed=1) for own in (base, counting))
        gain = heldout_gain(without, beside, seed=1)
        if skewed:
            assert gain.ci95[0] > 0
        else:
            assert gain.ci95[1] < 0


def test_teeth_are_where_a_comb_is_seen() -> None:
    def teeth(own: Camera) -> dict[str, float]:
        held = held_of(_counting(0.28, 0))
        return {name: float(one.max()) for name, one in teeth_of(own, held, signals()).items()}

    counts = registry()["poisson_shot_noise"]()
    flats = {f"flat-{i}" for i in range(len(FEW_LEVELS))}
    deep = teeth(camera(counts, segments=((GAIN, 0.28, None),)))
    assert set(deep) == flats
    assert list(deep.values()) == pytest.approx([GAIN] * len(flats))
    assert not teeth(camera(counts, segments=((GAIN, 6.0, None),)))  # 2 exp(-2 pi^2 0.42) = 0.0005
    assert not teeth(camera(segments=((GAIN, 0.28, None),)))


def test_blurred_frames_have_no_comb() -> None:
    rng = np.random.default_rng(3)
    comb = (GAIN * rng.poisson(300, (8, 64, 64)) + 0.5 * rng.normal(size=(8, 64, 64))).astype("f4")
    flat = blurred(comb, {"flat": np.full((64, 64), GAIN, np.float32)}, "flat", 1)
    depth = [abs(np.exp(2j * np.pi * own / GAIN).mean()) for own in (comb, flat)]
    assert depth[0] > 0.6
    assert depth[1] < 5 / comb.size**0.5
    assert blurred(comb, {}, "flat", 1) is comb
