"""Promise: derivatives by simulation are taken over steps that the physics is straight over."""

import numpy as np
import pytest

from analysis.mismatch.polish import Free, shifted
from dsis.effects.effect import OperatingPoint
from dsis.effects.saturation import Saturation
from mismatch_recordings import camera

SLOPE, READ = 0.5, 20.0


@pytest.mark.parametrize("level", [300.0, 3000.0, 30000.0])
@pytest.mark.parametrize("deviations", [-1.0, 0.0, 2.0])
def test_a_full_well_is_moved_by_a_share_of_its_noise(level: float, deviations: float) -> None:
    """The slope of mean and variance over a full well is that of a thousandth of the step."""
    full = level + deviations * (SLOPE * level) ** 0.5
    base = camera(segments=((SLOPE, READ, None),))
    free: list[Free] = [(0, "full_well_dn", False)]
    effect = Saturation(full_well_dn=full)
    [(moved, step)] = shifted(base, (effect,), free)
    assert moved is not None
    far = moved.effect[0]
    assert isinstance(far, Saturation)
    point = OperatingPoint(
        signal_dn=level,
        slope_dn=SLOPE,
        read_variance_dn2=READ,
        segment=0,
        full_scale_dn=65535.0,
        frames=8,
        rows=96,
        columns=128,
    )
    near = Saturation(full_well_dn=full * np.exp(step / 1000))
    at = effect.contributions(point)
    for measure, scale in (("level", full), ("pixel_variance", SLOPE * level)):
        slope = (far.contributions(point)[measure] - at[measure]) / step
        true = (near.contributions(point)[measure] - at[measure]) / (step / 1000)
        size = scale * full / (SLOPE * level) ** 0.5 if measure == "pixel_variance" else scale
        assert slope == pytest.approx(true, abs=0.15 * size)
        assert abs(true) > 0.02 * size


def test_other_sizes_are_moved_by_a_share_of_theirs() -> None:
    base = camera(Saturation(full_well_dn=2000.0))
    [(moved, step)] = shifted(base, base.effect, [(0, "full_well_dn", False)])
    assert moved is not None
    assert moved.effect[-1].model_dump()["full_well_dn"] == pytest.approx(2000.0 * np.exp(step))
