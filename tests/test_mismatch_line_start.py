"""Lines that begin at black: samples that remember the one before say so at their first ones."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.signal

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.linemeans import LineMeans
from analysis.mismatch.candidates.linestart import lines_begin_darker
from dsis.effects import registry
from mismatch_recordings import TWO_LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

BLACK, SLOPE, READ = 64.0, 0.5, 20.0
STEP = {"MONO": 1, "RGGB": 2}


def _filtered(cfa: str, taps: list[float], poles: list[float], axis: int) -> InMemory:
    """Return frames that scipy's causal filter made, from nothing before each line."""
    made = recorded(camera(cfa=cfa), 3, rows=64, columns=96, levels=TWO_LEVELS, lit=False)
    assert made.stacks is not None
    rng = np.random.default_rng(11)
    for name, frames in made.stacks.items():
        level = 0.0 if name.startswith("dark") else TWO_LEVELS[int(name.removeprefix("flat-"))]
        signal = level + (SLOPE * level + READ) ** 0.5 * rng.standard_normal(frames.shape)
        codes = BLACK + scipy.signal.lfilter(taps, poles, signal, axis=axis)
        made.stacks[name] = np.rint(codes).clip(0, 4095).astype(np.uint16)
    return made


@pytest.mark.parametrize(
    ("cfa", "lag", "axis", "along"),
    [("MONO", 1, 2, "rows"), pytest.param("RGGB", 8, 1, "columns", marks=pytest.mark.long)],
)
def test_memory_that_begins_at_black_is_named_and_nothing_else(
    cfa: str, lag: int, axis: int, along: str
) -> None:
    """Of noise alone it ties with a filter; first lines were amplifiers, or lines that settle."""
    share = 0.056
    recording = _filtered(cfa, [1.0, *[0.0] * (lag - 1), share], [1.0], axis)
    found = find_mismatch(camera(cfa=cfa), recording)
    (named,) = found.omitted_physics
    assert named.effect == "readout_memory"
    assert named.parameters["lag_pixels"].value == lag
    assert named.choices == {"along": along, "remembers": "signal", "before_line": "black"}
    fitted = named.parameters["fraction"]
    assert isinstance(fitted.value, float)
    assert isinstance(fitted.standard_error, float)
    assert abs(fitted.value - share / (1 + share)) < 4 * fitted.standard_error
    assert not found.unexplained


@pytest.mark.long
def test_an_amplifier_that_follows_itself_is_memory_of_the_sample_before() -> None:
    """A pole at 0.042: beyond one sample two thousandths are left."""
    found = find_mismatch(camera(), _filtered("MONO", [0.958], [1.0, -0.042], 2))
    assert [own.effect for own in found.omitted_physics] == ["readout_memory"]


def _clues(means: np.ndarray, *, signal: float = 1000.0) -> Any:
    """Return clues of two flats and a dark of such means of columns."""
    names = {"dark": 0.0, "flat-0": signal, "flat-1": 2 * signal}
    rng = np.random.default_rng(2)
    lines = {
        (name, "column"): LineMeans(8, own, own - np.median(own), own, 8.0, own)
        for name, level in names.items()
        for own in [level * means + rng.standard_normal(means.size)]
    }
    return SimpleNamespace(
        layout=SimpleNamespace(
            uniform=[SimpleNamespace(name=name) for name in names], channels=("MONO",)
        ),
        seen=SimpleNamespace(lines=lines),
        signal=lambda place: names[place[0]],
    )


@pytest.mark.parametrize("share", [0.02, -0.02])
def test_the_share_is_that_of_the_signal(share: float) -> None:
    means = np.ones(96)
    means[:3] -= share
    assert lines_begin_darker(_clues(means), "rows", 3) == pytest.approx(share, rel=0.1)
    assert lines_begin_darker(_clues(means), "columns", 3) == 0  # rows were not looked at


def test_lines_that_scatter_or_are_few_say_nothing() -> None:
    rng = np.random.default_rng(5)
    means = 1 + 0.02 * rng.standard_normal(96)
    means[:2] -= 0.02
    assert lines_begin_darker(_clues(means), "rows", 2) == 0
    assert lines_begin_darker(_clues(np.ones(96)), "rows", 2) == 0
    few = np.ones(12)
    few[:8] = 0.9
    assert lines_begin_darker(_clues(few), "rows", 8) == 0
    assert lines_begin_darker(_clues(means, signal=0.0), "rows", 2) == 0


def test_black_is_no_noise() -> None:
    word = registry()["readout_memory"]
    with pytest.raises(ValueError, match='needs remembers = "signal"'):
        word(fraction=0.1, lag_pixels=1, before_line="black")
