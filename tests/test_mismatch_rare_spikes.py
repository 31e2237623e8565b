"""Rare strong spikes are counted one by one and put aside; what resembles them is left alone."""

import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.source import Source
from analysis.mismatch.spikes import Cleaned, spikes_of, with_spikes
from analysis.mismatch.spikes.cleaned import cleaned, without_spikes
from analysis.mismatch.spikes.hits import Hits
from analysis.mismatch.spikes.law import _tracks, heldout_gain, law_of
from analysis.mismatch.spikes.population import LOW, SPIKE
from analysis.mismatch.split import Split
from dsis.effects import registry
from mismatch_findings import NOTHING
from mismatch_recordings import camera
from spiked_recordings import (
    BLACK,
    COLUMNS,
    DARKS,
    FLATS,
    MODEL,
    READ,
    ROWS,
    SLOPE,
    WHITE,
    Array,
    Change,
    found,
    made,
    samples,
    spikes,
)

pytestmark = pytest.mark.usefixtures("unproven")

Places = NDArray[np.intp]
EVERYTHING = frozenset({"impulse"})


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("count", "cfa", "scene", "frames"),
    [
        (13, "MONO", False, 12),
        (13, "RGGB", True, 12),
        (40, "RGGB", False, 12),
        (40, "MONO", True, 4),
        (13, "MONO", False, 3),
        (9, "RGGB", False, 2),
    ],
)
def test_spikes_are_counted(seed: int, count: int, cfa: str, scene: bool, frames: int) -> None:
    recording = made(seed, spikes(count), cfa=cfa, scene=scene, frames=frames)
    own = found(recording)
    assert own is not None
    everything = {e.name: range(frames) for e in recording.exposures}
    law = law_of(own, recording, everything)
    assert law is not None
    assert abs(law.share - count / samples(recording)) < 3 * law.share_error
    # In logarithms, for of few heights the error that is known is in proportion to their mean.
    assert abs(np.log(law.mean_dn / 1500)) < 3 * law.mean_error_dn / law.mean_dn
    assert 0.6 * count < own.hits.frame.size <= count


@pytest.mark.parametrize("seed", range(3))
def test_lower_ones_of_few_spikes_are_put_aside_as_well(seed: int) -> None:
    """Of exponential heights some lie between five and eight noises, of one sample in 15000 too.

    The tail that they made of the noise nothing simulates: kurtosis was left open at ten standard
    errors beside impulses that were named.
    """
    count, mean = 120, 120.0
    recording = made(seed, spikes(count, mean))
    assert count < 1e-4 * samples(recording) * 1.1
    own = found(recording)
    assert own is not None
    assert own.lowest == LOW
    noise = [np.sqrt(SLOPE * level + READ**2) for level in (*[0.0] * DARKS, *FLATS)]
    there, far = (
        count * np.mean([np.exp(-a * sd / mean) - np.exp(-b * sd / mean) for sd in noise])
        for a, b in ((LOW, SPIKE), (SPIKE, np.inf))
    )
    assert abs(own.lower.frame.size - there) < 5 * there**0.5
    assert abs(own.hits.frame.size - far) < 5 * far**0.5
    law = law_of(own, recording, {e.name: range(12) for e in recording.exposures})
    assert law is not None
    assert abs(law.share - count / samples(recording)) < 3 * law.share_error
    assert abs(law.mean_dn - mean) < 3 * law.mean_error_dn


