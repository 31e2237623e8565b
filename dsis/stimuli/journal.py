"""What is finished: one line per frame of a content, appended when all its clips hold it.

A build that was killed goes on from here. Frames count as finished only if the bytes on disk still
have the digests that the journal gives them.
"""

import hashlib
import json
import os
from pathlib import Path
from threading import Lock
from typing import Any

from dsis.errors import InputError

JOURNAL = "journal.jsonl"


class Journal:
    """Append-only record of a build in its unfinished folder.

    Parameters
    ----------
    folder
        The unfinished folder.
    digest
        Digest of all that decides the bytes; a journal of another build is refused.
    """

    def __init__(self, folder: Path, digest: str) -> None:
        self.path = folder / JOURNAL
        self.frames: dict[tuple[str, int], dict[str, Any]] = {}
        self._lock = Lock()
        lines = self._lines()
        if lines and lines[0].get("build") != digest:
            fact = "holds unfinished stimuli of another spec, seed or version: remove it, or give "
            raise InputError.of(folder, "", fact + "another folder with --out")
        for line in lines[1:]:
            self.frames[line["content"], line["frame"]] = line
        if not lines:
            self._append({"build": digest})

    def add(self, content: str, frame: int, clips: dict[str, Any]) -> None:
        """Record a frame whose files are all written."""
        line = {"content": content, "frame": frame, "clips": clips}
        with self._lock:
            self.frames[content, frame] = line
            self._append(line)

    def remove(self) -> None:
        """Take the journal away: the build is complete."""
        self.path.unlink()

    def _lines(self) -> list[dict[str, Any]]:
        if not self.path.exists():
            return []
        whole = self.path.read_bytes()
        # A line that was cut off by a kill has no newline: what it says is not finished.
        complete = whole[: whole.rfind(b"\n") + 1]
        if len(complete) < len(whole):
            os.truncate(self.path, len(complete))
        return [json.loads(line) for line in complete.splitlines()]

    def _append(self, line: dict[str, Any]) -> None:
        with self.path.open("ab") as file:
            file.write(json.dumps(line).encode() + b"\n")


def sha256(data: bytes | memoryview) -> str:
    """Return the SHA-256 of some bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()
