"""What a finding has of a named effect: what was fitted, and how well it is known."""

import math
from typing import Any

import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.finding import FittedParameter, Gain
from analysis.mismatch.jsonfile import _fitted
from analysis.mismatch.named import Named
from analysis.mismatch.omitted import omitted_effect
from analysis.mismatch.report.sentences import fitted
from dsis.effects import registry

STATE: Any = None
GAIN = Gain(2.0, (1.0, 3.0))


def _made(
    kind: str,
    free: tuple[str, ...],
    errors: dict[str, float],
    known: dict[str, float],
    **values: Any,
) -> Any:
    effect = registry()[kind](**values)
    named = Named(kind, Proposal(effect, free, errors=known), errors, 5.0, (("impulse", 4.0),))
    return omitted_effect(named, ("level",), GAIN, STATE)


def test_a_term_that_is_no_part_of_an_effect_is_none_without_an_error() -> None:
    found = _made(
        "shading", ("falloff_percent",), {"falloff_percent": 0.02}, {}, falloff_percent=0.4
    )
    assert found.parameters.pop("falloff_percent").standard_error == 0.02
    assert found.parameters
    for term in found.parameters.values():
        assert (term.value, term.standard_error) == (0, 0)
    fitted_to_none = _made(
        "shading",
        ("falloff_percent", "tilt_down_percent"),
        {"falloff_percent": 0.02, "tilt_down_percent": 0.1},
        {},
        falloff_percent=0.4,
        tilt_down_percent=0.0,
    )
    assert fitted_to_none.parameters["tilt_down_percent"].standard_error == 0.1


def test_exact_values_have_no_error_and_taken_ones_may_be_any() -> None:
    lag = _made("readout_memory", ("fraction",), {"fraction": 0.01}, {}, fraction=0.1, lag_pixels=2)
    assert lag.parameters["lag_pixels"].standard_error == 0
    jumps = {"pixel_fraction": 0.01, "amplitude_dn": 5.0, "switch_probability": 0.1}
    free = ("pixel_fraction", "amplitude_dn")
    errors = {"pixel_fraction": 0.001, "amplitude_dn": 0.2}
    taken = _made("rts", free, errors, {}, **jumps).parameters["switch_probability"]
    assert math.isinf(taken.standard_error)
    assert _fitted(taken) == {"value": 0.1, "standard_error": pytest.approx(100.0)}
    measured = _made("rts", free, errors, {"switch_probability": 0.03}, **jumps)
    assert measured.parameters["switch_probability"].standard_error == 0.03
    unknown = _made("rts", free, {"amplitude_dn": 0.2}, {}, **jumps)
    assert math.isinf(unknown.parameters["pixel_fraction"].standard_error)


def test_a_rival_that_came_near_says_what_would_settle_it() -> None:
    found = _made("impulse", (), {}, {}, per_megapixel_frame=20.0, mean_dn=100.0)
    (rival,) = found.alternatives
    assert rival.why_not == "explains the numbers 4 nats worse"
    assert rival.would_settle


def test_a_value_that_was_taken_is_said_to_be_not_measured() -> None:
    assert fitted("switch_probability", FittedParameter(0.1, math.inf)) == (
        "switch probability 0.1 (not measured)"
    )
    assert fitted("spread_percent", FittedParameter(0.5, 0.1)) == "spread 0.50 ± 0.10 %"
