"""Offsets that neighbouring rows share: the effect, the numbers that see it, that it is named."""

import sys
from pathlib import Path
from types import SimpleNamespace as Stub
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import numpy as np
import pytest
from planter.offsets import row_banding as planted_banding
from scipy.linalg import toeplitz

from analysis.mismatch.bank.bands import Bands
from analysis.mismatch.bank.coherent import SpectrumSums
from analysis.mismatch.bank.linelags import LINE_LAGS, line_lags
from analysis.mismatch.candidates.rows import CANDIDATES
from analysis.mismatch.feigned import wandering
from analysis.mismatch.finding import OmittedEffect
from analysis.mismatch.layout import sites
from analysis.mismatch.settle import would_settle
from dsis.cfa import Cfa
from dsis.effects import OperatingPoint, registry
from dsis.grid import PixelGrid
from dsis.measures import Accumulator, Channel
from exposing import apply, effect, flat
from mismatch_recordings import camera
from mismatch_rows import diagnosed

pytestmark = pytest.mark.usefixtures("unproven")

SURE = 5.0  # standard errors
ROWS, COLUMNS, FRAMES = 64, 48, 40


def _series(length: float, rows: int, frames: int, sigma: float = 2.0) -> np.ndarray:
    one = effect("row_banding", sigma_dn=sigma, length_rows=length)
    return np.stack([apply(one, flat(0.0, rows)[:, :2], t) for t in range(frames)])


@pytest.mark.parametrize("length", [0.7, 2.0, 9.0])
def test_rows_are_as_alike_as_a_markov_series(length: float) -> None:
    """exp(-d / L) at d rows; products scatter by Bartlett's formula, below (1 + r) / (1 - r)."""
    rows, frames = 256, 200
    made = _series(length, rows, frames)
    assert np.ptp(made, axis=2).max() == 0
    series = made[:, :, 0] / 2.0
    worth = rows * frames * np.tanh(1 / length)  # independent products, at least
    for lag in (0, 1, 2, 5, 12):
        found = float((series[:, lag:] * series[:, : rows - lag]).mean())
        assert abs(found - np.exp(-lag / length)) < SURE * np.sqrt(2 / worth)


def test_frames_are_new_and_a_crop_has_the_rows_of_the_whole() -> None:
    one = effect("row_banding", sigma_dn=2.0, length_rows=6.0)
    whole = apply(one, flat(0.0, 96), 4)
    part = apply(one, flat(0.0, 96)[:20, :10], 4, grid=PixelGrid(20, 10, Cfa.MONO, 37, 5))
    np.testing.assert_array_equal(part, whole[37:57, 5:15])
    next_one = apply(one, flat(0.0, 96), 5)
    assert abs(np.corrcoef(whole[:, 0], next_one[:, 0])[0, 1]) < 0.9


@pytest.mark.parametrize("length", [0.7, 2.5, 12.0])
def test_variances_of_rows_and_frames_are_the_sums_over_all_pairs(length: float) -> None:
    """Of the covariance matrix itself: mean of all entries, and what the diagonal has beyond."""
    point = OperatingPoint(
        signal_dn=400.0,
        slope_dn=0.5,
        read_variance_dn2=20.0,
        segment=0,
        full_scale_dn=4000.0,
        frames=8,
        rows=96,
        columns=64,
    )
    sigma = 3.0
    matrix = sigma**2 * toeplitz(np.exp(-np.arange(point.rows) / length))
    mean = matrix.mean()
    within = (np.trace(matrix) - point.rows * mean) / (point.rows - 1)
    stated = effect("row_banding", sigma_dn=sigma, length_rows=length).contributions(point)
    assert stated["row_variance"] == pytest.approx(within, rel=1e-9)
    assert stated["frame_variance"] == pytest.approx(mean - within / point.rows, rel=1e-9)


def test_what_shares_next_to_nothing_is_no_band() -> None:
    with pytest.raises(ValueError, match="length_rows"):
        effect("row_banding", sigma_dn=1.0, length_rows=0.3)


