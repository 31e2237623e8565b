"""Promise: votes are read from wide tables, sureal's JSON, a session's store and several labs."""

import hashlib
import json

import numpy as np
import pandas as pd
import pytest

import analysis
from analysis.scale import Scale
from analysis.votesfile import read_test
from dsis.cli import main
from dsis.errors import InputError
from dsis.manifest import Clip, ClipFiles, Manifest, Quality, write_manifest
from dsis.session import run_robots
from dsis.session.store import STORE
from dsis.spec import Sequence, Session

PAPER = (1, 10)
KEY = ["observer", "stimulus", "repetition"]


def faults(file, scale=PAPER):
    with pytest.raises(InputError) as caught:
        analysis.read_votes(file, scale)
    return [(fault.key, fault.fact) for fault in caught.value.faults]


def same_votes(one, other):
    columns = [*KEY, "vote", "content", "kind"]
    sides = [t.loc[t["vote"].notna(), columns].sort_values(KEY) for t in (one, other)]
    pd.testing.assert_frame_equal(*(side.reset_index(drop=True) for side in sides))


WIDE = """stimulus,content,ann,bob,cat
city-1,city,7,9,8
city-2,city,,5,6
sea-1,sea,4,4,10
"""


@pytest.mark.parametrize(
    "text",
    [WIDE, WIDE.replace(",", ";"), "\ufeff" + WIDE.replace(",", "\t")],
    ids=[",", ";", "tab"],
)
def test_a_wide_table_is_one_vote_per_cell(tmp_path, text):
    file = tmp_path / "votes.csv"
    file.write_text(text, encoding="utf-8")
    votes = analysis.read_votes(file, PAPER)
    assert len(votes) == 9
    assert votes["vote"].isna().sum() == 1
    scores = analysis.mos(votes).set_index("stimulus")
    assert scores.loc["city-1", "mos"] == 8
    assert scores.loc["city-2", "n"] == 2
    assert set(votes.loc[votes["stimulus"] == "sea-1", "content"]) == {"sea"}
    assert votes.index.tolist() == [2, 2, 2, 3, 3, 3, 4, 4, 4]


def test_faults_in_a_wide_table_name_row_and_observer(tmp_path):
    file = tmp_path / "votes.csv"
    file.write_text(WIDE.replace("9", "good").replace("10", "7,5"), encoding="utf-8")
    assert "has 6 cells" in faults(file)[0][1]
    file.write_text(WIDE.replace("9", "good").replace("5", "11"), encoding="utf-8")
    assert faults(file) == [
        ("row 2, bob", 'is "good", must be a number'),
        ("row 3, bob", "is 11, must be from 1 to 10"),
    ]
    file.write_text(WIDE.replace("sea-1", "city-1").replace(",sea", ",city"), encoding="utf-8")
    assert [key for key, _ in faults(file)] == ["row 4, observer"] * 3
    file.write_text("stimulus,content\na,b\n", encoding="utf-8")
    assert {key for key, _ in faults(file)} == {"row 1, observer", "row 1, vote"}


