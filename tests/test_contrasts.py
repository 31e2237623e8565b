"""Promise: the paper's question is answered within observers, by tests that others confirm."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.regression.mixed_linear_model import MixedLM, MixedLMParams
from statsmodels.stats.multitest import multipletests

import analysis
from analysis.holm import holm
from analysis.inference.linear import wald
from analysis.inference.signedrank import signed_rank


def paper_votes(observers=18, repetitions=1, seed=1, spread=1.1):
    """A test like the paper's: demosaicking costs 2.5 grades on city, 1.2 on landscape."""
    rng = np.random.default_rng(seed)
    bias = rng.normal(0, 0.6, observers)
    rows = []
    conditions = product((("city", -2.5), ("landscape", -1.2)), ("awgn", "sd"), range(2))
    for (content, loss), noise, demosaicked in conditions:
        quality = 7.5 + loss * demosaicked - 0.4 * (noise == "sd")
        method = "bilinear" if demosaicked else "none"
        for repetition, who in product(range(1, repetitions + 1), range(observers)):
            vote = np.clip(np.rint(quality + bias[who] + rng.normal(0, spread)), 1, 10)
            name = f"{content}__{noise}__{method}__0"
            rows.append((f"s{who}", name, content, noise, method, 0, repetition, vote))
    columns = ["observer", "stimulus", "content", "noise", "demosaic", "level", "repetition"]
    return pd.DataFrame(rows, columns=[*columns, "vote"])


def row_of(table, **where):
    rows = table
    for column, value in where.items():
        rows = rows[rows[column] == value]
    (row,) = rows.to_dict("records")
    return row


def test_cells_are_paired_t_and_exact_signed_rank_tests():
    votes = paper_votes()
    table = analysis.test_contrasts(votes)
    assert table.groupby(["question", "grain"]).size().to_dict() == {
        (question, grain): size
        for question in ("demosaicking", "noise")
        for grain, size in (("cell", 4), ("content", 2), ("overall", 1))
    }
    wide = votes.pivot_table(index="observer", columns="stimulus", values="vote")
    first, second = wide["city__sd__bilinear__0"], wide["city__sd__none__0"]
    row = row_of(table, question="demosaicking", grain="cell", content="city", within="sd")
    expected = stats.ttest_rel(first, second)
    interval = expected.confidence_interval(0.95)
    assert row["n"] == 18
    assert row["difference"] == pytest.approx((first - second).mean())
    assert row["p_t"] == pytest.approx(expected.pvalue)
    assert (row["ci_low"], row["ci_high"]) == pytest.approx(tuple(interval))
    assert row["effect_size"] == pytest.approx((first - second).mean() / (first - second).std())


def test_averages_are_those_of_the_pairs():
    votes = paper_votes()
    table = analysis.test_contrasts(votes)
    cells = table[(table["grain"] == "cell") & (table["question"] == "demosaicking")]
    by_content = cells.groupby("content")["difference"].mean()
    for content, mean in by_content.items():
        row = row_of(table, question="demosaicking", grain="content", content=content)
        assert row["difference"] == pytest.approx(mean)
    overall = row_of(table, question="demosaicking", grain="overall")
    assert overall["difference"] == pytest.approx(cells["difference"].mean())
    assert (overall["content"], overall["within"]) == ("all", "all")


def test_an_observer_who_missed_a_stimulus_is_left_out_of_its_contrasts_only():
    votes = paper_votes()
    gone = (votes["observer"] == "s3") & (votes["stimulus"] == "city__sd__none__0")
    table = analysis.test_contrasts(votes[~gone])
    assert row_of(table, question="demosaicking", grain="overall")["n"] == 17
    landscape = table[(table["content"] == "landscape")]
    assert set(landscape["n"]) == {18}


def test_degenerate_contrasts_are_said_in_words():
    votes = paper_votes(observers=5)
    votes["vote"] = np.where(votes["demosaic"] == "none", 8.0, 6.0)
    table = analysis.test_contrasts(votes)
    row = row_of(table, question="demosaicking", grain="overall")
    assert (row["difference"], row["sd"]) == (-2, 0)
    assert np.isnan(row["p_t"])
    assert row["p_wilcoxon"] == pytest.approx(2 / 2**5)
    said = analysis.conclusions(table)
    assert said[0] == (
        "Demosaicking (bilinear) lowers the MOS by 2.00 over all contents (all 5 observers alike; "
        "no test)."
    )
    assert any("does not change the MOS" in sentence for sentence in said)
    alone = analysis.conclusions(analysis.test_contrasts(votes[votes["observer"] == "s1"]))
    assert "(one observer; no test)" in alone[0]


