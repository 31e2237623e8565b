"""Clips on disk: where each frame of a clip lies, written, read and hashed alike by all."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis import imagefile
from dsis.imagefile import find_files
from dsis.manifest import Clip, ClipFiles
from dsis.spec import Sequence
from dsis.stimuli.journal import sha256
from dsis.stimuli.quality import delivered

Frame = NDArray[np.float32]


def clip_path(stimulus: str, form: str) -> str:
    """Return the path of a clip from the stimuli folder; a glob where frames are files."""
    if form == "player":
        return f"player/{stimulus}.rgb"
    return f"{form}/{stimulus}/*.{imagefile.EXTENSIONS[form]}"


def frame_path(folder: Path, stimulus: str, form: str, frame: int) -> Path:
    """Return the file that holds a frame of a clip."""
    path = clip_path(stimulus, form)
    return folder / path.replace("*", f"{frame:05d}")


def write_frame(folder: Path, stimulus: str, form: str, frame: int, display: Frame) -> str:
    """Write one frame of a clip and return the SHA-256 of its bytes."""
    if form == "player":
        data = delivered(display).data.cast("B")
        store_frame_bytes(folder, stimulus, form, frame, data)
        return sha256(data)
    path = frame_path(folder, stimulus, form, frame)
    imagefile.write(path, display, form)
    return sha256(path.read_bytes())


def store_frame_bytes(
    folder: Path, stimulus: str, form: str, frame: int, data: bytes | memoryview
) -> None:
    """Put the bytes of one frame of a clip where they belong."""
    path = frame_path(folder, stimulus, form, frame)
    path.parent.mkdir(parents=True, exist_ok=True)
    if form != "player":
        unfinished = path.with_name(f".{path.name}.unfinished")
        unfinished.write_bytes(data)
        unfinished.replace(path)
        return
    path.touch()
    with path.open("r+b") as file:
        file.seek(frame * len(data))
        file.write(data)


def read_frame_bytes(folder: Path, stimulus: str, form: str, frame: int, size: Sequence) -> bytes:
    """Return the bytes of one frame as they are on disk; empty where it is absent."""
    path = frame_path(folder, stimulus, form, frame)
    try:
        if form != "player":
            return path.read_bytes()
        length = size.width * size.height * 3
        with path.open("rb") as file:
            file.seek(frame * length)
            return file.read(length)
    except OSError:
        return b""


def frames_of(folder: Path, clip: Clip, form: str, size: Sequence) -> Iterator[bytes]:
    """Yield the bytes of every frame of a clip of a manifest, in order."""
    files: ClipFiles = clip.files[form]
    if form != "player":
        for path in find_files(folder, [files.path]):
            yield path.read_bytes()
        return
    length = size.width * size.height * 3
    with (folder / files.path).open("rb") as file:
        while data := file.read(length):
            yield data
