"""Promise: work is done whoever does it: same bytes, and again where a worker died."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from dsis.cli import main
from dsis.errors import Fault, InputError
from dsis.workers import MOST_TRIES, Workers, WorkersLostError, completed, workers

SECONDS = 60.0  # in which processes must start, however busy the machine is


def square(x: int) -> int:
    return x * x


def slow(x: int) -> int:
    time.sleep(0.2)
    return square(x)


def fails(x: int) -> int:
    message = f"no {x}"
    raise ValueError(message)


def refuses(x: int) -> int:
    raise InputError([Fault("a.toml", "key", f"is {x}"), Fault("b.toml", "", "is missing")])


def die_once(mark: Path, x: int) -> int:
    """Kill the process that runs this, the first time."""
    try:
        mark.touch(exist_ok=False)
    except FileExistsError:
        return square(x)
    os.kill(os.getpid(), signal.SIGKILL)
    return -1


def die(mark: Path, x: int) -> int:
    """Kill the process that runs this, every time, and count."""
    with mark.open("a", encoding="utf-8") as file:
        file.write(f"{x}\n")
    os.kill(os.getpid(), signal.SIGKILL)
    return -1


@pytest.fixture(params=["threads", "processes"])
def pool(request: pytest.FixtureRequest) -> Iterator[Workers]:
    with workers(2, kind=request.param) as pool:
        yield pool


def test_an_executor_like_any_other(pool: Workers) -> None:
    assert isinstance(pool, Executor)
    assert list(pool.map(square, range(20))) == [x * x for x in range(20)]
    assert dict(completed(pool, square, range(20))) == {x: x * x for x in range(20)}
    assert isinstance(pool.submit(fails, 3).exception(), ValueError)
    with pytest.raises(ValueError, match="no 1"):
        list(completed(pool, fails, [1]))


def test_few_calls_run_ahead_of_who_takes_the_results() -> None:
    begun: list[int] = []
    with workers(2) as pool:
        for taken, _ in enumerate(completed(pool, begun.append, range(50)), 1):
            assert len(begun) <= taken + 2 * pool.count
    assert sorted(begun) == list(range(50))


def test_no_more_is_begun_after_a_failure() -> None:
    begun: list[int] = []

    def work(x: int) -> None:
        begun.append(x)
        fails(x)

    with workers(1) as pool, pytest.raises(ValueError, match="no 0"):
        list(completed(pool, work, range(50)))
    assert len(begun) <= 2 * pool.count


def test_what_a_process_refuses_is_said_in_its_words() -> None:
    with pytest.raises(InputError) as refused, workers(1, kind="processes") as pool:
        pool.submit(refuses, 3).result(SECONDS)
    assert str(refused.value) == "a.toml: key: is 3\nb.toml: is missing"
    assert refused.value.faults[1] == Fault("b.toml", "", "is missing")


def test_work_of_a_process_that_died_is_done_again(tmp_path: Path) -> None:
    with workers(2, kind="processes") as pool:
        found = dict(completed(pool, partial(die_once, tmp_path / "died"), range(6)))
    assert (tmp_path / "died").exists()
    assert found == {x: x * x for x in range(6)}


def test_work_that_kills_every_process_is_given_up_with_a_clear_word(tmp_path: Path) -> None:
    with (
        workers(1, kind="processes") as pool,
        pytest.raises(WorkersLostError, match=r"a worker died each time .* out of memory"),
    ):
        pool.submit(die, tmp_path / "deaths", 1).result(SECONDS)
    assert (tmp_path / "deaths").read_text(encoding="utf-8") == "1\n" * MOST_TRIES


class Deserting(Executor):
    """A pool that calls off what it was given, as Dask does when its scheduler is gone."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        del fn, args, kwargs
        future: Future[Any] = Future()
        threading.Timer(0.05, future.cancel).start()
        return future


def test_a_pool_that_goes_away_is_an_error_and_no_cancellation() -> None:
    with (
        Workers(Deserting, 1, tries=1) as pool,
        pytest.raises(WorkersLostError, match="the scheduler went away"),
    ):
        list(completed(pool, square, [1, 2]))


def test_what_who_asks_calls_off_is_cancelled() -> None:
    hold = threading.Event()
    with workers(1) as pool:
        first, second = pool.submit(hold.wait), pool.submit(square, 2)
        assert second.cancel()
        hold.set()
        assert first.result(SECONDS)
        assert second.cancelled()
    later = workers(1)
    began, waits = later.submit(slow, 2), later.submit(square, 2)
    later.shutdown(cancel_futures=True)
    assert began.result(SECONDS) == 4
    assert waits.cancelled()


INTERRUPTED = """
import signal, sys, time
from pathlib import Path
from dsis.workers import completed, workers

def slow(path):
    Path(path).touch()
    time.sleep(60)

if __name__ == "__main__":
    # What a shell starts in the background ignores interrupts, and its children inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with workers(2, kind="processes") as pool:
        list(completed(pool, slow, sys.argv[1:]))
"""


def test_an_interrupt_ends_all_processes_at_once_and_only_one_speaks(tmp_path: Path) -> None:
    script, marks = tmp_path / "script.py", [tmp_path / name for name in "ab"]
    script.write_text(INTERRUPTED, encoding="utf-8")
    command = [sys.executable, str(script), *map(str, marks)]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as program:
        end = time.monotonic() + SECONDS
        while not all(mark.exists() for mark in marks):
            assert time.monotonic() < end
            time.sleep(0.05)
        os.killpg(program.pid, signal.SIGINT)  # as a terminal does
        said = program.communicate(timeout=SECONDS / 2)[1]  # the work would take twice as long
    assert program.returncode
    assert said.count("Traceback") == said.count("KeyboardInterrupt") == 1


@pytest.mark.parametrize("address", ["nonsense", "", "http://there:1", "nonsense://there:1"])
def test_what_is_no_address_is_refused_at_once(
    address: str, capfd: pytest.CaptureFixture[str]
) -> None:
    distributed = pytest.importorskip("distributed")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(distributed, "Client", None)  # half a client waits 20 s for its end
        with pytest.raises(InputError, match=r"--scheduler.*no address of a Dask scheduler"):
            workers(scheduler=address)
    assert capfd.readouterr().err == ""


def test_a_scheduler_that_does_not_answer_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("dsis.workers.CONNECT_S", 0.5)  # of nobody is there nothing to wait for
    assert main(["stimuli", "demo.toml", "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "tcp://127.0.0.1:9: no Dask scheduler answers" in capsys.readouterr().err
