"""An offset that drifts moves the frames of all exposures alike."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.unequal import unequal
from exposing import effect

Array = NDArray[np.float64]
FRAMES, PIXELS, NOISE = 8, 20_000, 3.0
TIMES = np.array([0.001, 0.001, 0.002, 0.004, 0.01, 0.05, 0.1, 0.2])


def _state(sds: Array, fitted: float, seed: int) -> tuple[Any, Array]:
    """Return what frames of numpy show that wander by `sds`, beside a drift of one size."""
    rng = np.random.default_rng(seed)
    white = NOISE**2 / PIXELS
    moved = [sd * rng.standard_normal(FRAMES) for sd in sds]
    means = [own + np.sqrt(white) * rng.standard_normal(FRAMES) for own in moved]
    seen = np.cbrt([own.var(ddof=1) / white for own in means])
    mean = np.full(sds.size, np.cbrt(1 + fitted**2 / white))
    # What chance does to a cube root of a variance of so few frames.
    sd = mean / 3 * np.sqrt(2 / (FRAMES - 1))
    z = (seen - mean) / sd
    keys = tuple(Key("frame_variance", "exposure", f"e{i}", "MONO") for i in range(sds.size))
    state = SimpleNamespace(
        vector=SimpleNamespace(keys=keys, values=seen),
        mismatches=[SimpleNamespace(statistic="frame_variance", z=float(z.max()))],
        null=SimpleNamespace(mean=mean, sd=sd, known=np.ones(sds.size, bool)),
    )
    return state, np.ones(sds.size)


@pytest.mark.parametrize("seed", range(20))
def test_what_grows_with_time_is_no_drift(seed: int) -> None:
    state, without = _state(10 * TIMES, 0.1, seed)
    assert unequal(state, effect("black_level_drift", sigma_dn=0.1), without) is not None


@pytest.mark.parametrize("seed", range(20))
def test_a_drift_is_believed_alone_and_beside_what_few_exposures_have(seed: int) -> None:
    drift = effect("black_level_drift", sigma_dn=0.1)
    state, without = _state(np.full(TIMES.size, 0.1), 0.1, seed)
    assert unequal(state, drift, without) is None
    state, without = _state(np.where(TIMES > 0.05, 3.0, 0.1), 0.1, seed)
    assert unequal(state, drift, without) is None


def test_only_a_drift_is_asked() -> None:
    state, without = _state(10 * TIMES, 0.1, 0)
    assert unequal(state, effect("flicker", sigma_percent=1.0), without) is None
