"""Sums over codes of unequal widths, block by block: little is held at once, nothing is lost."""

import tracemalloc
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from analysis.mismatch.prove.cells import Cells
from analysis.mismatch.prove.likelihood import _norm, _sums
from analysis.mismatch.prove.shape import NORMAL


def _cells(codes: int) -> Cells:
    weight = 1 + 0.1 * np.random.default_rng(4).standard_normal(codes)
    edges = np.arange(codes + 1) - 0.5
    return Cells(edges[:-1], edges[1:], 0.0, 0.01, weight)


@pytest.mark.parametrize("sd", [0.4, 3.0, 20.0])
def test_sums_are_expectations_of_the_widths(sd: float) -> None:
    cells, knots = _cells(900), np.linspace(300.0, 600.0, 57)
    mass = np.diff(norm.cdf((np.append(cells.lower_dn, 899.5) - knots[:, None]) / sd), axis=1)
    assert _sums(cells, NORMAL, knots, sd) == pytest.approx(mass @ cells.weight, abs=1e-9)


def test_a_bright_scene_of_sixteen_bits_takes_little_memory() -> None:
    cells, shape = _cells(60000), (24, 32)
    law: Any = SimpleNamespace(
        cells=cells, exposures={"scene": SimpleNamespace(shapes=(NORMAL,) * 4)}
    )
    centre = np.linspace(500.0, 20000.0, 24 * 32).reshape(shape)
    held: Any = SimpleNamespace(cfa=None, shape=shape)
    tracemalloc.start()
    found = _norm(law, "scene", centre, np.full(shape, 30.0), held)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 2e8
    mass = np.diff(norm.cdf((np.append(cells.lower_dn, 59999.5) - centre[:, 7:8]) / 30.0), axis=1)
    assert found[:, 7] == pytest.approx(mass @ cells.weight, abs=1e-4)
