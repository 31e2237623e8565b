"""The report: what it writes, that it says what must be said, and that it repeats itself."""

import base64
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread
from scipy.stats import beta

import analysis
from analysis.report import Options, analyse
from analysis.report.tables import TABLES
from analysis.scale import Description, Scale
from dsis.errors import InputError
from dsis.outdir import UNFINISHED

PAPER = (1, 10)
PICTURES = ("mos", "votes", "observers", "scale_use", "flagged", "contrasts")
FILES = {"report.html", *TABLES, *(f"{name}.{end}" for name in PICTURES for end in ("svg", "png"))}
MOS_HEADER = (
    "stimulus,content,noise,demosaic,level,n,mos,sd,ci_low,ci_high,"
    "n_removed,mos_trimmed,sd_trimmed,ci_trimmed_low,ci_trimmed_high,"
    "mos_bt500,mos_p913,score_p910,p910_ci_low,p910_ci_high"
)
OBSERVERS_HEADER = (
    "observer,n,bias,inconsistency,bt500_p,bt500_q,bt500_rejected,correlation,correlation_rejected"
)
MARK = "SIMULATED VOTES"


def make_votes(contents=("city", "landscape"), methods=("none", "bilinear"), observers=18):
    """Votes of a test like the paper's, with hidden references."""
    random = np.random.default_rng(1)
    rows = []
    for content in contents:
        conditions = [(n, d, 0) for n in ("awgn", "sd") for d in methods] + [("", "", None)]
        for noise, demosaic, level in conditions:
            name = f"{content}__{noise}__{demosaic}" if noise else f"{content}-ref"
            kind = "test" if noise else "reference"
            expected = 7.5 - 2 * (demosaic != "none") if noise else 9.5
            votes = np.clip(np.rint(random.normal(expected, 1.2, observers)), 1, 10)
            rows += [
                (f"s{o}", name, content, noise, demosaic, level, kind, vote)
                for o, vote in enumerate(votes, 1)
            ]
    columns = ["observer", "stimulus", "content", "noise", "demosaic", "level", "kind", "vote"]
    return pd.DataFrame(rows, columns=columns)


def report(folder, votes, scale=PAPER, name="report"):
    file = folder / "votes.csv"
    analysis.write_votes(votes, file)
    analysis.write_report(file, folder / name, scale)
    return folder / name


def page(out):
    return (out / "report.html").read_text()


class Page(HTMLParser):
    """Checks that elements nest, and gathers captions and the text of the remarks."""

    VOID = ("meta", "img", "br")

    def __init__(self, text):
        super().__init__()
        self.open, self.captions, self.shown, self.remarks = [], [], 0, ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append((tag, dict(attrs).get("class", "")))
        self.shown += tag == "figure" or (tag == "table" and "id" in dict(attrs))
        if tag in ("caption", "figcaption"):
            self.captions.append("")

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        tags = [tag for tag, _ in self.open]
        if "caption" in tags or "figcaption" in tags:
            self.captions[-1] += data
        if ("section", "remarks") in self.open:
            self.remarks += data


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


def marks_in_figure(out):
    """Texts of the SVG (matplotlib writes each as a comment), and red pixels of the PNG."""
    svg = (out / "mos.svg").read_text()
    red, green, blue = np.moveaxis(imread(out / "mos.png")[..., :3], -1, 0)
    strong = (red > 0.6) & (green < 0.1) & (blue < 0.2)
    pale = (red > 0.9) & (green > 0.85) & (green < 0.95) & (red - green > 0.05)
    return svg.count(MARK), int(strong.sum()), int(pale.sum())


def test_real_votes_carry_no_mark_of_simulation(written):
    out, __ = written
    assert marks_in_figure(out)[0] == 0
    assert marks_in_figure(out)[1] == 0
    assert MARK not in page(out)
    assert not pd.read_csv(out / "mos.csv")["simulated"].any()


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
    for name in ("mos.csv", "observers.csv", "removed_votes.csv"):
        flags = pd.read_csv(out / name)["simulated"]
        assert flags.dtype == bool
        assert flags.all() if share == 1 or name == "mos.csv" else flags.any()
    assert "say nothing about what people see" in parsed.remarks


def table(rows, **columns):
    """Votes from one list per stimulus, in the order of the observers."""
    return pd.DataFrame(
        [(f"o{o}", f"s{s}", vote) for s, row in enumerate(rows) for o, vote in enumerate(row)],
        columns=["observer", "stimulus", "vote"],
    ).assign(**columns)


