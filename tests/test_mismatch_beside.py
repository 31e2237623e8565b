"""Errors of base numbers have a part of those of effects that they go with."""

import numpy as np
import pytest

from analysis.mismatch.beside import fitted_beside
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.named import Named
from analysis.mismatch.parameters import parameter_errors
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of

LAG = registry()["image_lag"](fraction=0.1)
ERROR, FRAMES = 0.02, 8
WAVE = registry()["periodic_noise"](amplitude_dn=1.0, frequency=(0.21, 0.13))


def _kept(fraction: float) -> float:
    """Share of shot noise that is left, as frames about their mean show it."""
    alike = fraction * (1 - fraction)
    return (1 - fraction) ** 2 + fraction**2 - 2 * alike / FRAMES


def test_a_slope_goes_with_the_lag_that_takes_noise_away() -> None:
    """Its error is hypot of the fit's and of what the slope moves by with the lag's."""
    true = camera(LAG)
    state = state_of(recorded(true, 4, frames=FRAMES, levels=(300.0, 900.0, 2500.0)), true)
    lag = Named("image_lag", Proposal(LAG, ("fraction",)), {"fraction": ERROR}, 50.0, ())
    wave = Named("periodic_noise", Proposal(WAVE, ()), {"amplitude_dn": 0.1}, 50.0, ())
    (beside,) = fitted_beside(state, [lag, wave])  # the camera has no wave
    (piece,) = state.calibrated.fit.pieces
    moves = beside.pieces[0].slope - piece.slope
    expected = piece.slope * (_kept(LAG.model_dump()["fraction"]) / _kept(0.1 + ERROR) - 1)
    assert moves == pytest.approx(expected, rel=0.1)
    off = true.model_copy(update={"noise": camera(segments=((0.7, 20.0, None),)).noise})
    asked = off, state.calibrated, state.setting.layout, state.replicates.fits
    ((alone,), (both,)) = (
        [one for one in parameter_errors(*asked, own) if one.parameter == "noise.slope"]
        for own in ([], [beside])
    )
    assert both.standard_error == pytest.approx(np.hypot(alone.standard_error, moves), rel=1e-6)


def test_what_would_be_out_of_range_is_taken_off_the_other_side() -> None:
    most = registry()["image_lag"](fraction=0.495)
    true = camera(most)
    state = state_of(recorded(true, 5, frames=FRAMES, levels=(300.0, 900.0)), true)
    lag = Named("image_lag", Proposal(most, ("fraction",)), {"fraction": ERROR}, 50.0, ())
    (beside,) = fitted_beside(state, [lag])
    assert np.isfinite(beside.pieces[0].slope)
    far = Named("image_lag", Proposal(most, ("fraction",)), {"fraction": float("inf")}, 50.0, ())
    assert fitted_beside(state, [far]) == []
