"""Promise: a laboratory's set-up is read, kept and exported, and its faults are named."""

import re
import shlex
from pathlib import Path

import pytest

from dsis.cli import main, parser
from dsis.errors import InputError
from dsis.manifest import Quality, read_manifest, write_manifest
from dsis.session import export_votes, read_setup, run_robots
from dsis.session.clips import check_playable
from dsis.session.setup import Setup, current_setup, put_in_force
from dsis.session.store import Vote, open_store, read_store
from dsis.spec import Session
from tiny_clips import NOW, table, write_test

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def folder(tmp_path):
    write_test(tmp_path / "stimuli")
    return tmp_path / "stimuli"


def test_a_set_up_is_read_kept_and_exported(folder, tmp_path):
    path = tmp_path / "lab.toml"
    path.write_text(
        'schema = "dsis-session/1"\nlab = "TUM"\nhidden_references = true\nconsent = "Yes."\n'
        '[display]\nmodel = "BVM"\ndiagonal_inch = 24.5\npeak_cd_m2 = 100\ndistance_heights = 3\n',
        encoding="utf-8",
    )
    assert main(["session", str(folder), "--plan", "--setup", str(path)]) == 0
    with read_store(folder) as store:
        assert current_setup(store, Session()) == read_setup(path, (1, 10))
        kinds = [row.presentation.kind for row in store.rows("P01")]
        first = store.rows("P01")[0]
    assert kinds.count("reference") == 2
    with open_store(folder, read_manifest(folder)) as store:
        put_in_force(store, Setup(lab="EPFL", hidden_references=True), Session())  # what may change
        with pytest.raises(InputError, match="hidden_references: is false, must stay true"):
            put_in_force(store, Setup(), Session())
        store.record_vote(first.id, Vote(4, None, NOW, True, None, False))
    export_votes(folder, tmp_path / "votes")
    (row,) = table(tmp_path / "votes" / "votes.csv")
    assert row["lab"] == "EPFL"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "schema: is missing"),
        ('schema = "dsis-session/2"', "schema: is"),
        ('schema = "dsis-session/1"\nconsents = "x"', "did you mean consent"),
        ('schema = "dsis-session/1"\nlab = "a lab"', "lab: is"),
        ('schema = "dsis-session/1"\ngrade_words = ["bad", "good"]', "must have 10"),
        ('schema = "dsis-session/1"\n[display]\nmodel = "x"', "display.peak_cd_m2: is missing"),
    ],
)
def test_faults_of_a_set_up_are_named(tmp_path, text, why):
    path = tmp_path / "lab.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=why.replace(".", r"\.")):
        read_setup(path, (1, 10))


def test_robots_see_hidden_references_and_orders_in_pairs(tmp_path):
    folder = tmp_path / "stimuli"
    manifest = write_test(folder)
    clips = [
        clip.model_copy(update={"quality": Quality(visible_noise=2.0)}) for clip in manifest.clips
    ]
    write_manifest(manifest.model_copy(update={"clips": tuple(clips)}), folder)
    run_robots(folder, 2, seed=1, setup=Setup(hidden_references=True))
    with read_store(folder) as store:
        orders = [
            [r.presentation.stimulus for r in store.rows(n) if r.presentation.kind != "dummy"]
            for n in ("robot-001", "robot-002")
        ]
    assert orders[0] == orders[1][::-1]
    assert sorted(orders[0]) == sorted(clip.stimulus for clip in clips)


def test_the_examples_of_the_docs_work_as_they_stand_there(tmp_path):
    text = (ROOT / "docs" / "session.md").read_text(encoding="utf-8")
    for line in re.findall(r"^dsis .*$", text, re.MULTILINE):
        assert callable(parser().parse_args(shlex.split(line.split(" #")[0])[1:]).command)
    for picture in re.findall(r"!\[.*?\]\((.*?)\)", text):
        assert (ROOT / "docs" / picture).is_file(), picture
    (tmp_path / "lab.toml").write_text(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])
    assert read_setup(tmp_path / "lab.toml", (1, 2)).hidden_references
    (tmp_path / "manifest.json").write_text(re.search(r"```json\n(.*?)```", text, re.DOTALL)[1])
    check_playable(read_manifest(tmp_path), tmp_path)


def test_consent_and_hidden_references_come_from_the_spec_where_no_set_up_says() -> None:
    session = Session(consent="I agree.", hidden_references=True)
    assert Setup(lab="TUM").completed(session).consent == "I agree."
    assert Setup(lab="TUM").completed(session).hidden_references
    own = Setup(consent="Ours.", hidden_references=False).completed(session)
    assert (own.consent, own.hidden_references) == ("Ours.", False)


def test_what_the_page_on_sessions_says_may_be_left_out_of_a_set_up(tmp_path):
    page = (ROOT / "docs" / "session.md").read_text(encoding="utf-8")
    says, rest = page.split("```toml\n", 1)
    text = rest.split("```", 1)[0].replace('["...", "..."]', "[]")
    path = tmp_path / "lab.toml"
    whole, display = text.split("[display]")
    for line in whole.splitlines()[1:]:
        path.write_text(text.replace(line, ""), encoding="utf-8")
        assert read_setup(path, (1, 10)).display is not None
    path.write_text(whole, encoding="utf-8")
    assert read_setup(path, (1, 10)).display is None
    needed = [line for line in display.splitlines() if " = " in line]
    assert "a `[display]` needs the four keys\nshown" in says
    assert len(needed) == 4
    for line in needed:
        path.write_text(text.replace(line, ""), encoding="utf-8")
        with pytest.raises(InputError, match=f"display.{line.split()[0]}: is missing"):
            read_setup(path, (1, 10))
