"""Where the search for 1/f noise starts: the share of it that rows and frames have."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates.temporal import CANDIDATES, pink_shares
from dsis.effects.effect import OperatingPoint
from dsis.effects.pink_noise import PinkNoise

SHAPES = [(96, 128), (48, 64), (32, 400), (200, 32)]
(PINK,) = (one for one in CANDIDATES if one.kind == "pink_noise")


@pytest.mark.parametrize("shape", SHAPES)
def test_shares_are_those_of_the_series_covariance(shape: tuple[int, int]) -> None:
    rows, columns = shape
    point = OperatingPoint(
        signal_dn=0.0, slope_dn=1.0, read_variance_dn2=1.0, segment=0, full_scale_dn=4000.0,
        frames=8, rows=rows, columns=columns,
    )  # fmt: skip
    own = PinkNoise(sigma_dn=1.0).contributions(point)
    expected = own["row_variance"], own["frame_variance"]
    assert pink_shares(rows, columns) == pytest.approx(expected, rel=2e-3)


def test_shares_are_those_of_drawn_series() -> None:
    """Of the two-way model's mean squares, within five standard errors of the draws."""
    rows, columns, draws = 24, 40, 1500
    rng, size = np.random.default_rng(4), 2 * rows * columns
    k = np.arange(1, size // 2)
    parts = rng.normal(size=(draws, 2, k.size)) / np.sqrt(k)
    spectrum = np.zeros((draws, size // 2 + 1), np.complex128)
    spectrum[:, 1:-1] = parts[:, 0] + 1j * parts[:, 1]
    series = np.fft.irfft(spectrum, size)[:, : rows * columns].reshape(draws, rows, columns)
    series /= np.sqrt(4 * (1 / k).sum()) / size
    frame = series.mean((1, 2))
    row = series.mean(2) - frame[:, None]
    column = series.mean(1) - frame[:, None]
    rest = series - frame[:, None, None] - row[:, :, None] - column[:, None]
    of_rows = columns * (row**2).sum(1) / (rows - 1)
    of_pixels = (rest**2).sum((1, 2)) / (rows - 1) / (columns - 1)
    of_columns = rows * (column**2).sum(1) / (columns - 1)
    of_frames = rows * columns * frame**2
    drawn = np.stack([
        (of_rows - of_pixels) / columns,
        (of_frames - of_rows - of_columns + of_pixels) / (rows * columns),
    ])  # fmt: skip
    error = drawn.std(1) / np.sqrt(draws)
    assert (np.abs(drawn.mean(1) - pink_shares(rows, columns)) < 5 * error).all()


@pytest.mark.parametrize(("row", "frame"), [(0.4, 0.0), (0.4, 9.0), (-0.1, 0.05)])
def test_the_search_starts_from_rows_and_else_from_frames(row: float, frame: float) -> None:
    found = {"row_variance": (row, 0.1), "frame_variance": (frame, 0.1), "column_variance": (0, 1)}
    clues: Any = Stub(layout=Stub(rows=96, columns=128), amplitude=lambda name, _: found[name])
    of_row, of_frame = pink_shares(96, 128)
    sizes = [one.effect.model_dump()["sigma_dn"] for one in PINK.propose(clues)]
    expected = row / of_row if row > 0 else frame / of_frame
    assert max(sizes) ** 2 == pytest.approx(expected)


def test_where_neither_varies_it_is_not_proposed() -> None:
    clues: Any = Stub(layout=Stub(rows=96, columns=128), amplitude=lambda *_: (-0.1, 0.1))
    assert not PINK.propose(clues)


@pytest.mark.parametrize(("column", "proposed"), [(0.4, True), (0.2, False), (-0.4, False)])
def test_it_starts_along_columns_where_these_clearly_vary(column: float, proposed: bool) -> None:
    found = {"row_variance": (-0.1, 0.1), "frame_variance": (-0.1, 0.1)}
    found["column_variance"] = (column, 0.1)
    clues: Any = Stub(layout=Stub(rows=96, columns=128), amplitude=lambda name, _: found[name])
    own = [one.effect.model_dump() for one in PINK.propose(clues)]
    assert [one.get("along") for one in own] == ["columns"] * 2 * proposed
    if proposed:
        expected = column / pink_shares(128, 96)[0]
        assert max(one["sigma_dn"] for one in own) ** 2 == pytest.approx(expected)
