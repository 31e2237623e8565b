"""Promise: small frames that are measured together have the measures of frames taken one by one."""

import numpy as np
import pytest

from dsis.cfa import Cfa
from dsis.measures import Accumulator
from stacks import noise, recorded


def taken(stack: np.ndarray, cfa: Cfa, at_once: int, **kept: bool) -> tuple[object, ...]:
    """Return what an accumulator finds that takes so many frames at once, and the others alone."""
    seen: list[np.ndarray] = []
    sums = Accumulator(
        *stack.shape[1:], cfa, 100.0, 4095.0, spectra=lambda one: seen.append(one.copy()), **kept
    )
    sums.add_all(list(stack[:at_once]))
    for frame in stack[at_once:]:
        sums.add(frame)
    found = sums.result()
    arrays = [
        value
        for channel in found.channels.values()
        for value in vars(channel).values()
        if isinstance(value, np.ndarray)
    ]
    codes = [channel.codes and channel.codes.counts for channel in found.channels.values()]
    return found.estimates(), found.frames, arrays, codes, seen


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GBRG])
@pytest.mark.parametrize("shape", [(2, 8, 12), (3, 70, 34), (6, 131, 33)])
@pytest.mark.parametrize("whole", [True, False])
def test_the_same_bytes(cfa: Cfa, shape: tuple[int, int, int], *, whole: bool) -> None:
    stack = recorded(900 + 5 * noise(*shape)).astype(np.float32)
    if not whole:
        stack[-1, 3, 2] += 0.25
    alone = taken(stack, cfa, 0)
    for count in {2, shape[0]}:
        np.testing.assert_equal(taken(stack, cfa, count), alone)


def test_without_power_and_neighbours() -> None:
    stack = recorded(900 + noise(4, 24, 30))
    for kept in ({"power": False}, {"neighbours": False}):
        np.testing.assert_equal(
            taken(stack, Cfa.RGGB, 4, **kept), taken(stack, Cfa.RGGB, 0, **kept)
        )


def test_refusals() -> None:
    stack = recorded(900 + noise(3, 8, 8)).astype(np.float32)
    with pytest.raises(ValueError, match=r"frame 1 is \(7, 8\), must be \(8, 8\)"):
        Accumulator(8, 8).add_all([stack[0], stack[1, 1:]])
    stack[2, 3, 3] = np.nan
    with pytest.raises(ValueError, match="frame 2 holds values that are not finite"):
        Accumulator(8, 8).add_all(list(stack))