# Votes on 24 stimuli by sixteen observers, nothing remarkable about them.
TYPICAL = np.clip(
    np.rint(np.random.default_rng(0).normal(np.linspace(1.8, 4.2, 24)[:, None], 0.5, (24, 16))),
    1,
    5,
).tolist()


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
        (table(TYPICAL), ""),
        (table([[5, 4, 4], *TYPICAL]), "Not all sequences have the same number of votes"),
        (
            pd.concat([table(TYPICAL), table(TYPICAL, repetition=2)]),
            "shown repeatedly to the same observers",
        ),
        (
            pd.concat([table(TYPICAL, lab="x"), table(TYPICAL, lab="y")]),
            "Votes of 2 laboratories are pooled",
        ),
        (table([[4, 5]]), "finds no inconsistency"),
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


def test_votes_without_conditions_are_listed(shared_data, tmp_path):
    votes = pd.read_csv(shared_data / "votes" / "nflx_public_last4outliers_votes.csv")
    votes = votes.rename(columns={"subject": "observer"})
    votes["kind"] = votes["is_reference"].map({0: "test", 1: "reference"})
    out = report(tmp_path, votes, (1, 5))
    figure, text = (out / "mos.svg").read_text(), page(out)
    for stimulus in votes["stimulus"].unique():
        assert f"<!-- {stimulus} -->" in figure
    assert "would reject s27, s30; the correlation screen s27, s28, s29, s30" in text
    assert "Far above on BigBuckBunny_30_384_550" in text
    assert "hidden reference" in text


def test_many_contents_have_a_panel_each(tmp_path):
    contents = [f"kodim{n:02}" for n in range(1, 25)]
    out = report(tmp_path, make_votes(contents, observers=6))
    figure = (out / "mos.svg").read_text()
    for content in contents:
        assert f"<!-- {content} -->" in figure
    assert figure.count("<!-- without -->") == 24


def test_names_are_text_wherever_they_stand(tmp_path):
    """Neither markup nor formula; a label may start with an underscore."""
    votes = make_votes(methods=("none", "$x_1$")).replace(
        {"content": {"city": "_<b>a&b"}, "observer": {"s1": "<script>alert(1)</script>"}}
    )
    out = report(tmp_path, votes)
    Page(page(out))
    assert "<script" not in page(out)
    assert "&lt;script&gt;" in page(out)
    assert "_&lt;b&gt;a&amp;b" in page(out)


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


def repeated_votes():
    """Votes of a test with places, two repetitions and a drift of a grade in ten presentations."""
    random = np.random.default_rng(2)
    rows = []
    for observer in range(16):
        shown = [(s, r) for s in range(8) for r in (1, 2)]
        order = random.permutation(len(shown))
        for place, at in enumerate(order, 1):
            stimulus, repetition = shown[at]
            vote = np.clip(np.rint(2 + stimulus / 2 + place / 10 + random.normal(0, 0.8)), 1, 10)
            rows.append((f"o{observer}", f"s{stimulus}", repetition, place, vote))
    columns = ["observer", "stimulus", "repetition", "presentation", "vote"]
    return pd.DataFrame(rows, columns=columns)


def test_order_and_repetition_are_shown_where_they_are_known(tmp_path):
    out = report(tmp_path, repeated_votes())
    text = page(out)
    assert "The order of presentations shows in the votes (drift)" in Page(text).remarks
    assert (out / "order.svg").is_file()
    assert "128 votes of 16 observers were cast twice on the same sequence" in text
    assert "<h3>Test and retest</h3>" in text
    assert pd.read_csv(out / "order.csv")["effect"].tolist() == ["drift", "fatigue", "contrast"]


def test_votes_that_spread_too_much_are_flagged(shared_data):
    votes = pd.read_csv(shared_data / "votes" / "nflx_public_last4outliers_votes.csv")
    votes = votes.rename(columns={"subject": "observer"})
    results = analyse(votes, Description(Scale(1, 5)), Options())
    found = " ".join(results.remarks)
    assert "SOS parameter a = 0.26, over 0.25" in found
    assert "Screening proposes to reject s27, s28, s29, s30" in found


def test_very_many_stimuli_are_drawn_without_names(tmp_path):
    random = np.random.default_rng(1)
    rows = [
        (f"o{o}", f"s{s}", np.clip(np.rint(random.normal(3 + s / 60, 1.2)), 1, 10))
        for s in range(200)
        for o in range(6)
    ]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "vote"])
    out = report(tmp_path, votes)
    assert "200 stimuli, by MOS" in (out / "votes.svg").read_text()
    assert "<!-- s17 -->" not in (out / "votes.svg").read_text()


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
