"""A scene that shakes by hundredths of a pixel, beside noise that only seems to move it."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.motion import STATISTIC, MotionSums, _strongest
from analysis.mismatch.null import _normal
from analysis.mismatch.scenes import scene_of

ROWS, COLUMNS, FRAMES = 96, 130, 8
Y, X = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
COLOURS = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}
Array = NDArray[np.float64]


def _picture(down: Any = 0.0, right: Any = 0.0) -> Array:
    y, x = Y + down, X + right
    edge = 500 * np.tanh((x - 60 + 0.3 * y) / 2)
    return np.asarray(2400 + 700 * np.sin(x / 5 + y / 9) + edge + 300 * np.cos(y / 4))


def _found(cfa: str, seed: int, change: Any, frames: int = FRAMES) -> tuple[float, float]:
    """Return what a scene's frames show along rows and columns; `change(rng)` gives each, DN."""
    (rows, _), (columns, _) = _sums(cfa, seed, change, frames).numbers().values()
    return rows, columns


def _sums(cfa: str, seed: int, change: Any, frames: int) -> MotionSums:
    rng = np.random.default_rng(seed)
    cells = {"MONO": (slice(None), slice(None))}
    if cfa != "MONO":
        cells = {c: (slice(y, None, 2), slice(x, None, 2)) for c, (y, x) in COLOURS.items()}
    made = []
    for _ in range(frames):
        clean = change(rng)
        noisy = clean + rng.normal(0, 1, clean.shape) * np.sqrt(10 + 0.5 * clean)
        made.append(np.floor(noisy + 64.5).astype(np.uint16))
    scene = scene_of(made, cells, dict.fromkeys(cells, 64.0))
    assert scene is not None  # it does not move by so much that pixels show it
    sums = MotionSums(scene)
    assert len(list(sums.watching(map(scene.steadied, made)))) == frames
    return sums


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("frames", [2, 5, 10])
def test_a_static_scene_scores_no_higher_than_a_normal_variate(cfa: str, frames: int) -> None:
    """Lower in the mean: sums of waves are counted as if chance made each by itself."""
    still = np.array([_found(cfa, seed, lambda _: _picture(), frames) for seed in range(40)])
    assert -1.0 < still.mean() < 0.2
    assert 0.8 < still.std() < 1.4  # its lower tail is longer
    assert still.max() < 4


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_a_scene_that_shakes_is_seen(cfa: str) -> None:
    """Along which axis it shakes is seen where gradients point to all sides."""
    for seed in (1, 2, 3):
        assert max(_found(cfa, seed, lambda rng: _picture(right=rng.normal(0, 0.02)))) > 6
        assert max(_found(cfa, seed, lambda rng: _picture(down=rng.normal(0, 0.04)))) > 6


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_shifts_are_those_of_the_frames(cfa: str) -> None:
    """They scatter about the true ones by their errors."""
    off = []
    for seed in range(8):
        moved = np.random.default_rng(seed).normal(0, 0.03, (FRAMES, 2))
        each = iter(moved)

        def moving(_: np.random.Generator, each: Any = each) -> Array:
            right, down = next(each)
            return _picture(right=-right, down=-down)

        found = _sums(cfa, seed, moving, FRAMES).shifts()
        for axis, true in zip(("rows", "columns"), (moved - moved.mean(0)).T, strict=True):
            assert found.errors[axis] < 0.05
            off.append((found.along[axis] - true) / found.errors[axis])
    assert 0.85 < float(np.std(off)) < 1.15  # of 128


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_a_scene_that_vibrates_is_seen(cfa: str) -> None:
    def vibrating(rng: np.random.Generator) -> Array:
        turn = 2 * np.pi * 1.6 * Y / ROWS + rng.uniform(0, 2 * np.pi)
        return _picture(right=0.05 * np.sin(turn))

    assert max(_found(cfa, 2, vibrating)) > 6


