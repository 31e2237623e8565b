"""What happens to freed memory: it is kept for the next frame.

The C library's allocator returns the arrays of a frame to the system as soon as they are freed, and
the system clears every page that it hands out again: half the time of a frame of a camera with many
effects. Told so, it keeps a moderate amount instead.
"""

import ctypes
from contextlib import suppress

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of <malloc.h>
_KEPT_BYTES = 1 << 26  # freed memory that a process may keep
_LARGEST_BYTES = 1 << 25  # of an array that is kept; glibc allows no more


def keep_freed() -> None:
    """Let this process keep some freed memory, where the allocator can be told (glibc)."""
    with suppress(OSError, AttributeError, TypeError):  # other systems have no such function
        allocator = ctypes.CDLL(None)
        allocator.mallopt(_TRIM_THRESHOLD, _KEPT_BYTES)
        allocator.mallopt(_MMAP_THRESHOLD, _LARGEST_BYTES)
