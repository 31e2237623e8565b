"""Linear algebra of small matrices in one thread.

OpenBLAS spreads even a product of small matrices over all cores, whose threads wait for one another
awake. Beside processes that need the cores themselves, that takes many times as long as one thread.
"""

import ctypes
import os
from contextlib import suppress
from pathlib import Path

_SETTING = "OPENBLAS_NUM_THREADS"
_NAMES = tuple(
    f"{vendor}openblas_set_num_threads{width}" for vendor in ("scipy_", "") for width in ("64_", "")
)


def one_thread() -> None:
    """Let OpenBLAS use one thread here and in processes started from now on.

       What a user set stays.
    Libraries that are loaded already are told where the system says which
       these are (Linux).
    """
    if _SETTING in os.environ:
        return
    os.environ[_SETTING] = "1"
    with suppress(OSError):
        for library in _loaded():
            for name in _NAMES:
                if hasattr(library, name):
                    getattr(library, name)(1)


def _loaded() -> list[ctypes.CDLL]:
    """Return the loaded libraries that hold OpenBLAS."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    paths = {line.split(maxsplit=5)[-1] for line in lines if "openblas" in line}
    found = []
    for path in sorted(paths):
        with suppress(OSError):
            found.append(ctypes.CDLL(path))
    return found
