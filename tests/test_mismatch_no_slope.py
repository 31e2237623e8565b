"""A slope of the camera file that no flat tells bends nothing."""

from types import SimpleNamespace
from typing import Any

import pytest

from analysis.mismatch.noslope import untold_slope
from exposing import effect


@pytest.mark.parametrize(
    ("kinds", "kind", "denied"),
    [
        (("dark",), "nonlinearity", True),  # and scenes, which are not uniform
        ((), "nonlinearity", True),
        (("dark", "flat"), "nonlinearity", False),
        (("dark",), "saturation", False),
    ],
)
def test_a_bend_needs_a_flat(kinds: tuple[str, ...], kind: str, denied: bool) -> None:
    values = {"nonlinearity": {"percent_full_scale": 0.9}, "saturation": {"full_well_dn": 900.0}}
    uniform = [SimpleNamespace(kind=one) for one in kinds]
    state: Any = SimpleNamespace(setting=SimpleNamespace(layout=SimpleNamespace(uniform=uniform)))
    assert (untold_slope(state, effect(kind, **values[kind])) is not None) is denied
