"""Many strong spikes hide nothing: lower ones, and what spikes leave around them, are known."""

import numpy as np
import pytest

from analysis.mismatch.spikes.cleaned import without_spikes
from analysis.mismatch.spikes.law import law_of, left_dn4
from spiked_recordings import BLACK, MODEL, READ, SLOPE, WHITE, Array, found, made, samples, spikes


@pytest.mark.parametrize("seed", range(2))
def test_of_thousands_none_that_could_be_seen_is_left(seed: int) -> None:
    """One sample in 400: pixels are hit twice and more, also in two frames of a reference."""
    recording = made(seed, spikes(samples(made(seed)) // 400, 1500.0))
    own, _, some = without_spikes(recording, MODEL)
    assert some is not None
    law = law_of(some, recording, {e.name: range(12) for e in recording.exposures})
    assert law is not None
    assert abs(law.share - 1 / 400) < 3 * law.share_error
    assert abs(law.mean_dn - 1500) < 3 * law.mean_error_dn
    per_pixel = np.unique(np.stack([some.hits.row, some.hits.column]), axis=1, return_counts=True)
    assert per_pixel[1].max() >= 3
    for exposure in own.exposures:
        stack = np.stack([own.frame(exposure, k) for k in range(12)]).astype(np.float64)
        apart = stack - np.median(stack, 0)
        noise = (SLOPE * max(np.median(stack) - BLACK, 0.0) + READ**2 + 1 / 12) ** 0.5
        assert (apart > 6 * noise).sum() <= 2  # where light is brighter noise is larger


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("factor", "power"), [(0.05, 1), (2e-5, 2)])
def test_what_low_spikes_leave_is_foretold(seed: int, factor: float, power: int) -> None:
    """Of their fourth moments; a sample beside each has some of it, shown or not."""

    def dragging(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        before = {name: own.copy() for name, own in stacks.items()}
        spikes(1500, 1500.0)(rng, stacks)
        for name, own in stacks.items():
            own[:, :, 1:] += factor * (own - before[name])[:, :, :-1] ** power

    stored, quiet = made(seed, dragging), made(seed)
    own, _, some = without_spikes(stored, MODEL)
    assert some is not None
    found = left_dn4(some, stored)
    assert left_dn4(None, stored) == {}
    seen, foretold = 0.0, 0.0
    for exposure in stored.exposures:
        noise = (SLOPE * max(np.median(own.frame(exposure, 0)) - BLACK, 0.0) + READ**2) ** 0.5
        for k in range(12):
            put_aside = own.frame(exposure, k) != stored.frame(exposure, k)
            left = stored.frame(exposure, k).astype(float) - quiet.frame(exposure, k)
            seen += float((np.where(put_aside, 0.0, left) ** 4).mean()) / noise**4
        foretold += 12 * found[exposure.name] / noise**4
    assert 0.7 * seen < foretold < 1.6 * seen  # the larger of both laws


def test_a_flat_next_to_white_foretells_nothing_of_low_spikes() -> None:
    """There is no room for spikes above it, whatever their law."""

    def bright(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        stacks["flat-2"] += WHITE - BLACK - 1500 - 200  # eight noises below white, nearly
        spikes(400, 1500.0)(rng, stacks)

    stored = made(3, bright)
    some = found(stored)
    assert some is not None
    low = left_dn4(some, stored)
    assert "flat-1" in low
    assert "flat-2" not in low


def test_a_spike_on_a_pixel_that_jumps_is_put_aside_and_its_jumps_are_not() -> None:
    jumps = np.array([0, 1, 3, 4, 6])

    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(400, 3000.0)(rng, stacks)
        stacks["dark-0"][jumps, 30, 40] += 30
        stacks["dark-0"][7, 30, 40] += 1500

    stored = made(8, change)
    own, _, some = without_spikes(stored, MODEL)
    assert some is not None
    dark = own.exposure("dark-0")
    values = np.array([own.frame(dark, k)[30, 40] for k in range(12)], float)
    assert values[7] < BLACK + 40
    assert (values[jumps] > BLACK + 20).all()


@pytest.mark.parametrize(("freedom", "count"), [(5, 3000), (8, 1000)])
def test_tails_of_noise_are_no_echoes_of_many_spikes(freedom: float, count: int) -> None:
    """Far samples of Student's t are everywhere, around spikes no more than by chance."""

    def heavy(rng: np.random.Generator, mean: Array) -> Array:
        return np.asarray(mean + 3.0 * rng.standard_t(freedom, mean.shape))

    def many(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(count, 3000.0)(rng, stacks)

    some = found(made(5, many, clean=heavy))
    assert some is not None
    assert some.echoes.frame.size < 0.02 * some.hits.frame.size
    assert not some.lower.frame.size


def test_low_spikes_are_put_aside_only_where_noise_is_no_wider_downwards() -> None:
    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(300, 600.0)(rng, stacks)
        for own in stacks.values():
            where = rng.choice(own.size, 30, replace=False)
            own.reshape(-1)[where] += rng.choice([-6.5, 6.5], 30) * own.std(0).mean()

    for plain, many in ((spikes(300, 600.0), True), (change, False)):
        some = found(made(4, plain))
        assert some is not None
        assert (some.lower.frame.size > 5) == many
        assert (some.lower.ratio <= 8).all()


@pytest.mark.parametrize(("moving", "count", "left"), [(0.0, 400, False), (12.0, 400, True),
                                                       (12.0, 30, False)])  # fmt: skip
def test_many_spikes_are_left_where_lines_move_more_than_pixels(
    moving: float, count: int, *, left: bool
) -> None:
    """Lower ones, which no pixel tells from its line, would look like what they are not."""

    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        spikes(count, 3000.0)(rng, stacks)
        for name, own in stacks.items():
            stacks[name] = own + rng.normal(0, moving, (*own.shape[:2], 1))

    assert (found(made(2, change)) is None) == left
