"""Files of votes: what is read, what is refused and with which rows, what is written back."""

import csv
import io
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import analysis
from dsis.errors import InputError

CONTRACT_COLUMNS = {
    *("observer", "stimulus", "vote"),
    *("lab", "content", "noise", "demosaic", "level", "session", "presentation", "repetition"),
    *("attempt", "valid", "kind", "reaction_ms", "voted_at", "dropped_frames", "simulated"),
}
PAPER = (1, 10)
SMALL = "observer,stimulus,vote\nann,city,7\nbob,city,9\n"


def write(folder: Path, text: str | bytes) -> Path:
    file = folder / "votes.csv"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return file


def faults(file: Path, scale: tuple[int, int] = PAPER) -> list[tuple[str, str]]:
    """Read a wrong file; return (key, fact) of each fault."""
    with pytest.raises(InputError) as caught:
        analysis.read_votes(file, scale)
    assert all(fault.file == str(file) for fault in caught.value.faults)
    return [(fault.key, fault.fact) for fault in caught.value.faults]


def test_codebook_explains_the_columns_of_the_contract():
    book = analysis.codebook()
    assert {field["name"] for field in book} == CONTRACT_COLUMNS
    assert all(field["description"] and field["type"] for field in book)


def test_needed_columns_suffice_and_the_rest_has_defaults(tmp_path):
    votes = analysis.read_votes(write(tmp_path, SMALL), PAPER)
    assert set(votes.columns) == CONTRACT_COLUMNS
    assert votes["vote"].tolist() == [7, 9]
    assert votes.index.tolist() == [2, 3]
    assert votes["valid"].all()
    assert not votes["simulated"].any()
    assert votes["repetition"].tolist() == [1, 1]
    assert set(votes["kind"]) == {"test"}


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + SMALL,
        SMALL.replace("\n", "\r\n"),
        SMALL.replace(",", ";"),
        SMALL.replace(",", "\t"),
        SMALL.replace(",", " , "),
        SMALL.replace("ann,city", '"ann","city"'),
        SMALL.replace("\nbob", "\n\n,,\nbob"),
    ],
    ids=["bom", "crlf", "semicolons", "tabs", "blanks", "quotes", "blank lines"],
)
def test_spreadsheets_dialects_mean_the_same(tmp_path, text):
    plain = analysis.read_votes(write(tmp_path, SMALL), PAPER)
    read = analysis.read_votes(write(tmp_path, text), PAPER)
    pd.testing.assert_frame_equal(read.reset_index(drop=True), plain.reset_index(drop=True))


def test_decimal_commas_are_read_between_semicolons_only(tmp_path):
    german = "observer;stimulus;vote\nann;city;7,5\n"
    assert analysis.read_votes(write(tmp_path, german), PAPER)["vote"].tolist() == [7.5]
    found = faults(write(tmp_path, 'observer,stimulus,vote\nann,city,"7,5"\n'))
    assert found[0][0] == "row 2, vote"
    assert "decimal comma" in found[0][1]


def test_all_faults_come_at_once_with_their_rows(tmp_path):
    file = write(
        tmp_path,
        "observer,stimulus,content,vote,kind,presentation,voted_at\n"
        "ann,city,City,11,test,1,2026-03-01T09:30:00+01:00\n"
        "ann,sea,Sea,good,test,2,\n"
        ",city,City,5,test,3,\n"
        "bob,city,City,5,exam,4,\n"
        "bob,sea,Sea,5,test,0,\n"
        "cat,city,City,5,test,1.5,\n"
        "cat,sea,Sea,5,test,2,yesterday\n"
        "dan,city,City,5,test,1,\n"
        "dan,city,City,6,test,2,\n"
        "dan,sea,Lake,6,test,3,\n"
        "eve,sea,Sea,nan,test,4,\n",
    )
    assert [key for key, _ in faults(file)] == [
        "row 2, vote",
        "row 3, vote",
        "row 4, observer",
        "row 5, kind",
        "row 6, presentation",
        "row 7, presentation",
        "row 8, voted_at",
        "row 10, observer",
        "row 12, vote",
    ]
    found = dict(faults(file))
    assert found["row 2, vote"] == "is 11, must be from 1 to 10"
    assert '"good"' in found["row 3, vote"]
    assert "first in row 9" in found["row 10, observer"]
    assert "test, training, dummy, reference" in found["row 5, kind"]


