"""The last line of a camera.toml that dsis writes: a checksum, which tells whether it was changed.

Such a file can be made again; what a user wrote into it cannot, and is never overwritten.
"""

import hashlib
from pathlib import Path

from dsis.errors import InputError

_SAYS = "# SHA-256 of all above, as dsis wrote it: "


def with_checksum(text: str) -> str:
    """Return the text of a file with its checksum in a last line."""
    above = text + "\n"
    return f"{above}{_SAYS}{_digest(above)}\n"


def unchanged(path: Path) -> bool:
    """Tell whether a file is as dsis wrote it, whatever ends its lines."""
    try:
        above, _, digest = path.read_text(encoding="utf-8-sig").rpartition(_SAYS)
    except UnicodeDecodeError:
        return False
    return digest.strip() == _digest(above)


def check_camera_file(path: Path) -> None:
    """Refuse a place for a camera.toml that would not be one, or where a user's work is."""
    if path.suffix != ".toml":
        raise InputError.of(path, "", "must end in .toml: the camera model is written to it")
    if path.is_dir():
        raise InputError.of(path, "", "is a folder, must be the name of a file")
    if path.exists() and path.stat().st_size and not unchanged(path):
        fact = (
            "has no checksum of dsis (of another hand, or of an earlier version), or was changed "
            "since, and would be lost: give another name"
        )
        raise InputError.of(path, "", fact)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
