"""Charge that sites of a mosaic exchange shows in the levels of their colours."""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import pytest
from planter import Choice, draw_case, plant
from planter.case import Effect as Planted

from analysis.mismatch import find_mismatch
from dsis.camera import read_camera
from dsis.recording import read_recording

pytestmark = pytest.mark.usefixtures("unproven")

WORDS = frozenset(
    {"brighter_fatter", "crosstalk", "nonlinearity", "saturation", "adc_memory", "prnu",
     "channel_imbalance", "tap_mismatch"}
)  # fmt: skip


def test_charge_that_colours_exchange_is_named_before_any_covariance_shows(tmp_path: Path) -> None:
    choice = Choice(cfa="GRBG", segments=1, light=True, times="darks")
    case = draw_case(4, "small", choice)
    few = tuple(one for one in case.exposures if one.name not in {"flat-1", "flat-3"})
    case = replace(case, rows=64, columns=96, exposures=few)
    top = max(one.signal_dn for one in case.exposures)
    rate = 0.004 / top
    plant(tmp_path, case.having(Planted("brighter_fatter", {"per_dn": rate})))
    camera = read_camera(tmp_path / "camera.toml")
    found = find_mismatch(camera, read_recording(tmp_path), seed=1, vocabulary=WORDS)
    (named,) = found.omitted_physics
    assert named.effect == "brighter_fatter"
    assert "level" in named.because
    assert "correlation_0_1" not in {one.statistic for one in found.mismatches}
    fitted = named.parameters["per_dn"]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - rate) < 3 * fitted.standard_error
    assert not found.unexplained


@pytest.mark.long
def test_charge_shared_along_columns_makes_the_greens_differ(tmp_path: Path) -> None:
    """Correlations of neighbours tell charge that is shared from light that is not."""
    case = draw_case(4, "small", Choice(cfa="GRBG", segments=1, light=True, times="darks"))
    few = tuple(one for one in case.exposures if one.name not in {"flat-1", "flat-3"})
    case = replace(case, rows=64, columns=96, exposures=few, response=(0.55, 1.0, 0.85))
    own = {"fraction": 0.005, "along": "columns"}
    plant(tmp_path, case.having(Planted("crosstalk", own)))
    camera = read_camera(tmp_path / "camera.toml")
    found = find_mismatch(camera, read_recording(tmp_path), seed=1, vocabulary=WORDS)
    (named,) = found.omitted_physics
    assert named.effect == "crosstalk"
    assert named.choices["along"] == "columns"
    assert "channel_ratio" in named.because
    fitted = named.parameters["fraction"]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - 0.005) < 3 * fitted.standard_error
    assert not found.unexplained
