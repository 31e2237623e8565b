"""Electrons of several codes leave a comb, and widths of codes in step with it are needless."""

from math import log
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from scipy.special import gammaincc

from analysis.mismatch.bank.codephase import DETAIL, _log_chance
from analysis.mismatch.codegain import in_step_already
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.adc_memory import AdcMemory


def _state(seen: float, expected: float, sd: float = 2.0, known: bool = True) -> Any:
    keys = [Stub(detail=""), Stub(detail=DETAIL)]
    return Stub(
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
