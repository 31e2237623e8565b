"""Promise: screens propose with their numbers, and only what a person accepts is left out."""

import csv

import numpy as np
import pandas as pd
import pytest

import analysis
from analysis.rejection import read_accepted
from dsis.cli import main
from dsis.errors import InputError


def real_votes(shared_data, name):
    votes = pd.read_csv(shared_data / "votes" / f"{name}_votes.csv")
    return votes.rename(columns={"subject": "observer"})


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (
            "nflx_public_last4outliers",
            {
                "bt500": "s27 s30",
                "p913": "s27 s28 s29",
                "correlation": "s27 s28 s29 s30",
                "inconsistency": "s27 s28 s29 s30",
            },
        ),
        ("nflx_public", {"p913": "s04 s05 s10 s13"}),
        ("vqeg_hd3", {"bt500": "s13", "p913": "s10 s13 s23"}),
    ],
)
def test_which_method_finds_which_scrambled_observer(shared_data, name, expected):
    """Correlation and inconsistency find all four, and nobody in any of the three sets besides."""
    table = analysis.compare_screens(real_votes(shared_data, name))
    found = table[table["rejected"]].groupby("method")["observer"].agg(" ".join).to_dict()
    assert found == expected
    assert len(table) == 4 * table["observer"].nunique()


def test_a_proposal_gives_the_numbers_and_accepts_nobody(shared_data):
    proposal = analysis.propose_rejections(real_votes(shared_data, "nflx_public_last4outliers"))
    assert proposal["observer"].tolist() == ["s27", "s28", "s29", "s30"]
    assert not proposal["accept"].any()
    assert "inconsistency 1.83, median 0.60" in proposal["reason"][0]
    assert proposal["methods"][1] == "p913; correlation; inconsistency"


def test_faultless_observers_all_alike_are_not_rejected():
    rows = [(f"o{o}", f"s{s}", s) for o in range(6) for s in range(1, 6)]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "vote"])
    assert not analysis.screen_inconsistency(votes)["rejected"].any()


def test_the_inconsistency_screen_is_one_sided():
    """An observer far more consistent than the panel is not to be rejected for that."""
    rng = np.random.default_rng(8)
    quality = rng.uniform(2, 9, 60)
    spread = [0.05, *[1.0] * 18, 5.0]
    rows = [
        (f"o{o:02}", f"s{s}", quality[s] + rng.normal(0, sd))
        for o, sd in enumerate(spread)
        for s in range(60)
    ]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "vote"])
    table = analysis.screen_inconsistency(votes).set_index("observer")
    assert table["z"]["o00"] < -3
    assert table["z"]["o19"] > 3
    assert table.index[table["rejected"]].tolist() == ["o19"]


def two_labs():
    rows = [
        (lab, observer, f"s{s}", s + at)
        for lab in ("x", "y")
        for at, observer in enumerate(("ann", "bob", "cat" if lab == "x" else "dan"))
        for s in range(1, 6)
    ]
    return pd.DataFrame(rows, columns=["lab", "observer", "stimulus", "vote"])


def test_rejecting_takes_all_votes_of_whom_it_names():
    votes, gone = analysis.reject(two_labs(), ["x/ann", "dan"])
    assert [str(one) for one in gone] == ["x/ann", "y/dan"]
    left = votes[["lab", "observer"]].drop_duplicates().to_numpy().tolist()
    assert left == [["x", "bob"], ["x", "cat"], ["y", "ann"], ["y", "bob"]]


def test_names_that_are_nobodys_or_several_peoples_are_refused_at_once():
    with pytest.raises(InputError) as caught:
        analysis.reject(two_labs(), ["ann", "eve", "cat"])
    assert [(fault.key, fault.fact.split(":")[0]) for fault in caught.value.faults] == [
        ("ann", "is several observers"),
        ("eve", "is no observer who cast a scored vote"),
    ]
    everybody = ["x/ann", "x/bob", "cat", "y/ann", "y/bob", "dan"]
    with pytest.raises(InputError, match="leaves nobody"):
        analysis.reject(two_labs(), everybody)


