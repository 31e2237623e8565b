"""Whether the clips of a presentation fit into memory: checked before anybody waits for them."""

import os
from pathlib import Path

from dsis.errors import InputError
from dsis.manifest import MANIFEST, Manifest
from dsis.session.steps import steps

CLIPS = 2  # reference and test
PIXEL_BYTES = 4  # a canvas is RGBA
MARGIN_BYTES = 512 * 2**20  # for browser, server and whatever else runs
CLIPS_KEPT_MAX = 8
_MEMINFO = Path("/proc/meminfo")


def clip_bytes(manifest: Manifest) -> int:
    """Return the memory that the longest clip of a presentation needs in the page."""
    size = manifest.sequence
    longest_s = max(step.seconds for step in steps(manifest.session) if step.show != "grey")
    frames = min(size.frames, max(1, round(longest_s * size.fps)))
    return frames * size.width * size.height * PIXEL_BYTES


def check_memory(manifest: Manifest, folder: Path, available_bytes: int | None) -> None:
    """Raise `InputError` where a presentation needs more memory than there is.

    None: the system does not say what there is.
    """
    needed = CLIPS * clip_bytes(manifest) + MARGIN_BYTES
    if available_bytes is not None and needed > available_bytes:
        fact = (
            f"a presentation needs {needed / 1e9:.1f} GB of memory, {available_bytes / 1e9:.1f} GB "
            "are free: close other programs, shorten the clips, or use --player mpv"
        )
        raise InputError.of(folder / MANIFEST, "sequence", fact)


def clips_kept(manifest: Manifest, available_bytes: int | None) -> int:
    """Return how many clips a page may keep: references come again, and need not be loaded."""
    if available_bytes is None:
        return CLIPS
    fitting = (available_bytes - MARGIN_BYTES) // (2 * clip_bytes(manifest))
    return int(max(CLIPS, min(CLIPS_KEPT_MAX, fitting)))


def available_memory_bytes() -> int | None:
    """Return the memory that programs could take now; None where the system does not say."""
    try:
        for line in _MEMINFO.read_text(encoding="ascii").splitlines():
            name, _, value = line.partition(":")
            if name == "MemAvailable":
                return int(value.split()[0]) * 1024
    except OSError:
        pass
    try:  # all there is: an upper bound
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
