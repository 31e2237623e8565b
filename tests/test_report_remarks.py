"""Promise: the report says what must be said of the votes, and marks simulated ones everywhere."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import beta

import analysis
from analysis.figures import simulated_mark
from analysis.report import Options, analyse
from analysis.report.tables import TABLES
from analysis.scale import Description, Scale
from dsis.cli import main
from opinions import MARK, PICTURES, Page, make_votes, marks_in_figure, page, report, table


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_simulated_votes_are_marked_in_every_table_and_figure(tmp_path, share):
    votes = make_votes()
    robots = votes["observer"].str[1:].astype(int) <= share * 18
    out = report(tmp_path, votes.assign(simulated=robots))
    mark = MARK if share == 1 else f"50 % {MARK}"
    parsed = Page(page(out))
    assert len(parsed.captions) == parsed.shown
    assert all(f"{mark}." in caption for caption in parsed.captions)
    assert f'role="alert">{mark}.' in page(out)
    texts, strong, pale = marks_in_figure(out)
    assert texts >= 2  # title and across
    assert strong > 500
    assert pale > 5000
    assert mark.encode() in (out / "mos.png").read_bytes()  # among its properties
    for name in PICTURES:
        assert mark in (out / f"{name}.svg").read_text()
    for name in TABLES:
        rows = pd.read_csv(out / name)
        assert "simulated" in rows, name
        if name == "order.csv":  # no row: the votes have no order
            continue
        flags = rows["simulated"]
        assert flags.dtype == bool
        if "observer" in rows:
            assert flags.tolist() == (rows["observer"].str[1:].astype(int) <= share * 18).tolist()
        else:
            assert flags.all()
    assert "say nothing about what people see" in parsed.remarks


@pytest.mark.usefixtures("unpainted")
@pytest.mark.parametrize(("share", "mark"), [(1.0, MARK), (0.5, f"50 % {MARK}"), (0.0, None)])
def test_the_terminal_says_what_the_report_says(tmp_path, capsys, share, mark):
    votes = make_votes(methods=("none",))
    robots = votes["observer"].str[1:].astype(int) <= share * 18
    analysis.write_votes(votes.assign(simulated=robots), tmp_path / "votes.csv")
    assert main(["report", str(tmp_path / "votes.csv"), "--scale", "1", "10"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{mark}: ") if mark else "SIMULATED" not in said
    assert "- The scale is 1 to 10, not BT.500's" in said


@pytest.mark.usefixtures("unpainted")
def test_report_and_terminal_say_why_there_are_no_contrasts(tmp_path, capsys):
    analysis.write_votes(table(TYPICAL), tmp_path / "votes.csv")
    assert main(["report", str(tmp_path / "votes.csv"), "--scale", "1", "5"]) == 0
    why = "No comparison of conditions: the votes lack the columns noise and demosaic"
    assert f"- {why}" in capsys.readouterr().out
    assert why in Page(page(tmp_path / "votes-report")).remarks


@pytest.mark.usefixtures("unpainted")
def test_observers_left_out_keep_their_mark(tmp_path):
    votes = make_votes(methods=("none",))
    analysis.write_votes(votes.assign(simulated=votes["observer"] == "s1"), tmp_path / "votes.csv")
    results = analysis.write_report(
        tmp_path / "votes.csv", tmp_path / "report", (1, 10), rejected=["s1", "s2"]
    )
    assert results.counts.simulated_share == 0
    left_out = pd.read_csv(tmp_path / "report" / "rejections.csv").set_index("observer")
    assert left_out.loc[["s1", "s2"], "simulated"].tolist() == [True, False]


def test_votes_of_robots_that_are_not_marked_are_remarked_on():
    votes = table(TYPICAL, simulated=False)
    robots = votes.assign(observer="robot-" + votes["observer"])
    one = robots.assign(simulated=robots["observer"] == "robot-o1")
    for shown, expected in (
        (robots.drop(columns="simulated"), "robot-o0, robot-o1"),
        (robots, "robot-o0, robot-o1"),
        (robots.assign(simulated=True), ""),
        (pd.concat([robots, votes]), "robot-o0, robot-o1"),
        (one, "robot-o0, robot-o2"),
        (votes, ""),
    ):
        found = " ".join(analyse(shown, Description(Scale(1, 5))).remarks)
        said = "Not marked as simulated, but called as dsis calls its simulated observers: "
        assert f"{said}{expected}" in found if expected else said not in found


def test_a_single_person_among_robots_is_not_rounded_away():
    assert simulated_mark(0.9999) == f"99 % {MARK}"


# Votes on 24 stimuli by sixteen observers, nothing remarkable about them.
TYPICAL = np.clip(
    np.rint(np.random.default_rng(0).normal(np.linspace(1.8, 4.2, 24)[:, None], 0.5, (24, 16))),
    1,
    5,
).tolist()


# The same, named so that contrasts can be made.
PAIRED = table(TYPICAL).assign(
    noise=lambda votes: np.where(votes["stimulus"].str[1:].astype(int) % 2, "sd", "awgn"),
    demosaic="none",
    content=lambda votes: "c" + (votes["stimulus"].str[1:].astype(int) // 2).astype(str),
)


@pytest.mark.parametrize(
    ("votes", "remark"),
    [
        (table([row[:14] for row in TYPICAL]), "14 observers: with fewer than 15"),
        (table([[5, 4, 5, 5, 1], *TYPICAL]), "cannot remove anything where there are 5 votes"),
        (table([[5, 5, 5, 5, 5, 5, 5, 1]] * 3), "removes 12.5 % of the votes, more than 10 %"),
        (table([[4] * 16, *TYPICAL]), "All votes are equal on s0"),
        (table([[4], *TYPICAL]), "A single vote has no interval of Student's: s0"),
        (table([[5] * 15 + [4], *TYPICAL]), "The interval leaves the scale on s0"),
        (table([[4] * 16] * 2), "No correlation exists for o0"),
        (table(TYPICAL), "the votes lack the columns noise and demosaic (missing, or blank every"),
        (table(TYPICAL, noise="sd"), "the votes lack the column demosaic (missing, or blank every"),
        (
            pd.concat(
                [
                    table([row], noise="sd", demosaic="none", content=f"c{at}", level=0).assign(
                        stimulus=f"s{at}"
                    )
                    for at, row in enumerate(TYPICAL)
                ]
            ),
            "no two sequences of one content and level differ in demosaic alone",
        ),
        (PAIRED, ""),
        (table([[5, 4, 4], *TYPICAL]), "Not all sequences have the same number of votes"),
        (
            pd.concat([table(TYPICAL), table(TYPICAL, repetition=2)]),
            "shown repeatedly to the same observers",
        ),
        (
            pd.concat([table(TYPICAL, lab="x"), table(TYPICAL, lab="y")]),
            "Votes of 2 laboratories are pooled",
        ),
        (table([[1, 5, 1, 2], [2, 1, 2, 3], [3, 3, 2, 4]]), "Screening proposes to reject o2"),
        (
            table([[1, 5, 1, 2], [2, 1, 2, 3], [3, 3, 2, 4]]),
            "over 3 sequences is uncertain by 0.36",
        ),
    ],
)
def test_remarks(votes, remark):
    found = " ".join(analyse(votes, Description(Scale(1, 5))).remarks)
    assert remark in found if remark else found == ""


def test_trimmed_votes_that_all_agree_have_the_binomial_interval_of_their_own():
    """One vote far off is removed; fifteen equal ones are left, which Student gives no width."""
    rows = [[8] * 15 + [2], [5, 6, 7, 8] * 4]
    scores = analysis.score_table(table(rows), Scale(1, 10)).set_index("stimulus")
    agreed = scores.loc["s0"]
    assert (agreed["n_removed"], agreed["mos_trimmed"], agreed["sd_trimmed"]) == (1, 8, 0)
    # 15 votes at 7/9 of the scale: k = 35/3 of 15 in the beta quantiles of Clopper and Pearson
    k = 15 * 7 / 9
    expected = (1 + 9 * beta.ppf(0.025, k, 16 - k), 1 + 9 * beta.ppf(0.975, k + 1, 15 - k))
    assert (agreed["ci_trimmed_low"], agreed["ci_trimmed_high"]) == pytest.approx(expected)


def test_how_few_votes_no_rule_can_remove_follows_the_threshold():
    """Of four votes the farthest lies exactly 1.5 sd off, of five 1.79."""
    votes = table([[5, 5, 5, 1], [5, 5, 5, 5, 1], *TYPICAL])
    results = analyse(votes, Description(Scale(1, 5)), Options(threshold=1.5))
    remark = "The 1.5\u03c3 rule cannot remove anything where there are 4 votes or fewer: s0."
    assert remark in results.remarks
    assert results.scores.set_index("stimulus").loc[["s0", "s1"], "n_removed"].tolist() == [0, 1]


def test_stimuli_that_share_a_condition_are_named():
    """Two takes of one condition, or blank contents: no contrast, and never silently."""
    votes = make_votes()
    take = votes[votes["stimulus"] == "city__sd__none"].assign(stimulus="city-take-2")
    results = analyse(pd.concat([votes, take], ignore_index=True), Description(Scale(1, 10)))
    assert results.contrasts.empty
    remark = "city-take-2, city__sd__none are the same condition (content city, noise sd, "
    assert any(remark in one and "No comparison" in one for one in results.remarks)
    tests = votes[votes["kind"] == "test"].assign(content="")
    blank = analyse(tests, Description(Scale(1, 10)))
    assert sum("(content blank, " in one for one in blank.remarks) == 4
    sound = analyse(votes, Description(Scale(1, 10)))
    assert not any("No comparison" in one for one in sound.remarks)


def test_votes_that_spread_too_much_are_flagged(shared_data):
    votes = pd.read_csv(shared_data / "votes" / "nflx_public_last4outliers_votes.csv")
    votes = votes.rename(columns={"subject": "observer"})
    results = analyse(votes, Description(Scale(1, 5)), Options())
    found = " ".join(results.remarks)
    assert "SOS parameter a = 0.26, over 0.25" in found
    assert "Screening proposes to reject s27, s28, s29, s30" in found


LEANING = np.random.default_rng(2).integers(1, 6, (4, 12)).tolist()  # 12 observers, 4 sequences


def test_scores_that_lean_on_one_observer_are_left_blank(tmp_path):
    """What the remark says not to use stands nowhere; the rest of the table does."""
    votes = table(LEANING)
    assert analysis.p910(votes).degenerate
    out = report(tmp_path, votes, (1, 5))
    scores = pd.read_csv(out / "mos.csv")
    assert scores[["score_p910", "p910_ci_low", "p910_ci_high"]].isna().all(axis=None)
    assert scores[["mos", "ci_low", "mos_p913"]].notna().all(axis=None)
    models = pd.read_csv(out / "models.csv").set_index("model")
    criteria = ["loglik_per_vote", "aic_per_vote", "bic_per_vote"]
    assert models.loc["P.910", criteria].isna().all()
    assert models.loc["BR", criteria].notna().all()
    text = page(out)
    assert "do not use its scores" in Page(text).remarks
    assert "P.910 is left blank" in text
    assert "P.910's scores and likelihood are not given here" in text.replace("&#39;", "'")
    sound = report(tmp_path, table(TYPICAL), (1, 5), "sound")
    assert pd.read_csv(sound / "mos.csv")["score_p910"].notna().all()
    assert "P.910 is left blank" not in page(sound)


@pytest.mark.parametrize(
    "rows",
    [
        [[3] * 16, [4] * 16, [5] * 16, [2] * 16],
        [[3], [4], [5], [2]],
        [[0.1] * 7] * 3,
        [[1, 2, 3], [2, 3, 4], [3, 4, 5]],
    ],
    ids=["all alike", "alone", "one vote", "but for biases"],
)
def test_scores_of_observers_who_all_agree_are_their_means(rows):
    """Nobody leans on anybody: P.910 has the MOS, and no remark says otherwise."""
    results = analyse(table(rows), Description(Scale(0, 10)), Options())
    assert not results.p910_degenerate
    scores = analysis.score_table(table(rows))
    np.testing.assert_allclose(scores["score_p910"], scores["mos"], atol=1e-12)
    assert scores[["p910_ci_low", "p910_ci_high"]].notna().all(axis=None)
    assert "finds no inconsistency" not in " ".join(results.remarks)
    assert (
        analysis.compare_models(table(rows)).set_index("model").loc["P.910", "loglik_per_vote"] == 0
    )
