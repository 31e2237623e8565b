"""Promise: what no table of votes holds - endless numbers, NUL bytes - is refused with its row."""

from pathlib import Path

import pytest

import analysis
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
