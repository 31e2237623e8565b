"""Promise: a draw is a function of (seed, purpose, frame, row, column, channel), and a good one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dsis.cfa import Cfa, mosaic
from dsis.draw import Draw, philox
from dsis.grid import PixelGrid

Z_MAX = 5.0

# Known answers published with Random123 (tests/kat_vectors, "philox4x32 10").
KNOWN_ANSWERS = [
    ("00000000 00000000 00000000 00000000 00000000 00000000",
     "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff",
     "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0",
     "d16cfe09 94fdcceb 5001e420 24126ea1"),
]  # fmt: skip

FIELD = PixelGrid(1024, 1024)


@pytest.fixture(scope="module")
def field() -> np.ndarray:
    return Draw(7).normal("test", FIELD).astype(np.float64)


@pytest.mark.parametrize(("inputs", "answer"), KNOWN_ANSWERS)
def test_generator_gives_the_published_answers(inputs: str, answer: str) -> None:
    words = [np.uint64(int(word, 16)) for word in inputs.split()]
    assert [f"{int(word):08x}" for word in philox(*words)] == answer.split()


@given(
    row=st.integers(0, 40),
    column=st.integers(0, 40),
    rows=st.integers(1, 30),
    columns=st.integers(1, 30),
    cfa=st.sampled_from([None, *Cfa]),
    normal=st.booleans(),
)
def test_a_crop_of_a_field_is_the_field_of_the_crop(
    row: int, column: int, rows: int, columns: int, cfa: Cfa | None, normal: bool
) -> None:
    draw = Draw(3)
    make = draw.normal if normal else draw.uniform
    whole = make("crop", PixelGrid(70, 70, cfa), 5)
    crop = make("crop", PixelGrid(rows, columns, cfa, row, column), 5)
    np.testing.assert_array_equal(crop, whole[row : row + rows, column : column + columns])


@pytest.mark.parametrize("cfa", [cfa for cfa in Cfa if cfa is not Cfa.MONO])
def test_a_mosaic_is_the_planes_sampled_at_the_filters(cfa: Cfa) -> None:
    planes = Draw(1).normal("pair", PixelGrid(33, 47), 2)
    sampled = Draw(1).normal("pair", PixelGrid(33, 47, cfa), 2)
    np.testing.assert_array_equal(sampled, mosaic(planes, cfa))


def test_threads_do_not_change_a_field() -> None:
    grid = PixelGrid(500, 64)
    one, two = (Draw(9).normal("threads", grid, 1, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_normal_moments_to_order_four(field: np.ndarray) -> None:
    n = field.size
    assert abs(field.mean()) * np.sqrt(n) < Z_MAX
    assert abs(field.var() - 1) * np.sqrt(n / 2) < Z_MAX
    assert abs(stats.skew(field, axis=None)) * np.sqrt(n / 6) < Z_MAX
    assert abs(stats.kurtosis(field, axis=None)) * np.sqrt(n / 24) < Z_MAX


def test_normal_distribution_and_tails(field: np.ndarray) -> None:
    assert stats.kstest(field.ravel(), "norm").pvalue > 1e-4
    for sigma in (3.0, 4.0, 4.5):
        expected = 2 * stats.norm.sf(sigma) * field.size
        found = int((np.abs(field) > sigma).sum())
        assert abs(found - expected) < Z_MAX * np.sqrt(expected), f"beyond {sigma} sigma"


def test_uniform_distribution() -> None:
    field = Draw(7).uniform("test", FIELD)
    # In 8 million draws of 2^23 values the outermost ones occur; neither may round to 0 or 1.
    wide = Draw(4).uniform("test", PixelGrid(2048, 4096, Cfa.MONO))
    assert min(field.min(), wide.min()) > 0
    assert max(field.max(), wide.max()) < 1
    assert stats.kstest(field.ravel().astype(np.float64), "uniform").pvalue > 1e-4


def test_tails_to_five_sigma() -> None:
    """Frame after frame: of 134 million deviates some 77 lie beyond 5 sigma."""
    frames, beyond = 128, {4.0: 0, 4.5: 0, 5.0: 0}
    grid = PixelGrid(1024, 1024, Cfa.MONO)
    for frame in range(frames):
        size = np.abs(Draw(11).normal("tails", grid, frame))
        for sigma in beyond:
            beyond[sigma] += int(np.count_nonzero(size > sigma))
    for sigma, found in beyond.items():
        expected = 2 * stats.norm.sf(sigma) * frames * grid.rows * grid.columns
        assert abs(found - expected) < Z_MAX * np.sqrt(expected), f"beyond {sigma} sigma"


def test_no_correlation_with_any_neighbour(field: np.ndarray) -> None:
    """All lags up to 16 rows and columns in all directions, from the power spectrum."""
    for channel in range(3):
        power = np.abs(np.fft.rfft2(field[:, :, channel])) ** 2
        covariance = np.fft.irfft2(power) / field[:, :, 0].size
        lags = np.arange(-16, 17)
        z = covariance[np.ix_(lags, lags)] * np.sqrt(field[:, :, 0].size)
        z[16, 16] = 0.0  # with itself
        # 3 x 544 different lags: Gaussian z beyond 5 would come once in a thousand runs.
        assert np.abs(z).max() < Z_MAX, np.unravel_index(np.abs(z).argmax(), z.shape)


@pytest.mark.parametrize("lag", [(64, 0), (0, 64), (128, 128), (512, 0), (1, 512)])
def test_no_correlation_over_blocks(field: np.ndarray, lag: tuple[int, int]) -> None:
    a = field[: FIELD.rows - lag[0], : FIELD.columns - lag[1]]
    b = field[lag[0] :, lag[1] :]
    assert abs((a * b).mean()) * np.sqrt(a.size) < Z_MAX


def test_fields_of_other_channels_frames_purposes_seeds_and_scopes_are_independent(
    field: np.ndarray,
) -> None:
    others = {
        "channel": np.roll(field, 1, axis=2),
        "frame": Draw(7).normal("test", FIELD, 1),
        "purpose": Draw(7).normal("test2", FIELD),
        "seed": Draw(8).normal("test", FIELD),
        "scope": Draw(7).within("content").normal("test", FIELD),
    }
    for name, other in others.items():
        z = float((field * other).mean()) * np.sqrt(field.size)
        assert abs(z) < Z_MAX, name
        squares = float(((field**2 - 1) * (np.square(other, dtype=np.float64) - 1)).mean()) / 2
        assert abs(squares) * np.sqrt(field.size) < Z_MAX, f"squares, {name}"


def test_squares_are_uncorrelated_too(field: np.ndarray) -> None:
    # Box and Muller's pairs share a radius: their squares would betray a flaw.
    squares = field**2 - 1
    for lag in (2, 4, 6, 8):
        z = (squares[:, lag:] * squares[:, :-lag]).mean() / 2 * np.sqrt(squares[:, lag:].size)
        assert abs(z) < Z_MAX, lag


def test_line_offsets_follow_the_sensor_not_the_crop() -> None:
    whole = Draw(2).rows("rows", PixelGrid(50, 8))
    crop = Draw(2).rows("rows", PixelGrid(10, 3, Cfa.RGGB, 20, 5))
    np.testing.assert_array_equal(crop, whole[20:30])
    columns = Draw(2).columns("columns", PixelGrid(8, 50))
    part = Draw(2).columns("columns", PixelGrid(3, 10, None, 5, 21))
    np.testing.assert_array_equal(part, columns[21:31])


def test_a_field_that_is_kept_is_the_field_and_nobody_changes_it() -> None:
    grid = PixelGrid(6, 10, Cfa.RGGB)
    kept = Draw(5).within("sensor").fixed("prnu", grid)
    assert (kept == Draw(5).within("sensor").normal("prnu", grid)).all()
    assert (kept == Draw(5).within("sensor").fixed("prnu", grid)).all()
    assert (kept != Draw(6).within("sensor").fixed("prnu", grid)).all()
    with pytest.raises(ValueError, match="read-only"):
        kept[0, 0] = 0


PLACES = np.stack([np.arange(20_000) // 100, np.arange(20_000) % 100, np.zeros(20_000, int)])


@pytest.mark.parametrize("switching", [0.02, 0.2, 0.5])
def test_chains_hold_and_switch_as_often_as_said(switching: float) -> None:
    """Over k frames states are correlated by (1 - 2 w)^k: Kac, American Math. Monthly 54, 1947."""
    draw = Draw(3)
    states = np.array([draw.chained("test", PLACES, k, switching) for k in range(12)]) - 0.5
    error = 1 / np.sqrt(PLACES.shape[1])
    for lag in (0, 1, 2, 5):
        own = 4 * (states[0] * states[lag]).mean()
        assert abs(own - (1 - 2 * switching) ** lag) < Z_MAX * error
        assert abs(2 * states[lag].mean()) < Z_MAX * error


@given(st.integers(0, 9), st.floats(0.01, 0.5), st.integers(0, 99))
def test_a_chain_is_where_it_was_when_it_last_forgot(
    frame: int, switching: float, seed: int
) -> None:
    draw, places = Draw(seed), PLACES[:, :50]
    state = draw.scattered("test", places, 0)[1] < 0.5
    for k in range(1, frame + 1):
        forgets, drawn = draw.scattered("test", places, k)
        state = np.where(forgets < 2 * switching, drawn < 0.5, state)
    assert np.array_equal(draw.chained("test", places, frame, switching), state)