@pytest.mark.parametrize("name", ["presentation", "valid", "MOS", "mean"])
def test_a_column_that_is_nobodys_is_not_taken_for_an_observer(tmp_path, name):
    file = tmp_path / "votes.csv"
    file.write_text(f"stimulus,{name},ann,bob\na,1,5,6\nb,2,7,8\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"{name}: is no observer"):
        analysis.read_votes(file, PAPER)


def test_wide_tables_of_semicolons_have_decimal_commas(tmp_path):
    file = tmp_path / "votes.csv"
    file.write_text("stimulus;ann;bob\na;7,5;6\n", encoding="utf-8")
    assert analysis.read_votes(file, PAPER)["vote"].tolist() == [7.5, 6.0]


@pytest.fixture(scope="module", params=["nflx_public", "vqeg_hd3"])
def real(request, shared_data):
    votes = pd.read_csv(shared_data / "votes" / f"{request.param}_votes.csv")
    votes = votes.rename(columns={"subject": "observer"})
    return votes.assign(kind=votes["is_reference"].map({0: "test", 1: "reference"}))


def test_real_votes_survive_every_form(real, tmp_path):
    analysis.write_wide(real, tmp_path / "wide.csv")
    analysis.write_sureal(real, tmp_path / "votes.json", Scale(1, 5))
    analysis.write_votes(real, tmp_path / "votes.csv")
    plain = analysis.read_votes(tmp_path / "votes.csv", (1, 5))
    for name in ("wide.csv", "votes.json"):
        same_votes(analysis.read_votes(tmp_path / name, (1, 5)), plain)
    before = (tmp_path / "votes.json").read_bytes()
    analysis.write_sureal(plain, tmp_path / "votes.json", Scale(1, 5))
    assert (tmp_path / "votes.json").read_bytes() == before


def test_repetitions_and_gaps_survive_too(tmp_path):
    rows = [("ann", "a", 1, 3), ("ann", "a", 2, 4), ("bob", "a", 2, 5), ("bob", "b", 1, 6)]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "repetition", "vote"])
    votes = votes.assign(content="c", kind="test", vote=votes["vote"].astype(float))
    analysis.write_sureal(votes, tmp_path / "votes.json", Scale(1, 10))
    analysis.write_wide(votes, tmp_path / "wide.csv")
    os = {
        v["path"]: v["os"] for v in json.loads((tmp_path / "votes.json").read_text())["dis_videos"]
    }
    assert os == {"a": {"ann": [3, 4], "bob": [None, 5]}, "b": {"bob": 6}}
    plain = votes.astype({"repetition": "Int64", **dict.fromkeys(["observer", "stimulus"], "str")})
    plain = plain.astype({"content": "str", "kind": "str"})
    for name in ("votes.json", "wide.csv"):
        same_votes(analysis.read_votes(tmp_path / name, PAPER), plain)


SUREAL = {
    "ref_videos": [{"content_id": 0, "content_name": "city", "path": "city.yuv"}],
    "dis_videos": [
        {"content_id": 0, "asset_id": 0, "path": "city.yuv", "os": [5, 5, None]},
        {"content_id": 0, "asset_id": 1, "path": "city_1.yuv", "os": [3, 2, 4]},
    ],
}


def test_a_dataset_of_sureal(tmp_path):
    file = tmp_path / "dataset.json"
    file.write_text(json.dumps(SUREAL), encoding="utf-8")
    votes = analysis.read_votes(file, (1, 5))
    assert votes["observer"].tolist() == ["o1", "o2", "o3"] * 2
    assert votes["kind"].tolist() == ["reference"] * 3 + ["test"] * 3
    assert set(votes["content"]) == {"city"}
    assert analysis.mos(votes)["mos"].tolist() == [3.0, 5.0]
    assert analysis.dmos(votes, Scale(1, 5))["n"].tolist() == [2]


@pytest.mark.parametrize(
    ("text", "key", "fact"),
    [
        ("[1, 2]", "dis_videos", "is missing"),
        ("{", "", "is not JSON"),
        ('{"dis_videos": []}', "dis_videos", "holds no votes"),
        ('{"dis_videos": [{"path": "a"}]}', "dis_videos[0]", "has no votes"),
        ('{"dis_videos": [{"os": 3}]}', "dis_videos[0].os", "must be votes by observer"),
        (
            '{"dis_videos": [{"os": {"a": "x"}}]}',
            "dis_videos[0].os",
            'of a is "x", must be a number',
        ),
        (
            '{"dis_videos": [{"os": {"a": 3}}], "simulated_observers": "a"}',
            "simulated_observers",
            'is "a", must be a list of observers',
        ),
        (
            '{"dis_videos": [{"os": {"a": 3, "b": 4}}], "simulated_observers": ["a", "c"]}',
            "simulated_observers",
            'names "c", must be of a, b',
        ),
        (
            '{"dis_videos": [{"os": [3, 4]}], "simulated_observers": ["robot-001"]}',
            "simulated_observers",
            'names "robot-001", must be of o1, o2',
        ),
        ('{"dis_videos": [{"os": {"a": true}}]}', "dis_videos[0].os", "must be a number"),
        ('{"dis_videos": [{"os": {"a": 7}}]}', "vote 1, vote", "must be from 1 to 5"),
    ],
)
def test_what_is_no_dataset_of_sureal(tmp_path, text, key, fact):
    file = tmp_path / "dataset.json"
    file.write_text(text, encoding="utf-8")
    found = faults(file, (1, 5))
    assert found[0][0] == key
    assert fact in found[0][1]


