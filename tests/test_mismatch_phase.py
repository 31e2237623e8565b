"""What whole frames say of a line: whether its phase is kept, and which alias a mosaic has."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.aliases import aliases, strongest
from analysis.mismatch.phase import WholeFrames, look
from dsis.effects.bistable_pattern import BistablePattern
from dsis.effects.dsnu import Dsnu
from dsis.effects.periodic_noise import PeriodicNoise

ROWS, COLUMNS, FRAMES, SD = 48, 64, 12, 2.0
CHANNELS = ("R", "Gr", "Gb", "B")
FramesOf = Callable[[str], Iterator[NDArray[np.float64]]]
LAYOUT: Any = SimpleNamespace(
    rows=ROWS,
    columns=COLUMNS,
    channels=CHANNELS,
    uniform=(SimpleNamespace(name="dark"), SimpleNamespace(name="flat")),
    variance_dn2={(e, c): SD**2 for e in ("dark", "flat") for c in CHANNELS},
    still=frozenset(),
    signal_dn={
        (e, c): 400.0 * (e == "flat") for e in ("dark", "flat") for c in ("R", "Gr", "Gb", "B")
    },
)


def _frames(
    frequency: tuple[float, float], free: bool, frames: int = FRAMES, amplitude: float = 0.4
) -> FramesOf:
    y, x = np.arange(ROWS)[:, np.newaxis], np.arange(COLUMNS)

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([4, len(name)])
        fixed = rng.normal(0, 5 * SD, (ROWS, COLUMNS))
        for _ in range(frames):
            phase = rng.uniform(0, 1) if free else 0.5 * rng.integers(2)
            wave = np.cos(2 * np.pi * (frequency[0] * x + frequency[1] * y + phase))
            yield 100 + fixed + amplitude * SD * wave + rng.normal(0, SD, (ROWS, COLUMNS))

    return of


@pytest.mark.parametrize("free", [True, False])
def test_a_sign_keeps_the_phase_and_interference_does_not(free: bool) -> None:
    found = look(LAYOUT, _frames((0.11, -0.23), free), (0.11, -0.23)).kept
    assert found is not free


def test_few_frames_cannot_tell() -> None:
    assert look(LAYOUT, _frames((0.11, -0.23), True, frames=3), (0.11, -0.23)).kept is None


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
def test_a_line_is_denied_as_the_kind_that_it_is_not_and_asked_for_once(free: bool) -> None:
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
    assert read == ["dark", "flat"] * 2  # the line itself, and what is beside it


def test_of_a_mosaic_only_the_alias_that_whole_frames_show_is_possible() -> None:
    whole = WholeFrames(LAYOUT, _frames((0.11, -0.23), free=True))
    line = {fx: PeriodicNoise(kind="periodic_noise", amplitude_dn=0.8, frequency=(fx, -0.23))
            for fx in (0.11, -0.39)}  # fmt: skip
    assert whole.shown(line[0.11])
    assert not whole.shown(line[-0.39])
    no_line = Dsnu(kind="dsnu", sigma_dn=1.0)
    assert whole.shown(no_line)
    assert whole.denial(no_line) is None


@pytest.mark.parametrize("free", [True, False])
def test_the_phase_of_a_weak_line_is_told_by_its_likelihood(free: bool) -> None:
    """Of 36 samples of noise power 1 and a line of 1.5 the squares alone say too little."""
    f = (0.11, -0.23)
    told = [look(LAYOUT, _frames(f, free, n, amplitude=0.045), f) for n in range(36, 46)]
    assert all(not one.absent and not one.broad for one in told)
    kept = [one.kept for one in told]
    assert free not in kept
    assert kept.count(not free) >= 8


def test_noise_holds_no_line() -> None:
    """The largest of all bins is what chance does: it is not one too often."""
    frames = [_frames((0.11, -0.23), True, 20, amplitude=0.0)(name) for name in ("dark", "flat")]
    stack = np.stack([np.stack(list(one)) for one in frames])
    of = dict(zip(("dark", "flat"), stack, strict=True))
    centred = stack - stack.mean((1, 2, 3), keepdims=True)
    centred -= centred.mean(1, keepdims=True)
    power = (np.abs(np.fft.fft2(centred)) ** 2).sum((0, 1))
    power[0, 0] = 0
    y, x = np.unravel_index(power.argmax(), power.shape)
    assert look(LAYOUT, lambda name: iter(of[name]), (x / COLUMNS, y / ROWS)).absent


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("wave", [0.0, 0.5])
def test_the_slowest_wave_of_noise_that_rises_is_no_line(seed: int, wave: float) -> None:
    """Means of rows that wander, weakly: their one slow wave stands out, and may be a line."""
    rows = 96
    layout: Any = SimpleNamespace(**{**vars(LAYOUT), "rows": rows, "channels": ("MONO",)})
    layout.variance_dn2 = {(e, "MONO"): SD**2 for e in ("dark", "flat")}
    layout.signal_dn = {("dark", "MONO"): 0.0, ("flat", "MONO"): 400.0}
    at = (0.0, 1.1 / rows)

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([seed, len(name)])
        f = np.arange(0.5, rows / 2, 0.5)
        turns = 2 * np.pi * np.arange(rows)[:, np.newaxis] * f / rows
        for _ in range(20):
            parts = 0.0 if wave else rng.normal(size=(2, f.size)) * 0.16 / np.sqrt(f)
            lines = (np.stack([np.cos(turns), np.sin(turns)]) * np.reshape(parts, (-1, 1, f.size))
                     if not wave else np.zeros((2, rows, f.size)))  # fmt: skip
            phase = 2 * np.pi * (at[1] * np.arange(rows) + rng.uniform())
            one = lines.sum((0, 2)) + wave * np.cos(phase)
            yield one[:, np.newaxis] + rng.normal(0, SD, (rows, COLUMNS))

    seen = look(layout, of, at)
    assert seen.absent is not bool(wave) or seen.broad


@pytest.mark.parametrize("row_noise", [0.0, 0.3])
def test_a_band_is_no_line_and_a_line_beside_noise_of_rows_is(row_noise: float) -> None:
    """Slow waves of rows raise the bins beside the highest; row noise raises all bins alike."""

    def frames(band: bool) -> FramesOf:
        def of(name: str) -> Iterator[NDArray[np.float64]]:
            rng = np.random.default_rng([6, len(name)])
            for _ in range(20):
                f = np.arange(1, 7) if band else np.array([3])
                parts = rng.normal(size=(2, f.size)) / np.sqrt(f if band else 1)
                turns = 2 * np.pi * np.arange(ROWS)[:, np.newaxis] * f / ROWS
                lines = (np.cos(turns) * parts[0] + np.sin(turns) * parts[1]).sum(1)
                lines = lines + row_noise * rng.normal(size=ROWS)
                yield lines[:, np.newaxis] + rng.normal(0, SD, (ROWS, COLUMNS))

        return of

    at = (0.0, 3 / ROWS)
    assert look(LAYOUT, frames(band=True), (0.0, 1 / ROWS)).broad
    assert look(LAYOUT, frames(band=True), at).broad
    seen = look(LAYOUT, frames(band=False), at)
    assert not seen.absent
    assert not seen.broad


@pytest.mark.parametrize("at", [(0.0, 1 / ROWS), (1 / COLUMNS, 0.0)])
def test_one_cycle_a_frame_is_a_line_too(at: tuple[float, float]) -> None:
    """Two bins below it is the same real wave, running backwards."""
    seen = look(LAYOUT, _frames(at, free=True), at)
    assert not seen.absent
    assert not seen.broad


def test_a_line_beside_a_stronger_one_is_a_line() -> None:
    weak, strong = (0.125, -0.25), (0.125 + 2 / COLUMNS, -0.25)

    def both(name: str) -> Iterator[NDArray[np.float64]]:
        waves = zip(
            _frames(weak, True)(name), _frames(strong, True, amplitude=0.8)(name), strict=True
        )
        return (one + other for one, other in waves)

    seen = look(LAYOUT, both, weak)
    assert not seen.absent
    assert not seen.broad


@pytest.mark.parametrize("at", [(0.5, 0.5), (0.5, 0.0), (0.25, 0.25), (0.0, 0.25)])
def test_noise_holds_as_few_patterns_of_single_pixels_as_chance_allows(
    at: tuple[float, float],
) -> None:
    """Of 200 recordings 5 % over 8 such patterns are 1.25."""
    rng = np.random.default_rng(7)
    found = 0
    for _ in range(200):
        of = {e.name: 100 + rng.normal(0, SD, (8, ROWS, COLUMNS)) for e in LAYOUT.uniform}
        found += not look(LAYOUT, lambda name, of=of: iter(of[name]), at).absent
    assert found <= 6  # more in one of a thousand


def test_what_repeats_over_eight_pixels_lies_where_it_lies() -> None:
    at = (0.125, -0.375)
    seen = look(LAYOUT, _frames(at, free=False), at)
    assert seen.exact
    assert seen.kept
    assert seen.frequency is None


@pytest.mark.parametrize(("across", "down"), [(0.2, 0.2), (0.3, 0.0), (0.0, -0.3)])
def test_interference_beside_an_eighth_is_looked_for_there(across: float, down: float) -> None:
    """A fifth of a bin off is no pattern of eight pixels: its frequency is measured."""
    at = (0.125 + across / COLUMNS, 0.375 + down / ROWS)
    seen = look(LAYOUT, _frames(at, free=True), (0.125, 0.375))
    assert not seen.exact
    assert seen.frequency is not None
    off = [(a - b) * n for a, b, n in zip(seen.frequency, at, (COLUMNS, ROWS), strict=True)]
    assert max(map(abs, off)) < 0.1


def test_a_weak_line_of_eight_pixels_is_not_named_where_few_frames_know_no_phase() -> None:
    at = (0.125, 0.375)
    whole = WholeFrames(LAYOUT, _frames(at, free=True, frames=3))
    line: Any = {"kind": "bistable_pattern", "amplitude_dn": 1.0, "frequency": at}
    assert whole.denial(BistablePattern(**line)) == "frames do not tell whether its phase is kept"


@pytest.mark.parametrize(("of_light", "sizes"), [(True, (0.0, 1.0)), (False, (1.0, 1.0))])
@pytest.mark.parametrize("at", [(0.0, 0.5), (0.21, 0.13)])
def test_a_pattern_that_grows_with_the_light_is_none_of_the_read_out(
    at: tuple[float, float], of_light: bool, sizes: tuple[float, float]
) -> None:
    """Two fields of rows that flicker each by itself, say, and interference on light."""
    for seed in range(5):

        def of(name: str, seed: int = seed) -> Iterator[NDArray[np.float64]]:
            rng = np.random.default_rng([seed, len(name)])
            y, x = np.arange(ROWS)[:, np.newaxis], np.arange(COLUMNS)
            for _ in range(FRAMES):
                phase = 0.5 * rng.integers(2) if at[1] == 0.5 else rng.uniform()
                wave = np.cos(2 * np.pi * (at[0] * x + at[1] * y + phase))
                size = 0.3 * SD * sizes[name == "flat"]
                yield 100 + size * wave + rng.normal(0, SD, (ROWS, COLUMNS))

        seen = look(LAYOUT, of, at)
        assert not seen.absent
        assert seen.grows == of_light
        kind = BistablePattern if at[1] == 0.5 else PeriodicNoise
        denial = WholeFrames(LAYOUT, of).denial(kind(amplitude_dn=0.5, frequency=at))
        assert ("light" in (denial or "")) == of_light


def test_darks_whose_codes_hardly_move_deny_no_pattern() -> None:
    """They show nothing, whatever there is: it may be the same at all signals."""
    for still, grows in ((frozenset(), True), (frozenset(("dark", c) for c in CHANNELS), False)):
        layout: Any = SimpleNamespace(**{**vars(LAYOUT), "still": still})

        def of(name: str) -> Iterator[NDArray[np.float64]]:
            return _frames((0.21, 0.13), free=True, amplitude=0.3 * (name == "flat"))(name)

        assert look(layout, of, (0.21, 0.13)).grows == grows
