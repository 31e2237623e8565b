"""Promise: the report has the columns and numbers of the contract, and the same bytes each time."""

import base64
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import analysis
from analysis.report.tables import TABLES
from dsis.errors import InputError
from dsis.outdir import UNFINISHED
from opinions import MARK, PAPER, PICTURES, Page, make_votes, marks_in_figure, page, report

FILES = {"report.html", *TABLES, *(f"{name}.{end}" for name in PICTURES for end in ("svg", "png"))}

MOS_HEADER = (
    "stimulus,content,noise,demosaic,level,n,mos,sd,ci_low,ci_high,"
    "n_removed,mos_trimmed,sd_trimmed,ci_trimmed_low,ci_trimmed_high,"
    "mos_bt500,mos_p913,score_p910,p910_ci_low,p910_ci_high"
)

OBSERVERS_HEADER = (
    "observer,n,bias,inconsistency,bt500_p,bt500_q,bt500_rejected,correlation,correlation_rejected"
)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("people")
    votes = make_votes()
    extra = pd.concat(
        [
            votes.iloc[:3].assign(valid=False, vote=1),
            votes.iloc[:4].assign(kind="training", vote=1),
            votes.iloc[:5].assign(kind="dummy", vote=1),
        ]
    )
    return report(folder, pd.concat([votes, extra], ignore_index=True)), votes


def test_files_and_columns_of_the_contract(written):
    out, __ = written
    assert {file.name for file in out.iterdir()} == FILES
    assert not out.with_name("report.partial").exists()
    assert (out / "mos.csv").read_text().startswith(MOS_HEADER + ",simulated,kind,ci_method,")
    assert (out / "observers.csv").read_text().startswith(OBSERVERS_HEADER + ",simulated,lab\n")
    removed = pd.read_csv(out / "removed_votes.csv")
    assert {"observer", "stimulus", "vote", "z", "mean", "sd", "n"} <= set(removed.columns)


def test_numbers_are_those_of_the_functions_and_only_of_scored_votes(written):
    out, votes = written
    table = pd.read_csv(out / "mos.csv")
    by_hand = votes.groupby("stimulus")["vote"]
    rows = table.set_index("stimulus")
    np.testing.assert_allclose(rows["mos"], by_hand.mean()[rows.index], rtol=1e-12)
    np.testing.assert_allclose(rows["sd"], by_hand.std(ddof=1)[rows.index], rtol=1e-12)
    assert table["n_removed"].sum() == len(pd.read_csv(out / "removed_votes.csv"))
    text = page(out)
    assert "3 invalid" in text
    assert "4 training" in text
    assert "5 dummy" in text
    for mos in table["mos"]:
        assert f"<b>{mos:.2f}</b>" in text


def test_removed_votes_point_to_their_lines(written):
    out, __ = written
    lines = (out.parent / "votes.csv").read_text().splitlines()
    header = lines[0].split(",")
    removed = pd.read_csv(out / "removed_votes.csv", dtype={"row": int})
    assert len(removed) > 0
    for row in removed.itertuples():
        cells = dict(zip(header, lines[row.row - 1].split(","), strict=True))
        assert (cells["observer"], cells["stimulus"]) == (row.observer, row.stimulus)
        assert float(cells["vote"]) == row.vote


def test_page_is_well_formed_and_needs_no_network(written):
    out, __ = written
    text = page(out)
    parsed = Page(text)
    assert len(parsed.captions) == parsed.shown == 8 + len(PICTURES)  # tables and figures
    numbers = re.findall(r"<b>((?:Table|Figure) [0-9]+)[.]", text)
    assert len(set(numbers)) == len(numbers) == parsed.shown
    assert not re.search(r"https?:|//[a-z]|<script|<link|@import|url\(", text)
    assert all(source.startswith("data:") for source in re.findall(r'src="([^"]*)', text))
    embedded = re.findall(r"data:image/svg\+xml;base64,([^\"]*)", text)
    svgs = {(out / f"{name}.svg").read_bytes() for name in PICTURES}
    assert {base64.b64decode(picture) for picture in embedded} == svgs
    assert "@media print" in text


def test_trimmed_scores_stand_beside_untrimmed_ones(written):
    out, __ = written
    scores = page(out).split('<table id="scores">')[1].split("</table>")[0]
    for row in pd.read_csv(out / "mos.csv").itertuples():
        both = rf"<b>{row.mos:.2f}</b>.*<td>{row.mos_trimmed:.2f}</td>"
        assert re.search(both, scores)
    assert "too short" in scores


def test_same_votes_same_bytes(written, tmp_path):
    """In another process, folder and hash seed."""
    out, __ = written
    again = tmp_path / "again"
    code = (
        "import sys; from pathlib import Path; from analysis.report import write_report; "
        "write_report(Path(sys.argv[1]), Path(sys.argv[2]), (1, 10))"
    )
    subprocess.run(
        [sys.executable, "-c", code, out.parent / "votes.csv", again],
        check=True,
        env=os.environ | {"PYTHONHASHSEED": "5"},
        cwd=Path(__file__).parents[1],
    )
    for name in FILES:
        assert (again / name).read_bytes() == (out / name).read_bytes(), name


def test_real_votes_carry_no_mark_of_simulation(written):
    out, __ = written
    assert marks_in_figure(out)[0] == 0
    assert marks_in_figure(out)[1] == 0
    assert MARK not in page(out)
    assert not pd.read_csv(out / "mos.csv")["simulated"].any()