def _measured(stack: np.ndarray, cfa: Cfa) -> dict[str, Channel]:
    sums = Accumulator(stack.shape[1], stack.shape[2], cfa, 0.0, 65535.0)
    for frame in stack:
        sums.add(frame)
    return dict(sums.result().channels)


def _numbers(stack: np.ndarray, cfa: Cfa, variance: float) -> dict[str, tuple[float, float]]:
    channels = _measured(stack, cfa)
    if cfa is Cfa.MONO:
        sums = SpectrumSums(stack.shape[1:])
        sums.add(channels["MONO"], len(stack), variance, 500.0)
        return dict(sums.slow_rows())
    bands = Bands(stack.shape[1], sites(cfa))
    bands.add(channels, dict.fromkeys(channels, variance), dict.fromkeys(channels, 500.0), FRAMES)
    return dict(bands.numbers())


def _recorded(rng: np.random.Generator, rows_dn: np.ndarray, sd: float) -> np.ndarray:
    """Return frames of white noise and offsets (frame, row)."""
    white = rng.normal(0, sd, (FRAMES, ROWS, COLUMNS))
    return 500.0 + white + rows_dn[:, :, np.newaxis]


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_correlations_are_those_of_the_row_means(cfa: Cfa) -> None:
    """Products of rows in a loop; of a mosaic whose channels are alike all rows are one series."""
    rng = np.random.default_rng(3)
    stack = _recorded(rng, np.cumsum(rng.normal(0, 0.3, (FRAMES, ROWS)), 1), 2.0)
    found = _numbers(stack, cfa, 4.0)
    means = stack.mean(2)
    means -= (
        means.reshape(FRAMES, -1, 1 if cfa is Cfa.MONO else 2)
        .mean(1)[:, np.newaxis]
        .repeat(ROWS // (1 if cfa is Cfa.MONO else 2), 1)
        .reshape(FRAMES, ROWS)
    )
    means -= means.mean(0)
    square = np.mean([m * m for m in means])
    for lag in LINE_LAGS:
        pairs = [m[y] * m[y + lag] for m in means for y in range(ROWS - lag)]
        value, _ = found[f"row_correlation of lag {lag}"]
        assert value == pytest.approx(np.mean(pairs) / square, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("row_dn", [0.0, 3.0])
def test_white_rows_are_alike_by_chance_as_far_as_is_said(cfa: Cfa, row_dn: float) -> None:
    rng, repeats = np.random.default_rng(5), 80
    made = [
        _numbers(_recorded(rng, rng.normal(0, row_dn, (FRAMES, ROWS)), 2.0), cfa, 4.0)
        for _ in range(repeats)
    ]
    for lag in LINE_LAGS:
        own = np.array([one[f"row_correlation of lag {lag}"] for one in made])
        error = own[:, 1].mean()
        assert own[:, 0].std(ddof=1) == pytest.approx(error, rel=SURE / np.sqrt(2 * repeats))
        # The mean that is taken off leaves -1 / n, of a mosaic's channels twice that at even lags.
        assert abs(own[:, 0].mean()) < 2.5 / ROWS + SURE * error / np.sqrt(repeats)


def test_of_few_rows_far_lags_are_unknown() -> None:
    found = line_lags(np.ones(11), 20.0, "row")
    assert np.isfinite(found["row_correlation of lag 4"][0])
    assert not np.isfinite(found["row_correlation of lag 8"][0])
    assert not np.isfinite(line_lags(np.zeros(65), 20.0, "row")["row_correlation of lag 1"][0])


def test_a_band_is_no_row_noise_and_no_drift() -> None:
    (candidate,) = CANDIDATES
    layout: Any = Stub(rows=96)
    for length, sane in ((0.6, False), (1.0, True), (9.0, True), (23.0, True), (25.0, False)):
        one = registry()["row_banding"](sigma_dn=1.0, length_rows=length)
        assert candidate.sane(layout, one) == sane
    for other in ("row_noise", "pink_noise", "line_flicker"):
        assert would_settle("row_banding", other) != would_settle("row_banding", "adc_dnl")


def test_the_planters_rows_have_the_covariance_that_is_stated() -> None:
    def view(seed: int) -> Any:
        return Stub(case=Stub(rows=40), fresh=lambda _: np.random.default_rng(seed))

    frames = 4000
    parameters = {"sigma_dn": 2.0, "length_rows": 3.0}
    zero = np.zeros((40, 1), np.float32)
    made = np.stack([planted_banding(zero, parameters, view(k))[:, 0] for k in range(frames)])
    wanted = 4 * toeplitz(np.exp(-np.arange(40) / 3.0))
    error = np.sqrt((wanted**2 + 16) / frames)
    assert np.abs((made.T @ made / frames - wanted) / error).max() < SURE


def _has_numbers(named: OmittedEffect, own: dict[str, float]) -> None:
    for name, value in own.items():
        fitted = named.parameters[name]
        assert isinstance(fitted.value, float)
        assert abs(fitted.value - value) < 4 * fitted.standard_error


@pytest.mark.long
def test_in_a_mosaic_it_is_named_with_its_numbers() -> None:
    own = {"sigma_dn": 1.13, "length_rows": 3.0}
    true, base = camera(effect("row_banding", **own), cfa="RGGB"), camera(cfa="RGGB")
    found = diagnosed(true, base, 9, columns=64)
    (named,) = found.omitted_physics
    assert named.effect == "row_banding"
    assert not found.unexplained
    _has_numbers(named, own)


@pytest.mark.long
def test_beside_white_rows_both_are_named_with_their_numbers() -> None:
    both = {
        "row_noise": {"sigma_dn": 1.6},
        "row_banding": {"sigma_dn": 1.15, "length_rows": 2.5},
    }
    found = diagnosed(camera(*(effect(kind, **own) for kind, own in both.items())), camera(), 9)
    named = {one.effect: one for one in found.omitted_physics}
    assert named.keys() == both.keys()
    assert not found.unexplained
    for kind, own in both.items():
        _has_numbers(named[kind], own)


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("pink_noise", {"sigma_dn": 2.4}),
        ("line_flicker", {"depth_percent": 0.48, "cycles_per_frame": 2.3}),
    ],
)
def test_what_resembles_it_is_not_it(kind: str, values: dict[str, float]) -> None:
    found = diagnosed(camera(effect(kind, **values)), camera(), 10)
    assert [one.effect for one in found.omitted_physics] == [kind]


