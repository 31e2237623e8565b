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

from dsis.outdir import UNFINISHED


class Journal:
    """Append-only record of a build in its unfinished folder (`dsis.outdir.result_folder`).

    Parameters
    ----------
    folder
        The unfinished folder, which already holds the journal with its first line.

    Attributes
    ----------
    frames
        What is finished, by content and frame.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / UNFINISHED
        self._lock = Lock()
        self.frames: dict[tuple[str, int], dict[str, Any]] = {
            (line["content"], line["frame"]): line
            for line in self._lines()
            if {"content", "frame", "clips"} <= line.keys()
        }

    def add(self, content: str, frame: int, clips: dict[str, Any]) -> None:
        """Record a frame whose files are all written."""
        line = {"content": content, "frame": frame, "clips": clips}
        with self._lock:
            self.frames[content, frame] = line
            self._append(line)

    def _lines(self) -> list[dict[str, Any]]:
        whole = self.path.read_bytes()
        # A line that was cut off by a kill has no newline: what it says is not finished.
        complete = whole[: whole.rfind(b"\n") + 1]
        if len(complete) < len(whole):
            os.truncate(self.path, len(complete))
        return [entry for line in complete.splitlines() if (entry := _entry(line)) is not None]

    def _append(self, line: dict[str, Any]) -> None:
        with self.path.open("ab") as file:
            file.write(json.dumps(line).encode() + b"\n")


def _entry(line: bytes) -> dict[str, Any] | None:
    """Return what a line says; None where a crash left something else: that frame is made again."""
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) else None


def sha256(data: bytes | memoryview) -> str:
    """Return the SHA-256 of some bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()