@pytest.mark.usefixtures("unpainted")
def test_an_earlier_report_is_replaced_and_anything_else_refused(tmp_path):
    votes = make_votes(observers=3)
    out = report(tmp_path, votes)
    before = (out / "mos.csv").read_text()
    (tmp_path / "report.partial").mkdir()  # of a killed run
    (tmp_path / "report.partial" / "mos.csv").write_text("half")
    (tmp_path / "report.partial" / UNFINISHED).write_text('{"build": null}\n')
    report(tmp_path, votes.assign(vote=5))
    assert (out / "mos.csv").read_text() != before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report", "votes.csv"]
    with pytest.raises(InputError, match="row 2, vote"):
        report(tmp_path, votes.assign(vote=11))
    flagged = {"flagged.svg", "flagged.png"}  # nobody is, where all agree
    assert {file.name for file in out.iterdir()} == FILES - flagged
    (out / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"notes.txt"):
        report(tmp_path, votes)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds no mos.csv"):
        report(tmp_path, votes, name="other")
    with pytest.raises(InputError, match="is a file"):
        report(tmp_path, votes, name="votes.csv")


def test_a_file_without_scored_votes_is_refused(tmp_path):
    with pytest.raises(InputError, match="no valid vote"):
        report(tmp_path, make_votes(observers=2).assign(kind="training"))
    assert not (tmp_path / "report").exists()


def test_methods_say_what_was_done_and_no_more(written):
    out, votes = written
    text = page(out)
    said = text[text.index('<section class="methods">') :]
    assert (
        "18 observers judged 10 sequences, 2 of them hidden references, on a scale from 1 to 10"
        in said
    )
    assert f"{len(votes)} votes were scored, 18 per sequence" in said
    removed = len(pd.read_csv(out / "removed_votes.csv"))
    assert f"once: {removed} of 180 votes ({100 * removed / 180:.1f} %)" in said
    for done in ("DMOS", "Contrasts", "Mixed models", "Screening"):
        assert f"<h3>{done}</h3>" in said
    for not_done in ("Order", "Test and retest"):
        assert f"<h3>{not_done}</h3>" not in said
    assert "left out by decision" not in said
    assert "Where observers differ in what they mind, the paired tests are the honest ones" in said
    assert "As in Seybold et al. (2014), votes further than 2 sample" in said
    assert "77 to 92 %" in said
    assert "votes removed: further than 2 sd from mos, in one pass" in text
    assert "mean of all votes on the stimulus, this one included" in text


@pytest.mark.usefixtures("unpainted")
def test_other_rules_of_removal_are_said(tmp_path):
    votes = make_votes(methods=("none",))
    analysis.write_votes(votes, tmp_path / "votes.csv")
    files = [tmp_path / "votes.csv"]
    analysis.write_report(files, tmp_path / "report", PAPER, threshold=1.5, passes=2)
    text = page(tmp_path / "report")
    assert "Votes are removed beyond 1.5 sd, not the paper&#39;s 2." in text
    assert "further than 1.5 sample standard deviations" in text
    assert "in at most 2 passes, not in the paper&#39;s one" in text
    assert "votes removed: further than 1.5 sd from the mean of those that the pass before" in text
    assert "mean of the votes on the stimulus before its pass, this one included" in text
    for of_the_papers_rule in ("As in Seybold", "77 to 92 %", "further than 2 sd", "in one pass"):
        assert of_the_papers_rule not in text
    removed = pd.read_csv(tmp_path / "report" / "removed_votes.csv")
    kept, expected = analysis.remove_outliers(votes, 1.5, passes=2)
    assert len(removed) == len(expected) == len(votes) - len(kept)
    assert pd.read_csv(tmp_path / "report" / "mos.csv")["n_removed"].sum() == len(removed)


@pytest.mark.usefixtures("unpainted")
def test_scripts_to_copy_run(tmp_path, capsys, monkeypatch):
    from analysis.scripts import compare_conditions, merge_and_convert, mos_report

    votes = make_votes()
    files = []
    for lab in ("a", "b"):
        (tmp_path / lab).mkdir()
        files.append(tmp_path / lab / "votes.csv")
        # b's observers are others: a copy of a's would be refused
        shown = votes if lab == "a" else votes.assign(vote=(votes["vote"] - 1).clip(lower=1))
        analysis.write_votes(shown, files[-1])
    monkeypatch.setattr(mos_report, "REJECTED", ["b/s3"])
    mos_report.main(files, tmp_path / "report")
    assert set(pd.read_csv(tmp_path / "report" / "mos.csv")["n"]) == {35}
    merge_and_convert.main(files, tmp_path / "merged")
    merged = analysis.read_votes(tmp_path / "merged" / "votes.csv", PAPER)
    assert len(merged) == 2 * len(votes)
    assert len(analysis.read_votes(tmp_path / "merged" / "sureal.json", PAPER)) == len(merged)
    capsys.readouterr()
    compare_conditions.main(files[0])
    said = capsys.readouterr().out
    assert "Demosaicking (bilinear) lowers the MOS by" in said
    assert "superiority" in said


def test_public_names_load():
    for name in analysis.__all__:
        assert callable(getattr(analysis, name))
    with pytest.raises(AttributeError, match="no_such"):
        _ = analysis.no_such
