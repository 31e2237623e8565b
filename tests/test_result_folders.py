"""Promise: a result folder is replaced in one step or not at all, and nothing foreign is lost."""

import contextlib
import errno
import multiprocessing
import os
from pathlib import Path

import pytest

from dsis import imagefile
from dsis.cli import main
from dsis.errors import InputError
from dsis.outdir import UNFINISHED, result_folder

MARK = "result.txt"


def make(out: Path, text: str = "new", **options: object) -> None:
    with result_folder(out, MARK, **options) as folder:
        (folder / MARK).write_text(text, encoding="utf-8")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_result_replaces_an_earlier_one(tmp_path: Path) -> None:
    make(tmp_path / "out", "old")
    make(tmp_path / "out", "new")
    assert (tmp_path / "out" / MARK).read_text(encoding="utf-8") == "new"
    assert names(tmp_path) == ["out"]
    assert names(tmp_path / "out") == [MARK]


def test_an_error_leaves_the_earlier_result(tmp_path: Path) -> None:
    make(tmp_path / "out", "old")
    interrupted(tmp_path / "out", None)
    assert (tmp_path / "out" / MARK).read_text(encoding="utf-8") == "old"


@pytest.mark.parametrize("end", ["", ".partial", ".replaced"])
def test_what_is_not_ours_is_refused_and_kept(tmp_path: Path, end: str) -> None:
    mine = tmp_path / f"out{end}" / "thesis.txt"
    mine.parent.mkdir()
    mine.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=f"out{end}"):
        make(tmp_path / "out")
    assert mine.read_text(encoding="utf-8") == "mine"


def test_what_must_be_kept_is_kept(tmp_path: Path) -> None:
    make(tmp_path / "out", "votes")
    with pytest.raises(InputError, match="holds the votes, which would be lost"):
        make(tmp_path / "out", keep=lambda _: "the votes")
    assert (tmp_path / "out" / MARK).read_text(encoding="utf-8") == "votes"


@pytest.mark.parametrize("inside", ["out", "new/out"])
def test_a_place_below_a_file_is_refused(tmp_path: Path, inside: str) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        make(tmp_path / "file" / inside)
    place = tmp_path / "file"
    fact = f"lies below {place}, which is a file: give another place"
    assert str(refused.value) == f"{place / inside}: {fact}"


def test_what_the_system_refuses_is_said_of_the_folder_that_was_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, **_: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "mkdir", refuse)
    monkeypatch.setattr("dsis.outdir._held", lambda _: contextlib.nullcontext())
    with pytest.raises(PermissionError) as refused:
        make(tmp_path / "out")
    assert refused.value.filename == str(tmp_path / "out")
    assert refused.value.strerror == "cannot be written: Permission denied"


def interrupted(out: Path, resume: str | None) -> None:
    with contextlib.suppress(KeyboardInterrupt), result_folder(out, MARK, resume=resume) as folder:
        (folder / "half").write_text("half", encoding="utf-8")
        raise KeyboardInterrupt


def test_unfinished_work_of_the_same_digest_is_resumed(tmp_path: Path) -> None:
    interrupted(tmp_path / "out", "digest")
    with result_folder(tmp_path / "out", MARK, resume="digest") as folder:
        assert (folder / "half").exists()
        (folder / MARK).touch()


def test_finished_parts_of_another_digest_are_not_lost(tmp_path: Path) -> None:
    interrupted(tmp_path / "out", "digest")
    with (tmp_path / "out.partial" / UNFINISHED).open("a", encoding="utf-8") as journal:
        journal.write('{"frames": 1}\n')
    with pytest.raises(InputError, match="unfinished work of another spec"):
        make(tmp_path / "out", resume="other")
    assert (tmp_path / "out.partial" / "half").exists()


def test_work_of_another_digest_of_which_nothing_was_finished_gives_way(tmp_path: Path) -> None:
    """A command that was stopped before it finished anything does not stop other ones."""
    interrupted(tmp_path / "out", "digest")
    with result_folder(tmp_path / "out", MARK, resume="other") as folder:
        assert names(folder) == [UNFINISHED]
        (folder / MARK).touch()


@pytest.mark.parametrize("resume", [None, "digest"])
def test_unfinished_work_that_cannot_be_resumed_begins_anew(
    tmp_path: Path, resume: str | None
) -> None:
    interrupted(tmp_path / "out", None)
    with result_folder(tmp_path / "out", MARK, resume=resume) as folder:
        assert names(folder) == [UNFINISHED]
        (folder / MARK).touch()


def test_a_refusal_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(InputError), result_folder(tmp_path / "out", MARK, resume="digest"):
        raise InputError.of("spec.toml", "key", "cannot be")
    make(tmp_path / "out", resume="other")


def test_a_kill_between_the_two_renames_loses_nothing(tmp_path: Path) -> None:
    make(tmp_path / "out", "old")
    (tmp_path / "out").rename(tmp_path / "out.replaced")
    with pytest.raises(RuntimeError), result_folder(tmp_path / "out", MARK):
        raise RuntimeError
    assert (tmp_path / "out" / MARK).read_text(encoding="utf-8") == "old"


def test_a_kill_after_the_renames_is_cleared_up(tmp_path: Path) -> None:
    make(tmp_path / "out", "new")
    (tmp_path / "out.replaced").mkdir()
    (tmp_path / "out.replaced" / MARK).write_text("old", encoding="utf-8")
    make(tmp_path / "out", "newer")
    assert names(tmp_path) == ["out"]


def _hold(
    out: str, held: "multiprocessing.Queue[bool]", leave: "multiprocessing.Queue[bool]"
) -> None:
    with result_folder(Path(out), MARK) as folder:
        held.put(True)
        leave.get()
        (folder / MARK).touch()


def test_two_processes_do_not_work_on_one_folder(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    held, leave = context.Queue(), context.Queue()
    other = context.Process(target=_hold, args=(str(tmp_path / "out"), held, leave))
    other.start()
    held.get()
    with pytest.raises(InputError, match="another process is at work"):
        make(tmp_path / "out")
    leave.put(True)
    other.join()
    make(tmp_path / "out")


@pytest.mark.parametrize("place", [".", "file", "file/below", "/"])
def test_places_that_are_none_get_a_message(
    tmp_path: Path, place: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "votes.csv").write_text("observer,stimulus,vote\na,s,1\nb,s,2\n", encoding="utf-8")
    status = main(["report", "votes.csv", "--scale", "1", "10", "--out", place])
    assert status == 2
    assert capsys.readouterr().err.startswith("dsis: ")
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_a_frame_that_does_not_fit_on_the_disk_is_no_frame(tmp_path: Path) -> None:
    """/dev/full takes every write and says that the disk is full, when the file is closed."""
    if not os.path.exists("/dev/full"):  # noqa: PTH110 - a device
        pytest.skip("no /dev/full on this system")
    import numpy as np

    frame = np.zeros((64, 64, 3), np.uint16)
    for extension in ("dpx", "tif", "png"):
        target = tmp_path / f"frame.{extension}"
        (tmp_path / f".frame.unfinished.{extension}").symlink_to("/dev/full")
        with pytest.raises(OSError, match="cannot be written") as raised:
            imagefile.write_codes(target, frame)
        assert raised.value.errno == errno.EIO
        assert not target.exists()
