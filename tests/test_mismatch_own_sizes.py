"""Sizes of effects that the user's camera has: wrong ones are wrong numbers, no omitted physics."""

from types import SimpleNamespace

import pytest

from analysis.mismatch import VOCABULARY, Finding, find_mismatch
from analysis.mismatch.own import eased, sizes
from dsis.camera import Camera
from dsis.effects import Effect, registry
from mismatch_recordings import FEW_LEVELS, LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

SURE = 3.0  # standard errors


def _effect(kind: str, **parameters: float | str) -> Effect:
    return registry()[kind](**parameters)  # type: ignore[arg-type] # pydantic checks them


def _prnu(percent: float) -> Effect:
    return _effect("prnu", sigma_percent=percent)


def _column_fpn(dn: float) -> Effect:
    return _effect("column_fpn", sigma_dn=dn)


def _found(true: Camera, model: Camera, levels: tuple[float, ...] = FEW_LEVELS) -> Finding:
    return find_mismatch(model, recorded(true, 11, levels=levels), seed=5)


@pytest.mark.long
def test_a_wrong_size_is_a_parameter_error() -> None:
    found = _found(camera(_column_fpn(1.0)), camera(_column_fpn(2.0)))
    assert found.verdict == "parameters"
    assert not found.mismatches
    assert not found.unexplained
    (error,) = found.parameter_errors
    assert (error.parameter, error.model) == ("effect.column_fpn.sigma_dn", 2.0)
    assert abs(error.recorded - 1.0) < SURE * error.standard_error
    assert abs(error.recorded - error.model) > SURE * error.standard_error
    assert found.camera.effect == (_column_fpn(error.recorded),)


@pytest.mark.long
def test_an_effect_that_is_not_there_has_next_to_no_size() -> None:
    found = _found(camera(), camera(_prnu(1.0)), LEVELS)  # few tell so little of none
    assert found.verdict == "parameters"
    (error,) = found.parameter_errors
    assert error.recorded < SURE * error.standard_error < 0.5


def test_a_size_of_none_is_no_reason_for_a_second_effect() -> None:
    found = _found(camera(_prnu(1.0)), camera(_prnu(0.0)))
    assert found.verdict == "parameters"
    assert not found.mismatches
    assert not found.unexplained
    (error,) = found.parameter_errors
    assert (error.parameter, error.model) == ("effect.prnu.sigma_percent", 0.0)
    assert abs(error.recorded - 1.0) < SURE * error.standard_error
    assert found.camera.effect == (_prnu(error.recorded),)


@pytest.mark.long
def test_a_right_size_does_not_stand_in_for_a_wrong_one_beside_it() -> None:
    """Gains that neighbours share are too large: the white ones must not shrink instead."""
    true, model = (
        camera(_prnu(1.0), _effect("smooth_prnu", sigma_percent=percent, length_pixels=5.0))
        for percent in (0.8, 1.1)
    )
    found = _found(true, model)
    assert [error.parameter for error in found.parameter_errors] == [
        "effect.smooth_prnu.sigma_percent"
    ]
    assert abs(found.parameter_errors[0].recorded - 0.8) < SURE * (
        found.parameter_errors[0].standard_error
    )
    assert found.camera.effect[0] == _prnu(1.0)
    assert any("z = -" in remark for remark in found.remarks)  # what the user's sizes leave


def test_right_sizes_stay_as_they_are() -> None:
    own = (_prnu(1.0), _column_fpn(1.5), _effect("dsnu", sigma_dn=1.0))
    found = _found(camera(*own), camera(*own))
    assert found.verdict == "match"
    assert found.camera.effect == own


@pytest.mark.long
def test_right_sizes_stay_as_they_are_beside_physics_that_is_left_out() -> None:
    own = (_prnu(1.0), _column_fpn(1.5))
    rows = _effect("row_fpn", sigma_dn=2.0)
    found = _found(camera(*own, rows), camera(*own))
    assert [one.effect for one in found.omitted_physics] == ["row_fpn"]
    assert not found.parameter_errors
    assert found.camera.effect[:2] == own


