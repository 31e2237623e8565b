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


def test_a_few_exposures_of_which_each_wanders_by_its_own_amount_have_no_drift() -> None:
    """As a ramp of temperature makes darks of several exposure times."""
    drift, apart, alike = effect("black_level_drift", sigma_dn=0.15), 0, 0
    for seed in range(20):
        state, without = _state(np.array([0.02, 0.15, 1.0, 5.0]), 0.15, seed)
        apart += unequal(state, drift, without) is not None
        state, without = _state(np.array([0.15, 0.15, 0.15, 5.0]), 0.15, seed)
        alike += unequal(state, drift, without) is None
    assert apart >= 18  # eight frames of noise alone look now and then as if they drifted
    assert alike == 20


@pytest.mark.parametrize("seed", range(20))
def test_a_drift_that_persists_is_believed_beside_what_one_exposure_has(seed: int) -> None:
    """Its variances in few frames scatter by more than those of a white one."""
    rng, rho = np.random.default_rng(100 + seed), 0.8
    walk = np.zeros((6, FRAMES))
    walk[:, 0] = rng.standard_normal(6)
    for t in range(1, FRAMES):
        walk[:, t] = rho * walk[:, t - 1] + (1 - rho**2) ** 0.5 * rng.standard_normal(6)
    sds = 0.15 * walk.std(1, ddof=1)
    fitted = float(np.median(sds))
    state, without = _state(np.append(sds, 3.0), fitted, seed)
    drift = effect("black_level_drift", sigma_dn=fitted)
    exact = np.append(np.cbrt(1 + sds**2 / (NOISE**2 / PIXELS)), state.vector.values[-1])
    state.vector.values = exact
    assert unequal(state, drift, without) is None


def test_only_a_drift_is_asked() -> None:
    state, without = _state(10 * TIMES, 0.1, 0)
    assert unequal(state, effect("flicker", sigma_percent=1.0), without) is None
