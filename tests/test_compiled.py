"""Promise: kernels do the same work on any number of threads, and are never stale."""

import importlib
import os
import shutil
import sys
import threading
import time
from pathlib import Path

import numba
import numpy as np
import pytest

from dsis import compiled
from dsis.compiled import ROWS_PER_BLOCK, _cache, kernel, over_rows
from dsis.demosaic.bilinear_block import ALIGNMENT, PIXELS, fence, store, stream


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize(
    "rows", [0, 1, ROWS_PER_BLOCK, ROWS_PER_BLOCK + 1, 10 * ROWS_PER_BLOCK - 1]
)
def test_every_row_is_worked_on_once(rows: int, threads: int) -> None:
    times = np.zeros(rows, int)

    def work(first: int, last: int) -> None:
        times[first:last] += 1

    over_rows(work, rows, threads)
    assert (times == 1).all()


def test_work_that_fails_is_told_and_the_rest_is_left() -> None:
    begun: list[int] = []
    met = threading.Barrier(2)

    def work(first: int, last: int) -> None:
        begun.append(first)
        if len(begun) <= 2:
            met.wait(timeout=60)  # both threads have a block: what is left is nobody's yet
        raise ValueError(last)

    with pytest.raises(ValueError, match=r"\d"):
        over_rows(work, 50 * ROWS_PER_BLOCK, 2)
    assert len(begun) == 2


@pytest.mark.parametrize("failing", ["this thread", "another"])
def test_who_works_on_is_stopped_by_who_fails(failing: str) -> None:
    begun: list[int] = []
    met = threading.Barrier(2)

    def work(first: int, last: int) -> None:
        begun.append(first)
        if len(begun) > 2:
            return
        met.wait(timeout=60)
        if (threading.current_thread() is threading.main_thread()) == (failing == "this thread"):
            raise ValueError(last)
        time.sleep(0.2)  # long enough for the other to fail

    with pytest.raises(ValueError, match=r"\d"):
        over_rows(work, 50 * ROWS_PER_BLOCK, 2)
    assert len(begun) < 50


def test_rows_within_rows_and_from_many_threads_wait_for_nobody() -> None:
    rows, times = 3 * ROWS_PER_BLOCK, np.zeros(9 * ROWS_PER_BLOCK, int)

    def outer(first: int, last: int) -> None:
        del last

        def inner(start: int, end: int) -> None:
            times[3 * first + start : 3 * first + end] += 1

        over_rows(inner, rows, 3)

    def call() -> None:
        over_rows(outer, rows, 2)

    threads = [threading.Thread(target=call, daemon=True) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    assert (times == 4).all()


def test_rows_within_rows_do_not_wait_for_those_around() -> None:
    begun: list[int] = []
    met, inner_is_done = threading.Barrier(2), threading.Event()

    def outer(first: int, last: int) -> None:
        del last
        begun.append(first)
        if len(begun) > 2:
            return
        met.wait(timeout=60)
        if threading.current_thread() is threading.main_thread():
            over_rows(lambda _first, _last: None, 4 * ROWS_PER_BLOCK, 2)
            inner_is_done.set()
        else:
            assert inner_is_done.wait(timeout=10)

    over_rows(outer, 6 * ROWS_PER_BLOCK, 2)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_threads_are_found_after_a_fork() -> None:
    def work(first: int, last: int) -> None:
        del first, last

    over_rows(work, 2 * ROWS_PER_BLOCK, 2)
    child = os.fork()
    if child == 0:
        threading.Timer(30, os._exit, (1,)).start()
        over_rows(work, 2 * ROWS_PER_BLOCK, 2)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0


def aligned(samples: int) -> np.ndarray:
    """Return zeros that begin where a line of the cache does."""
    space = np.zeros(samples + ALIGNMENT, np.float32)
    return space[-space.ctypes.data % ALIGNMENT // 4 :][:samples]


@kernel
def block(rows: np.ndarray, line: np.ndarray, blue: bool, odd: bool, past: bool) -> None:
    if past:
        stream(rows[0], rows[1], rows[2], np.uintp(PIXELS), line, blue, odd)
    else:
        store(rows[0], rows[1], rows[2], np.uintp(PIXELS), line, blue, odd)
    fence()


@pytest.mark.parametrize("blue", [False, True])
@pytest.mark.parametrize("odd", [False, True])
def test_stores_past_the_cache_write_the_same_bytes_and_no_others(blue: bool, odd: bool) -> None:
    rows = np.random.default_rng(1).random((3, 3 * PIXELS), np.float32)
    written = []
    for past in (False, True):
        line = aligned(9 * PIXELS)
        block(rows, line, blue, odd, past)
        written.append(line.tobytes())
        assert not line[: 3 * PIXELS].any()
        assert line[3 * PIXELS : 6 * PIXELS].all()
        assert not line[6 * PIXELS :].any()
    assert written[0] == written[1]


INNER = "from dsis.compiled import kernel\n\n@kernel\ndef add(x):\n    return x + {}\n"
OUTER = """from dsis.compiled import kernel
from inner import add

@kernel
def outer(x):
    return add(x)
"""


@pytest.mark.parametrize("place", ["NUMBA_CACHE_DIR", "the user's cache"])
def test_kernels_of_changed_sources_are_compiled_anew_wherever_they_lie(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside the sources, and from one process to the next, they are as well: `test_startup.py`."""
    package, elsewhere = tmp_path / "package", tmp_path / "elsewhere"
    package.mkdir()
    (package / "outer.py").write_text(OUTER)
    monkeypatch.syspath_prepend(package)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    given = place == "NUMBA_CACHE_DIR"
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(elsewhere) if given else "")
    for home in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(home, str(elsewhere))
    if not given:
        monkeypatch.setattr(os, "access", lambda *_: False)
    said = []
    for step in (1, 2, 2):
        (package / "inner.py").write_text(INNER.format(step))
        os.utime(package / "inner.py", (step, step))  # of one size; written at another time
        importlib.invalidate_caches()
        _cache.cache_clear()  # as in a new process
        outer = importlib.import_module("outer").outer
        said.append((outer(1), sum(outer.stats.cache_hits.values())))
        for name in ("inner", "outer"):
            del sys.modules[name]
    assert said == [(2, 0), (3, 0), (3, 1)]
    assert list(elsewhere.rglob("*.nbc"))
    assert not list(package.rglob("*.nbc"))


def test_only_kernels_that_nobody_uses_any_more_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process may be at it too: what it has removed meanwhile is no fault."""
    (tmp_path / "package").mkdir()
    caches = tmp_path / "package" / "__pycache__"
    known = {"kernels-new": 0.5, "kernels-old": 2, "kernels-older": 3, "others-old": 2}
    for name, days in known.items():
        (caches / name).mkdir(parents=True)
        os.utime(caches / name, (3e9 - 86400 * days,) * 2)
    monkeypatch.setattr(compiled.time, "time", lambda: 3e9)
    remove = shutil.rmtree

    def both(folder: Path, **_: bool) -> None:
        for old in caches.glob("kernels-old*"):  # the other process is quicker
            remove(old)
        assert not folder.exists()

    monkeypatch.setattr(compiled.shutil, "rmtree", both)
    compiled._cache.__wrapped__(tmp_path / "package", "")
    left = {path.name for path in caches.iterdir()}
    assert left & set(known) == {"kernels-new", "others-old"}


def test_where_nothing_can_be_written_kernels_run_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "file"))
    assert kernel(lambda x: x + 1)(1) == 2
    assert str(tmp_path / "file") == numba.config.CACHE_DIR
