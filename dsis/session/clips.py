"""Clips as the player shows them: raw rgb24 of a manifest's `player` files, checked before use."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from dsis.errors import DamagedError, Fault, InputError
from dsis.manifest import MANIFEST, Clip, Manifest

FORMAT = "player"


@dataclass(frozen=True)
class PlayerClip:
    """A clip whose bytes are those of the manifest.

    Attributes
    ----------
    stimulus
        Name of the clip.
    path
        File of raw frames, rgb24, row by row.
    frame_bytes
        Bytes of one frame.
    frame_sha256
        Hash of each frame: the page compares what arrived there.
    """

    stimulus: str
    path: Path
    frame_bytes: int
    frame_sha256: tuple[str, ...]

    def frame(self, number: int) -> bytes:
        """Return the bytes of a frame, counted from 0."""
        with self.path.open("rb") as file:
            file.seek(number * self.frame_bytes)
            return file.read(self.frame_bytes)


def check_playable(manifest: Manifest, folder: Path) -> None:
    """Raise `InputError` unless every clip has a player file of the right size."""
    faults = []
    for i, clip in enumerate(manifest.clips):
        files = clip.files.get(FORMAT)
        if files is None:
            fact = (
                f'is missing; people are shown this format: set formats = ["{FORMAT}"] in the spec'
            )
            faults.append(Fault(str(folder / MANIFEST), f"clips[{i}].files.{FORMAT}", fact))
            continue
        path, wanted = folder / files.path, _frame_bytes(manifest) * manifest.sequence.frames
        found = path.stat().st_size if path.is_file() else None
        if found != wanted:
            fact = "is missing" if found is None else f"has {found} bytes, must have {wanted}"
            faults.append(Fault(str(path), "", fact))
    if faults:
        raise InputError(faults)


def checked_clip(manifest: Manifest, folder: Path, clip: Clip) -> PlayerClip:
    """Read a clip once and return it; raise `DamagedError` where it is not the manifest's.

    A manifest written by hand may have no hashes: then the file is what it is now.
    """
    files = clip.files[FORMAT]
    path, length = folder / files.path, _frame_bytes(manifest)
    whole = hashlib.sha256()
    frames = []
    try:
        with path.open("rb") as file:
            while data := file.read(length):
                whole.update(data)
                frames.append(hashlib.sha256(data).hexdigest())
    except OSError as error:
        message = f"{path}: cannot be read: {error.strerror}"
        raise DamagedError(message) from None
    stated = files.frame_sha256 or tuple(frames)
    if len(frames) != manifest.sequence.frames or stated != tuple(frames):
        wrong = [i for i, (a, b) in enumerate(zip(stated, frames, strict=False)) if a != b]
        message = f"{path}: differs from the manifest in frames {wrong or len(frames)}"
        raise DamagedError(message)
    if files.sha256 is not None and files.sha256 != whole.hexdigest():
        message = f"{path}: differs from the manifest (SHA-256)"
        raise DamagedError(message)
    return PlayerClip(clip.stimulus, path, length, tuple(frames))


def _frame_bytes(manifest: Manifest) -> int:
    return manifest.sequence.width * manifest.sequence.height * 3
