"""Scores and screening against what other programs gave for real votes, and against closed forms.

The votes of three real tests, and the results of the program `sureal` on them, lie in the shared
data (`votes/*.json`); so do the votes and printed results of the demonstration of ITU-T P.910.
"""

import json
import re

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import analysis
from analysis.models import Z95
from analysis.screening import SUREAL

SETS = ("nflx_public", "nflx_public_last4outliers", "vqeg_hd3")
CLOSED_FORM = 1e-8
ITERATED = 1e-6


def votes_of(shared_data, name):
    votes = pd.read_csv(shared_data / "votes" / f"{name}_votes.csv")
    return votes.rename(columns={"subject": "observer"})


@pytest.fixture(scope="module", params=SETS)
def real(request, shared_data):
    """Name, votes, and the results of sureal."""
    text = (shared_data / "votes" / f"{request.param}.json").read_text()
    return request.param, votes_of(shared_data, request.param), json.loads(text)


def by_stimulus(table, results, column):
    return table.set_index("stimulus").loc[results["stimuli"], column].to_numpy()


def names(table):
    return " ".join(table.loc[table["rejected"], "observer"])


MOS_MEAN_AND_VARIANCE = {
    "nflx_public": (3.5447906524, 1.4012220201),
    "nflx_public_last4outliers": (3.5535864979, 1.0883380512),
    "vqeg_hd3": (3.2447916667, 1.0812084057),
}


def test_mos(real):
    name, votes, results = real
    table = analysis.mos(votes)
    expected = results["models"]["MOS"]
    mos = by_stimulus(table, results, "mos")
    np.testing.assert_allclose(mos, expected["quality_scores"], atol=CLOSED_FORM)
    assert (mos.mean(), mos.var()) == pytest.approx(MOS_MEAN_AND_VARIANCE[name], abs=1e-9)
    error = by_stimulus(table, results, "sd") / np.sqrt(by_stimulus(table, results, "n"))
    np.testing.assert_allclose(error, expected["quality_scores_std"], atol=CLOSED_FORM)


def test_interval_is_students(real):
    __, votes, __ = real
    for row in analysis.mos(votes).itertuples():
        of_one = votes.loc[votes["stimulus"] == row.stimulus, "vote"]
        if of_one.min() < of_one.max():
            interval = stats.ttest_1samp(of_one, 0.0).confidence_interval(0.95)
            assert (row.ci_low, row.ci_high) == pytest.approx(tuple(interval), abs=CLOSED_FORM)


AS_SUREAL = {
    "nflx_public": ("s03", 1.4215819260, "s04 s05 s10 s13", 1.4713438591),
    "nflx_public_last4outliers": ("s27 s29 s30", 1.3263346132, "s27 s28 s29", 1.3178984322),
    "vqeg_hd3": ("s13", 1.1070678429, "s13 s23", 1.1202300786),
}


def test_bt500_as_sureal_counts(real):
    name, votes, results = real
    screened = analysis.screen_bt500(votes, SUREAL)
    expected = results["models"]["BT500"]
    assert screened["observer"].tolist() == results["subjects"]
    assert names(screened) == AS_SUREAL[name][0]
    first = np.array(expected["observer_rejected_1st_stats"], dtype=float)
    second = np.array(expected["observer_rejected_2nd_stats"], dtype=float)
    np.testing.assert_allclose(screened["outside"], first, atol=CLOSED_FORM)
    np.testing.assert_allclose(screened["balance"], second, atol=CLOSED_FORM)
    kept = votes[~votes["observer"].isin(names(screened).split())]
    mos = by_stimulus(analysis.mos(kept), results, "mos")
    np.testing.assert_allclose(mos, expected["quality_scores"], atol=CLOSED_FORM)
    assert mos.var() == pytest.approx(AS_SUREAL[name][1], abs=1e-9)


def test_p913_as_sureal_counts(real):
    name, votes, results = real
    fitted = analysis.p913(votes, SUREAL)
    expected = results["models"]["P913"]
    score = by_stimulus(fitted.scores, results, "score")
    assert names(fitted.observers) == AS_SUREAL[name][2]
    assert score.var() == pytest.approx(AS_SUREAL[name][3], abs=1e-9)
    np.testing.assert_allclose(score, expected["quality_scores"], atol=CLOSED_FORM)
    np.testing.assert_allclose(
        by_stimulus(fitted.scores, results, "se"), expected["quality_scores_std"], atol=CLOSED_FORM
    )
    np.testing.assert_allclose(
        fitted.observers["bias"], expected["observer_bias"], atol=CLOSED_FORM
    )


