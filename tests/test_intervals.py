"""Promise: intervals are what they are called, and cover what they say."""

import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import analysis
from analysis.bootstrap import RESAMPLES, SEED, bootstrap_interval, draw_resamples
from analysis.intervals import binomial_interval, default_interval, student_interval
from analysis.scale import Scale

TEN = Scale(1.0, 10.0)
STANDARD_ERRORS = 5  # two-sided chance of 6e-7


def table(rows):
    """Votes from one list per stimulus, in the order of the observers."""
    return pd.DataFrame(
        [(f"o{o}", f"s{s:02}", vote) for s, row in enumerate(rows) for o, vote in enumerate(row)],
        columns=["observer", "stimulus", "vote"],
    )


@given(st.integers(1, 60), st.data())
def test_binomial_is_clopper_and_pearsons(n, data):
    k = data.draw(st.integers(0, n))
    exact = stats.binomtest(k, n).proportion_ci(0.95, method="exact")
    got = binomial_interval([n], [1 + 9 * k / n], TEN)
    assert got.low[0] == pytest.approx(1 + 9 * exact.low, abs=1e-9)
    assert got.high[0] == pytest.approx(1 + 9 * exact.high, abs=1e-9)


@given(st.lists(st.integers(1, 10), min_size=2, max_size=40))
def test_binomial_never_leaves_the_scale_and_holds_the_mean(votes):
    got = binomial_interval([len(votes)], [np.mean(votes)], TEN)
    assert 1 <= got.low[0] <= np.mean(votes) <= got.high[0] <= 10
    assert got.low[0] < got.high[0]


def test_students_is_scipys():
    votes = np.array([3.0, 5, 6, 6, 9])
    expected = stats.ttest_1samp(votes, 0).confidence_interval(0.9)
    got = student_interval(5, votes.mean(), votes.std(ddof=1), 0.9)
    assert (got.low, got.high) == pytest.approx(tuple(expected))


def test_without_spread_the_binomial_interval_stands_in():
    interval, method = default_interval([12, 1, 12], [10.0, 7, 5], [0.0, np.nan, 1.0], TEN)
    assert method.tolist() == ["binomial", "binomial", "t"]
    # all twelve at the top: the lower end is where 12 of 12 has a chance of 2.5 %
    assert interval.low[0] == pytest.approx(1 + 9 * 0.025 ** (1 / 12))
    assert interval.high[0] == 10
    assert (interval.high > interval.low).all()
    scores = analysis.mos(table([[10] * 12, [7, 8] * 6]), TEN)
    assert scores["ci_method"].tolist() == ["binomial", "t"]
    assert scores["ci_low"][0] == pytest.approx(interval.low[0])
    without = analysis.mos(table([[10] * 12]))
    assert without["ci_method"].tolist() == ["none"]
    assert without["ci_low"][0] == without["ci_high"][0] == 10


def cell(rng, size, mu, sd):
    """Votes of a cell as in the shared simulation: normal, rounded, kept on 1..10."""
    return np.clip(np.rint(rng.normal(mu, sd, size)), 1, 10)


def true_mean(mu, sd):
    return 1 + stats.norm.sf((np.arange(1, 10) + 0.5 - mu) / sd).sum()


@pytest.mark.parametrize(("n", "mu", "sd"), [(15, 5.5, 1.6), (24, 9.2, 1.2), (40, 9.2, 1.2)])
def test_default_interval_covers(n, mu, sd, shared_data):
    """The benchmark has 20 000 cells and all rows; here 4000, and the promised 93.5 to 96.5 %."""
    cells = 4000
    votes = cell(np.random.default_rng(n), (cells, n), mu, sd)
    interval, _ = default_interval(np.full(cells, n), votes.mean(1), votes.std(1, ddof=1), TEN)
    inside = (interval.low <= true_mean(mu, sd)) & (true_mean(mu, sd) <= interval.high)
    error = np.sqrt(0.05 * 0.95 / cells)
    assert 0.935 - STANDARD_ERRORS * error < inside.mean() < 0.965 + STANDARD_ERRORS * error
    rows = json.loads((shared_data / "votes" / "ci_coverage_simulation.json").read_text())
    (row,) = [r for r in rows if (r["n"], r["mu"], r["sd"]) == (n, mu, sd)]
    both = np.hypot(error, np.sqrt(0.05 * 0.95 / 20_000))
    assert inside.mean() == pytest.approx(row["raw_t"], abs=STANDARD_ERRORS * both)


