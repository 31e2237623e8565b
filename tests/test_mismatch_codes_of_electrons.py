"""Electrons of several codes leave a comb, and widths of codes in step with it are needless."""

from math import log
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from scipy.special import gammaincc

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.codephase import DETAIL, _log_chance
from analysis.mismatch.codegain import in_step_already, of_electrons
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.adc_memory import AdcMemory
from dsis.effects.poisson_shot_noise import PoissonShotNoise
from mismatch_recordings import camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")


def _state(seen: float, expected: float, sd: float = 2.0, known: bool = True, **more: Any) -> Any:
    keys = [Stub(detail=""), Stub(detail=DETAIL)]
    return Stub(
        camera=more.pop("camera", camera()),
        mismatches=[Stub(statistic=name) for name in more.pop("left", ())],
        predictor=lambda: Stub(mean=lambda _: np.array([0.0, more["made"]])),
        vector=Stub(keys=keys, values=np.array([9.0, seen])),
        null=Stub(known=np.array([True, known]), mean=np.array([0.0, expected]), sd=np.full(2, sd)),
    )


def test_a_comb_of_the_model_is_as_much_in_step() -> None:
    widths = AdcDnl(rms_lsb=0.1)
    assert in_step_already(_state(21.0, 20.0), widths)
    assert in_step_already(_state(21.0, 41.0), widths)  # more of it than was recorded
    assert not in_step_already(_state(21.0, 0.0), widths)
    assert not in_step_already(_state(21.0, 20.0, known=False), widths)
    assert not in_step_already(_state(21.0, 20.0), AdcMemory(step_dn=1, period_codes=64, at_code=0))


def test_a_comb_of_electrons_hangs_on_where_levels_lie() -> None:
    """Half of what is seen may be theirs: there widths say nothing, whatever is beside it."""
    widths, counting = AdcDnl(rms_lsb=0.1), camera(PoissonShotNoise())
    for expected, enough in ((65.0, True), (40.0, False)):
        assert in_step_already(_state(90.0, expected, camera=counting), widths) is enough
        assert of_electrons(_state(90.0, expected, camera=counting)) is enough
        assert not in_step_already(_state(90.0, expected), widths)
        called = _state(90.0, 0.0, left=("skewness",), made=expected)
        assert of_electrons(called) is enough
    assert not of_electrons(_state(90.0, 0.0, left=("kurtosis",), made=90.0))  # nothing calls it
    assert not of_electrons(_state(90.0, 0.0, known=False, left=("skewness",), made=90.0))
    unknown = _state(90.0, 0.0, left=("skewness",), made=np.nan)
    assert not of_electrons(unknown)


def test_widths_are_not_taken_for_electrons_that_show_one_by_one() -> None:
    """Electrons of 6.65 codes in read noise of a seventh of one: their comb is no converter's."""
    true = camera(PoissonShotNoise(), segments=((6.65, 0.83, None),), black=96.0)
    recording = recorded(true, 5, rows=64, columns=96, frames=6, levels=(120.0, 800.0, 2200.0))
    found = find_mismatch(camera(segments=((6.65, 0.83, None),), black=96.0), recording, seed=2)
    assert [own.effect for own in found.omitted_physics] == ["poisson_shot_noise"]


@pytest.mark.parametrize("dof", [2.0, 5.0, 63.0])
def test_the_chance_of_a_strong_comb_has_no_end(dof: float) -> None:
    """Beyond exp(-745) the logarithm goes on as the tail does: half a nat for each unit."""
    assert _log_chance(300.0, dof) == pytest.approx(log(gammaincc(dof / 2, 150.0)), rel=1e-9)
    for chi2 in (1600.0, 1e4, 1e6):
        found = _log_chance(chi2, dof)
        slope = (_log_chance(chi2 + 2, dof) - found) / 2
        assert slope == pytest.approx(-0.5 + (dof / 2 - 1) / chi2, abs=1e-4)
    # Where both are known they agree: one is the other's first term.
    near, half = 1400.0, 700.0
    first = (dof / 2 - 1) * log(half) - half
    assert _log_chance(near, dof) - _log_chance(near - 2, dof) == pytest.approx(
        first - ((dof / 2 - 1) * log(half - 1) - (half - 1)), abs=1e-3
    )
