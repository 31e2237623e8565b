"""Compiled kernels and how they are spread over threads: the only file that touches numba.

Kernels are serial, release the interpreter lock and work on a range of rows; threads take row
blocks, or whole frames. So the result cannot depend on the number of workers, and a kernel may be
called from any thread (numba's own parallel back ends may not). No fast-math: the same bytes from
every processor that rounds as IEEE 754 says.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

ROWS_PER_BLOCK = 64


def kernel(function: F) -> F:
    """Compile `function` on its first call; cached on disk, releases the interpreter lock."""
    compiled = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=False)(function)
    return cast("F", compiled)


def inlined(function: F) -> F:
    """Compile a small function that kernels call; it is pasted into their loops.

    It must stand in the file of the kernels that call it: the cache on disk follows that file only.
    """
    compiled = numba.njit(nogil=True, error_model="numpy", fastmath=False, inline="always")(
        function
    )
    return cast("F", compiled)


def over_rows(work: Callable[[int, int], None], rows: int, threads: int = 1) -> None:
    """Call `work(first, last)` on blocks that cover the rows 0..rows-1, on `threads` threads.

    Parameters
    ----------
    work
        Writes its own rows only; `last` is exclusive.
    rows
        Number of rows.
    threads
        Number of threads; 1 calls `work(0, rows)` directly.
    """
    if threads <= 1 or rows <= ROWS_PER_BLOCK:
        work(0, rows)
        return
    blocks = [(r, min(r + ROWS_PER_BLOCK, rows)) for r in range(0, rows, ROWS_PER_BLOCK)]
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(work, first, last) for first, last in blocks]:
            done.result()
