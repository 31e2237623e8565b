"""The classifier two-sample test: it sees what is there, and nothing else."""

import numpy as np
import pytest

from analysis.mismatch.prove import auc_of
from dsis.effects import registry
from mismatch_recordings import camera, held_of, recorded, signals


def test_classifier_finds_nothing_in_the_right_model() -> None:
    """Six recordings of 24 samples against 144: one area has a standard error of 0.065."""
    areas = []
    for seed in range(6):
        auc = auc_of(held_of(recorded(camera(), 1000 + seed)), camera(), signals(), seed=seed)
        assert auc is not None
        areas.append(auc.value)
    assert abs(np.mean(areas) - 0.5) < 5 * 0.065 / np.sqrt(6)


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("quantisation", {"step_dn": 2.0}),
        ("adc_dnl", {"rms_lsb": 0.15}),
        ("image_lag", {"fraction": 0.04}),
        ("spatial_filtering", {"fraction": 0.015}),
        ("crosstalk", {"fraction": 0.02}),
        ("heavy_tailed_read_noise", {"tail_df": 18.0}),
        ("dsnu", {"sigma_dn": 0.6}),
        ("row_noise", {"sigma_dn": 1.0}),
    ],
)
def test_classifier_sees_what_is_visible(kind: str, parameters: dict[str, float]) -> None:
    true = camera(registry()[kind](**parameters))
    held = held_of(recorded(true, 31))
    before, after = (auc_of(held, c, signals(), seed=1) for c in (camera(), true))
    assert before is not None
    assert after is not None
    assert before.value >= 0.9
    assert after.ci95[0] < 0.5


def test_a_sensor_without_a_patch_has_no_classifier() -> None:
    held = held_of(recorded(camera(), 1, rows=24, columns=64, levels=(400.0,)))
    assert auc_of(held, camera(), signals((400.0,)), seed=1) is None