P910_NUMBERS = {
    "nflx_public": (1.4355485664, 15.681766180, 14, 0.22845),
    "nflx_public_last4outliers": (1.3834038648, 22.255804586, 15, 0.28647),
    "vqeg_hd3": (1.0776756322, 14.310892847, 12, 0.23494),
}


def test_p910(real):
    name, votes, results = real
    fitted = analysis.p910(votes)
    expected = results["models"]["P910"]
    variance, sum_inconsistency, rounds, half_interval = P910_NUMBERS[name]
    score = by_stimulus(fitted.scores, results, "score")
    half = by_stimulus(fitted.scores, results, "ci_high") - score
    people = fitted.observers
    assert fitted.converged
    assert fitted.rounds == rounds == expected["num_iter"]
    assert score.var() == pytest.approx(variance, abs=1e-9)
    assert people["inconsistency"].sum() == pytest.approx(sum_inconsistency, abs=1e-8)
    assert half.mean() == pytest.approx(half_interval, abs=5e-6)
    below, above = np.array(expected["observer_inconsistency_ci95"])
    for got, reference in (
        (score, expected["quality_scores"]),
        (half, expected["quality_scores_ci95"][0]),
        (people["bias"], expected["observer_bias"]),
        (people["bias_ci_high"] - people["bias"], expected["observer_bias_ci95"][0]),
        (people["inconsistency"], expected["observer_inconsistency"]),
        (people["inconsistency"] - people["inconsistency_ci_low"], below),
        (people["inconsistency_ci_high"] - people["inconsistency"], above),
    ):
        np.testing.assert_allclose(got, reference, atol=ITERATED)


def test_correlations_are_sureals_and_find_the_scrambled_observers(real):
    name, votes, results = real
    screened = analysis.screen_correlation(votes)
    for column, model in (("pearson", "SR_MOS_PCC"), ("spearman", "SR_MOS_SRCC")):
        expected = results["models"][model]["observer_rejected_1st_stats"]
        np.testing.assert_allclose(screened[column], expected, atol=CLOSED_FORM)
    scrambled = "s27 s28 s29 s30" if name == "nflx_public_last4outliers" else ""
    assert names(screened) == scrambled


def test_bt500_done_right(real):
    """Sample sd, only presentations with variance, denominators = votes cast."""
    name, votes, __ = real
    expected = {"nflx_public": "", "nflx_public_last4outliers": "s27 s30", "vqeg_hd3": "s13"}
    screened = analysis.screen_bt500(votes).set_index("observer")
    assert names(screened.reset_index()) == expected[name]
    counted = screened["above"].str.split("; ").map(lambda s: len([name for name in s if name]))
    assert (counted == screened["p"]).all()


AFTER_TWO_SIGMA = {  # removed with ddof 1 and 0; mean MOS; largest shift of a MOS; mean sd
    "nflx_public": (97, 103, 3.5548943031, 0.190635, 0.5285),
    "nflx_public_last4outliers": (110, 118, 3.5711248845, 0.362963, 0.6577),
    "vqeg_hd3": (56, 58, 3.2437584306, 0.174242, 0.6540),
}


def test_two_sigma_removal(real):
    name, votes, __ = real
    sample, population, mean, shift, sd = AFTER_TWO_SIGMA[name]
    kept, removed = analysis.remove_outliers(votes)
    assert len(removed) == sample
    assert len(kept) + len(removed) == len(votes)
    assert len(analysis.remove_outliers(votes, ddof=0).removed) == population
    before, after = analysis.mos(votes), analysis.mos(kept)
    assert after["mos"].mean() == pytest.approx(mean, abs=1e-9)
    assert (after["mos"] - before["mos"]).abs().max() == pytest.approx(shift, abs=5e-7)
    assert after["sd"].mean() == pytest.approx(sd, abs=5e-5)
    # The audit can be checked by hand against the votes themselves.
    for row in removed.itertuples():
        of_one = votes.loc[votes["stimulus"] == row.stimulus, "vote"]
        assert votes.loc[row.Index, "vote"] == row.vote
        assert (row.mean, row.sd, row.n) == pytest.approx(
            (of_one.mean(), of_one.std(ddof=1), len(of_one))
        )
        assert row.z == pytest.approx((row.vote - row.mean) / row.sd)
        assert abs(row.z) > 2


