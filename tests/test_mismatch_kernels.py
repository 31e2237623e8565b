"""Which kernel a camera smooths with: proposals by axes and diagonals, and that it is named."""

from collections.abc import Mapping
from typing import Any

import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates import CANDIDATES
from dsis.camera import Camera
from exposing import effect
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")


def _proposed(one: Mapping[str, Any], cfa: str = "MONO") -> list[dict[str, Any]]:
    """Return what is proposed for a recording of a camera that smooths."""
    true = camera(effect("spatial_filtering", **one), cfa=cfa)
    state = state_of(recorded(true, 5, levels=FEW_LEVELS), camera(cfa=cfa))
    found = CANDIDATES["spatial_filtering"].propose(state.clues())
    return [proposal.effect.model_dump(exclude={"kind"}) for proposal in found]


def _small(true: Camera) -> InMemory:
    return recorded(true, 5, rows=64, columns=96, levels=FEW_LEVELS)


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("along", ["rows", "columns"])
def test_a_kernel_along_one_axis_is_proposed_where_axes_differ(cfa: str, along: str) -> None:
    *_, found = _proposed({"fraction": 0.03, "along": along}, cfa)
    assert found["along"] == along
    assert found["fraction"] == pytest.approx(0.03, rel=0.15)


def test_one_of_four_neighbours_is_proposed_first() -> None:
    first, *others = _proposed({"fraction": 0.03})
    assert first == {"fraction": pytest.approx(0.03, rel=0.2)}
    assert not any("diagonal" in one for one in others)


def test_diagonals_are_proposed_where_they_are_alike() -> None:
    *_, found = _proposed({"fraction": 0.02, "diagonal": 0.8})
    assert found["diagonal"] == pytest.approx(0.8, abs=0.15)


def test_memory_pays_for_the_lag_that_was_chosen() -> None:
    true = camera(effect("readout_memory", fraction=0.1, lag_pixels=3))
    state = state_of(recorded(true, 5, levels=FEW_LEVELS), camera())
    first, *_ = CANDIDATES["readout_memory"].propose(state.clues())
    assert first.effect.model_dump()["lag_pixels"] == 3
    lags = {k.detail for k in state.null.keys if k.statistic == "line_correlation"}
    assert first.best_of == len(lags) > 4


@pytest.mark.long
def test_smoothing_along_rows_and_memory_are_told_apart_by_no_slope() -> None:
    """A sample that has not settled keeps a share of the last: its variance falls as a filter's.

    So the slope of the photon transfer curve, which a filter lessens, tells nothing: neither is
    claimed, and what would settle it is said.
    """
    true = camera(effect("spatial_filtering", fraction=0.028, along="rows"))
    found = find_mismatch(camera(), _small(true), seed=3)
    assert not found.omitted_physics
    assert {one.effect for one in found.undecided} == {"spatial_filtering", "readout_memory"}
    assert all(one.would_settle for one in found.undecided)
    assert any(m.statistic == "correlation_0_1" for m in found.unexplained)


@pytest.mark.long
def test_smoothing_along_both_axes_is_named() -> None:
    """No memory of a sample before, along one line, makes neighbours along both alike."""
    true = camera(effect("spatial_filtering", fraction=0.028))
    found = find_mismatch(camera(), _small(true), seed=3)
    (omitted,) = found.omitted_physics
    assert omitted.effect == "spatial_filtering"
    fitted = omitted.parameters["fraction"]
    assert abs(fitted.value - 0.028) < 4 * fitted.standard_error < 0.008
    assert not found.parameter_errors
