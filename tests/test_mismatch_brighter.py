"""Charge that repels charge, and neighbours alike for another reason: frames made by numpy."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.brighter import no_brighter_alike
from analysis.mismatch.displaced import displaced
from analysis.mismatch.state import State
from dsis.cfa import Cfa, pattern
from mismatch_recordings import camera, recorded, state_of

Array = NDArray[np.float64]
KIND = "brighter_fatter"
LEVELS = (60.0, 250.0, 700.0, 1600.0, 2800.0)
SIGNALS = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": s for i, s in enumerate(LEVELS)}
SLOPE, READ, BLACK, BRIGHTEST = 0.5, 20.0, 64.0, 2800.0
SHARE = 0.012  # of what a pixel collects, that it gives each neighbour, at the brightest at most
RESPONSE = (0.6, 1.0, 0.7)


def _exchanged(light: Array, given: Array, axes: tuple[int, ...]) -> Array:
    """Return light of which each pixel has given a share to its neighbours along some axes."""
    made = light.copy()
    for axis in axes:
        for step in (1, -1):
            made += np.roll(given * light, step, axis) - given * light
    return made


@cache
def _state(law: str, cfa: str, axes: tuple[int, ...], pink: float = 0.0) -> State:
    """Return a state of noise that neighbours share by a law; `pink` is alike along rows."""
    true = camera(cfa=cfa)
    recording = recorded(true, 5, levels=LEVELS)
    assert recording.stacks is not None
    for i, (name, frames) in enumerate(recording.stacks.items()):
        rng = np.random.default_rng([3, i])
        response = np.array(RESPONSE)[pattern(Cfa(cfa))] if cfa != "MONO" else np.ones((2, 2))
        rows, columns = frames.shape[1:]
        signal = SIGNALS[name] * np.tile(response, (rows // 2, columns // 2))
        light = rng.normal(0, 1, frames.shape) * np.sqrt(SLOPE * signal)
        charge = SHARE * signal / BRIGHTEST
        given = {"light": SHARE / 2, "charge": charge, "both": SHARE + charge, "none": 0.0}[law]
        noise = _exchanged(light, np.broadcast_to(given, signal.shape), axes)
        read = rng.normal(0, READ**0.5, frames.shape)
        read = (read + pink * np.roll(read, 1, 2)) / (1 + pink**2) ** 0.5
        codes = np.rint(BLACK + signal + noise + read)
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return state_of(recording, true)


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize(("axes", "pink"), [((1, 2), 0.0), ((2,), 0.0), ((1, 2), 0.2)])
def test_neighbours_that_share_light_alone_deny_it(
    cfa: str, axes: tuple[int, ...], pink: float
) -> None:
    """Noise of read-out that is alike along rows is no word on either."""
    state = _state("light", cfa, axes, pink)
    denial = no_brighter_alike(state, KIND, state.null.mean)
    assert displaced(state, KIND, state.null.mean) == denial  # which search and judge ask
    assert denial is not None
    assert denial.share < 0.05


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize(("axes", "pink"), [((1, 2), 0.0), ((2,), 0.0), ((1, 2), 0.2)])
def test_neighbours_that_are_alike_the_more_the_brighter_do_not(
    cfa: str, axes: tuple[int, ...], pink: float
) -> None:
    state = _state("charge", cfa, axes, pink)
    assert no_brighter_alike(state, KIND, state.null.mean) is None


def test_charge_beside_neighbours_that_share_light_for_another_reason_stays() -> None:
    state = _state("both", "MONO", (1, 2))
    assert no_brighter_alike(state, KIND, state.null.mean) is None


@pytest.mark.parametrize("pink", [0.0, 0.2])
def test_where_light_shares_nothing_nothing_is_told(pink: float) -> None:
    state = _state("none", "MONO", (1, 2), pink)
    assert no_brighter_alike(state, KIND, state.null.mean) is None
    assert no_brighter_alike(_state("light", "MONO", (1, 2)), "prnu", state.null.mean) is None