def test_binomial_is_conservative():
    votes = cell(np.random.default_rng(1), (4000, 15), 9.2, 1.2)
    interval = binomial_interval(np.full(4000, 15), votes.mean(1), TEN)
    inside = (interval.low <= true_mean(9.2, 1.2)) & (true_mean(9.2, 1.2) <= interval.high)
    assert inside.mean() > 0.95


def by_hand(votes, drawn, limit_sd=2.0):
    """Remove and average each resample with plain lists, and take the expanded percentiles."""
    means = []
    for counts in drawn.astype(int):
        resample = np.repeat(votes, counts)
        away = np.abs(resample - resample.mean())
        means.append(resample[away <= limit_sd * resample.std(ddof=1) + 1e-9].mean())
    n = len(votes)
    tail = stats.norm.cdf(np.sqrt(n / (n - 1)) * stats.t.ppf(0.025, n - 1))
    return np.quantile(means, [tail, 1 - tail])


def test_the_bootstrap_removes_inside_each_resample():
    rng = np.random.default_rng(3)
    votes = cell(rng, 18, 7, 1.5)
    drawn = rng.multinomial(18, np.full(18, 1 / 18), 400).astype(float)
    got = bootstrap_interval(votes, drawn, 2.0)
    assert (got.low, got.high) == pytest.approx(tuple(by_hand(votes, drawn)), abs=1e-12)


def test_the_table_has_the_bootstrap_with_and_without_removal():
    """One vote of eighteen lies far off: the two intervals differ by more than a tenth."""
    far = [7, 8, 8, 9] * 4 + [8, 1]
    votes = table([far])
    drawn = draw_resamples(18, RESAMPLES, SEED)
    ordered = np.array(far, dtype=float)  # observers sort as they are numbered
    (row,) = analysis.score_table(votes, TEN).to_dict("records")
    trimmed, whole = by_hand(ordered, drawn), by_hand(ordered, drawn, np.inf)
    assert (row["ci_boot_trimmed_low"], row["ci_boot_trimmed_high"]) == pytest.approx(
        tuple(trimmed), abs=1e-9
    )
    assert (row["ci_boot_low"], row["ci_boot_high"]) == pytest.approx(tuple(whole), abs=1e-9)
    assert np.abs(trimmed - whole).max() > 0.1


def test_the_bootstrap_resamples_observers_not_votes():
    """Two votes of each observer that are always equal carry no more than one."""
    rng = np.random.default_rng(4)
    rows = [cell(rng, 20, 6, 1.5) for _ in range(3)]
    once = table(rows).assign(repetition=1)
    twice = pd.concat([once, once.assign(repetition=2)], ignore_index=True)
    one = analysis.bootstrap_scores(once, threshold=None)
    two = analysis.bootstrap_scores(twice, threshold=None)
    np.testing.assert_allclose(two["boot_low"], one["boot_low"])
    student = analysis.mos(twice)
    assert (student["ci_low"] > two["boot_low"]).all()  # too short, as the report remarks


def test_the_bootstrap_takes_missing_votes_and_is_fixed_by_its_seed():
    votes = table([[5, 6, 7, 8, 9, 5, 6, 7], [3, 4, 5]])
    first = analysis.bootstrap_scores(votes, seed=7)
    pd.testing.assert_frame_equal(first, analysis.bootstrap_scores(votes, seed=7))
    assert (first["boot_low"] < first["boot_high"]).all()
    assert not first.equals(analysis.bootstrap_scores(votes, seed=8))
    lonely = analysis.bootstrap_scores(table([[5]]))
    assert lonely["boot_low"].isna().all()