@pytest.mark.parametrize(
    ("header", "wrong"),
    [
        ("observer,stimulus,vote,Kind", {"Kind": "kind"}),
        ("observer,stimulus,vote,VALID", {"VALID": "valid"}),
        ("observer,stimulus,Vote,Simulated", {"Vote": "vote", "Simulated": "simulated"}),
        ("observer,stimulus,vote,Dropped frames", {"Dropped frames": "dropped_frames"}),
        ("stimulus,Simulated,ann,bob", {"Simulated": "simulated"}),
        ("stimulus,Observer,Vote,x", {"Observer": "observer", "Vote": "vote"}),
        ("Stimulus,ann,bob,cat", {"Stimulus": "stimulus"}),
    ],
)
def test_known_columns_that_are_spelled_otherwise_are_not_passed_over(tmp_path, header, wrong):
    """Else dummy, invalid and simulated votes would be scored as those of people."""
    found = faults(write(tmp_path, f"{header}\na,b,5,1\n"))
    assert dict(found) == {
        f"row 1, {name}": f"must be spelled {meant}" for name, meant in wrong.items()
    }


def test_an_observer_of_a_wide_table_may_be_called_like_a_column(tmp_path):
    """Votes are no kinds; where they could be what the column says, both ways out are said."""
    votes = analysis.read_votes(write(tmp_path, "stimulus,Kind,ann\na,5,6\nb,,7\n"), PAPER)
    assert set(votes["observer"]) == {"Kind", "ann"}
    assert votes.loc[votes["observer"] == "Kind", "vote"].dropna().tolist() == [5]
    for name in ("Lab", "Level"):
        found = faults(write(tmp_path, f"stimulus,{name},ann\na,1,6\nb,2,7\n"))
        fact = f"must be spelled {name.lower()}; an observer needs another name"
        assert found == [(f"row 1, {name}", fact)]


def test_two_spellings_of_a_column_are_not_both_to_be_spelled_alike(tmp_path):
    found = dict(faults(write(tmp_path, "observer,stimulus,vote,Kind,KIND\na,b,5,test,dummy\n")))
    assert found == {
        "row 1, Kind": "must be spelled kind",
        "row 1, KIND": "means kind, as Kind does: take one of them out",
    }


def test_a_data_frame_has_its_columns_by_their_names_too(tmp_path):
    votes = analysis.read_votes(write(tmp_path, SMALL), PAPER)
    with pytest.raises(InputError, match="votes: Kind: must be spelled kind"):
        analysis.mos(votes.rename(columns={"kind": "Kind"}))
    assert len(analysis.mos(votes.assign(Kind="mine")))  # beside the one that counts


def test_a_stimulus_has_one_condition(tmp_path):
    file = write(
        tmp_path,
        "observer,stimulus,content,level,vote\nann,a,City,0,5\nbob,a,Sea,0,5\ncat,a,City,,5\n",
    )
    assert faults(file) == [
        ("row 3, content", "of a is Sea, but City in row 2"),
        ("row 4, level", "of a is blank, but 0.0 in row 2"),
    ]


def test_rows_are_lines_of_the_file_even_where_cells_hold_line_breaks(tmp_path):
    file = write(tmp_path, 'observer,stimulus,vote\n"an\nn",a,5\n\nbob,a,99\n')
    assert faults(file)[0][0] == "row 5, vote"


@pytest.mark.parametrize(
    ("text", "key", "fact"),
    [
        ("", "", "is empty"),
        ("\n \n", "", "is empty"),
        ("observer,stimulus,vote\n", "", "no votes"),
        ("observer,stimulus\nann,city\n", "row 1, vote", "missing"),
        ("subject,stimulus,vote\nann,city,3\n", "row 1, observer", "rename subject to observer"),
        ("observer,stimulus,vote,vote\nann,city,3,4\n", "row 1, vote", "2 times"),
        ("observer,stimulus,vote,\nann,city,3,4\n", "row 1, header", "no name"),
        ("observer,stimulus,vote\nann,city\n", "row 2", "has 2 cells, the header 3"),
        ('observer,stimulus,vote\nann,"city,3\n', "row 2", "is not CSV"),
        (b"observer,stimulus,vote\nann,stra\xdfe,3\n", "", "not UTF-8"),
        ("observer,stimulus,vote,valid\nann,city,3,maybe\n", "row 2, valid", "true or false"),
    ],
)
def test_what_is_no_table_of_votes_is_refused(tmp_path, text, key, fact):
    found = faults(write(tmp_path, text))
    assert found[0][0] == key
    assert fact in found[0][1]


def test_a_missing_file_is_refused(tmp_path):
    assert "cannot be read" in faults(tmp_path / "votes.csv")[0][1]