@pytest.mark.usefixtures("unpainted")
def test_the_loop_of_a_lab(shared_data, tmp_path, capsys):
    """Report, accept in a spreadsheet, report again: scores without the four, said so."""
    votes = real_votes(shared_data, "nflx_public_last4outliers")
    votes = votes[votes["content"].isin(["BigBuckBunny", "CrowdRun"])]
    analysis.write_votes(votes, tmp_path / "votes.csv")
    command = ["report", str(tmp_path / "votes.csv"), "--scale", "1", "5"]
    assert main([*command, "--out", str(tmp_path / "first")]) == 0
    with (tmp_path / "first" / "rejections.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["accept"] for row in rows} == {"false"}
    first = pd.read_csv(tmp_path / "first" / "mos.csv")
    assert set(first["n"]) == {30}
    edited = tmp_path / "decided.csv"
    scrambled = [row["observer"] for row in rows if row["observer"] >= "s27"]
    assert len(scrambled) == 4
    lines = ["lab;observer;accept", *(f";{name};TRUE" for name in scrambled), ";s01;0"]
    edited.write_text("\ufeff" + "\r\n".join(lines), encoding="utf-8")
    second = tmp_path / "second"
    assert main([*command, "--out", str(second), "--accept", str(edited)]) == 0
    assert set(pd.read_csv(second / "mos.csv")["n"]) == {26}
    page = (second / "report.html").read_text(encoding="utf-8")
    assert "The votes of s27, s28, s29, s30 were left out by decision" in page
    assert "Left out by decision: s27, s28, s29, s30" in page
    public = analysis.mos(real_votes(shared_data, "nflx_public"))
    kept = pd.read_csv(second / "mos.csv").set_index("stimulus")["mos"]
    pd.testing.assert_series_equal(
        kept, public.set_index("stimulus")["mos"].reindex(kept.index), check_exact=False
    )
    assert main([*command, "--out", str(second), "--reject", "s99"]) == 2
    assert "--reject: s99: is no observer" in capsys.readouterr().err
    edited.write_text("observer,accept\ns98,true\n", encoding="utf-8")
    both = ["report", "--reject", "s99", *command[1:], "--accept", str(edited)]
    assert main(both) == 2  # the file of votes after --reject is no observer
    said = capsys.readouterr().err
    assert "--reject: s99: is no observer" in said
    assert "--accept: s98: is no observer" in said


@pytest.mark.usefixtures("unpainted")
def test_a_report_made_again_in_place_keeps_the_decisions(shared_data, tmp_path):
    """`--accept` of the very folder that is written: twice the same command, twice the same."""
    votes = real_votes(shared_data, "nflx_public_last4outliers")
    votes = votes[votes["content"].isin(["BigBuckBunny", "CrowdRun"])]
    analysis.write_votes(votes, tmp_path / "votes.csv")
    out = tmp_path / "report"
    command = ["report", str(tmp_path / "votes.csv"), "--scale", "1", "5", "--out", str(out)]
    assert main([*command, "--reject", "s27", "--reject", "s28"]) == 0
    for _ in range(2):
        assert read_accepted(out / "rejections.csv") == ["s27", "s28"]
        assert main([*command, "--accept", str(out / "rejections.csv")]) == 0
        assert set(pd.read_csv(out / "mos.csv")["n"]) == {28}


def test_a_file_of_decisions_that_is_none_is_refused(tmp_path):
    file = tmp_path / "decided.csv"
    with pytest.raises(InputError, match="cannot be read"):
        read_accepted(file)
    file.write_text("observer,why\nann,late\n", encoding="utf-8")
    with pytest.raises(InputError, match="accept: is missing"):
        read_accepted(file)
    file.write_text("observer,accept\nann,yes\nbob,true\n", encoding="utf-8")
    with pytest.raises(InputError, match="row 2, accept"):
        read_accepted(file)
