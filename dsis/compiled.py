"""Compiled kernels and how they are spread over threads: the only file that touches numba.

Kernels are serial, release the interpreter lock and work on a range of rows; threads take row
blocks, or whole frames. So the result cannot depend on the number of workers, and a kernel may be
called from any thread (numba's own parallel back ends may not). No fast-math: the same bytes from
every processor that rounds as IEEE 754 says.
"""

import gc
import hashlib
import inspect
import os
import shutil
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from threading import Lock, local
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import event, types
from numba.core.caching import UserProvidedCacheLocator
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic
from numba.misc.appdirs import AppDirs
from numpy.typing import NDArray

F = TypeVar("F", bound=Callable[..., Any])

ROWS_PER_BLOCK = 64
_ALONE = 128  # values that are summed in one loop
_UNUSED_S = 7 * 86400.0  # from when on nobody is taken to need it any more
_one_places = Lock()  # the compiler has one setting for all threads, and they may import at once


class _Compiling(event.Listener):
    """Says once, on a terminal, why the first use of a command takes longer; sweeps nothing then.

    A compiler makes very many objects, few of them waste: sweeps take a tenth of its time. One
    thread compiles at a time; a kernel that calls others waits for theirs.
    """

    said = False
    depth = 0
    swept = True  # whether there is a sweeper, outside

    def on_start(self, event: object) -> None:
        del event
        if not self.said and sys.stderr.isatty():
            print("dsis: compiling once for this machine, some seconds ...", file=sys.stderr)  # noqa: T201 - for the terminal only
        self.said = True
        if self.depth == 0:
            self.swept = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: object) -> None:
        del event
        self.depth -= 1
        if self.depth == 0 and self.swept:
            gc.enable()


event.register("numba:compile", _Compiling())  # type: ignore[no-untyped-call] # numba has no types; not sent where the cache on disk holds the kernel


def kernel(function: F) -> F:
    """Compile `function` on its first call; cached on disk, releases the interpreter lock.

    Kernels may call kernels of other files, and constants of other files of their folder: all that
    lie in one folder, and all that call them, are compiled anew when one of its files changes.
    """
    settings: Any = numba.config
    with _one_places:
        before = settings.CACHE_DIR, settings.CACHE_LOCATOR_CLASSES
        home = Path(function.__code__.co_filename).parent
        place = _cache(home, before[0], _called_elsewhere(function, home))
        settings.CACHE_DIR = str(place or before[0])
        settings.CACHE_LOCATOR_CLASSES = f"{__name__}.{_There.__name__}"
        try:
            compile_ = numba.njit(
                cache=place is not None, nogil=True, error_model="numpy", fastmath=False
            )
            return cast("F", compile_(function))
        finally:
            settings.CACHE_DIR, settings.CACHE_LOCATOR_CLASSES = before