@pytest.mark.parametrize("seed", range(3))
def test_many_spikes_some_at_one_pixel_some_clipped(seed: int) -> None:
    recording = made(seed, spikes(45, 2500.0))
    own = found(recording)
    assert own is not None
    assert own.hits.clipped.sum() > 3
    law = law_of(own, recording, {e.name: range(12) for e in recording.exposures})
    assert law is not None
    assert abs(law.mean_dn - 2500) < 3 * law.mean_error_dn

    def twice(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(20)(rng, stacks)
        stacks["dark-0"][3, 10, 20] += 900
        stacks["dark-0"][7, 10, 20] += 1100

    own = found(made(seed, twice))
    assert own is not None
    here = (own.hits.row == 10) & (own.hits.column == 20)
    assert set(own.hits.frame[here]) >= {3, 7}


def test_saturated_flats_say_nothing_of_how_often_spikes_hit() -> None:
    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(30)(rng, stacks)
        stacks["flat-1"] += 4 * WHITE
        stacks["flat-2"] += 4 * WHITE

    recording = made(6, change)
    own = found(recording)
    assert own is not None
    everything = {e.name: range(12) for e in recording.exposures}
    others = {name: k for name, k in everything.items() if name not in ("flat-1", "flat-2")}
    law, same = law_of(own, recording, everything), law_of(own, recording, others)
    assert law is not None
    assert law == same
    hits = own.hits.frame.size  # of four exposures, most of them seen
    assert hits / (4 * 12 * ROWS * COLUMNS) == pytest.approx(law.share, rel=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_spikes_are_found_beside_noise_with_a_tail_of_its_own(seed: int) -> None:
    """A sample or two past eight standard deviations do not hide nine far above."""

    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(9, 3000.0)(rng, stacks)
        for own in (stacks["dark-0"], stacks["flat-1"]):
            y, x = rng.integers(ROWS), rng.integers(COLUMNS)
            own[3, y, x] += 9.5 * own[:, y, x].std()

    some = found(made(30 + seed, change))
    assert some is not None
    assert some.hits.frame.size >= 8


def test_spikes_are_put_aside_and_nothing_else() -> None:
    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(20)(rng, stacks)
        stacks["dark-1"][5, 40, 50] += 3000
        stacks["dark-1"][5, 40, 52] += 60  # what it leaves in the sample read two later
        stacks["dark-1"][6, 40, 50] += 90  # and in the next frame

    stored = made(1, change)
    own, source, some = without_spikes(stored, MODEL)
    assert isinstance(own, Cleaned)
    assert some is not None
    dark = own.exposure("dark-1")
    assert [int(own.frame(dark, k)[40, c]) for k, c in ((5, 50), (5, 52), (6, 50))] == (
        pytest.approx([64] * 3, abs=5)
    )
    assert some.echoes.frame.size == 2
    changed = 0
    for e in stored.exposures:
        for k, frame in enumerate(source.frames(e.name, range(12))):
            assert (frame == own.frame(e, k)).all()
            changed += int((frame != stored.frame(e, k)).sum())
    assert changed == some.replaced.frame.size
    assert found(replace(cleaned(stored, some.replaced))) is None  # type: ignore[arg-type]


@pytest.mark.parametrize("frames", [2, 3])
def test_what_stands_in_place_of_a_spike_has_moved_with_its_frame(frames: int) -> None:
    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(9)(rng, stacks)
        stacks["dark-1"][0] += 40
        stacks["dark-1"][:2, [40, 60], [50, 70]] += 1000 * np.eye(2)

    stored = made(4, change, frames=frames)
    own, _, some = without_spikes(stored, MODEL)
    assert some is not None
    dark = own.exposure("dark-1")
    moved = [own.frame(dark, k)[y, x] for k, y, x in ((0, 40, 50), (1, 60, 70))]
    # In one frame alone a pixel has its pattern and noise of 2.2 DN.
    assert moved == pytest.approx([BLACK + 40, BLACK], abs=9)
    here = (some.hits.exposure == 1) & np.isin(some.hits.row, [40, 60])
    assert some.hits.height_dn[here] == pytest.approx([1000, 1000], abs=12)


def test_locked_frames_prove_the_effect() -> None:
    recording = made(2, spikes(40))
    own, split = found(recording), Split.of(recording)
    told = with_spikes(NOTHING, own, recording, split, EVERYTHING)
    (effect,) = told.omitted_physics
    assert effect.effect == "impulse"
    assert effect.heldout_gain.ci95[0] > 0
    assert told.mismatches[0].explained_by == "impulse"
    assert told.mismatches[0].where.pixels is not None
    assert told.unexplained == ()
    assert told.verdict == "omitted_physics"
    (added,) = told.camera.effect
    values = {name: one.value for name, one in effect.parameters.items()}
    assert added.model_dump(exclude={"kind"}) == pytest.approx(values)
    for words, parts in ((frozenset[str](), split), (EVERYTHING, split.without(FLATS_AND_DARKS))):
        left = with_spikes(NOTHING, own, recording, parts, words)
        assert left.verdict == "unexplained"
        assert [m.statistic for m in left.unexplained] == ["one_off_outliers"]
        assert left.camera is NOTHING.camera
    assert with_spikes(NOTHING, None, recording, split, EVERYTHING) is NOTHING


FLATS_AND_DARKS = frozenset(e.name for e in made(0).exposures)


def test_a_track_of_spikes_counts_once() -> None:
    """Pixels that touch, in one frame, are one particle's; memory is that of hits, not of pairs."""

    def hits_at(exposure: Places, frame: Places, row: Places, column: Places) -> Hits:
        zero = np.zeros(row.size)
        codes = zero.astype(np.uint16)
        return Hits(exposure, frame, row, column, zero, zero, zero, codes, zero > 0)

    row = np.array([5, 6, 7, 20, 20, 20, 20])
    column = np.array([5, 6, 6, 30, 30, 30, 32])
    frame, exposure = np.array([0, 0, 0, 0, 1, 0, 0]), np.array([0, 0, 0, 0, 0, 1, 0])
    assert sorted(_tracks(hits_at(exposure, frame, row, column))) == [1, 1, 1, 1, 3]
    many = np.arange(20_000)
    tracemalloc.start()
    assert _tracks(hits_at(0 * many, many // 5000, many % 5000, 3 * (many % 7))).size == many.size
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6


def test_the_gain_of_a_law_that_is_not_there_is_a_loss() -> None:
    recording = made(3, spikes(40))
    own, split = found(recording), Split.of(recording)
    assert own is not None
    law = law_of(own, recording, split.development)
    assert law is not None
    assert heldout_gain(own, recording, law, split.locked).ci95[0] > 0
    none = replace(own, hits=own.hits.of(np.zeros(own.hits.frame.size, bool)))
    lost = heldout_gain(none, recording, law, split.locked)
    assert lost.ci95[0] <= lost.nats_per_frame < 0 < lost.ci95[1]
    assert law_of(none, recording, split.development) is None
    assert not np.isfinite(heldout_gain(own, recording, None, split.locked).ci95[0])


def test_a_camera_that_has_impulses_is_asked_nothing() -> None:
    recording = made(4, spikes(40))
    has = camera(registry()["impulse"](per_megapixel_frame=20.0, mean_dn=1500.0))
    assert spikes_of(recording, Source(recording), has) is None


def test_a_diagnosis_names_them() -> None:
    told = find_mismatch(MODEL, made(5, spikes(13)), seed=1, vocabulary=frozenset({"impulse"}))
    assert [one.effect for one in told.omitted_physics] == ["impulse"]
    assert told.searched


def few_electrons(rng: np.random.Generator, mean: Array) -> Array:
    """Return light of 60 DN an electron, and a dark current of one electron in 1e4 samples."""
    electrons: Array = rng.poisson(mean / 60 + 5e-5) * 60.0
    return electrons + rng.normal(0, 1.5, mean.shape)


def student(rng: np.random.Generator, mean: Array) -> Array:
    """Return read noise of heavy tails."""
    return rng.normal(mean, np.sqrt(SLOPE * mean.clip(0))) + READ * rng.standard_t(3, mean.shape)


def jumping(dwell: float, share: float, height_dn: float) -> Change:
    """Return what makes some pixels jump between two levels."""

    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        which = np.argwhere(rng.random((ROWS, COLUMNS)) < share)
        heights = rng.exponential(height_dn, len(which))
        state = rng.random(len(which)) < 0.5
        for own in stacks.values():
            for frame in own:
                state ^= rng.random(len(which)) < 1 / dwell
                frame[tuple(which.T)] += heights * (state - 0.5)

    return change


def blinking(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
    """Make few pixels rise now and then, always high."""
    which = np.argwhere(rng.random((ROWS, COLUMNS)) < 2e-3)
    for own in stacks.values():
        for frame in own:
            frame[tuple(which.T)] += 500 * (rng.random(len(which)) < 0.05)


def hot(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
    """Make hot pixels with the shot noise of their charge."""
    which = rng.random((ROWS, COLUMNS)) < 5e-3
    for i, own in enumerate(stacks.values()):
        charge = rng.exponential(400.0 * (1 + i), which.sum())
        own[:, which] += rng.normal(charge, np.sqrt(SLOPE * charge), (len(own), charge.size))


def dusty(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
    """Take light away where dust lies."""
    dust = np.where(rng.random((ROWS, COLUMNS)) < 0.02, rng.uniform(0, 0.9, (ROWS, COLUMNS)), 0)
    for name, own in stacks.items():
        if name.startswith("flat"):
            np.multiply(own, 1 - dust, out=own)


def glitches(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
    """Lift three rows of single frames."""
    for name in ("dark-0", "flat-0", "flat-1"):
        stacks[name][rng.integers(12), rng.integers(ROWS)] += 300


def both_ways(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
    for own in stacks.values():
        which = rng.random(own.shape) < 5e-5
        own[which] += rng.choice([-1, 1], which.sum()) * rng.exponential(1500, which.sum())


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("change", "clean"),
    [
        (None, None),
        (None, student),
        (None, few_electrons),
        (jumping(2.0, 0.01, 40.0), None),
        (jumping(2.0, 0.001, 600.0), None),
        (jumping(8.0, 0.002, 600.0), None),
        (jumping(50.0, 0.002, 600.0), None),
        (blinking, None),
        (hot, None),
        (dusty, None),
        (glitches, None),
        (both_ways, None),
    ],
)
@pytest.mark.parametrize("frames", [3, 12])
def test_what_resembles_spikes_is_left_alone(
    seed: int,
    change: Change | None,
    clean: Callable[[np.random.Generator, Array], Array] | None,
    frames: int,
) -> None:
    if change is glitches and frames < 12:
        return
    recording = made(100 + seed, change, clean=clean, frames=frames)
    assert found(recording) is None
    assert without_spikes(recording, MODEL)[0] is recording