def test_sentences_carry_the_numbers_per_content():
    said = analysis.conclusions(analysis.test_contrasts(paper_votes(observers=24, seed=2)))
    city = next(s for s in said if "Demosaicking" in s and " on city (" in s)
    assert "lowers the MOS by 2." in city
    assert "p < 0.001 after Holm" in city
    assert "n = 24" in city
    assert any("no significant effect" in s for s in said)


def test_stimuli_without_conditions_have_no_contrasts(shared_data):
    votes = pd.read_csv(shared_data / "votes" / "vqeg_hd3_votes.csv")
    table = analysis.test_contrasts(votes.rename(columns={"subject": "observer"}))
    assert table.empty
    assert analysis.conclusions(table) == []


@settings(max_examples=40)
@given(st.lists(st.integers(-4, 4), min_size=1, max_size=9))
def test_signed_rank_is_the_permutation_test_it_says(differences):
    """All signs of all non-zero differences, ranks by Pratt; zeros stay zero."""
    values = np.array(differences, dtype=float)
    ranks = stats.rankdata(np.abs(values))
    used = values != 0
    observed = ranks[values > 0].sum()
    sums = [
        ranks[used][np.array(signs, dtype=bool)].sum()
        for signs in product((0, 1), repeat=int(used.sum()))
    ]
    tail = min(
        np.mean(np.array(sums) <= observed + 1e-9), np.mean(np.array(sums) >= observed - 1e-9)
    )
    assert signed_rank(values) == pytest.approx(min(1.0, 2 * tail))


def test_signed_rank_is_scipys_without_ties():
    rng = np.random.default_rng(1)
    for n in (6, 15, 40):
        values = rng.normal(0.3, 1, n)
        expected = stats.wilcoxon(values, method="exact").pvalue
        assert signed_rank(values) == pytest.approx(expected)
    values = rng.normal(0.1, 1, 150)
    expected = stats.wilcoxon(values, method="asymptotic").pvalue
    assert signed_rank(values) == pytest.approx(expected)


@pytest.mark.usefixtures("swept")
@settings(max_examples=25)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_holm_is_statsmodels(p):
    expected = multipletests(p, method="holm")[1]
    np.testing.assert_allclose(holm(np.array(p)), expected, atol=1e-12)


def test_holm_passes_over_what_is_no_test():
    np.testing.assert_allclose(holm(np.array([0.01, np.nan, 0.02])), [0.02, np.nan, 0.02])


def test_the_linear_model_is_the_analysis_of_variance_of_a_balanced_design():
    """Of two-way data without gaps REML has closed forms: mean squares of residual, observers."""
    votes = paper_votes()
    fit = analysis.fit_linear(votes)
    wide = votes.pivot_table(index="observer", columns="stimulus", values="vote").to_numpy()
    observers, stimuli = wide.shape
    residual = wide - wide.mean(0) - wide.mean(1, keepdims=True) + wide.mean()
    within = (residual**2).sum() / ((observers - 1) * (stimuli - 1))
    between = stimuli * wide.mean(1).var(ddof=1)
    assert fit.estimable
    assert fit.residual_sd == pytest.approx(np.sqrt(within), rel=1e-6)
    assert fit.observer_sd == pytest.approx(np.sqrt((between - within) / stimuli), rel=1e-5)
    row = row_of(fit.contrasts, question="demosaicking", grain="overall")
    expected = row_of(analysis.test_contrasts(votes), question="demosaicking", grain="overall")
    assert row["difference"] == pytest.approx(expected["difference"])
    # 8 stimuli with weights of a quarter
    assert row["se"] == pytest.approx(np.sqrt(within * 8 / 16 / observers), rel=1e-6)
    # Wald's: 1.959964 is the normal table's 97.5 %
    ends = (row["difference"] - 1.959964 * row["se"], row["difference"] + 1.959964 * row["se"])
    assert (row["ci_low"], row["ci_high"]) == pytest.approx(ends, abs=1e-6)


def test_walds_p_is_that_of_a_chi_square_with_one_degree_of_freedom():
    """z squared is chi-squared: two-sided by nature. 0.05 is where the interval ends at zero."""
    votes = paper_votes(observers=6, spread=2.5)
    for row in analysis.fit_linear(votes).contrasts.to_dict("records"):
        expected = stats.chi2.sf((row["difference"] / row["se"]) ** 2, 1)
        assert row["p"] == pytest.approx(expected, rel=1e-9)
        assert (row["p"] < 0.05) == (row["ci_low"] * row["ci_high"] > 0)
    same = wald(np.array([0.0, 1.959964]), np.array([1.0, 1.0]))
    assert same["p"] == pytest.approx([1.0, 0.05], abs=1e-6)


