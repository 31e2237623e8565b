"""Whether levels show the law of an effect: skewness of counts, amplifiers of two greens."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bylevel import otherwise_by_level

Array = NDArray[np.float64]
LIGHT = np.array([0.0, 300.0, 1000.0, 2500.0, 6000.0, 14000.0])  # DN above black
ERROR = 1e-3
GAIN = 4.0  # electrons per DN
COUNTS = np.where(LIGHT > 0, 1 / np.sqrt(GAIN * np.maximum(LIGHT, 1.0)), 0.0)  # skewness of Poisson
APART = np.where(LIGHT > 0, 0.02, 0.0)  # of an amplifier's gain, at any light


def _state(statistic: str, left: Array, seed: int) -> Any:
    """Return a state whose numbers are zero and errors; `left` is what the recording shows."""
    mosaic = statistic == "channel_ratio"
    names, channels = [f"e{i}" for i in range(LIGHT.size)], ("Gr", "Gb") if mosaic else ("MONO",)
    keys = [
        SimpleNamespace(
            statistic=statistic, scope="exposure", exposure=n, channel="G" if mosaic else "MONO"
        )
        for n in names
    ]
    noise = np.random.default_rng(seed).normal(0, ERROR, LIGHT.size)
    return SimpleNamespace(
        vector=SimpleNamespace(keys=keys, values=left + noise),
        null=SimpleNamespace(known=np.ones(LIGHT.size, bool), sd=np.full(LIGHT.size, ERROR)),
        calibrated=SimpleNamespace(
            fit=SimpleNamespace(
                signal_dn={(n, c): s for n, s in zip(names, LIGHT, strict=True) for c in channels}
            )
        ),
        setting=SimpleNamespace(
            seen=SimpleNamespace(
                levels={(n, c): SimpleNamespace(clipped_high=0.0) for n in names for c in channels}
            )
        ),
    )


CASES = [
    ("poisson_shot_noise", "skewness", COUNTS),
    ("channel_imbalance", "channel_ratio", APART),
    ("tap_mismatch", "channel_ratio", APART),
]


@pytest.mark.parametrize(("kind", "statistic", "law"), CASES)
def test_what_grows_with_light_denies_it(kind: str, statistic: str, law: Array) -> None:
    """Grains of light skew noise by what they have in common; charge that is repelled by S^2."""
    for power in (1.0, 1.3, 2.0):
        left = 0.02 * (LIGHT / LIGHT.max()) ** power
        denial = otherwise_by_level(_state(statistic, left, 1), kind, 0 * law, law)
        assert denial is not None
        assert denial.share < 0.05
        assert "light" in denial.why or "brighter" in denial.why


@pytest.mark.parametrize(("kind", "statistic", "law"), CASES)
@pytest.mark.parametrize("size", [0.2, 0.6, 1.0])
def test_its_own_law_is_believed_whatever_its_size(
    kind: str, statistic: str, law: Array, size: float
) -> None:
    """At odds of 20: of a fifth of what is predicted few in a hundred are not."""
    denied = [
        otherwise_by_level(_state(statistic, size * law, seed), kind, 0 * law, law) is not None
        for seed in range(40)
    ]
    assert sum(denied) <= (2 if size < 1 else 0)


@pytest.mark.parametrize(("kind", "statistic", "law"), CASES)
def test_a_law_that_is_a_few_percent_off_denies_nothing(
    kind: str, statistic: str, law: Array
) -> None:
    """Seen at twenty errors of each level, and bent a little: no effect's form is known better."""
    for seed in range(20):
        left = law * (1 + 0.06 * (LIGHT / LIGHT.max()) ** 0.5)
        assert otherwise_by_level(_state(statistic, left, seed), kind, 0 * law, law) is None


@pytest.mark.parametrize(("kind", "statistic", "law"), CASES)
def test_beside_what_grows_it_stays_where_it_is_needed(
    kind: str, statistic: str, law: Array
) -> None:
    left = law + 0.03 * (LIGHT / LIGHT.max()) ** 1.5
    for seed in range(20):
        assert otherwise_by_level(_state(statistic, left, seed), kind, 0 * law, law) is None


def test_of_few_levels_and_of_other_effects_nothing_is_said() -> None:
    few = np.where(LIGHT > 2000, LIGHT / LIGHT.max(), np.nan)
    few[LIGHT < 5000] = np.nan
    state = _state("skewness", few, 1)
    assert otherwise_by_level(state, "poisson_shot_noise", 0 * COUNTS, COUNTS) is None
    state = _state("skewness", 0.02 * LIGHT / LIGHT.max(), 1)
    assert otherwise_by_level(state, "nonlinearity", 0 * COUNTS, COUNTS) is None


def test_halves_that_do_not_part_the_greens_are_not_denied_by_them() -> None:
    """What their noise changes there is far below errors: the greens differ for another reason."""
    rng = np.random.default_rng(3)
    for seed in range(50):
        left = 1e-3 * LIGHT / LIGHT.max()
        state = _state("channel_ratio", left, seed)
        tap = rng.normal(0, 5e-6, LIGHT.size)
        assert otherwise_by_level(state, "tap_mismatch", 0 * tap, tap) is None


def test_of_its_own_size_beside_another_it_stays() -> None:
    """Flats from 2000 to 4000 DN: what grows with light is hardly told from a constant."""
    narrow = np.where(LIGHT > 2000, np.linspace(2000, 4000, LIGHT.size), np.nan)
    law = np.where(LIGHT > 0, 0.008, 0.0)
    left = law + np.nan_to_num(0.002 * narrow / 4000)
    denied = 0
    for seed in range(60):
        state = _state("skewness", left, seed)
        denied += otherwise_by_level(state, "poisson_shot_noise", 0 * law, law) is not None
    assert denied <= 3
