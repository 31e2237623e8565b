"""First frames that follow darkness are left out, and said to be; frames that wander are not."""

import tracemalloc
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.finding import FittedParameter, Gain, OmittedEffect
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.unsettled import (
    STATISTIC,
    Unsettled,
    _frame_means,
    told_beside,
    unsettled,
    with_first_frames,
    without,
)
from dsis.recording import read_recording
from mismatch_findings import NOTHING

Array = NDArray[np.float64]
LEVELS = (300.0, 900.0, 2000.0)
SHAPE = (24, 32)


def written(folder: Path, seed: int, relative: Array, dark_dn: Array | None = None) -> Path:
    """Write flats whose frames have light by `relative` (exposure, frame), and a dark."""
    rng = np.random.default_rng(seed)
    lines = ['[sensor]\nname = "s"\ncfa = "MONO"\nblack_level = 64\nwhite_level = 4095']
    lines.append("bit_depth = 12")

    def expose(name: str, kind: str, means: Array) -> None:
        frames = []
        for k, mean in enumerate(means):
            frame = 64 + mean + rng.normal(0, np.sqrt(abs(mean) + 9), SHAPE)
            (folder / name).mkdir(parents=True, exist_ok=True)
            np.save(folder / name / f"{k}.npy", np.clip(np.rint(frame), 0, 4095).astype(np.uint16))
            frames.append(f'"{name}/{k}.npy"')
        lines.append(
            f'[[exposure]]\nname = "{name}"\nkind = "{kind}"\nexposure_time_s = 0.01\n'
            f"frames = [{', '.join(frames)}]"
        )

    expose("dark", "dark", np.zeros(8) if dark_dn is None else dark_dn)
    for i, level in enumerate(LEVELS):
        expose(f"flat-{i}", "flat", level * relative[i])
    (folder / "recording.toml").write_text("\n".join(lines), encoding="utf-8")
    return folder


def lagging(fraction: float, frames: int = 8) -> Array:
    """Return light by frame where a share of the frame before stays, and darkness came first."""
    return np.tile(1 - fraction ** np.arange(1, frames + 1), (len(LEVELS), 1))


def seen(folder: Path) -> tuple[Unsettled, ...]:
    recording = read_recording(folder)
    return unsettled(recording, Source(recording))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("fraction", "frames"), [(0.03, 1), (0.2, 2)])
def test_frames_after_darkness_are_left_out(
    tmp_path: Path, seed: int, fraction: float, frames: int
) -> None:
    (found,) = seen(written(tmp_path, seed, lagging(fraction)))
    assert (found.kind, found.frames) == ("flat", frames)
    assert found.share == pytest.approx(-100 * fraction, rel=0.1)
    split = without(Split.of(read_recording(tmp_path)), [found])
    kept = split.all_of_development
    assert all(min(kept[f"flat-{i}"]) == frames for i in range(3))
    assert min(kept["dark"]) == 0
    assert found.mismatch().where.frames == tuple(range(frames))
    assert f"{abs(found.share):.3g} % of the signal below" in found.mismatch().says


@pytest.mark.parametrize("seed", range(20))
def test_nothing_is_left_out_of_what_does_not_differ_or_wanders(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    flicker = 1 + 0.01 * rng.normal(0, 1, (3, 8)) * (seed % 2)
    warming = 1 + 0.01 * np.linspace(0, 1, 8) * (seed % 3)  # all along, and no first frame
    assert seen(written(tmp_path, seed, flicker * warming)) == ()


def test_frames_are_read_one_by_one() -> None:
    """Of ten frames of a large sensor no ten are held as floats."""
    frame = np.zeros((500, 500), np.uint16)
    noise = np.random.default_rng(1).integers(0, 7, frame.shape, np.uint16)  # variance 4

    def frames(_name: str, numbers: Sequence[int]) -> Iterator[NDArray[np.uint16]]:
        return (frame + np.uint16(k) + noise * np.uint16(k == 9) for k in numbers)

    source: Any = SimpleNamespace(frames=frames)
    tracemalloc.start()
    means, white = _frame_means(source, "flat", range(10))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert means == pytest.approx([*range(9), 12], abs=0.02)
    assert white == pytest.approx(np.full(10, 4 / 2 / frame.size), rel=0.02)
    assert peak < 6 * 8 * frame.size


def test_one_exposure_says_nothing_of_first_frames(tmp_path: Path) -> None:
    relative = lagging(0.0)
    relative[1, 0] = 0.9
    assert seen(written(tmp_path, 1, relative)) == ()


UNSETTLED = Unsettled("flat", ("flat-0", "flat-1"), 1, -9.0, -12.0, -3.0)


def test_image_lag_explains_what_first_frames_lack() -> None:
    alone = with_first_frames(NOTHING, [UNSETTLED])
    assert alone.verdict == "unexplained"
    assert [m.statistic for m in alone.unexplained] == [STATISTIC]
    for fraction, explained in ((0.03, True), (0.06, False)):
        lag = OmittedEffect(
            "image_lag", {"fraction": FittedParameter(fraction, 0.001)}, (), Gain(1.0, (0.5, 1.5))
        )
        both = with_first_frames(
            replace(NOTHING, omitted_physics=(lag,), verdict="omitted_physics"), [UNSETTLED]
        )
        assert both.verdict == "omitted_physics"
        assert (both.mismatches[0].explained_by == "image_lag") is explained
        assert (both.unexplained == ()) is explained
    assert with_first_frames(NOTHING, []) is NOTHING


def test_a_wander_is_not_told_beside_first_frames() -> None:
    words = frozenset({"flicker", "black_level_drift", "image_lag"})
    assert told_beside(words, [UNSETTLED]) == {"black_level_drift", "image_lag"}
    assert told_beside(words, [replace(UNSETTLED, kind="dark")]) == {"flicker", "image_lag"}
