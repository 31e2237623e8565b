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


@pytest.fixture(name="users")
def _users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder that is the user's cache."""
    for home in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(home, str(tmp_path / "users"))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    return tmp_path / "users"


def imported(package: Path, step: int, monkeypatch: pytest.MonkeyPatch) -> tuple[int, int]:
    """Return what a kernel in a new process gives and how many were found on disk.

    It calls another, which adds `step`.
    """
    package.mkdir(exist_ok=True)
    (package / "outer.py").write_text(OUTER)
    (package / "inner.py").write_text(INNER.format(step))
    with monkeypatch.context() as context:
        context.syspath_prepend(package)
        importlib.invalidate_caches()
        _cache.cache_clear()
        outer = importlib.import_module("outer").outer
        for name in ("inner", "outer"):
            del sys.modules[name]
    return outer(1), sum(outer.stats.cache_hits.values())


@pytest.mark.parametrize("place", ["NUMBA_CACHE_DIR", "the user's cache", "beside the sources"])
def test_kernels_of_changed_sources_are_compiled_anew_wherever_they_lie(
    place: str, users: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From one process to the next, they are as well: `test_startup.py`."""
    package, given, beside = tmp_path / "package", tmp_path / "given", place.startswith("beside")
    if place == "NUMBA_CACHE_DIR":
        monkeypatch.setattr(numba.config, "CACHE_DIR", str(given))
    if beside:
        users.write_text("no folder")
    said = [imported(package, step, monkeypatch) for step in (1, 2, 2)]
    assert said == [(2, 0), (3, 0), (3, 1)]
    folder = package if beside else given if given.exists() else users
    assert {path.name.partition(".")[0] for path in folder.rglob("*.nbc")} == {"outer", "inner"}
    assert bool(list(package.rglob("*.nbc"))) == beside


def test_the_same_sources_elsewhere_are_not_compiled_again(
    users: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each new virtual environment would spend a minute on it."""
    said = []
    for step, place in ((1, "one"), (2, "one"), (1, "two"), (3, "two")):
        (tmp_path / place).mkdir(exist_ok=True)
        said.append(imported(tmp_path / place / "package", step, monkeypatch))
    assert said == [(2, 0), (3, 0), (2, 1), (4, 0)]
    assert len(list((users / "dsis" / "kernels").iterdir())) == 3


def test_kernels_that_call_those_of_another_folder_are_compiled_anew_with_them(
    users: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Landscapes call the noise of all scenes, by kernels of their own folder among others."""
    package, other = tmp_path / "package", tmp_path / "other"
    other.mkdir()
    monkeypatch.syspath_prepend(other)
    package.mkdir()
    (package / "middle.py").write_text(OUTER)
    (package / "outer.py").write_text(
        OUTER.replace("inner import add", "middle import outer as add")
    )
    monkeypatch.syspath_prepend(package)
    said = []
    for step in (1, 2, 2):
        (other / "inner.py").write_text(INNER.format(step))
        importlib.invalidate_caches()
        _cache.cache_clear()
        outer = importlib.import_module("outer").outer
        said.append((outer(1), sum(outer.stats.cache_hits.values())))
        for name in ("inner", "middle", "outer"):
            del sys.modules[name]
    assert said == [(2, 0), (3, 0), (3, 1)]
    assert list(users.rglob("outer*.nbc"))


def test_only_kernels_that_nobody_uses_any_more_are_removed(
    users: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process may be at it too: what it has removed meanwhile is no fault."""
    package, caches = tmp_path / "package", users / "dsis" / "kernels"
    package.mkdir()
    in_use = _cache.__wrapped__(package, "")
    assert in_use is not None
    known = {
        in_use.name: 9,
        "package-new": 6.5,
        "package-old": 8,
        "package-older": 9,
        "other-old": 8,
    }
    for name, days in known.items():
        (caches / name).mkdir(exist_ok=True)
        os.utime(caches / name, (3e9 - 86400 * days,) * 2)
    monkeypatch.setattr(compiled.time, "time", lambda: 3e9)
    remove = shutil.rmtree

    def both(folder: Path, **_: bool) -> None:
        for old in caches.glob("package-old*"):  # the other process is quicker
            remove(old)
        assert not folder.exists()

    monkeypatch.setattr(compiled.shutil, "rmtree", both)
    assert _cache.__wrapped__(package, "") == in_use
    (package / "changed.py").touch()
    assert _cache.__wrapped__(package, "") != in_use
    left = {path.name for path in caches.iterdir()}
    assert left & set(known) == {in_use.name, "package-new", "other-old"}


def test_where_nothing_can_be_written_kernels_run_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError

    monkeypatch.setattr(Path, "mkdir", refused)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    _cache.cache_clear()
    assert kernel(lambda x: x + 1)(1) == 2
    assert not list(tmp_path.iterdir())
    assert str(tmp_path) == numba.config.CACHE_DIR
    _cache.cache_clear()