def write_stimuli(folder):
    """Write a test by hand: two contents of two clips each, with clips of four small frames."""
    folder.mkdir()
    clips = []
    for content in ("city", "land"):
        for i, role in enumerate(["reference", "test", "test", "training"]):
            data = np.full(4 * 16 * 16 * 3, 40 + i, np.uint8).tobytes()
            name = f"{content}__{role}__{i}"
            (folder / f"{name}.rgb").write_bytes(data)
            player = ClipFiles(path=f"{name}.rgb", sha256=hashlib.sha256(data).hexdigest())
            bare = role == "reference"
            clips.append(
                Clip(
                    stimulus=name,
                    content=content,
                    role=role,
                    reference=None if bare else f"{content}__reference__0",
                    noise=None if bare else "sd",
                    demosaic=None if bare else "bilinear",
                    level=None if bare else i,
                    files={"player": player},
                    quality=Quality(visible_noise=2.0**i),
                )
            )
    manifest = Manifest(
        schema="dsis-manifest/1",
        title="By hand",
        sequence=Sequence(width=16, height=16, fps=25.0, seconds=0.16),
        session=Session(),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)


def test_the_store_is_read_as_its_export(tmp_path, capsys):
    folder = tmp_path / "stimuli"
    write_stimuli(folder)
    with pytest.raises(InputError, match="no session has been held"):
        analysis.read_votes(folder)
    run_robots(folder, 3, seed=5)
    assert main(["votes", str(folder), "-o", str(tmp_path / "votes")]) == 0
    assert "SIMULATED: all of these votes" in capsys.readouterr().out
    exported = analysis.read_votes(tmp_path / "votes" / "votes.csv")
    for path in (folder, folder / STORE):
        votes, test = read_test(path)
        pd.testing.assert_frame_equal(votes, exported)
        assert str(test.scale) == "1 (very annoying) to 10 (imperceptible)"
        assert test.title == "By hand"
    assert main(["report", str(folder), "--out", str(tmp_path / "report")]) == 0
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "SIMULATED VOTES" in page
    assert "By hand" in page
    sureal = analysis.read_votes(tmp_path / "votes" / "sureal.json")
    assert sureal["simulated"].all()


def test_every_form_of_votes_says_whose_are_simulated(tmp_path):
    rows = [("ann", "a", 3), ("bot", "a", 4), ("ann", "b", 5), ("bot", "b", 6)]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "vote"])
    votes = votes.assign(simulated=votes["observer"] == "bot")
    analysis.write_sureal(votes, tmp_path / "votes.json", Scale(1, 10))
    analysis.write_votes(votes, tmp_path / "votes.csv")
    analysis.write_wide(votes, tmp_path / "wide.csv")
    for name in ("votes.json", "votes.csv", "wide.csv"):
        again = analysis.read_votes(tmp_path / name, PAPER)
        again = again[again["vote"].notna()]
        assert again.groupby("observer")["simulated"].all().to_dict() == {"ann": False, "bot": True}
        assert len(again) == 4
    analysis.write_wide(votes.assign(simulated=False), tmp_path / "wide.csv")
    assert "simulated" not in (tmp_path / "wide.csv").read_text(encoding="utf-8")


def test_an_observer_with_votes_of_both_kinds_is_no_observer_of_a_dataset(tmp_path):
    rows = [("ann", "a", 3), ("bot", "a", 4), ("ann", "b", 5), ("bot", "b", 6)]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "vote"])
    file = tmp_path / "votes.json"
    with pytest.raises(InputError) as caught:
        analysis.write_sureal(votes.assign(simulated=[0, 1, 0, 0]), file, Scale(1, 10))
    assert [fault.key for fault in caught.value.faults] == ["bot"]
    assert "has simulated votes and others" in caught.value.faults[0].fact
    assert not file.exists()


def lab(folder, text, scale="[1, 10]"):
    folder.mkdir()
    (folder / "votes.csv").write_text(text, encoding="utf-8")
    package = f'{{"scale": {scale}, "title": "{folder.name}"}}'
    (folder / "datapackage.json").write_text(package, encoding="utf-8")
    return folder / "votes.csv"


