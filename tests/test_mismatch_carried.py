"""Memory in proportion, or a residue of the sample before: which makes neighbours alike."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.carryover import CarryOver
from analysis.mismatch.feigned import carried
from dsis.effects import registry

Frames = NDArray[np.float64]
LEVELS = ((15.0, 3.0), (139.0, 7.0), (460.0, 12.0), (900.0, 16.0))  # mean and noise, DN
SHAPE = (6, 80, 100)
PERIOD, AT = 64, 11.0


def _state(
    share: float, step_dn: float, axis: int = 2, *, left: str = "carry_over", seed: int = 4
) -> Any:
    """Return a state of frames (frame, row, column) whose samples have something of those before.

    A share of what those depart by, and their residue.
    """
    rng = np.random.default_rng(seed)
    kept: dict[str, list[Any]] = {"rows": [], "columns": []}
    for mean, sd in LEVELS:
        white = mean + sd * rng.standard_normal(SHAPE)
        before = np.roll(white, 1, axis)
        phase = (before - AT) / PERIOD
        made = white + share * (before - mean) + step_dn * (phase - np.floor(phase) - 0.5)
        own = CarryOver(keep=True)
        assert len(list(own.watching(np.rint(made)))) == len(made)
        for name, samples in kept.items():
            samples.append(own.samples(name))
    return SimpleNamespace(
        mismatches=[SimpleNamespace(statistic=left)],
        setting=SimpleNamespace(
            seen=SimpleNamespace(carried={name: tuple(own) for name, own in kept.items()})
        ),
    )


def _memory(lag: int = 1, along: str = "rows") -> Any:
    return registry()["readout_memory"](fraction=0.02, lag_pixels=lag, along=along)


@pytest.mark.parametrize("step_dn", [2.0, -2.0])
@pytest.mark.parametrize(("axis", "along"), [(2, "rows"), (1, "columns")])
def test_a_residue_that_is_left_denies_memory_of_the_sample_before(
    step_dn: float, axis: int, along: str
) -> None:
    denial = carried(_state(0.0, step_dn, axis), _memory(along=along))
    assert denial is not None
    assert denial.share < 0.05
    assert "codes before" in denial.why


@pytest.mark.parametrize("share", [0.04, -0.04])
@pytest.mark.parametrize("seed", range(3))
def test_memory_in_proportion_is_not_denied(share: float, seed: int) -> None:
    assert carried(_state(share, 0.0, seed=seed), _memory()) is None


@pytest.mark.parametrize("share", [0.12, -0.06])
def test_nor_beside_a_residue_that_makes_less(share: float) -> None:
    """This residue by itself makes a negative correlation, and takes as much from the memory."""
    assert carried(_state(share, 1.0), _memory()) is None


def test_what_is_not_the_sample_before_or_left_by_codes_is_not_asked() -> None:
    state = _state(0.0, 2.0)
    assert carried(state, _memory(lag=2)) is None
    assert carried(state, registry()["row_noise"](sigma_dn=1.0)) is None
    assert carried(_state(0.0, 2.0, left="correlation_0_1"), _memory()) is None


def test_without_samples_nothing_is_said() -> None:
    state = _state(0.0, 2.0)
    state.setting.seen.carried = {}
    assert carried(state, _memory()) is None
