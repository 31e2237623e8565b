"""Promise: models, quality flags, retest and effects of order say what others and truth say."""

import json

import numpy as np
import pandas as pd
import pytest

import analysis
from analysis.order import ORDER_COLUMNS
from analysis.scale import Scale
from analysis.screening import SUREAL
from dsis.errors import InputError

SETS = ("nflx_public", "nflx_public_last4outliers", "vqeg_hd3")
FIVE = Scale(1.0, 5.0)
STANDARD_ERRORS = 5


@pytest.fixture(scope="module", params=SETS)
def real(request, shared_data):
    votes = pd.read_csv(shared_data / "votes" / f"{request.param}_votes.csv")
    votes = votes.rename(columns={"subject": "observer"})
    votes["kind"] = votes["is_reference"].map({0: "test", 1: "reference"})
    text = (shared_data / "votes" / f"{request.param}.json").read_text()
    return request.param, votes, json.loads(text)


def test_likelihoods_and_bic_are_sureals(real):
    __, votes, results = real
    table = analysis.compare_models(votes, SUREAL).set_index("model")
    theirs = {"MOS": "MOS", "BT.500": "BT500", "BR": "BR_MOS", "P.913": "P913", "P.910": "P910"}
    for mine, name in theirs.items():
        expected = results["models"][name]
        for column, key in (
            ("loglik_per_vote", "loglikelihood"),
            ("aic_per_vote", "aic"),
            ("bic_per_vote", "bic"),
        ):
            assert table.loc[mine, column] == pytest.approx(expected[key], abs=1e-6)
    assert table["bic_per_vote"].idxmin() == "P.910"


def test_dmos_is_sureals_where_everybody_judged_everything(real):
    __, votes, results = real
    scores = analysis.dmos(votes, FIVE)
    expected = dict(
        zip(results["stimuli"], results["models"]["DMOS"]["quality_scores"], strict=True)
    )
    assert len(scores) == (votes.drop_duplicates("stimulus")["kind"] == "test").sum()
    np.testing.assert_allclose(scores["dmos"], scores["stimulus"].map(expected), atol=1e-8)
    assert (scores["ci_low"] < scores["dmos"]).all()


def test_dmos_pairs_observers_with_themselves():
    rows = [
        ("a", "x", "c", "test", 6), ("a", "r", "c", "reference", 9),
        ("b", "x", "c", "test", 4), ("b", "r", "c", "reference", 10),
        ("c", "x", "c", "test", 1),  # never saw the reference
    ]  # fmt: skip
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "content", "kind", "vote"])
    (row,) = analysis.dmos(votes, Scale(1, 10)).itertuples()
    assert (row.n, row.dmos, row.reference) == (2, (7 + 4) / 2, "r")
    assert row.sd == pytest.approx(3 / np.sqrt(2))  # of 7 and 4, with n - 1
    # t(0.975, 1) is tan(0.475 pi)
    half = np.tan(0.475 * np.pi) * 3 / 2
    assert (row.ci_low, row.ci_high) == pytest.approx((5.5 - half, 5.5 + half))
    assert analysis.dmos(votes[votes["kind"] == "test"], Scale(1, 10)).empty
    second = votes[votes["kind"] == "reference"].assign(stimulus="r2")
    with pytest.raises(InputError, match="several hidden references: c"):
        analysis.dmos(pd.concat([votes, second]), Scale(1, 10))


SOS = {"nflx_public": 0.1904, "nflx_public_last4outliers": 0.2610, "vqeg_hd3": 0.1862}


def test_sos_parameter_flags_the_scrambled_set(real):
    name, votes, __ = real
    fit = analysis.sos_parameter(votes, FIVE)
    assert fit.a == pytest.approx(SOS[name], abs=5e-5)
    assert fit.suspicious == (name == "nflx_public_last4outliers")
    assert fit.a_random == 0.5


def test_random_votes_have_the_stated_sos():
    grades = np.tile(np.arange(1, 11), 30)
    votes = pd.DataFrame({"observer": np.arange(300).astype(str), "stimulus": "s", "vote": grades})
    fit = analysis.sos_parameter(votes, Scale(1, 10))
    assert fit.a == pytest.approx(fit.a_random)


