"""A second read-out path scales noise; what changes its shape is none."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.segments import _misshapen
from exposing import effect

PLACES = [("flat-0", "MONO"), ("flat-4", "MONO")]


def _state(*effects: Any, **z: tuple[float, float]) -> Any:
    """Return a state with departures of two flats, by statistic; its camera has some effects."""
    keys = [Key(name, "exposure", *place) for name in z for place in PLACES]
    signals = dict(zip(PLACES, (100.0, 2900.0), strict=True))
    return Stub(
        null=Stub(keys=keys),
        departures=np.array([v for both in z.values() for v in both]),
        camera=Stub(effect=effects),
        calibrated=Stub(fit=Stub(signal_dn=signals)),
        setting=Stub(seen=Stub(levels={place: Stub(variance_dn2=900.0) for place in PLACES})),
    )


@pytest.mark.parametrize(
    ("variance", "skewness", "kurtosis", "misshapen"),
    [
        ((0.5, -8.0), (0.3, -15.0), (1.0, -9.0), True),  # charge that a full well cuts
        ((0.5, 40.0), (0.3, 0.5), (1.0, 0.8), False),  # noise of another gain
        ((0.5, 300.0), (0.3, 12.0), (1.0, 2.0), False),  # its shot noise is less skew
        ((0.5, 9.0), (15.0, 0.5), (1.0, 2.0), False),  # the shape departs elsewhere
        ((0.5, 2.0), (0.3, -15.0), (1.0, -9.0), False),  # no variance departs
        ((0.5, -8.0), (0.3, -1.0), (1.0, -11.0), True),
    ],
)
def test_shape_tells_what_bends_from_a_second_path(
    variance: Any, skewness: Any, kurtosis: Any, misshapen: bool
) -> None:
    state = _state(pixel_variance=variance, skewness=skewness, kurtosis=kurtosis)
    assert bool(_misshapen(state)) == misshapen


def test_where_a_full_well_of_the_camera_cuts_noise_it_bends_nothing_else() -> None:
    """Its reach is three standard deviations; below that the shape tells what it told."""
    z = {"pixel_variance": (0.5, -8.0), "skewness": (0.3, -15.0)}
    for full_well_dn, misshapen in ((2950.0, []), (3100.0, [PLACES[1]])):
        state = _state(effect("saturation", full_well_dn=full_well_dn), **z)
        assert _misshapen(state) == misshapen
