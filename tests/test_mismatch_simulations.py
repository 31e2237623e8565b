"""Simulations that are made ahead, side by side: the same as one by one, and each made once."""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import analysis.mismatch.simulations as module
from analysis.mismatch import model
from analysis.mismatch.model import Model, apart, both, each, in_turn, processes
from analysis.mismatch.simulations import Simulations
from dsis.cfa import Cfa
from dsis.workers import Workers, workers
from mismatch_recordings import camera

CAMERAS = [camera(black=64.0 + i) for i in range(3)]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, int]]:
    """Return what was simulated: the camera's black level, and the replicate."""
    found: list[tuple[float, int]] = []

    def simulate(
        model: Any, _layout: Any, replicates: Any, _seed: int, _jobs: int, tell: Any, _made: Any
    ) -> list[Any]:
        found.extend((model.camera.black_level, number) for number in replicates)
        return [tell((model.camera.black_level, number)) for number in replicates]

    def simulated(layout: Any, seed: int, tell: Any, which: tuple[Any, int]) -> Any:
        return [
            simulate(model, layout, [which[1]], seed, 1, tell, made)[0] for model, made in which[0]
        ]

    monkeypatch.setattr(module, "simulate", simulate)
    monkeypatch.setattr(module, "simulated_together", simulated)
    return found


def simulations(jobs: int) -> Simulations:
    layout: Any = SimpleNamespace(
        cfa=Cfa.MONO, rows=4, columns=6, uniform=(), keeps_amplitudes=False
    )
    return Simulations(layout, Model(CAMERAS[0], {}), np.array, 1, jobs)


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_what_is_made_ahead_is_what_would_be_made(jobs: int, made: list[tuple[float, int]]) -> None:
    own = simulations(jobs)
    own.of(CAMERAS[1], 1)
    own.ready([*CAMERAS, CAMERAS[0]], 2)
    assert len(made) == 6
    for one in CAMERAS:
        expected = [[one.black_level, number] for number in range(2)]
        np.testing.assert_array_equal(own.of(one, 2), expected)
    assert sorted(made) == [(one.black_level, number) for one in CAMERAS for number in range(2)]


def test_a_single_one_is_left_to_who_asks(made: list[tuple[float, int]]) -> None:
    own = simulations(2)
    own.ready(CAMERAS[:1], 1)
    assert not made


@pytest.fixture(scope="module")
def pool() -> Iterator[Workers]:
    with workers(2, kind="processes") as two:
        yield two


@pytest.fixture
def at_hand(pool: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let processes that are asked for be two that several tests use: to start takes seconds."""
    monkeypatch.setattr(model, "workers", lambda *_, **__: nullcontext(pool))


def _twice(offset: int, item: int) -> tuple[int, int]:
    return os.getpid(), offset + 2 * item


def test_processes_give_the_results_in_order_and_only_where_they_are_asked_for() -> None:
    work = partial(_twice, 5)
    with processes(2):
        beside = each(work, range(6), 2)
        alone = each(work, [3], 2)
    after = each(work, range(6), 2)
    assert [value for _, value in beside] == [5, 7, 9, 11, 13, 15]
    assert os.getpid() not in {own for own, _ in beside}
    assert alone == [(os.getpid(), 11)]
    assert after == [(os.getpid(), value) for _, value in beside]


def _thread(_item: int) -> tuple[int, int]:
    return os.getpid(), threading.get_ident()


@pytest.mark.usefixtures("at_hand")
def test_what_threads_must_not_do_is_done_by_processes_or_in_turn() -> None:
    with processes(2), processes(3):  # the outer ones
        beside = {own for own, _ in apart(_thread, range(4))}
    assert os.getpid() not in beside
    assert len(beside) <= 2
    assert set(apart(_thread, range(4))) == {_thread(0)}


def _failing(item: int) -> float:
    if item == 0:
        raise ValueError(item)
    time.sleep(0.2)
    return time.monotonic()


@pytest.mark.usefixtures("at_hand")
def test_a_failure_calls_off_what_was_not_begun() -> None:
    with processes(2):
        each(_failing, [1, 2], 2)
        begun = time.monotonic()
        with pytest.raises(ValueError, match="0"):
            each(_failing, range(40), 2)
    assert time.monotonic() - begun < 0.2 * 40 / 2


def test_one_job_starts_no_process() -> None:
    with processes(1):
        assert each(partial(_twice, 0), range(3), 2) == [(os.getpid(), 2 * i) for i in range(3)]


@pytest.mark.usefixtures("at_hand")
def test_results_come_one_by_one() -> None:
    with processes(2):
        assert next(iter(in_turn(_failing, [1, 0], 2))) > 0


@pytest.mark.usefixtures("at_hand")
def test_two_calls_beside_one_another_may_ask_for_processes() -> None:
    work = partial(_twice, 1)
    with processes(2):
        made, here = both(partial(each, work, [1], 2), os.getpid, 2)
    assert made[0][0] != here == os.getpid()
    assert made[0][1] == 3
    assert both(partial(each, work, [1], 2), os.getpid, 1) == ([(here, 3)], here)