def test_score_tables_hold_the_same_numbers(real):
    name, votes, results = real
    scores, people = analysis.score_table(votes), analysis.observer_table(votes)
    assert scores["n_removed"].sum() == AFTER_TWO_SIGMA[name][0]
    expected = results["models"]
    for column, reference in (
        ("mos", expected["MOS"]["quality_scores"]),
        ("score_p910", expected["P910"]["quality_scores"]),
    ):
        np.testing.assert_allclose(by_stimulus(scores, results, column), reference, atol=ITERATED)
    rejected = people.loc[people["bt500_rejected"], "observer"]
    kept = analysis.mos(votes[~votes["observer"].isin(rejected)])
    np.testing.assert_allclose(scores["mos_bt500"], kept["mos"], atol=CLOSED_FORM)
    assert people["n"].sum() == len(votes)


@pytest.mark.parametrize(
    ("sheet", "printout", "rounds"),
    [
        ("p910_demo_sample_data.csv", "p910_demo_sample_data_output.txt", 16),
        ("p910_demo_small_sample_data.csv", "p910_demo_small_sample_repeats_output.txt", 24),
    ],
)
def test_p910_demonstration(shared_data, sheet, printout, rounds):
    """The second has two repetitions of thirty stimuli; both have votes missing."""
    fitted = analysis.p910(sheet_of_votes(shared_data / "votes" / sheet))
    text = (shared_data / "votes" / printout).read_text()
    assert fitted.rounds == rounds
    for key, got in (
        ("bias_i", fitted.observers["bias"]),
        ("inconsistency_i", fitted.observers["inconsistency"]),
        ("mos_j", fitted.scores["score"]),
        ("sos_j", fitted.scores["se"]),
    ):
        part = text[text.index(f"'{key}'") :]
        printed = re.findall(r"float64\(([^)]*)\)", part[: part.index("]")])
        np.testing.assert_allclose(got, np.array(printed, dtype=float), atol=1e-12)


def sheet_of_votes(path):
    """Rows are stimuli, columns observers; a line of commas parts the repetitions."""
    blocks = [[]]
    for line in path.read_text().split():
        if line.strip(","):
            blocks[-1].append([float(cell) for cell in line.split(",")])
        else:
            blocks.append([])
    return pd.DataFrame(
        [
            (f"o{observer}", f"s{stimulus}", repetition, vote)
            for repetition, block in enumerate(filter(None, blocks), 1)
            for stimulus, row in enumerate(block)
            for observer, vote in enumerate(row)
        ],
        columns=["observer", "stimulus", "repetition", "vote"],
    )


def table(rows):
    """Votes from one list per stimulus, in the order of the observers."""
    return pd.DataFrame(
        [(f"o{o}", f"s{s}", vote) for s, row in enumerate(rows) for o, vote in enumerate(row)],
        columns=["observer", "stimulus", "vote"],
    )


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(1, 10), min_size=1, max_size=5))
def test_two_sigma_removes_nothing_from_five_votes(row):
    assert analysis.remove_outliers(table([row])).removed.empty


def test_two_sigma_is_strict():
    """With seven equal votes and two at +-1 the latter lie at exactly two sample sd."""
    on_the_limit = [5, 5, 5, 5, 5, 5, 5, 4, 6]
    assert analysis.remove_outliers(table([on_the_limit])).removed.empty
    assert analysis.remove_outliers(table([on_the_limit[1:]]), ddof=0).removed.empty
    assert len(analysis.remove_outliers(table([[5, *on_the_limit]])).removed) == 2


def test_two_sigma_is_one_pass():
    """Once 1 is gone, 4 lies beyond two sd of the rest: it stays."""
    row = [5] * 12 + [4, 1]
    first = analysis.remove_outliers(table([row]))
    assert first.removed["vote"].tolist() == [1]
    assert analysis.remove_outliers(first.kept).removed["vote"].tolist() == [4]


