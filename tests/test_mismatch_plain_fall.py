"""Whether light falls to the corners at all, where the shape of its fall is not clear."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.named import Named, unclear
from analysis.mismatch.polish import Free
from analysis.mismatch.uncertainty import _plain
from exposing import effect

NORMAL = 1.96
FREE: list[Free] = [(0, "falloff_percent", False), (0, "ring_percent", True)]
LAYOUT: Any = Stub()


def _fitted(ring: float) -> tuple[float, float, np.ndarray, float, float]:
    """Return logarithm of a fall and ring by least squares, their covariance, and the fall alone.

    Last the error of that. Both shapes are much alike.
    """
    rng = np.random.default_rng(3)
    x = rng.normal(size=(200, 2)) @ np.array([[1.0, 0.6], [0.0, 0.3]])
    y = x @ [np.log(0.06), ring] + 0.5 * rng.normal(size=200)
    covariance = 0.25 * np.linalg.inv(x.T @ x)
    fall, bend = np.linalg.solve(x.T @ x, x.T @ y)
    (alone,), *_ = np.linalg.lstsq(x[:, :1], y, rcond=None)
    return fall, bend, covariance, alone, 0.5 / np.sqrt((x[:, 0] ** 2).sum())


def test_without_a_ring_a_fall_is_what_a_fit_of_it_alone_finds() -> None:
    fall, ring, covariance, alone, error = _fitted(0.0)
    both = effect("shading", falloff_percent=np.exp(fall), ring_percent=ring)
    found = _plain(both, 0, FREE, NORMAL**2 * covariance, LAYOUT)
    assert found is not None
    plain, errors = found
    value = float(np.exp(alone))
    expected = effect("shading", falloff_percent=value).model_dump()
    assert plain.model_dump() == {**expected, "falloff_percent": pytest.approx(value, rel=1e-9)}
    farther = value * np.expm1(NORMAL * error) / NORMAL
    assert errors == {"falloff_percent": pytest.approx(farther, rel=1e-9)}


def test_a_ring_that_is_clear_is_there() -> None:
    fall, ring, covariance, _, _ = _fitted(3.0)
    both = effect("shading", falloff_percent=np.exp(fall), ring_percent=ring)
    assert _plain(both, 0, FREE, NORMAL**2 * covariance, LAYOUT) is None


def test_without_a_ring_that_is_fitted_nothing_is_said() -> None:
    alone = effect("shading", falloff_percent=0.06)
    assert _plain(alone, 0, FREE[:1], np.eye(1), LAYOUT) is None
    assert (
        _plain(effect("row_noise", sigma_dn=1.0), 0, [(0, "sigma_dn", False)], np.eye(1), LAYOUT)
        is None
    )


@pytest.mark.parametrize(("alone", "clear"), [(0.01, True), (0.03, False)])
def test_a_fall_is_there_where_that_of_a_plain_shape_is_sure(alone: float, clear: bool) -> None:
    """A ring that is not clear makes the fall in the corners less known, not less there."""
    fall = effect("shading", falloff_percent=0.06, ring_percent=0.01)
    errors = {"falloff_percent": 0.031, "ring_percent": 0.05}
    proposal = Proposal(fall, tuple(errors), frozenset({"ring_percent"}))
    unknown = Named("shading", proposal, errors, 17.0, ())
    assert "falloff percent 0.06 ± 0.031" in unclear(unknown)
    plain = effect("shading", falloff_percent=0.056), {"falloff_percent": alone}
    named = Named("shading", proposal, errors, 17.0, (), plain=plain)
    assert (unclear(named) == "") == clear


def test_a_bend_whose_exponent_is_open_is_as_sure_as_a_parabola() -> None:
    rng = np.random.default_rng(5)
    x = rng.normal(size=(200, 2)) @ np.array([[1.0, 0.6], [0.0, 0.3]])
    y = x @ [-0.4, 0.0] + 0.5 * rng.normal(size=200)
    covariance = 0.25 * np.linalg.inv(x.T @ x)
    size, logarithm = np.linalg.solve(x.T @ x, x.T @ y)
    (alone,), *_ = np.linalg.lstsq(x[:, :1], y, rcond=None)
    error = 0.5 / np.sqrt((x[:, 0] ** 2).sum())
    values = {"percent_full_scale": size, "exponent": float(np.exp(logarithm))}
    free: list[Free] = [(0, "percent_full_scale", True), (0, "exponent", False)]
    found = _plain(effect("nonlinearity", **values), 0, free, NORMAL**2 * covariance, LAYOUT)
    assert found is not None
    plain, errors = found
    expected = effect("nonlinearity", percent_full_scale=float(alone)).model_dump()
    assert plain.model_dump() == {**expected, "percent_full_scale": pytest.approx(alone, rel=1e-9)}
    assert errors == {"percent_full_scale": pytest.approx(error, rel=1e-9)}
    sure = NORMAL**2 * np.diag([0.01, 0.01])
    steep = effect("nonlinearity", percent_full_scale=size, exponent=4.0)
    assert _plain(steep, 0, free, sure, LAYOUT) is None