def simulated(observers=30, stimuli=40, drift=0.0, fatigue=0.0, contrast=0.0, seed=1):
    """Votes without rounding, everyone in an order of one's own, with planted effects of order."""
    rng = np.random.default_rng(seed)
    quality = rng.uniform(2, 9, stimuli)
    rows = []
    for observer in range(observers):
        order = rng.permutation(stimuli)
        bias = rng.normal(0, 0.5)
        for place, stimulus in enumerate(order, 1):
            spread = 0.8 + fatigue * place / 10
            before = quality[order[place - 2]] if place > 1 else 5.5
            vote = quality[stimulus] + bias + drift * place / 10 + contrast * (before - 5.5)
            vote += rng.normal(0, spread)
            rows.append((f"o{observer}", f"s{stimulus}", place, vote))
    return pd.DataFrame(rows, columns=["observer", "stimulus", "presentation", "vote"])


def test_planted_effects_of_order_are_recovered():
    effects = analysis.order_effects(simulated(drift=0.25, contrast=-0.12)).set_index("effect")
    for name, planted in (("drift", 0.25), ("contrast", -0.12)):
        row = effects.loc[name]
        error = (row["ci_high"] - row["ci_low"]) / 4
        assert row["slope"] == pytest.approx(planted, abs=STANDARD_ERRORS * error)
        assert row["p_holm"] < 0.001
    tired = analysis.order_effects(simulated(fatigue=0.2)).set_index("effect").loc["fatigue"]
    # |N(0, s)| has mean s sqrt(2 / pi)
    error = (tired["ci_high"] - tired["ci_low"]) / 4
    assert tired["slope"] == pytest.approx(0.2 * np.sqrt(2 / np.pi), abs=STANDARD_ERRORS * error)


def test_without_effects_of_order_they_are_found_at_the_nominal_rate():
    runs = 80
    p = [
        analysis.order_effects(simulated(observers=12, stimuli=12, seed=seed))["p"]
        for seed in range(runs)
    ]
    found = (np.array(p) < 0.05).mean(axis=0)
    assert (np.abs(found - 0.05) < STANDARD_ERRORS * np.sqrt(0.05 * 0.95 / runs)).all()


def test_without_places_there_are_no_effects_of_order():
    effects = analysis.order_effects(simulated().drop(columns="presentation"))
    assert effects.empty
    assert effects.columns.tolist() == [column.name for column in ORDER_COLUMNS]


def test_retest_of_planted_repetitions():
    rng = np.random.default_rng(5)
    first = simulated(observers=60).drop(columns="presentation").assign(repetition=1)
    quality = first["vote"]
    first["vote"] = quality + rng.normal(0, 0.7, len(first))
    second = first.assign(repetition=2, vote=quality + 0.3 + rng.normal(0, 0.7, len(first)))
    found = analysis.retest(pd.concat([first, second], ignore_index=True))
    assert (found.pairs, found.observers) == (2400, 60)
    # of 2400 differences with sd 0.7 sqrt 2
    assert found.shift == pytest.approx(0.3, abs=STANDARD_ERRORS * 0.7 * np.sqrt(2 / 2400))
    assert found.shift_ci[0] < found.shift < found.shift_ci[1]
    assert found.repeat_sd == pytest.approx(0.7, rel=STANDARD_ERRORS / np.sqrt(2 * 2400))
    assert analysis.retest(first) is None


def test_retest_counts_by_hand():
    pairs = [(5, 5), (6, 7), (3, 6), (8, 8)]
    rows = [
        ("o", f"s{at}", repetition, vote)
        for at, pair in enumerate(pairs)
        for repetition, vote in enumerate(pair, 1)
    ]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "repetition", "vote"])
    found = analysis.retest(votes)
    assert (found.equal, found.within_one, found.shift) == (0.5, 0.75, 1.0)
    assert found.repeat_sd == pytest.approx(np.sqrt((1 + 0 + 4 + 1) / 4 / 2))
    assert np.isnan(found.shift_ci).all()
