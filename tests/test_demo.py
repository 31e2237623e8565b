"""Promise: one command runs the whole chain, from frames to a MOS report, for a newcomer."""

import csv
import json
import shutil
from itertools import pairwise
from pathlib import Path

import pytest

from dsis.cli import main
from dsis.manifest import read_manifest
from dsis.session import draw_plan
from dsis.session.store import open_store
from dsis.spec import SHIPPED


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the demo's result, from frames of 96 x 64 instead of 480 x 270."""
    folder = tmp_path_factory.mktemp("demo")
    text = (SHIPPED / "demo.toml").read_text(encoding="utf-8")
    for old, new in (
        ("width = 480", "width = 96"),
        ("height = 270", "height = 64"),
        ("seconds = 2", "seconds = 0.2"),
        ("reference_s = 2.0", "reference_s = 0.2"),
        ("test_s = 2.0", "test_s = 0.2"),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "small.toml").write_text(text, encoding="utf-8")
    # A file of that name in the current folder is not the demo's.
    (folder / "demo.toml").write_text("no spec at all", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("dsis.cli.demo.DEMO_SPEC", str(folder / "small.toml"))
        assert main(["demo"]) == 0
    return folder / "dsis-demo"


def test_it_leaves_stimuli_votes_and_a_report(demo: Path) -> None:
    clips = json.loads((demo / "stimuli" / "manifest.json").read_text(encoding="utf-8"))["clips"]
    tests = [clip["stimulus"] for clip in clips if clip["role"] == "test"]
    assert len(tests) == 8
    with (demo / "report" / "mos.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert sorted(row["stimulus"] for row in rows) == sorted(tests)
    assert {row["n"] for row in rows} == {"18"}
    assert "<html" in (demo / "report" / "report.html").read_text(encoding="utf-8")
    assert (demo / "report" / "mos.svg").stat().st_size > 0
    assert (demo / "stimuli" / "figures" / "fig5__city__sd__2.png").stat().st_size > 0
    assert not demo.with_name("dsis-demo.partial").exists()


def test_simulated_votes_say_so_everywhere(demo: Path) -> None:
    for table in ("votes/votes.csv", "report/mos.csv", "report/observers.csv"):
        with (demo / table).open(encoding="utf-8") as file:
            assert {row["simulated"] for row in csv.DictReader(file)} == {"true"}, table
    for text in ("report/report.html", "report/mos.svg"):
        assert "SIMULATED" in (demo / text).read_text(encoding="utf-8"), text


def test_the_report_shows_what_was_shown(demo: Path) -> None:
    manifest = json.loads((demo / "stimuli" / "manifest.json").read_text(encoding="utf-8"))
    page = (demo / "report" / "report.html").read_text(encoding="utf-8")
    table = page[page.index('<table id="stimuli">') :]
    for clip in manifest["clips"]:
        if clip["role"] == "test":
            psnr = clip["quality"]["psnr_db"]
            assert f">{sum(psnr) / len(psnr):.2f}<" in table, clip["stimulus"]
            assert f">{clip['quality']['visible_noise']:.2f}<" in table
    assert "added physics" not in table


@pytest.mark.usefixtures("unpainted")
def test_the_report_says_what_added_physics_does(tmp_path: Path) -> None:
    """A camera with row noise of 200 DN: every camera clip has its PSNR change in the report."""
    text = (SHIPPED / "demo.toml").read_text(encoding="utf-8")
    for old, new in (
        ("width = 480", "width = 96"),
        ("height = 270", "height = 64"),
        ("seconds = 2", "seconds = 0.12"),
        ("reference_s = 2.0", "reference_s = 0.1"),
        ("test_s = 2.0", "test_s = 0.1"),
        ("cameras/dual_gain_cinema.toml", "striped.toml"),
        ("levels = [2]", "levels = [0]"),
        ('scene = "landscape"', 'scene = "city"'),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "striped.toml").write_text(
        (SHIPPED / "cameras" / "dual_gain_cinema.toml").read_text(encoding="utf-8")
        + '[[effect]]\nkind = "row_noise"\nsigma_dn = 200\n',
        encoding="utf-8",
    )
    (tmp_path / "test.toml").write_text(text, encoding="utf-8")
    folder, votes = tmp_path / "stimuli", tmp_path / "votes"
    assert main(["stimuli", str(tmp_path / "test.toml"), "--out", str(folder)]) == 0
    assert main(["session", str(folder), "--robots", "6"]) == 0
    assert main(["votes", str(folder), "-o", str(votes)]) == 0
    assert main(["report", str(votes / "votes.csv"), "--out", str(tmp_path / "report")]) == 0
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "added physics" in page
    with (votes / "stimuli.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["role"] == "test"]
    for row in rows:
        if row["noise"] == "sd":
            assert float(row["effects_psnr_db"]) < -1
            assert float(row["effects_visible_ratio"]) > 1.2
        else:
            assert row["effects_psnr_db"] == ""


def test_training_clips_are_not_the_tests_and_not_scored(demo: Path) -> None:
    with (demo / "votes" / "votes.csv").open(encoding="utf-8") as file:
        votes = list(csv.DictReader(file))
    training = {v["stimulus"] for v in votes if v["kind"] == "training"}
    assert training
    assert all(name.startswith("training__") for name in training)
    assert not training & {v["stimulus"] for v in votes if v["kind"] == "test"}
    with (demo / "report" / "mos.csv").open(encoding="utf-8") as file:
        assert not training & {row["stimulus"] for row in csv.DictReader(file)}


def test_content_never_repeats_in_succession(demo: Path) -> None:
    with (demo / "votes" / "votes.csv").open(encoding="utf-8") as file:
        votes = list(csv.DictReader(file))
    for observer in {v["observer"] for v in votes}:
        shown = [v for v in votes if v["observer"] == observer and v["kind"] != "training"]
        shown.sort(key=lambda v: int(v["presentation"]))
        contents = [v["content"] for v in shown]
        assert all(a != b for a, b in pairwise(contents)), observer


def test_it_never_deletes_the_votes_of_people(
    demo: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("dsis.cli.demo.DEMO_SPEC", str(demo.parent / "small.toml"))
    mine = tmp_path / "dsis-demo"
    shutil.copytree(demo, mine)
    manifest = read_manifest(mine / "stimuli")
    with open_store(mine / "stimuli", manifest) as store:
        store.add_observer("anna", draw_plan(manifest, "anna", 1), simulated=False)
    votes = (mine / "stimuli" / "session" / "votes.sqlite").read_bytes()
    assert main(["demo", "--out", str(mine)]) == 2
    assert "holds votes of anna, which would be lost" in capsys.readouterr().err
    assert (mine / "stimuli" / "session" / "votes.sqlite").read_bytes() == votes


def test_it_can_be_run_again(demo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (demo / "report" / "report.html").read_bytes()
    monkeypatch.chdir(demo.parent)
    monkeypatch.setattr("dsis.cli.demo.DEMO_SPEC", str(demo.parent / "small.toml"))
    assert main(["demo"]) == 0
    assert (demo / "report" / "report.html").read_bytes() == before
