"""An effect whose own size does not tell it from none is not named."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.confirmed import small
from analysis.mismatch.named import Named, unclear
from dsis.effects import registry
from mismatch_findings import decay


@pytest.mark.parametrize(("error", "clear"), [(0.2, True), (0.5, False)])
def test_what_draws_nothing_must_exceed_its_own_errors(error: float, clear: bool) -> None:
    """Its length is sure, but it is the size that tells a decay from none."""
    assert (unclear(decay(-1.2, error)) == "") == clear
    assert "gain percent -1.2 ± 0.5" in unclear(decay(-1.2, 0.5))
    assert unclear(decay(-1.2, float("nan"))) == ""  # unknown is not none
    drift = registry()["black_level_drift"](sigma_dn=1.0)
    few = Named("black_level_drift", Proposal(drift, ("sigma_dn",)), {"sigma_dn": 0.5}, 9.0, ())
    assert unclear(few) == ""  # of few frames, and certain


@pytest.mark.parametrize(("error", "clear"), [(0.1, True), (0.49, True), (0.65, False)])
def test_a_size_whose_logarithm_is_fitted_is_told_by_errors_of_that(
    error: float, clear: bool
) -> None:
    """1.96 errors reach to the farther end of its interval: from 1 to e^(1.96 / z), z of them."""
    share = registry()["crosstalk"](fraction=0.01)
    errors = {"fraction": 0.01 * np.expm1(1.96 * error / 1.5) / 1.96}
    named = Named("crosstalk", Proposal(share, ("fraction",)), errors, 9.0, ())
    assert (unclear(named) == "") == (1.5 / error > 3)
    assert clear == (1.5 / error > 3)


def test_a_bend_at_full_scale_is_known_no_better_than_its_exponent() -> None:
    bend = registry()["nonlinearity"](percent_full_scale=0.4, exponent=4.0)
    errors = {"percent_full_scale": 0.2, "exponent": 1.0}
    for free, clear in (
        (("percent_full_scale", "exponent"), True),
        (("percent_full_scale",), False),
    ):
        named = Named("nonlinearity", Proposal(bend, free), errors, 34.0, ())
        assert (unclear(named) == "") == clear
        unknown = Named("nonlinearity", Proposal(bend, free), {**errors, "exponent": 5.0}, 34.0, ())
        assert "percent full scale" in unclear(unknown)


@pytest.mark.parametrize("left", [True, False])
def test_what_draws_must_exceed_its_errors_where_what_calls_for_it_is_left(left: bool) -> None:
    """A camera averages frames: pixels that jump fit a little of it, and frames gain by that."""
    jumps = registry()["rts"](pixel_fraction=0.16, amplitude_dn=0.7, switch_probability=0.1)
    errors = {"pixel_fraction": 1.1, "amplitude_dn": 0.7}
    named = Named("rts", Proposal(jumps, tuple(errors)), errors, 90.0, ())
    surely: Any = Stub(nats=0.0, certain=True, gain=Stub(nats_per_frame=1.6, ci95=(1.3, 1.9)))
    state: Any = Stub(
        mismatches=[Stub(statistic="frame_correlation")] if left else [],
        chances=np.array([]),
        null=Stub(keys=()),
    )
    search: Any = None  # nothing more is asked: no number of the bank is known
    assert ("pixel fraction 0.16 ± 1.1" in small(search, state, named, surely)) == left
    sure = Named("rts", Proposal(jumps, tuple(errors)), {**errors, "amplitude_dn": 0.1}, 90.0, ())
    assert small(search, state, sure, surely) == ""