def test_long_lists_of_faults_are_cut_and_counted(tmp_path):
    file = write(tmp_path, SMALL + "".join(f"o{n},city,0\n" for n in range(500)))
    found = faults(file)
    assert len(found) == 21
    assert found[-1] == ("", "and 480 more faults")


def test_votes_not_scored_are_kept(tmp_path):
    text = (
        "observer,stimulus,vote,valid,kind\n"
        "ann,city,2,false,test\n"  # shown with dropped frames ...
        "ann,city,7,true,test\n"  # ... and repeated
        "ann,city,1,true,training\n"
        "ann,city,1,true,dummy\n"
        "ann,city-ref,10,true,reference\n"
        "ann,sea,,true,test\n"
    )
    votes = analysis.read_votes(write(tmp_path, text), PAPER)
    assert len(votes) == 6
    assert analysis.scored(votes).index.tolist() == [3, 6]
    assert analysis.mos(votes)["mos"].tolist() == [7, 10]


def test_the_same_name_in_two_labs_is_two_people(tmp_path):
    text = "lab,observer,stimulus,vote\nx,ann,city,2\ny,ann,city,7\n"
    votes = analysis.read_votes(write(tmp_path, text), PAPER)
    assert len(analysis.observer_table(votes)) == 2
    text += "y,ann,city,7\n"
    assert faults(write(tmp_path, text))[0][0] == "row 4, observer"


def test_the_scale_comes_from_the_option_or_the_package(tmp_path):
    file = write(tmp_path, SMALL)
    with pytest.raises(InputError, match="--scale LOW HIGH"):
        analysis.read_votes(file)
    with pytest.raises(InputError, match=r"no.csv: cannot be read: No such file"):
        analysis.read_votes(tmp_path / "no.csv")  # that is missing, not the scale
    package = tmp_path / "datapackage.json"
    package.write_text('{"scale": [1, 8], "labels": ["bad", "good"], "title": "T"}')
    with pytest.raises(InputError, match="from 1 to 8"):
        analysis.read_votes(file)
    assert str(analysis.describe_test(file).scale) == "1 (bad) to 8 (good)"
    assert str(analysis.describe_test(file, PAPER).scale) == "1 to 10"
    assert len(analysis.read_votes(file, PAPER)) == 2
    for wrong in ("[10, 1]", "[1]", '"1-10"', "[1, true]", "[NaN, 2]"):
        package.write_text(f'{{"scale": {wrong}}}')
        with pytest.raises(InputError, match="two numbers, the lower first"):
            analysis.read_votes(file)
    package.write_text("[")
    with pytest.raises(InputError, match=r"datapackage.json: cannot be read"):
        analysis.read_votes(file)


NAMES = st.text(
    st.characters(exclude_categories=("Cc", "Cs", "Zs", "Zl", "Zp")), min_size=1, max_size=8
)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    rows=st.lists(
        st.tuples(NAMES, NAMES, st.floats(1, 10) | st.none(), st.booleans(), st.integers(1, 99)),
        min_size=1,
        max_size=8,
        unique_by=lambda row: row[:2],
    )
)
def test_what_is_written_is_read_back(tmp_path, rows):
    columns = ["observer", "stimulus", "vote", "simulated", "presentation"]
    votes = pd.DataFrame(rows, columns=columns).astype({"vote": float})
    votes["remark"] = 'a "b", c'
    file = tmp_path / "votes.csv"
    analysis.write_votes(votes, file)
    read = analysis.read_votes(file, PAPER)
    pd.testing.assert_frame_equal(
        read[columns].reset_index(drop=True),
        votes[columns],
        check_dtype=False,
    )
    assert set(read["remark"]) == {'a "b", c'}
    again = file.read_bytes()
    analysis.write_votes(read, file)
    assert file.read_bytes() == again
    header = next(csv.reader(io.StringIO(again.decode())))
    assert set(header) == CONTRACT_COLUMNS | {"remark"}


def test_tables_made_by_hand_need_the_same_columns():
    with pytest.raises(InputError, match="observer"):
        analysis.mos(pd.DataFrame({"stimulus": ["a"], "vote": [1]}))
    with pytest.raises(InputError, match="vote"):
        analysis.mos(pd.DataFrame({"observer": ["o"], "stimulus": ["a"], "vote": ["x"]}))
    with pytest.raises(InputError, match="no valid vote"):
        analysis.mos(pd.DataFrame({"observer": ["o"], "stimulus": ["a"], "vote": [None]}))
