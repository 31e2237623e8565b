"""Errors of base numbers have a part of those of effects that they go with."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.beside import Beside, fitted_beside
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.named import Named
from analysis.mismatch.own import Own
from analysis.mismatch.parameters import parameter_errors
from analysis.mismatch.state import State
from dsis.effects import Effect, registry
from mismatch_recordings import camera, recorded, state_of

FRACTION, ERROR, FRAMES = 0.1, 0.02, 8
LAG = registry()["image_lag"](fraction=FRACTION)
WAVE = registry()["periodic_noise"](amplitude_dn=1.0, frequency=(0.21, 0.13))


def _kept(fraction: float) -> float:
    """Share of shot noise that is left, as frames about their mean show it."""
    alike = fraction * (1 - fraction)
    return (1 - fraction) ** 2 + fraction**2 - 2 * alike / FRAMES


def _named(effect: Effect, error: float) -> Named:
    return Named(effect.kind, Proposal(effect, ("fraction",)), {"fraction": error}, 50.0, ())


@pytest.fixture(scope="module")
def state() -> State:
    true = camera(LAG)
    return state_of(recorded(true, 4, frames=FRAMES, levels=(300.0, 900.0, 2500.0)), true)


def _error(state: State, beside: list[Beside]) -> float:
    """Return the error of a slope that `camera.toml` states wrong."""
    off = state.camera.model_copy(update={"noise": camera(segments=((0.7, 20.0, None),)).noise})
    asked = off, state.calibrated, state.setting.layout, state.replicates.fits, beside
    (wrong,) = (one for one in parameter_errors(*asked) if one.parameter == "noise.slope")
    return wrong.standard_error


def test_a_slope_goes_with_the_lag_that_takes_noise_away(state: State) -> None:
    """Its error is hypot of the fit's and of what the slope moves by with the lag's."""
    wave = Named("periodic_noise", Proposal(WAVE, ()), {"amplitude_dn": 0.1}, 50.0, ())
    (beside,) = fitted_beside(state, [_named(LAG, ERROR), wave])  # the camera has no wave
    slopes = [fit.pieces[0].slope for fit in (beside.before, beside.after)]
    moves = beside.errors * (slopes[1] - slopes[0])
    expected = slopes[0] * (_kept(FRACTION) / _kept(FRACTION + ERROR) - 1)
    assert moves == pytest.approx(expected, rel=0.05)
    alone, both = _error(state, []), _error(state, [beside])
    assert both == pytest.approx(np.hypot(alone, moves), rel=1e-6)


def test_a_size_of_the_user_that_was_wrong_counts_as_one_that_is_named(state: State) -> None:
    own = Own(0, "fraction", 0.3, LAG, gain=50.0, errors={"fraction": ERROR})
    assert fitted_beside(state, [], [own]) == fitted_beside(state, [_named(LAG, ERROR)])
    (one,) = fitted_beside(state, [_named(WAVE, 0.1)], [own])  # the camera has no wave
    assert one.after.pieces[0].slope != one.before.pieces[0].slope


def test_a_size_that_is_known_well_adds_nothing(state: State) -> None:
    """Though another round moves a fit that has not settled: that is no matter of the size."""
    assert _error(state, fitted_beside(state, [_named(LAG, 1e-6)])) == pytest.approx(
        _error(state, []), rel=1e-4
    )


def test_a_size_that_nobody_knows_is_no_other_camera(state: State) -> None:
    """A step is a fifth of a size, whatever its error: beyond it nothing is straight."""
    (some,), (far,) = (fitted_beside(state, [_named(LAG, by)]) for by in (0.02, 2000.0))
    assert far.after == some.after
    assert far.errors == pytest.approx(1e5 * some.errors)
    assert fitted_beside(state, [_named(LAG, float("inf"))]) == []


def test_what_would_be_out_of_range_is_taken_off_the_other_side(state: State) -> None:
    most = registry()["image_lag"](fraction=0.45)
    own = replace(state, calibrated=state.setting.calibrated(camera(most)))
    (beside,) = fitted_beside(own, [_named(most, 0.06)])
    assert beside.after.pieces[0].slope < beside.before.pieces[0].slope


def test_numbers_that_go_with_one_effect_are_not_called_wrong_together(state: State) -> None:
    """Slope and intercept that are off by 2.9 errors of one size are so by one chance."""
    fit, layout = state.calibrated.fit, state.setting.layout
    (piece,) = fit.pieces

    def off(by: float) -> BaseFit:
        other = replace(piece, slope=piece.slope * (1 + by), intercept=piece.intercept * (1 + by))
        return replace(fit, pieces=(other,))

    true = camera(segments=((piece.slope * 1.29, piece.intercept * 1.29, None),))
    beside = Beside(fit, off(0.1), 1.0)
    assert not any(
        "noise" in one.parameter
        for one in parameter_errors(true, state.calibrated, layout, (), [beside])
    )