@pytest.mark.parametrize("cycles", [3.0, 5.1, 6.5])
def test_one_fast_wave_is_seen_among_all_that_are_slow(cycles: float) -> None:
    def vibrating(rng: np.random.Generator) -> Array:
        turn = 2 * np.pi * cycles * Y / ROWS + rng.uniform(0, 2 * np.pi)
        return _picture(right=0.02 * np.sin(turn))

    for seed in range(3):
        assert max(_found("RGGB", seed, vibrating)) > 5
        shifts = _sums("RGGB", seed, vibrating, FRAMES).shifts()
        right = shifts.waves["rows"]
        assert abs(int(right.argmax()) - cycles) <= 0.5
        assert right.max() > chi2.ppf(0.9999, shifts.degrees.max()) / shifts.degrees.max()


def test_waves_of_a_scene_at_rest_are_1_by_chance() -> None:
    all_waves = []
    for seed in range(24):
        shifts = _sums("RGGB", seed, lambda _: _picture(), FRAMES).shifts()
        all_waves += [shifts.waves["rows"], shifts.waves["columns"]]
        assert shifts.degrees.tolist() == [FRAMES - 1, *[2 * (FRAMES - 1)] * 12]
    waves = np.stack(all_waves)
    error = np.sqrt(2 / shifts.degrees / len(waves))
    assert (np.abs(waves.mean(0) - 1) < 4 * error + 0.03).all()


@pytest.mark.parametrize("frames", [3, 9])
def test_scores_of_white_noise_are_those_of_a_normal_variate(frames: int) -> None:
    rng, rows = np.random.default_rng(frames), 90
    turn = 2 * np.pi * np.outer(np.arange(9), np.arange(rows)) / rows
    cos, sin = np.cos(turn), np.sin(turn)
    slow = np.stack([(cos**2).sum(1), (sin**2).sum(1), (cos * sin).sum(1)], 1)
    noise = np.ones(rows)
    scores = np.empty(2000)
    for k in range(scores.size):
        white = rng.normal(size=(frames, rows))
        scores[k] = _strongest(white - white.mean(0), noise, slow)[0]
    assert -0.5 < scores.mean() < 0.1
    assert (scores > 2.326).sum() <= 36  # 20 are expected: 4 standard deviations
    assert (scores > 1.282).sum() <= 254  # 200


@pytest.mark.parametrize("count", [4, 16, 64])
def test_scores_are_normal_that_lie_no_higher_than_normal_variates(count: int) -> None:
    """How long their lower tail is does not matter; a long upper one does."""
    drawn = np.random.default_rng(count).normal(size=(count, 20000))
    keys = [Key(STATISTIC, "scene")] * drawn.shape[1]
    denied = drawn.shape[1] - _normal(keys, drawn).sum()
    assert 6 <= denied <= 38  # 1 in 1000 by chance: 3 standard deviations
    assert _normal(keys, np.where(drawn < 0, 3 * drawn, drawn)).sum() == len(keys) - denied
    higher = _normal(keys, np.where(drawn > 0, 2 * drawn, drawn)).mean()
    assert higher < {4: 0.9, 16: 0.55, 64: 0.05}[count]
    assert not _normal([Key("row_variance", "exposure")] * drawn.shape[1], drawn).any()


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_lines_and_light_that_change_are_no_motion(cfa: str) -> None:
    def light(rng: np.random.Generator) -> Array:
        waves = 0.01 * np.sin(2 * np.pi * 3.3 * Y / ROWS + rng.uniform(0, 2 * np.pi))
        return np.asarray(_picture() * (1 + 0.01 * rng.normal() + waves))

    changes = (
        lambda rng: _picture() + rng.normal(0, 8.0, (ROWS, 1)),
        lambda rng: _picture() + rng.normal(0, 8.0, (1, COLUMNS)),
        light,
    )
    for change in changes:
        found = np.array([_found(cfa, seed, change) for seed in range(8)])
        assert -1.5 < found.mean() < 1
        assert found.max() < 4


def test_few_rows_say_nothing() -> None:
    scene = scene_of([np.full((20, 30), 500 + k, np.uint16) for k in range(3)],
                     {"MONO": (slice(None), slice(None))}, {"MONO": 64.0})  # fmt: skip
    assert scene is not None
    sums = MotionSums(scene)
    list(sums.watching(np.full((20, 30), 500.0 + k) for k in range(3)))
    assert not any(np.isfinite(value) for value, _ in sums.numbers().values())
    shifts = sums.shifts()
    assert shifts.errors == {"rows": np.inf, "columns": np.inf}  # nothing has a gradient
    assert not shifts.waves
