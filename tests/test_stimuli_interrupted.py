"""Promise: a build that was killed goes on, and ends bit-identical."""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dsis.errors import InputError
from dsis.spec import read_spec
from dsis.stimuli import build_stimuli
from folder_bytes import every_byte
from ramp import write_test


def killed_at_work(spec: Path, out: Path) -> set[int]:
    """Build in a process of its own, kill it soon and return the frames that it had finished."""
    command = [sys.executable, "-m", "dsis", "stimuli", str(spec), "--out", str(out), "--jobs", "2"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    journal = out.with_name(out.name + ".partial") / "journal.jsonl"

    def finished() -> list[bytes]:
        try:
            data = journal.read_bytes()
        except FileNotFoundError:
            data = b""  # not begun, or ended: a finished build takes its journal away
        return [line for line in data.splitlines(keepends=True) if b'"frame"' in line]

    deadline = time.monotonic() + 120
    while len(finished()) <= 8 and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)  # at once, whatever else the machine does before the kill
    process.send_signal(signal.SIGKILL)
    assert process.wait() in (0, -signal.SIGKILL)
    return {json.loads(line)["frame"] for line in finished() if line.endswith(b"\n")}


def test_killed_half_way_it_goes_on_and_ends_bit_identical(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows, columns = 160, 240
    out, partial = tmp_path / "out", tmp_path / "out.partial"
    # On a busy machine a build may end before its progress is seen: then a longer one is killed.
    for frames in (24, 48, 80):
        shutil.rmtree(out, ignore_errors=True)
        shutil.rmtree(partial, ignore_errors=True)
        spec = write_test(tmp_path, rows=rows, columns=columns, frames=frames)
        kept = killed_at_work(spec, out)
        if 0 < len(kept) < frames:
            break
    else:
        pytest.fail("all builds ended before they could be killed")
    assert not out.exists()
    # A frame that was damaged on disk is made again; a torn last line is forgotten.
    spoilt = min(kept)
    with (partial / "player" / "ramp__sd__none__0.rgb").open("r+b") as file:
        file.seek(spoilt * rows * columns * 3)
        file.write(b"spoilt")
    with (partial / "journal.jsonl").open("ab") as file:
        file.write(b'{"content": "ramp", "fra')
    undisturbed = tmp_path / "undisturbed"
    build_stimuli(read_spec(spec), undisturbed, jobs=2)

    from dsis.stimuli.build import Builder

    made: list[int] = []
    write_one = Builder._write

    def spy(self: Builder, frame: int) -> dict:
        made.append(frame)
        return write_one(self, frame)

    monkeypatch.setattr(Builder, "_write", spy)
    build_stimuli(read_spec(spec), out, jobs=2)
    assert sorted(made) == sorted(set(range(frames)) - kept | {spoilt})
    assert every_byte(out) == every_byte(undisturbed)
    assert not partial.exists()


def test_unfinished_work_of_another_spec_is_not_mixed_in(tmp_path: Path) -> None:
    spec = write_test(tmp_path)
    partial = tmp_path / "out.partial"
    partial.mkdir()
    # A frame is finished: of less, nothing would be lost, and the work gives way.
    begun = '{"build": "of another spec"}\n{"content": "a", "frame": 0, "clips": {}}\n'
    (partial / "journal.jsonl").write_text(begun, encoding="utf-8")
    with pytest.raises(InputError, match="unfinished work of another spec"):
        build_stimuli(read_spec(spec), tmp_path / "out")
    assert (partial / "journal.jsonl").exists()