class _There(UserProvidedCacheLocator):
    """Has a kernel where `_cache` says, whatever the path of its source."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)  # type: ignore[no-untyped-call] # numba has no types
        self._cache_path: str = numba.config.CACHE_DIR  # type: ignore[attr-defined] # as above

    def get_source_stamp(self) -> str:
        """Return what tells sources apart: nothing, for others have another folder."""
        return ""


def _called_elsewhere(function: Callable[..., Any], home: Path) -> tuple[Path, ...]:
    """Return the folders, but its own, of kernels that a kernel calls, or those that it calls."""
    found, asked = {function}, [function]
    while asked:
        one: Any = asked.pop()
        named = (one.__globals__.get(name) for name in one.__code__.co_names)
        called = {own.py_func for own in named if isinstance(own, Dispatcher)} - found
        found |= called
        asked += called
    files = {Path(own.__code__.co_filename) for own in found} - {Path(__file__)}  # every stamp's
    return tuple(sorted({file.parent for file in files} - {home}))


@lru_cache(maxsize=64)
def _cache(package: Path, given: str, others: tuple[Path, ...] = ()) -> Path | None:
    """Return where the compiled kernels of a folder lie, None: nowhere; old ones are removed.

    The compiler's own cache looks at the file of a kernel only, and would keep what calls another.
    They lie in the user's cache, or in `given` (NUMBA_CACHE_DIR) if not "", by the content of the
    folder, and of `others` whose kernels they call: every installation of the same sources has the
    same. Else they lie beside the sources.
    """
    stamp = hashlib.blake2b(digest_size=8)
    sources = (file for folder in (package, *others) for file in sorted(folder.glob("*.py")))
    for file in (Path(__file__), *sources):
        stamp.update(f"{file.name} {file.stat().st_size}\n".encode())
        stamp.update(file.read_bytes())
    users = given or AppDirs("dsis", appauthor=False).user_cache_dir  # type: ignore[no-untyped-call] # numba has no types
    for caches in (Path(users) / "kernels", package / "__pycache__"):
        wanted = caches / f"{package.name}-{stamp.hexdigest()}"
        known = wanted.exists()
        try:
            wanted.mkdir(parents=True, exist_ok=True)
            os.utime(wanted, (time.time(),) * 2)  # in use
        except OSError:
            continue
        if not known:
            _remove_unused(caches, package.name)
        if os.access(wanted, os.W_OK):
            return wanted
    return None  # nothing can be written: each process compiles for itself


def _remove_unused(caches: Path, name: str) -> None:
    """Remove kernels of a folder of this name that nobody has used for long."""
    for earlier in caches.glob(f"{name}-*"):
        with suppress(FileNotFoundError):  # another process removes them, too
            if time.time() - earlier.stat().st_mtime > _UNUSED_S:
                shutil.rmtree(earlier, ignore_errors=True)


def inlined(function: F) -> F:
    """Compile a small function that kernels call; it is pasted into their loops.

    It must stand in the file of the kernels that call it: the cache on disk follows that file only.
    """
    compiled = numba.njit(nogil=True, error_model="numpy", fastmath=False, forceinline=True)(
        function
    )
    return cast("F", compiled)


@kernel
def pairwise_sum(values: NDArray[np.float64]) -> float:
    """Return the sum of values (any,), in the order in which `numpy.sum` adds them.

    Its rounding error does not grow with what is summed. Kernels of any folder may call it.
    """
    if values.size > _ALONE:
        half = values.size // 2 // 8 * 8
        return pairwise_sum(values[:half]) + pairwise_sum(values[half:])
    a = b = c = d = e = f = g = h = 0.0  # which do not wait for one another
    end = values.size // 8 * 8
    for i in range(0, end, 8):
        a += values[i]
        b += values[i + 1]
        c += values[i + 2]
        d += values[i + 3]
        e += values[i + 4]
        f += values[i + 5]
        g += values[i + 6]
        h += values[i + 7]
    total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(end, values.size):
        total += values[i]
    return total


def emitted(emit: Callable[..., object]) -> Callable[..., None]:
    """Make a function for kernels out of one that emits LLVM instructions.

    For what Python cannot say, stores past the cache for example. `emit` is called with an
    `llvmlite.ir.IRBuilder` and the kernel's arguments: numbers, and pointers to the first element
    of arrays, which must be contiguous.
    """

    def typed(typing: object, *kinds: Any) -> tuple[Any, Callable[..., Any]]:
        del typing

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            def plain(kind: Any, value: Any) -> Any:
                array = isinstance(kind, types.Array)
                return context.make_array(kind)(context, builder, value).data if array else value

            emit(builder, *map(plain, signature.args, values))
            return context.get_dummy_value()

        return types.void(*kinds), generate

    typed.__signature__ = inspect.signature(emit)  # type: ignore[attr-defined] # what calls are checked against
    return cast("Callable[..., None]", intrinsic(typed))


def over_rows(work: Callable[[int, int], None], rows: int, threads: int = 1) -> None:
    """Call `work(first, last)` on blocks that cover the rows 0..rows-1, on `threads` threads.

    Parameters
    ----------
    work
        Writes its own rows only; `last` is exclusive.
    rows
        Number of rows.
    threads
        Number of threads; 1 calls `work(0, rows)` directly. The threads are kept: to start one
        takes as long as a megapixel.
    """
    if threads <= 1 or rows <= ROWS_PER_BLOCK:
        work(0, rows)
        return
    blocks = iter(range(0, rows, ROWS_PER_BLOCK))  # shared: each block goes to who asks first

    def take() -> None:
        try:
            for first in blocks:
                work(first, min(first + ROWS_PER_BLOCK, rows))
        finally:
            for _ in blocks:  # who fails or is interrupted does not wait for every block
                pass

    pool = _kept.pool(threads - 1)
    others = [pool.submit(take) for _ in range(threads - 1)]
    try:
        take()
    finally:
        # Who has not begun finds no block any more: it may stand behind work that calls this one.
        begun = [other for other in others if not other.cancel()]
        wait(begun)
    for other in begun:
        other.result()


class _Pools(local):
    """Threads that each thread keeps for its own calls: none waits for another's, nested or not."""

    def __init__(self) -> None:
        self._pools: dict[tuple[int, int], ThreadPoolExecutor] = {}

    def pool(self, threads: int) -> ThreadPoolExecutor:
        key = os.getpid(), threads  # after a fork the parent's threads are not there
        if key not in self._pools:
            self._pools[key] = ThreadPoolExecutor(threads)
        return self._pools[key]


_kept = _Pools()