@pytest.mark.parametrize("column", ["p_t", "p_wilcoxon"])
def test_holms_family_is_one_question_at_one_grain(column):
    """Each of the six families (2, 3 or 1 tests wide) is statsmodels' correction of it alone."""
    table = analysis.test_contrasts(paper_votes(observers=9, spread=2.0))
    families = list(product(("demosaicking", "noise"), ("cell", "content", "overall")))
    for question, grain in families:
        rows = table[(table["question"] == question) & (table["grain"] == grain)]
        expected = multipletests(rows[column], method="holm")[1]
        np.testing.assert_allclose(rows[f"{column}_holm"], expected, rtol=1e-12)
    for question in ("demosaicking", "noise"):  # a wider family would give other values
        rows = table[table["question"] == question]
        wider = multipletests(rows[column], method="holm")[1]
        assert not np.allclose(rows[f"{column}_holm"], wider)


def two_levels():
    """Votes at 0 and 2 stops; each stimulus has a mean of its own, and observers a bias."""
    rng = np.random.default_rng(3)
    votes = paper_votes(observers=12)
    deeper = votes.assign(
        level=2,
        stimulus=votes["stimulus"].str.replace("__0", "__2"),
        vote=votes["vote"] - 1 - (votes["demosaic"] != "none") + rng.normal(0, 0.3, len(votes)),
    )
    return pd.concat([votes, deeper], ignore_index=True)


def test_pairs_are_of_one_level():
    """Two levels, contents and factors: 8 pairs a question, each of stimuli of one level."""
    votes = two_levels()
    table = analysis.test_contrasts(votes)
    assert table.groupby(["question", "grain"]).size().to_dict() == {
        (question, grain): size
        for question in ("demosaicking", "noise")
        for grain, size in (("cell", 8), ("content", 2), ("overall", 1))
    }
    mean = votes.groupby("stimulus")["vote"].mean()
    for content, noise, level in product(("city", "landscape"), ("awgn", "sd"), ("0", "2")):
        row = row_of(
            table,
            question="demosaicking",
            grain="cell",
            content=content,
            within=noise,
            level=level,
        )
        first, second = (mean[f"{content}__{noise}__{d}__{level}"] for d in ("bilinear", "none"))
        assert row["difference"] == pytest.approx(first - second)
    for content in ("city", "landscape"):
        row = row_of(table, question="demosaicking", grain="content", content=content)
        assert row["level"] == "all"
        with_it, without = (
            mean.filter(regex=f"^{content}__.*__{d}__") for d in ("bilinear", "none")
        )
        assert row["difference"] == pytest.approx(with_it.mean() - without.mean())
    paired = table.sort_values(["question", "grain", "content", "within", "level"])
    linear = analysis.fit_linear(votes).contrasts.sort_values(
        ["question", "grain", "content", "within", "level"]
    )
    np.testing.assert_allclose(paired["difference"], linear["difference"])


def test_the_linear_model_is_at_the_maximum_of_statsmodels_likelihood():
    """Votes missing, repetitions: MixedLM gives the same value here, and lower ones beside it."""
    votes = paper_votes(repetitions=2).sample(frac=0.8, random_state=1)
    fit = analysis.fit_linear(votes)
    stimulus, names = pd.factorize(votes["stimulus"], sort=True)
    design = np.eye(len(names))[stimulus]
    model = MixedLM(votes["vote"].to_numpy(), design, groups=votes["observer"].to_numpy())
    model.cov_pen, model.fe_pen, model.reml = None, None, True  # else set by its own fit
    ratio = (fit.observer_sd / fit.residual_sd) ** 2
    here = MixedLMParams.from_components(fe_params=np.zeros(8), cov_re=np.array([[ratio]]))
    assert fit.loglik == pytest.approx(model.loglike(here, profile_fe=True), abs=1e-6)
    for other in (0.5, 0.99, 1.01, 2.0):
        there = MixedLMParams.from_components(
            fe_params=np.zeros(8), cov_re=np.array([[other * ratio]])
        )
        assert model.loglike(there, profile_fe=True) < fit.loglik


def test_the_linear_model_without_anything_to_spread_says_so():
    votes = paper_votes(observers=4)
    votes["vote"] = np.where(votes["demosaic"] == "none", 8.0, 6.0)
    fit = analysis.fit_linear(votes)
    assert not fit.estimable
    row = row_of(fit.contrasts, question="demosaicking", grain="overall")
    assert row["difference"] == pytest.approx(-2)
    assert np.isnan(row["se"])
