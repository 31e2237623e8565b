"""Promise: work is done whoever does it: same bytes, and again where a worker died."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import pytest

from dsis.cli import main
from dsis.errors import InputError
from dsis.workers import MOST_TRIES, Workers, WorkersLostError, completed, workers

SECONDS = 60.0  # in which processes must start, however busy the machine is


def square(x: int) -> int:
    return x * x


def fails(x: int) -> int:
    message = f"no {x}"
    raise ValueError(message)


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


def test_a_scheduler_that_does_not_answer_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("dsis.workers.CONNECT_S", 0.5)  # of nobody is there nothing to wait for
    with pytest.raises(InputError, match=r"--scheduler.*no Dask scheduler answers"):
        workers(scheduler="nonsense://")
    assert main(["stimuli", "demo.toml", "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "tcp://127.0.0.1:9: no Dask scheduler answers" in capsys.readouterr().err
