"""Promise: `dsis paper` recomputes the paper beside its published numbers and says what differs."""

import pytest

from analysis.paper import PARTS, Setting, denoised, equation5, table1, write_paper
from analysis.paper.published import PRESUMED, TABLE_1
from dsis.cli import main
from dsis.errors import InputError
from small_paper import Small, read, write_pictures


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Return a folder of two small pictures in the place of Kodak's."""
    folder = tmp_path_factory.mktemp("pictures")
    write_pictures(folder)
    return folder


@pytest.fixture(scope="module")
def paper(tmp_path_factory, pictures):
    """Return the folder of the whole paper, in small."""
    folder = tmp_path_factory.mktemp("paper") / "out"
    setting = Small(kodak=tuple(sorted(pictures.glob("*.png"))), jobs=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(equation5, "FIELDS", 2)
        patch.setattr(equation5, "STOPS", (-2.0, 0.0))
        patch.setattr(denoised, "FACTORS", (1.0,))
        write_paper(folder, setting)
    return folder


# The page.


def test_everything_is_written(paper):
    page = (paper / "paper.html").read_text(encoding="utf-8")
    for name in PARTS:
        assert f'<section id="{name}">' in page
    for name in ("fig1_stages", "fig2_simulated", "fig3", "fig4", "fig5", "fig6",
                 "equation5_regions", "equation5_levels", "table2_adapted"):  # fmt: skip
        assert (paper / f"{name}.svg").stat().st_size > 0
        assert (paper / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert f"{name}.svg" in page
    for name in ("table1", "table2", "claims", "equation5", "fig1", "fig2", "fig3", "fig5", "fig6"):
        assert read(paper / f"{name}.csv")
        assert (paper / f"{name}.md").read_text(encoding="utf-8").count("\n| --- |") == 1
    assert "http" not in page.replace("http://www.w3.org", "")  # it needs no network
    assert not paper.with_name("out.partial").exists()


def test_published_numbers_stand_beside_ours_with_their_deviation(paper):
    rows = {row["what"]: row for row in read(paper / "table1.csv")}
    assert len(rows) == 24
    for method, name in table1.NAMES.items():
        row = rows[f"{name} (0,2)"]
        printed = TABLE_1[method][0, 2]
        assert float(row["published"]) == pytest.approx(printed, abs=6e-5)
        off = float(row["recomputed"]) - float(row["published"])
        assert float(row["deviation"]) == pytest.approx(off, abs=2e-4)
        assert float(row["standard error"]) > 0
    assert str(PRESUMED) in rows["DLMMSE (1,0)"]["remark"]
    assert rows["DLMMSE (1,0)"]["published"] == "0.3750"


def test_simulated_votes_say_so_everywhere(paper):
    page = (paper / "paper.html").read_text(encoding="utf-8")
    assert "SIMULATED: no person has voted" in page
    assert "SIMULATED VOTES" in (paper / "fig6.svg").read_text(encoding="utf-8")
    assert all("SIMULATED" in row["remark"] for row in read(paper / "fig6.csv"))
    verdicts = {row["claim"]: row["on our content"] for row in read(paper / "claims.csv")}
    assert {v for c, v in verdicts.items() if "MOS" in c or "votes" in c} == {"cannot be told"}


def test_reduced_sizes_are_stated(paper):
    page = (paper / "paper.html").read_text(encoding="utf-8")
    assert "96 \u00d7 64" in page
    assert "Reduced: the paper's frames are 1920 \u00d7 1080" in page
    assert "The folder holds 2 images; the Kodak set has 24." in page


# Its numbers, in small.


def test_table_2_has_the_papers_noise_and_pairs_of_it(paper):
    rows = {row["what"]: float(row["recomputed"]) for row in read(paper / "table2.csv")}
    assert len(rows) == 18
    assert rows["SD / 3, noisy, RGB"] == pytest.approx(31.51, abs=0.02)
    # White noise of 4.28 codes and the rounding of the delivered frame; the tails that clip.
    assert rows["AWGN / 3, noisy, RGB"] == pytest.approx(35.47, abs=0.25)
    for pixels in ("RGB", "dem."):
        assert rows[f"SD / 2, noisy, {pixels}"] == rows[f"SD / 3, noisy, {pixels}"]
    assert rows["AWGN / 3, BM3D, RGB"] > rows["AWGN / 3, noisy, RGB"] + 2
    won = read(paper / "table2_won_back.csv")
    assert len(won) == 12


def test_photon_transfer_finds_the_simulated_camera_again(paper):
    rows = {
        row["what"]: [float(row[name] or "nan") for name in ("recomputed", "standard error")]
        for row in read(paper / "fig2.csv")
    }
    for what, true in (("slope m, piece 1", 2.18), ("intercept t, piece 1", 96.0),
                       ("slope m, piece 2", 2.18), ("intercept t, piece 2", 385.0)):  # fmt: skip
        assert abs(rows[what][0] - true) < 5 * rows[what][1], what
    assert rows["signal of the step"][0] == pytest.approx(1000, rel=0.15)
    assert abs(rows["skewness at one level"][0]) < 0.05


# The command.


def test_the_command_writes_the_parts_named(pictures, tmp_path, capsys):
    for out, jobs in (("one", "1"), ("two", "2")):
        words = ["paper", "table1", "fig3", "--kodak", str(pictures), "--jobs", jobs]
        assert main([*words, "--out", str(tmp_path / out)]) == 0
    assert "Table 1" in capsys.readouterr().out
    one, two = ({p.name: p.read_bytes() for p in (tmp_path / n).iterdir()} for n in ("one", "two"))
    assert one == two
    assert "fig3.png" in one
    assert "fig4.png" not in one


def test_bad_input_leaves_with_status_2_and_one_message(pictures, tmp_path, capsys):
    full = tmp_path / "full"
    full.mkdir()
    (full / "paper.html").write_text("mine", encoding="utf-8")
    (full / "notes.txt").write_text("mine", encoding="utf-8")
    cases = {
        ("tabel1",): "NAME: is 'tabel1', must be one of claims, fig1",
        ("table1", "--kodak", str(tmp_path / "no")): "--kodak: is",
        ("table1", "--kodak", str(full)): "holds no .png",
        ("fig2", "--recording", str(tmp_path / "no")): "--recording: is",
        ("fig6", "--votes", str(tmp_path / "no.csv")): "no.csv",
        ("fig6", "--scale", "1", "10"): "--scale: is that of people's votes: give --votes FILE",
        ("table1", "--kodak", str(pictures), "--out", str(full)): "holds notes.txt",
    }
    for words, message in cases.items():
        out = [] if "--out" in words else ["--out", str(tmp_path / "out")]
        assert main(["paper", *words, *out]) == 2, words
        assert message in capsys.readouterr().err
    assert (full / "notes.txt").exists()
    assert not (tmp_path / "out").exists()


def test_votes_that_cannot_be_used_are_refused_before_the_work_begins(tmp_path, monkeypatch):
    for name in PARTS:
        monkeypatch.setitem(PARTS, name, None)  # called, it raises a TypeError
    votes = tmp_path / "votes.csv"
    votes.write_text("observer,stimulus,vote\na,x,11\n", encoding="utf-8")
    with pytest.raises(InputError, match="is 11, must be from 1 to 10"):
        write_paper(tmp_path / "out", Small(votes=votes, scale=(1.0, 10.0)))
    assert [p.name for p in tmp_path.iterdir()] == ["votes.csv"]


def test_one_image_has_no_standard_error_and_no_nan(pictures, tmp_path):
    one = Setting(kodak=tuple(sorted(pictures.glob("*.png")))[:1])
    write_paper(tmp_path / "out", one, ["table1"])
    for path in (tmp_path / "out").iterdir():
        assert "nan" not in path.read_text(encoding="utf-8"), path
    exact = read(tmp_path / "out" / "table1_bilinear.csv")
    assert {row["s.e."] + row["z"] for row in exact} == {""}
