"""Greens that differ because charge leaks to other colours, whatever it is that is left of that."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.displaced import displaced
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of

Array = NDArray[np.float64]
LEVELS = (400.0, 1200.0, 2600.0)
COLOURS = {"R": 0.6, "G": 1.0, "B": 0.8}
SITES = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}
FRACTION, LITTLE = 0.02, 0.015
SLOPE, READ, BLACK = 0.5, 20.0, 64.0


def _shared(charge: Array, axis: int, fraction: float) -> Array:
    """Return frames (frame, row, column) that gave neighbours along an axis a share of charge."""
    here = (1 - 2 * fraction) * charge
    return here + fraction * (np.roll(charge, 1, axis) + np.roll(charge, -1, axis))


def _state(
    model: Any,
    *,
    axis: int = 2,
    fraction: float = 0.0,
    greens: float = 0.0,
    memory: float = 0.0,
) -> Any:
    """Return a state of a mosaic under light of three colours; `greens` differ by that share.

    `memory`: share of the sample three before along the axis that is read once more, light and all.
    """
    recording = recorded(camera(cfa="RGGB"), 5, levels=LEVELS, lit=False)
    assert recording.stacks is not None
    rng = np.random.default_rng(8)
    for name, frames in recording.stacks.items():
        level = 0.0 if name.startswith("dark") else LEVELS[int(name.removeprefix("flat-"))]
        mean = np.zeros(frames.shape)
        for site, (y, x) in SITES.items():
            own = {"Gr": 1 + greens / 2, "Gb": 1 - greens / 2}.get(site, 1.0)
            mean[:, y::2, x::2] = level * COLOURS[site[0]] * own
        charge = mean + (SLOPE * mean) ** 0.5 * rng.standard_normal(frames.shape)
        read = READ**0.5 * rng.standard_normal(frames.shape)
        made = _shared(charge, axis, fraction) + read
        made += BLACK + memory * np.roll(made, 3, axis)
        recording.stacks[name] = np.rint(made).clip(0, 4095).astype(np.uint16)
    return state_of(recording, camera(*model, cfa="RGGB"))


def _said(state: Any, kind: str = "channel_imbalance") -> Any:
    others = tuple(e for e in state.camera.effect if e.kind != kind)
    without = state.camera.model_copy(update={"effect": others})
    return displaced(state, kind, state.null.mean, state.predictor(8).mean(without))


@pytest.mark.parametrize(("axis", "sign"), [(2, 1), (1, -1)])
def test_what_colours_share_makes_the_greens_differ(axis: int, sign: int) -> None:
    """Along rows Gr gains 2 f (R - B) / G beside Gb, along columns it loses as much."""
    percent = 200 * FRACTION * sign * (COLOURS["R"] - COLOURS["B"])
    own = {"gain_percent": percent}
    state = _state([registry()["channel_imbalance"](**own)], axis=axis, fraction=FRACTION)
    denial = _said(state)
    assert denial is not None
    assert denial.share < 0.4
    assert "other colours" in denial.why


@pytest.mark.long
@pytest.mark.parametrize(("axis", "along", "sign"), [(2, "rows", 1), (1, "columns", -1)])
def test_what_samples_remember_of_other_colours_makes_the_greens_differ(
    axis: int, along: str, sign: int
) -> None:
    share = -0.03
    percent = 100 * share * sign * (COLOURS["R"] - COLOURS["B"])
    greens = registry()["channel_imbalance"](gain_percent=percent)
    own = {"fraction": share, "lag_pixels": 3, "along": along}
    memory = registry()["readout_memory"](**own)
    denial = _said(_state([memory, greens], axis=axis, memory=share))
    assert denial is not None
    assert denial.share < 0.4
    assert "remember" in denial.why
    # Four before is of the same colour, and greens that differ by more do so by themselves.
    even = registry()["readout_memory"](**{**own, "lag_pixels": 4})
    assert _said(_state([even, greens], axis=axis, greens=percent / 100)) is None
    # Memory of the signal has its part in what is predicted already.
    whole = registry()["readout_memory"](**own, remembers="signal")
    assert _said(_state([whole, greens], axis=axis, greens=percent / 100)) is None
    strong = registry()["channel_imbalance"](gain_percent=5 * percent)
    assert _said(_state([memory, strong], axis=axis, greens=percent / 20)) is None


def test_crosstalk_too_small_to_be_seen_but_in_the_greens_may_be_memory() -> None:
    """It makes neighbours alike, which show it by less than the greens that it makes differ."""
    own = {"fraction": -0.03, "lag_pixels": 3, "along": "rows"}
    memory = registry()["readout_memory"](**own)
    little = registry()["crosstalk"](fraction=LITTLE, along="columns")
    denial = _said(_state([memory, little], memory=-0.03), "crosstalk")
    assert denial is not None
    assert "remember" in denial.why
    assert _said(_state([little], axis=1, fraction=LITTLE), "crosstalk") is None


def test_greens_that_differ_by_themselves_are_not_denied() -> None:
    own = {"gain_percent": 0.8}
    effect = registry()["channel_imbalance"](**own)
    assert _said(_state([effect], greens=0.008)) is None
    # Nor where they differ by far more than what is shared makes.
    strong = {"gain_percent": 3.0}
    effect = registry()["channel_imbalance"](**strong)
    state = _state([effect], greens=0.03, fraction=FRACTION)
    assert _said(state) is None