def test_degenerate_tables_have_defined_scores():
    one = analysis.score_table(table([[7]])).iloc[0]
    assert (one["mos"], one["mos_bt500"], one["score_p910"]) == (7, 7, 7)
    assert np.isnan([one["sd"], one["ci_low"], one["sd_trimmed"]]).all()
    equal = analysis.score_table(table([[0.1] * 7, [0.7] * 7]))
    assert equal["sd"].tolist() == [0, 0]
    assert equal["ci_high"].tolist() == equal["mos"].tolist()
    assert equal["n_removed"].sum() == 0
    people = analysis.observer_table(table([[0.1] * 7, [0.1] * 7]))
    assert people["correlation"].isna().all()
    assert not (people["bt500_rejected"] | people["correlation_rejected"]).any()


def test_repetitions_are_presentations_of_their_own():
    """A 5 is 2.6 sd low (kurtosis 3.4) in the second showing, and not at all in both pooled."""
    second = [7] * 6 + [8] * 5 + [9] * 6 + [5]
    first = [vote - 4 for vote in second[::-1]]
    votes = pd.concat(
        [table([first]).assign(repetition=1), table([second]).assign(repetition=2)],
        ignore_index=True,
    )
    screened = analysis.screen_bt500(votes)
    assert screened["n"].tolist() == [2] * 18
    assert screened["q"].tolist() == [1] + [0] * 16 + [1]
    pooled = votes.assign(observer=votes["observer"] + votes["repetition"].astype(str))
    assert analysis.screen_bt500(pooled.assign(repetition=1))["q"].sum() == 0
    assert analysis.mos(votes)["n"].tolist() == [36]


VOTES = st.lists(st.lists(st.integers(1, 10), min_size=8, max_size=8), min_size=3, max_size=8)


@settings(max_examples=12, deadline=None)
@given(rows=VOTES, shift=st.floats(-50, 50), stretch=st.sampled_from([0.1, 1 / 3, 2.5, 11.0]))
def test_another_scale_changes_nothing_but_the_numbers(rows, shift, stretch):
    """Scores follow vote -> shift + stretch vote; the same votes and observers are rejected."""
    votes = table(rows)
    other = votes.assign(vote=shift + stretch * votes["vote"])
    before, after = analysis.mos(votes), analysis.mos(other)
    for column in ("mos", "ci_low", "ci_high"):
        np.testing.assert_allclose(after[column], shift + stretch * before[column], atol=1e-9)
    assert (
        analysis.remove_outliers(other).removed.index.tolist()
        == analysis.remove_outliers(votes).removed.index.tolist()
    )
    same = ["p", "q", "rejected"]
    assert analysis.screen_bt500(other)[same].equals(analysis.screen_bt500(votes)[same])
    assert (
        analysis.screen_correlation(other)["rejected"].tolist()
        == analysis.screen_correlation(votes)["rejected"].tolist()
    )
    np.testing.assert_allclose(
        analysis.p913(other).scores["score"],
        shift + stretch * analysis.p913(votes).scores["score"],
        atol=1e-9,
    )


@pytest.mark.parametrize(("shift", "stretch"), [(-1.25, 2.25), (100.0, -20.0)])
def test_p910_on_another_scale(shared_data, shift, stretch):
    """1..5 to 1..10, and to 80..0: the fit stops at another round, hence the tolerance."""
    votes = votes_of(shared_data, "nflx_public")
    before = analysis.p910(votes)
    after = analysis.p910(votes.assign(vote=shift + stretch * votes["vote"]))
    expected = shift + stretch * before.scores["score"]
    np.testing.assert_allclose(after.scores["score"], expected, atol=ITERATED)
    np.testing.assert_allclose(
        after.observers["inconsistency"],
        abs(stretch) * before.observers["inconsistency"],
        atol=ITERATED,
    )
    np.testing.assert_allclose(
        after.scores["se"], abs(stretch) * before.scores["se"], atol=ITERATED
    )


def test_the_constant_of_published_intervals_is_the_normal_quantile():
    assert stats.norm.ppf(0.975) == pytest.approx(Z95, abs=5e-6)
