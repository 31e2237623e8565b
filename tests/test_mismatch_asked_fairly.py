"""An effect is judged by what the recording can say of it, not by what chance or another did."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.candidates.currents import _noisy
from analysis.mismatch.contradicted import _alike_spread
from analysis.mismatch.judge import Judge
from analysis.mismatch.memory import Memory
from analysis.mismatch.straight import misfits
from dsis.effects.brighter_fatter import BrighterFatter
from dsis.effects.tap_mismatch import TapMismatch
from mismatch_recordings import camera, recorded, state_of


def test_what_spikes_scatter_they_scatter_at_all_exposures_alike() -> None:
    """Two simulations that both have a spike in one exposure do not say that each would."""
    keys = [Key("kurtosis", "exposure", f"flat-{i}", "MONO") for i in range(4)]
    keys.append(Key("level", "exposure", "flat-0", "MONO"))
    state: Any = Stub(vector=Stub(keys=keys))
    change = np.array([100.0, 50.0, 200.0, 0.0, 10.0])
    drawn = np.array([100.0, 50.0, 2.0, 0.0, 0.1])
    found = _alike_spread(state, change, drawn)
    assert found[2] == pytest.approx(200 * np.sqrt((1 + 1 + 1e-4) / 3))
    assert found[:2].tolist() == [100.0, 50.0]  # no less than they have
    assert found[3:].tolist() == pytest.approx([0.0, 0.1])  # another statistic is another's


@pytest.mark.parametrize(
    ("kind", "left", "steps"),
    [
        ("quantisation", ("kurtosis",), True),
        ("quantisation", ("kurtosis", "code_spacing"), False),
        ("row_noise", ("kurtosis",), False),
    ],
)
def test_a_step_is_known_by_the_codes_that_occur(
    kind: str, left: tuple[str, ...], steps: bool
) -> None:
    judge: Any = Stub(state=Stub(mismatches=[Stub(statistic=own) for own in left]))
    assert Judge._steps(judge, Stub(kind=kind)) is steps  # type: ignore[arg-type] # a stub


def test_what_frames_gain_is_remembered_where_numbers_gain_less() -> None:
    memory = Memory()
    halves = TapMismatch(gain_percent=1.0, regions="left_right")
    memory.gains_at_least("tap_mismatch", halves, 5.0)
    memory.gains_at_least("tap_mismatch", halves, 3.0)
    assert memory.gained("tap_mismatch", 0.0) == 5.0
    memory.gains_at_least("tap_mismatch", halves, 9.0)
    assert memory.gains["tap_mismatch"] == {("left_right",): 9.0}


def test_variances_beside_an_effect_of_the_model_lie_on_lines() -> None:
    """Charge that repels charge bends them: the model that has it knows by how much."""
    levels = (200.0, 600.0, 1200.0, 2000.0, 2800.0)
    shared = camera(BrighterFatter(per_dn=2e-5))
    state = state_of(recorded(shared, 7, levels=levels, frames=8), shared)
    bent, _ = misfits(state, lambda _, default: default)
    straight, _ = misfits(state, lambda _, default: default, beside=True)
    assert bent > 100
    assert straight < 30  # of 4 degrees of freedom and what simulations leave unsure


@pytest.mark.parametrize(("times", "noisy"), [(7.0, True), (2.0, False)])
def test_charge_scatters_the_variance_where_it_was_gathered(times: float, noisy: bool) -> None:
    """A pixel 100 DN above the dark has 4 times its variance there, and none more in bright flats.

    Of 7 frames a variance of 4 times 10 DN^2 scatters by 0.58 of itself: 7 times as much are far
    beyond it, twice as much are not.
    """
    frames, dark, bright = 7, 10.0, 1000.0
    total = np.random.default_rng(0).normal(0.0, np.sqrt(2 * (frames - 1)) / dark, (40, 40))
    rate = np.zeros((40, 40))
    rate[5, 5] = 100.0  # DN a second, of one
    total[5, 5] = (frames - 1) / dark * (times * 4 - 1)
    uniform = [
        Stub(name="dark", numbers=tuple(range(frames)), exposure_time_s=1.0),
        *(Stub(name=f"flat-{i}", numbers=tuple(range(frames)), exposure_time_s=1.0) for i in "ab"),
    ]
    variance = {("dark", "MONO"): dark, ("flat-a", "MONO"): bright, ("flat-b", "MONO"): bright}
    clues: Any = Stub(
        image=lambda _: {"MONO": (total, 1.0)},
        fit=Stub(line_dn2=lambda signal: dark + 0.3 * signal),
        layout=Stub(uniform=uniform, still={}, variance_dn2=variance),
    )
    found = _noisy(clues, "MONO", rate)
    assert found[5, 5] == noisy
    assert found.sum() == noisy
