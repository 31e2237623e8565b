"""Samples that have a small share of a spike are put aside with it: next to it, or after it."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kurtosis

from analysis.mismatch.source import Source
from analysis.mismatch.spikes import Spikes, left_dn4, spikes_of, without_spikes
from analysis.mismatch.spikes.cleaned import cleaned
from spiked_recordings import MODEL, Change, made, spikes

Array = NDArray[np.float64]
COUNT, MEAN_DN = 800, 400.0
Offset = tuple[int, int, int]
NEXT: frozenset[Offset] = frozenset({(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0)})


def _sharing(
    share: float, offsets: frozenset[Offset], mean_dn: float = MEAN_DN, count: int = COUNT
) -> Change:
    """Return what adds spikes that give places around them a share of themselves."""

    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        for name, stack in stacks.items():
            without = stack.copy()
            spikes(count // len(stacks), mean_dn)(rng, {"": stack})
            whole = stack - without
            for frames, down, right in offsets:
                moved = np.roll(whole, (down, right), (1, 2))
                moved = np.concatenate([0 * moved[:frames], moved[: len(stack) - frames]])
                stacks[name] += share * moved

    return change


def _offsets(some: Spikes) -> set[Offset]:
    """Return where from spikes the most samples lie that have a share of one."""
    assert some.shares is not None
    at, own = (
        np.stack([one.exposure, one.frame, one.row, one.column], 1)
        for one in (some.hits, some.shares)
    )
    away = (own[:, np.newaxis] - at).reshape(-1, 4)
    near = away[(away[:, 0] == 0) & (np.abs(away[:, 1:]).max(1) <= 2)][:, 1:]
    places, counts = np.unique(near, axis=0, return_counts=True)
    return {tuple(one) for one in places[counts > 0.2 * counts.max()].tolist()}


@pytest.mark.parametrize(("cfa", "seed"), [("MONO", 0), ("GBRG", 1)])
@pytest.mark.parametrize(
    "offsets",
    [NEXT, frozenset({(0, 0, 1)}), frozenset({(0, 2, 0), (0, -2, 0)}), frozenset({(1, 0, 0)})],
)
def test_what_has_a_small_share_of_a_spike_is_put_aside(
    offsets: frozenset[Offset], cfa: str, seed: int
) -> None:
    recording = made(seed, _sharing(0.015, offsets), cfa=cfa)
    source = Source(recording)
    some = spikes_of(recording, source, MODEL)
    assert some is not None
    _, _, told = without_spikes(recording, MODEL)
    assert told is not None
    assert _offsets(told) == offsets
    alone = made(seed, _sharing(0.0, offsets), cfa=cfa)
    _, _, plain = without_spikes(alone, MODEL)
    assert plain is not None
    before, after, without = (
        kurtosis(_residuals(cleaned(stored, own.replaced), "dark-0"), fisher=False)
        for stored, own in ((recording, some), (recording, told), (alone, plain))
    )
    assert before > without + 0.01
    assert abs(after - without) < 0.4 * (before - without)


def _residuals(recording: object, name: str) -> Array:
    exposure = next(e for e in recording.exposures if e.name == name)  # type: ignore[attr-defined]
    frames = np.array(
        [recording.frame(exposure, k) for k in range(len(exposure.frames))],  # type: ignore[attr-defined]
        np.float64,
    )
    return np.asarray((frames - np.median(frames, 0)).reshape(-1))


@pytest.mark.parametrize(
    ("count", "mean_dn", "share"), [(800, 3000.0, 0.015), (2400, 400.0, 0.03), (2400, 1500.0, 0.01)]
)
def test_shares_of_strong_spikes_are_put_aside_and_leave_the_variance(
    count: int, mean_dn: float, share: float
) -> None:
    """Around the strongest all samples of a share are seen one by one."""
    _, _, some = without_spikes(made(0, _sharing(share, NEXT, mean_dn, count)), MODEL)
    alone = made(0, _sharing(0.0, NEXT, mean_dn, count))
    _, _, plain = without_spikes(alone, MODEL)
    assert some is not None
    assert plain is not None
    assert _offsets(some) == NEXT
    recording = made(0, _sharing(share, NEXT, mean_dn, count))
    own, without = (
        _residuals(cleaned(stored, one.replaced), "dark-0")
        for stored, one in ((recording, some), (alone, plain))
    )
    assert kurtosis(own) == pytest.approx(kurtosis(without), abs=0.05)
    assert own.var() == pytest.approx(without.var(), rel=5e-3)
    assert left_dn4(some, recording) == pytest.approx(left_dn4(plain, alone), rel=0.5)


@pytest.mark.parametrize("count", [800, 2400])
def test_skewed_noise_of_few_electrons_is_no_share(count: int) -> None:
    def electrons(rng: np.random.Generator, mean: Array) -> Array:
        return np.asarray(8 * rng.poisson(mean.clip(0) / 8 + 0.3) + rng.normal(0, 1, mean.shape))

    recording = made(0, spikes(count, 3000.0), clean=electrons)
    _, _, told = without_spikes(recording, MODEL)
    assert told is not None
    assert told.shares is None


@pytest.mark.parametrize(("seed", "scene"), [(0, True), (1, False), (2, False)])
def test_spikes_that_share_nothing_put_nothing_aside(seed: int, *, scene: bool) -> None:
    recording = made(seed, spikes(COUNT, MEAN_DN), scene=scene)
    _, _, told = without_spikes(recording, MODEL)
    assert told is not None
    assert told.shares is None


def test_samples_of_a_share_are_no_spikes() -> None:
    """Each sample is told once; none of them is a spike, or was put aside before."""
    recording = made(0, _sharing(0.01, NEXT, 800.0))
    _, _, told = without_spikes(recording, MODEL)
    assert told is not None
    assert told.shares is not None
    every = told.replaced
    at = np.stack([every.exposure, every.frame, every.row, every.column], 1)
    assert len(np.unique(at, axis=0)) == len(at)
    least = 0.25 * np.median(told.shares.noise_dn) / 0.01
    large = told.hits.height_dn > 2 * least
    assert large.sum() < told.shares.frame.size <= 4 * told.hits.frame.size