def test_several_files_are_laboratories(tmp_path, capsys):
    one = lab(tmp_path / "munich", "observer,stimulus,vote,age\nann,a,3,40\nbob,a,4,50\n")
    two = lab(tmp_path / "paris", "observer,stimulus,vote\nann,a,7\n")
    named = lab(tmp_path / "x", "lab,observer,stimulus,vote\nrome,ann,a,8\n,eve,a,9\n")
    votes, test = analysis.read_labs([one, two, named])
    people = votes[["lab", "observer"]].to_numpy().tolist()
    expected = [
        ["munich", "ann"],
        ["munich", "bob"],
        ["paris", "ann"],
        ["rome", "ann"],
        ["x", "eve"],
    ]
    assert people == expected
    assert votes["age"].tolist() == ["40", "50", "", "", ""]
    assert test.title == "munich"
    command = ["report", str(one), str(two), str(named), "--out", str(tmp_path / "report")]
    assert main([*command, "--reject", "munich/ann"]) == 0
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "Votes of 4 laboratories are pooled" in page
    assert "munich / bob" in page
    assert main([*command, "--reject", "ann"]) == 2
    assert "give one of munich/ann, paris/ann, rome/ann" in capsys.readouterr().err


def test_files_named_alike_in_folders_named_alike_get_numbers(tmp_path):
    for parent in ("1", "2"):
        (tmp_path / parent).mkdir()
    text = "observer,stimulus,vote\nann,a,{}\n"
    files = [lab(tmp_path / parent / "lab", text.format(parent)) for parent in ("1", "2")]
    assert set(analysis.read_labs(files)[0]["lab"]) == {"votes-1", "votes-2"}


def test_a_file_given_twice_and_a_copy_of_one_are_refused(tmp_path):
    """Else every observer votes twice, and intervals shrink by the root of two."""
    rows = ["ann,a,3", "ann,b,5", "bob,a,4"]
    one = lab(tmp_path / "one", "\n".join(["observer,stimulus,vote", *rows]) + "\n")
    with pytest.raises(InputError, match=r"is given twice"):
        analysis.read_labs([one, tmp_path / "two" / ".." / "one" / "votes.csv"])
    turned = [f"{row},x" for row in reversed(rows)]
    copy = lab(tmp_path / "copy", "\n".join(["observer,stimulus,vote,lab", *turned]) + "\n")
    with pytest.raises(InputError, match=f"same votes of the same observers as {one}"):
        analysis.read_labs([one, copy])
    turned[0] = "bob,a,5,x"
    other = lab(tmp_path / "other", "\n".join(["observer,stimulus,vote,lab", *turned]) + "\n")
    assert len(analysis.read_labs([one, other])[0]) == 6


def test_laboratories_that_contradict_one_another_are_refused(tmp_path):
    one = lab(tmp_path / "one", "lab,observer,stimulus,content,vote\nq,ann,a,City,3\n")
    two = lab(tmp_path / "two", "lab,observer,stimulus,content,vote\nq,ann,a,Sea,3\n")
    with pytest.raises(InputError) as caught:
        analysis.read_labs([one, two])
    said = str(caught.value)
    assert f"{two}:2: content: of a is Sea, but City in row {one}:2" in said
    assert "votes a second time" in said
    other = lab(tmp_path / "three", "observer,stimulus,vote\nann,a,3\n", scale="[1, 5]")
    with pytest.raises(InputError, match="scale: is 1 to 5, but 1 to 10 in"):
        analysis.read_labs([one, other])


def test_names_that_cannot_be_columns_of_a_wide_table_are_refused(tmp_path):
    rows = [("x", "ann", "a", 1), ("y", "ann", "a", 2)]
    votes = pd.DataFrame(rows, columns=["lab", "observer", "stimulus", "vote"])
    with pytest.raises(InputError, match="ann: stands in several labs"):
        analysis.write_wide(votes, tmp_path / "wide.csv")
    with pytest.raises(InputError, match="content: is the name of another column"):
        analysis.write_wide(votes.iloc[:1].assign(observer="content"), tmp_path / "wide.csv")
