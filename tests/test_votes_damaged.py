"""Promise: damaged files are refused with their rows, odd ones give a report that says so."""

from pathlib import Path

import pytest

import analysis
from analysis.report import analyse
from analysis.votesfile import read_test
from dsis.cli import main
from dsis.errors import InputError

HEAD = "observer,stimulus,vote"


def faults(folder: Path, content: bytes) -> list[tuple[str, str]]:
    """Read a wrong file; return (key, fact) of each fault."""
    file = folder / "votes.csv"
    file.write_bytes(content)
    with pytest.raises(InputError) as caught:
        analysis.read_votes(file, (1, 10))
    return [(fault.key, fault.fact) for fault in caught.value.faults]


@pytest.mark.parametrize("column", ["presentation", "repetition", "attempt", "dropped_frames"])
@pytest.mark.parametrize("number", ["1" * 23, "1e300", str(2**53 + 2)])
def test_whole_numbers_beyond_53_bits(tmp_path: Path, column: str, number: str) -> None:
    text = f"{HEAD},{column}\nann,a,5,{2**53}\nbob,a,5,{number}\n"
    ((key, fact),) = faults(tmp_path, text.encode())
    assert key == f"row 3, {column}"
    assert fact.endswith("must be at most 2^53 = 9007199254740992")


@pytest.mark.parametrize("row", ["b\0ob,a,5", "bob,a\0,5", "bob,a,5\0"])
def test_nul_bytes(tmp_path: Path, row: str) -> None:
    found = faults(tmp_path, f"{HEAD}\nann,a,5\n{row}\n".encode())
    assert [key for key, _ in found] == ["row 3"]
    assert "NUL byte" in found[0][1]


def test_utf_16(tmp_path: Path) -> None:
    found = faults(tmp_path, f"{HEAD}\nann,a,5\n".encode("utf-16-le"))
    assert "UTF-16" in str(found)


CONDITIONS = [(noise, demosaic) for noise in ("awgn", "sd") for demosaic in ("none", "bilinear")]
WHOLE = [f"o{o},s{s},{1 + (3 * o + 2 * s) % 10}" for s in range(6) for o in range(8)]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([HEAD, *WHOLE, "o1,s9,11"], "row 50, vote: is 11, must be from 1 to 10"),
        ([HEAD, *WHOLE, "o1,s9,nice"], 'row 50, vote: is "nice", must be a number'),
        ([HEAD, *WHOLE, "o1,s1,5"], "row 50, observer: votes a second time"),
        (["observer,stimulus", "o1,s1"], "row 1, vote: column is missing"),
        ([], "is empty"),
        ([HEAD], "holds a header and no votes"),
        ([HEAD, "o1,s1,"], "holds no valid vote on a test sequence"),
    ],
    ids=["vote 11", "text", "duplicate", "missing column", "empty", "header only", "no vote"],
)
def test_the_report_refuses_broken_files_with_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lines: list[str], said: str
) -> None:
    file = tmp_path / "votes.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    assert main(["report", str(file), "--scale", "1", "10"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
    assert [path.name for path in tmp_path.iterdir()] == ["votes.csv"]


@pytest.mark.parametrize(
    ("text", "remarks"),
    [
        ("\n".join([HEAD, *(row for row in WHOLE if row.startswith("o1,"))]), ["1 observer"]),
        (
            "\n".join([HEAD, *(f"o{o},s{s},5" for s in range(4) for o in range(16))]),
            ["All votes are equal on s0, s1, s2, s3", "No correlation exists for"],
        ),
        ("\ufeff" + "\n".join([HEAD, *WHOLE]), ["8 observers: with fewer than 15"]),
        ("\n".join([HEAD, *WHOLE]).replace(",", ";"), ["8 observers"]),
        ("\n".join([HEAD, *WHOLE]).replace(",", ";") + "\no9;s1;7,5", ["9 observers"]),
        ("\r\n".join([HEAD, *WHOLE]), ["8 observers"]),
    ],
    ids=["one observer", "all votes equal", "BOM", "semicolons", "decimal commas", "CRLF"],
)
def test_odd_files_give_a_report_with_remarks(
    tmp_path: Path, text: str, remarks: list[str]
) -> None:
    file = tmp_path / "votes.csv"
    file.write_text(text, encoding="utf-8", newline="")
    votes, test = read_test(file, (1, 10))
    found = " ".join(analyse(votes, test).remarks)
    for remark in remarks:
        assert remark in found


def test_one_observer_and_equal_votes_make_a_whole_report(tmp_path: Path) -> None:
    file = tmp_path / "votes.csv"
    columns = f"{HEAD},content,noise,demosaic,presentation"
    rows = [f"o1,c__{n}__{d},5,c,{n},{d},{p}" for p, (n, d) in enumerate(CONDITIONS, 1)]
    file.write_text("\n".join([columns, *rows]), encoding="utf-8")
    assert main(["report", str(file), "--scale", "1", "10"]) == 0
    page = (tmp_path / "votes-report" / "report.html").read_text(encoding="utf-8")
    assert "No mixed models: they need observers, and votes, that differ" in page
    assert "does not change the MOS" in page


def test_many_rows(tmp_path: Path) -> None:
    """Here 10^5; the benchmark `votes_scale.py` reads 10^6."""
    rows = [f"o{o},s{s},{1 + (o * s) % 10}" for s in range(1000) for o in range(100)]
    file = tmp_path / "votes.csv"
    file.write_text("\n".join([HEAD, *rows]), encoding="utf-8")
    votes = analysis.read_votes(file, (1, 10))
    assert len(votes) == 100_000
    assert analysis.mos(votes)["mos"].mean() == pytest.approx(votes["vote"].mean())
