"""Bands of light that cross a mosaic, and where a search for saturation starts."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.bank.bands import Bands
from analysis.mismatch.bank.coherent import SpectrumSums, slow_lines
from analysis.mismatch.candidates import temporal
from analysis.mismatch.candidates.response import skewness_below
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout, sites
from dsis.cfa import Cfa
from dsis.measures import Accumulator, Channel

Array = NDArray[np.float64]
ROWS, COLUMNS, FRAMES = 64, 48, 8
SIGNAL = {"R": 200.0, "Gr": 500.0, "Gb": 500.0, "B": 300.0}
VARIANCE = {name: signal / 4 + 9 for name, signal in SIGNAL.items()}
PLACES = sites(Cfa.RGGB)


def recorded(rng: np.random.Generator, depth: float, cycles: float) -> dict[str, Channel]:
    """Return the measures of a flat under a lamp that flickers while rows are read."""
    rows = np.arange(ROWS)[:, None]
    sums = Accumulator(ROWS, COLUMNS, Cfa.RGGB, 0.0, 65535.0)
    clean, sd = np.zeros((2, ROWS, COLUMNS))
    for name, (y, x) in PLACES.items():
        clean[y::2, x::2], sd[y::2, x::2] = SIGNAL[name], VARIANCE[name] ** 0.5
    for phase in rng.uniform(0, 2 * np.pi, FRAMES):
        band = 1 + depth * np.sin(2 * np.pi * cycles * rows / ROWS + phase)
        sums.add(clean * band + rng.normal(0, sd))
    return dict(sums.result().channels)


def bands_of(channels: dict[str, Channel]) -> Bands:
    """Return the mosaic's bands."""
    bands = Bands(ROWS, PLACES)
    bands.add(channels, VARIANCE, SIGNAL, FRAMES)
    return bands


def score(channels: dict[str, Channel]) -> float:
    """Return how clear a band of light is."""
    return bands_of(channels).numbers()["row_spectrum_peak of light"][0]


@pytest.mark.parametrize("cycles", [5.0, 8.25, 13.5, 20.75])
def test_a_band_is_clearer_in_all_colours_together_and_where_it_is(cycles: float) -> None:
    channels = recorded(np.random.default_rng(3), 0.004, cycles)
    alone = []
    for name, channel in channels.items():
        sums = SpectrumSums((ROWS // 2, COLUMNS // 2))
        sums.add(channel, FRAMES, VARIANCE[name], SIGNAL[name])
        alone.append(sums.numbers()["row_spectrum_peak of light"][0])
    assert score(channels) > max(alone) + 2
    peak = bands_of(channels).peaks()["rows of light"]
    assert peak.fy * ROWS / 2 + peak.off == pytest.approx(cycles, abs=0.2)


@pytest.mark.parametrize("cycles", [5.0, 8.25, 13.5, 20.75])
def test_a_fit_starts_where_the_band_is_and_at_its_depth(cycles: float) -> None:
    """Half bins lose 1 - sinc(1/4)^2 = 0.19 of the power, 0.1 of the depth, at most."""
    depth, places = 0.01, [("flat", name) for name in SIGNAL]
    bands = bands_of(recorded(np.random.default_rng(6), depth, cycles))
    clues = SimpleNamespace(
        places=places,
        signal=lambda place: SIGNAL[place[1]],
        seen=SimpleNamespace(
            levels={p: SimpleNamespace(variance_dn2=VARIANCE[p[1]]) for p in places},
            peaks={("", kind): peak for kind, peak in bands.peaks().items()},
            pooled={"": bands.numbers()},
        ),
        frames=lambda _: FRAMES,
        shape=lambda _: (ROWS // 2, COLUMNS // 2),
        layout=Layout((), ROWS, COLUMNS, Cfa.RGGB, 0.0, 4095.0, {}, {}),
    )
    (proposal,) = temporal._line_flicker(cast(Clues, clues))
    found = proposal.effect.model_dump()
    assert 0.8 * depth < found["depth_percent"] / 100 < 1.1 * depth
    assert proposal.free == ("depth_percent",)
    error = proposal.errors["cycles_per_frame"]
    assert abs(found["cycles_per_frame"] - cycles) < max(4 * error, 0.1)


def test_slow_waves_of_white_rows_have_the_spread_that_is_said() -> None:
    """Mean square 1 + share of row noise; its cube root scatters as in closed form."""
    rng = np.random.default_rng(8)
    numbers = [bands_of(recorded(rng, 0.0, 5.0)).numbers() for _ in range(60)]
    values, errors = np.array([one["slow_row_variance"] for one in numbers]).T
    assert values.std(ddof=1) == pytest.approx(errors.mean(), rel=0.25)
    assert values.mean() == pytest.approx(1.0, abs=4 * errors.mean() / 60**0.5 + 0.02)


@pytest.mark.parametrize(("exponent", "clearer"), [(1.0, True), (0.0, False)])
def test_pink_rows_are_clearer_in_their_slow_waves_and_white_ones_in_their_variance(
    exponent: float, clearer: bool
) -> None:
    """z of sum w_k P_k is largest for w_k in proportion to the signal's power."""
    rng, rows, degrees = np.random.default_rng(9), 128, 40.0
    cycles = np.arange(1, rows // 2)
    drift = 0.4 * cycles**-exponent / (cycles**-exponent).mean()
    slow, plain = [], []
    for _ in range(40):
        power = np.zeros(rows + 1)
        power[2:-1:2] = rng.gamma(degrees, 1 / degrees, cycles.size) + drift
        value, error = slow_lines(power, degrees)
        slow.append((value - 1) / error)
        plain.append(
            (np.cbrt(power[2:-1:2].mean()) - 1) / (2 / 9 / (2 * degrees * cycles.size)) ** 0.5
        )
    assert (np.mean(slow) > 1.3 * np.mean(plain)) == clearer
    assert (np.mean(plain) > 1.3 * np.mean(slow)) != clearer


def test_noise_alone_is_scored_as_a_normal_deviate_or_less() -> None:
    rng = np.random.default_rng(4)
    scores = np.array([score(recorded(rng, 0.0, 1.0)) for _ in range(120)])
    for level in (0.1, 0.02):
        allowed = level + 3 * (level * (1 - level) / scores.size) ** 0.5
        assert (scores > scipy.stats.norm.isf(level)).mean() <= allowed


@pytest.mark.parametrize("limit", [-0.5, 0.5, 2.0])
def test_skewness_of_charge_that_is_cut(limit: float) -> None:
    cut = np.minimum(np.random.default_rng(5).normal(size=400_000), limit)
    assert skewness_below(limit) == pytest.approx(scipy.stats.skew(cut), abs=0.03)