def _wander(length: float, drift_dn: float, located: str = "row_correlation") -> Any:
    """Return a state with a drift, and slow waves of rows that no effect of it explains.

    Row means of variance 1 / 4 DN^2 whose neighbours are alike, beside white pixels of 20 DN^2:
    their spectrum by its cosine series.
    """
    rows, columns = 96, 128
    lags, cycles = np.arange(-400, 401), np.arange(1, rows // 2)
    waves = np.cos(2 * np.pi * np.outer(cycles / rows, lags)) @ np.exp(-np.abs(lags) / length) / 4
    ratio = 1 + (waves / cycles).sum() / (1 / cycles).sum() / (20 / columns)
    key = Stub(statistic="slow_row_variance", scope="all")
    state = Stub(
        mismatches=[Stub(statistic=located)],
        setting=Stub(
            layout=Stub(rows=rows, columns=columns),
            seen=Stub(levels={"dark": Stub(variance_dn2=20.0), "flat": Stub(variance_dn2=90.0)}),
        ),
        vector=Stub(keys=[key], values=np.array([np.cbrt(ratio)])),
        null=Stub(mean=np.ones(1), known=np.ones(1, bool)),
    )
    return state, effect("black_level_drift", sigma_dn=drift_dn)


@pytest.mark.parametrize("length", [1.0, 4.0, 12.0])
def test_frames_do_not_wander_by_what_their_rows_share(length: float) -> None:
    """The mean of a frame's rows has the mean of their covariances."""
    own = float(np.sqrt(toeplitz(np.exp(-np.arange(96) / length)).mean() / 4))
    assert wandering(*_wander(length, own)) is not None
    assert wandering(*_wander(length, 4 * own)) is None
    assert wandering(*_wander(length, own, "slow_row_variance")) is not None
    assert wandering(*_wander(length, own, "frame_variance")) is None
    state, _ = _wander(length, own)
    assert wandering(state, effect("flicker", sigma_percent=0.1)) is None
