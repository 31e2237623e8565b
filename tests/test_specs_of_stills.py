"""Promise: files and stills are the contents that they look like, or refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dsis.errors import InputError
from dsis.imagefile import write
from dsis.spec import read_spec
from dsis.stimuli import build_stimuli, check_stimuli
from written_spec import SHORT


def picture(path: Path, rows: int = 60, columns: int = 70) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    forms = {".png": "png8", ".tif": "tiff16", ".exr": "exr"}
    write(path, np.full((rows, columns, 3), 0.2, np.float32), forms[path.suffix])
    return path


STILLS = ('name = "still"\nfiles = "still.exr"', 'stills = "photos"')


@pytest.mark.parametrize(
    "names", [["IMG 1.png", "IMG-1.tif"], ["s.png", "s.tif", "s.exr"]], ids=["sign", "extension"]
)
def test_stills_with_one_name_are_refused(
    spec: Callable[..., Path], tmp_path: Path, names: list[str]
) -> None:
    for name in names:
        picture(tmp_path / "photos" / name)
    with pytest.raises(InputError, match="two contents have the name") as raised:
        read_spec(spec(STILLS))
    shown = sorted(str(tmp_path / "photos" / name) for name in names)
    assert sum(path in str(raised.value) for path in shown) == 2
    assert ("and 1 more" in str(raised.value)) == (len(names) == 3)


def test_stills_of_many_folders_with_one_name_are_refused(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    sources = [picture(tmp_path / f"day{i}" / "a.png") for i in range(10)]
    picture(tmp_path / "photos" / "b.png")
    with pytest.raises(InputError, match=r"'a': .*day0.a\.png and .*day1.a\.png and 8 more"):
        read_spec(spec(STILLS), sources)


def test_one_still_found_twice_is_refused(spec: Callable[..., Path], tmp_path: Path) -> None:
    picture(tmp_path / "photos" / "b.png")
    path = spec((STILLS[0], 'stills = ["photos", "photos/*.png"]'))
    with pytest.raises(InputError, match=r"b\.png is found twice"):
        read_spec(path)


def test_one_file_is_a_still_and_many_are_a_sequence(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    assert read_spec(spec()).footage["still"].still
    for i in range(5):
        picture(tmp_path / f"take{i}.exr")
    taken = read_spec(spec(("still.exr", "take*.exr"))).footage["still"]
    assert not taken.still
    assert [path.name for path in taken] == [f"take{i}.exr" for i in range(5)]


def test_a_sequences_frames_have_one_size_and_are_images(
    spec: Callable[..., Path], tmp_path: Path
) -> None:
    path = spec()
    for i in range(7):
        picture(tmp_path / "take" / f"{i}.exr")
    path = spec(("still.exr", "take"))
    for rows, columns in ((50, 70), (90, 90)):
        picture(tmp_path / "take" / "2.exr", rows, columns)
        with pytest.raises(InputError, match=rf"2\.exr is {columns}x{rows} .*0\.exr is 70x60"):
            read_spec(path)
    (tmp_path / "take" / "2.exr").write_text("no image", encoding="utf-8")
    with pytest.raises(InputError, match=r"2\.exr: is no readable image") as raised:
        read_spec(path)
    assert len(raised.value.faults) == 1
    picture(tmp_path / "take" / "2.exr")
    (tmp_path / "take" / "6.exr").write_text("no image, and not needed", encoding="utf-8")
    assert read_spec(path)


def test_folders_may_have_brackets_hidden_files_and_folders(
    spec: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "take[1]"
    for name in ("a.png", "._a.png", "b.png"):
        picture(folder / name)
    (folder / "dir.png").mkdir()
    for pattern in (folder, folder / "*.png", folder / "[ab].png"):
        assert set(read_spec(spec(STILLS), [pattern]).footage) == {"a", "b"}
    monkeypatch.chdir(folder)
    assert set(read_spec(spec(STILLS), ["*.png"]).footage) == {"a", "b"}
    inside = spec(("player", "png8"), *SHORT)
    build_stimuli(read_spec(inside), folder / "out")
    assert check_stimuli(folder / "out") == 5