@pytest.mark.long
def test_a_wrong_size_and_omitted_physics_are_told_apart() -> None:
    noise = _effect("row_noise", sigma_dn=2.0)
    found = _found(camera(_prnu(1.0), noise), camera(_prnu(1.2)))
    assert found.verdict == "omitted_physics"
    assert [one.effect for one in found.omitted_physics] == ["row_noise"]
    (error,) = found.parameter_errors
    assert error.parameter == "effect.prnu.sigma_percent"
    assert abs(error.recorded - 1.0) < SURE * error.standard_error
    assert "fixed_pixel_variance" not in {m.statistic for m in found.mismatches}
    assert [own.kind for own in found.camera.effect] == ["prnu", "row_noise"]


def test_an_effect_has_a_size_where_one_number_less_of_it_is_less() -> None:
    some = (
        _prnu(1.0),
        _effect("tap_mismatch", gain_percent=-1.0, regions="left_right"),
        _effect("saturation", full_well_dn=3000.0),
        _effect("quantisation", step_dn=4.0),
        _effect("hot_pixels", pixel_fraction=0.01, mean_dn_per_s=100.0),
        _effect("row_noise", sigma_dn=0.0),
        _effect("dsnu", sigma_dn=1.0),
        _effect("dsnu", sigma_dn=2.0),
        _effect("smooth_prnu", sigma_percent=0.5, length_pixels=5.0),
    )
    found = sizes(camera(*some))
    assert [(own.effect.kind, own.name, own.model) for own in found] == [
        ("prnu", "sigma_percent", 1.0),
        ("tap_mismatch", "gain_percent", -1.0),
        ("row_noise", "sigma_dn", 0.0),
        ("smooth_prnu", "sigma_percent", 0.5),
    ]
    prnu, taps, _, smooth = found
    assert smooth.like(_effect("smooth_prnu", sigma_percent=0.7, length_pixels=9.0))
    assert not prnu.proposal.signed
    assert taps.proposal.signed
    assert prnu.beside(_prnu(1.0)).value == pytest.approx(2**0.5)
    assert not taps.like(_effect("tap_mismatch", gain_percent=-1.0, regions="top_bottom"))


@pytest.mark.long
@pytest.mark.parametrize("drift_dn", [0.0, 0.25])
def test_what_is_named_first_gives_back_what_another_size_makes(drift_dn: float) -> None:
    """A field took what a larger PRNU makes, was denied for it, and PRNU took the field.

    Beside a drift that has no word, too: what it leaves is no matter of either.
    """
    field = _effect("smooth_prnu", sigma_percent=0.31, length_pixels=3.8)
    drift = [_effect("black_level_drift", sigma_dn=drift_dn)] if drift_dn else []
    true, model = camera(_prnu(0.64), field, *drift, cfa="RGGB"), camera(_prnu(0.44), cfa="RGGB")
    recording = recorded(true, 3, rows=96, columns=96, levels=(100.0, 300.0, 900.0))
    words = VOCABULARY - {"black_level_drift"}
    found = find_mismatch(model, recording, seed=1, vocabulary=words)
    (named,) = found.omitted_physics
    assert named.effect == "smooth_prnu"
    assert {one.statistic for one in found.unexplained} == ({"frame_variance"} if drift else set())
    (error,) = (e for e in found.parameter_errors if e.parameter.startswith("effect"))
    assert error.parameter == "effect.prnu.sigma_percent"
    assert abs(error.recorded - 0.64) < SURE * error.standard_error
    sigma = named.parameters["sigma_percent"]
    assert abs(sigma.value - 0.31) < SURE * sigma.standard_error


def test_what_is_eased_is_asked_of_some_statistics_alone() -> None:
    before, after = (
        SimpleNamespace(mismatches=[SimpleNamespace(statistic=s, z=z) for s, z in own.items()])
        for own in ({"fixed_pixel_variance": -6.0, "level": 40.0}, {"level": -41.0})
    )
    assert eased({"fixed_pixel_variance", "skewness"}, before, after)  # type: ignore[arg-type]
    assert not eased({"level"}, before, after)  # type: ignore[arg-type]
    assert not eased({"fixed_pixel_variance"}, before, before)  # type: ignore[arg-type]
