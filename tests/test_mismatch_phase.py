"""What whole frames say of a line: whether its phase is kept, and which alias a mosaic has."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.phase import WholeFrames, aliases, keeps_phase, strongest
from dsis.effects.bistable_pattern import BistablePattern
from dsis.effects.dsnu import Dsnu
from dsis.effects.periodic_noise import PeriodicNoise

ROWS, COLUMNS, FRAMES, SD = 48, 64, 12, 2.0
FramesOf = Callable[[str], Iterator[NDArray[np.float64]]]
LAYOUT: Any = SimpleNamespace(
    rows=ROWS,
    columns=COLUMNS,
    channels=("R", "Gr", "Gb", "B"),
    uniform=(SimpleNamespace(name="dark"), SimpleNamespace(name="flat")),
    variance_dn2={(e, c): SD**2 for e in ("dark", "flat") for c in ("R", "Gr", "Gb", "B")},
)


def _frames(frequency: tuple[float, float], free: bool, frames: int = FRAMES) -> FramesOf:
    y, x = np.arange(ROWS)[:, np.newaxis], np.arange(COLUMNS)

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([4, len(name)])
        fixed = rng.normal(0, 5 * SD, (ROWS, COLUMNS))
        for _ in range(frames):
            phase = rng.uniform(0, 1) if free else 0.5 * rng.integers(2)
            wave = np.cos(2 * np.pi * (frequency[0] * x + frequency[1] * y + phase))
            yield 100 + fixed + 0.4 * SD * wave + rng.normal(0, SD, (ROWS, COLUMNS))

    return of


@pytest.mark.parametrize("free", [True, False])
def test_a_sign_keeps_the_phase_and_interference_does_not(free: bool) -> None:
    found = keeps_phase(LAYOUT, _frames((0.11, -0.23), free), (0.11, -0.23))
    assert found is not free


def test_few_frames_cannot_tell() -> None:
    assert keeps_phase(LAYOUT, _frames((0.11, -0.23), True, frames=3), (0.11, -0.23)) is None


@pytest.mark.parametrize("free", [True, False])
@pytest.mark.parametrize("which", range(4))
def test_the_mosaic_tells_aliases_that_its_planes_cannot(which: int, free: bool) -> None:
    """Every second pixel sees f and f + 1/2 alike; all pixels do not."""
    alike = aliases((0.25, 0.25))
    planted = alike[which]
    y, x = np.arange(0, ROWS, 2)[:, np.newaxis], np.arange(0, COLUMNS, 2)
    planes = [np.abs(np.cos(2 * np.pi * (fx * x + fy * y))) for fx, fy in alike]
    assert all(np.allclose(plane, planes[0]) for plane in planes)
    assert strongest(LAYOUT, _frames(planted, free), alike) in {
        planted,
        (-planted[0], -planted[1]),  # the same real wave
    }


def test_a_mean_is_no_line() -> None:
    assert sorted(aliases((0.0, 0.0))) == [(-0.5, -0.5), (-0.5, 0.0), (0.0, -0.5)]


@pytest.mark.parametrize("free", [True, False])
def test_a_line_is_denied_as_the_kind_that_it_is_not_and_frames_are_read_once(free: bool) -> None:
    frames, read = _frames((0.11, -0.23), free, 40), []

    def reading(name: str) -> Iterator[NDArray[np.float64]]:
        read.append(name)
        return frames(name)

    whole = WholeFrames(LAYOUT, reading)
    one = PeriodicNoise(kind="periodic_noise", amplitude_dn=0.8, frequency=(0.11, -0.23))
    other = BistablePattern(kind="bistable_pattern", amplitude_dn=0.8, frequency=(0.11, -0.23))
    right, wrong = (one, other) if free else (other, one)
    words = "another in every frame" if free else "the same in all frames"
    for _ in range(2):
        assert whole.denial(right) is None
        assert words in str(whole.denial(wrong))
    assert read == ["dark", "flat"]


def test_of_a_mosaic_only_the_alias_that_whole_frames_show_is_possible() -> None:
    whole = WholeFrames(LAYOUT, _frames((0.11, -0.23), free=True))
    line = {fx: PeriodicNoise(kind="periodic_noise", amplitude_dn=0.8, frequency=(fx, -0.23))
            for fx in (0.11, -0.39)}  # fmt: skip
    assert whole.shown(line[0.11])
    assert not whole.shown(line[-0.39])
    no_line = Dsnu(kind="dsnu", sigma_dn=1.0)
    assert whole.shown(no_line)
    assert whole.denial(no_line) is None
