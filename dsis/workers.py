"""Who does the work: threads, processes, or a Dask cluster, behind one `Executor`.

What is handed out must be a function of its arguments alone: then the bytes are the same on all,
and work whose worker died is simply done again.
"""

import importlib
import logging
import multiprocessing
import platform
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from threading import Lock
from typing import Any, Literal, TypeVar, cast

from dsis.blas import one_thread
from dsis.errors import DsisError, Fault, InputError
from dsis.freed import keep_freed

T = TypeVar("T")
R = TypeVar("R")

MOST_TRIES = 3
CONNECT_S = 10
PAUSE_S = 0.2
_SAME_ON_ALL = ("dsis", "numpy", "scipy", "numba", "llvmlite", "opencolorio", "openimageio")


class WorkersLostError(DsisError):
    """Workers died again and again, or a cluster went away, before the work was done."""


@dataclass
class _Order:
    """A call that somebody waits for."""

    call: Callable[[], Any]
    promised: Future[Any] = field(default_factory=Future)
    tries: int = 0


class Workers(Executor):
    """An executor that does again what a dying worker left undone; see `workers`.

    Parameters
    ----------
    start
        Starts a pool; called again when the pool is broken.
    count
        How many calls run at once.
    lost
        What a pool raises for calls whose worker is gone for good.
    tries
        How often a call is handed out before `WorkersLostError`.
    apart
        Whether calls run outside this process: they and their results are pickled.
    """

    def __init__(
        self,
        start: Callable[[], Executor],
        count: int,
        lost: tuple[type[BaseException], ...] = (BrokenExecutor,),
        tries: int = MOST_TRIES,
        *,
        apart: bool = True,
    ) -> None:
        self.count, self.apart = count, apart
        self._start, self._lost, self._tries = start, lost, tries
        self._pool, self._lock = start(), Lock()

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Hand out a call; its future holds the result, or what the call raised."""
        order = _Order(partial(fn, *args, **kwargs))
        self._hand_out(order)
        return order.promised

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers, see `concurrent.futures.Executor.shutdown`."""
        self._tries = 0
        self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)

    def _hand_out(self, order: _Order) -> None:
        order.tries += 1
        pool = self._pool
        try:
            running = pool.submit(order.call)
        except self._lost as reason:
            self._lost_worker(order, pool, reason)
            return
        running.add_done_callback(partial(self._done, order, pool))
        order.promised.add_done_callback(partial(_cancel_too, running))

    def _done(self, order: _Order, pool: Executor, running: Future[Any]) -> None:
        """Keep the promise with what came back, or hand the call out again."""
        if running.cancelled() and self._tries and not order.promised.cancelled():
            self._lost_worker(order, pool, CancelledError("nobody here called it off"))
            return
        if running.cancelled():
            order.promised.cancel()
            order.promised.set_running_or_notify_cancel()
            return
        failed = running.exception()
        if isinstance(failed, self._lost):
            self._lost_worker(order, pool, failed)
        elif not order.promised.set_running_or_notify_cancel():
            return
        elif failed is not None:
            order.promised.set_exception(failed)
        else:
            order.promised.set_result(running.result())

    def _lost_worker(self, order: _Order, pool: Executor, reason: BaseException) -> None:
        if order.tries < self._tries:
            time.sleep(PAUSE_S)  # Ctrl-C ends processes, too: then the call is called off by now
        if order.tries < self._tries and not order.promised.cancelled():
            with self._lock:
                if self._pool is pool:  # the first of its calls to notice
                    self._pool = self._start()
            self._hand_out(order)
        elif order.promised.set_running_or_notify_cancel():
            fact = "a worker died each time it was given this work (killed, or out of memory?)"
            if isinstance(reason, CancelledError):
                fact = "the scheduler went away before this work was done (ended, out of reach?)"
            error = WorkersLostError(f"{fact}: {reason}")
            error.__cause__ = reason
            order.promised.set_exception(error)


def _cancel_too(running: Future[Any], promised: Future[Any]) -> None:
    if promised.cancelled():
        running.cancel()


def workers(
    jobs: int = 1,
    kind: Literal["threads", "processes"] = "threads",
    scheduler: str | None = None,
) -> Workers:
    """Return an executor, to be used in a `with` statement.

    Parameters
    ----------
    jobs
        How many threads or processes; a cluster has as many as it has.
    kind
        Processes are started afresh: the calling program needs its `__main__` guard, and calls
        and results must be picklable.
    scheduler
        Address of a Dask scheduler, `tcp://host:8786`; calls and results travel there and back.

    Raises
    ------
    InputError
        No scheduler answers there, it has no workers, they hold other versions, or Dask is absent.
    """
    if scheduler is not None:
        return _cluster(scheduler)
    count = max(1, jobs)
    if kind == "threads":
        return Workers(partial(ThreadPoolExecutor, count), count, apart=False)
    # A fork would copy locks that other threads hold.
    afresh = multiprocessing.get_context("spawn")
    start = partial(ProcessPoolExecutor, count, mp_context=afresh, initializer=_begin)
    return Workers(start, count)


def _begin() -> None:
    """Make a process ready.

    Ctrl-C ends it without a word: who handed out its work says that it was interrupted.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    keep_freed()
    one_thread()


def completed(pool: Workers, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R]]:
    """Yield (item, work(item)) in the order of completion, few items ahead of the caller.

    So results do not pile up in memory. When the caller leaves or a call fails, no more is begun.
    """
    running: dict[Future[R], T] = {}
    try:
        for item in items:
            running[pool.submit(work, item)] = item
            if len(running) >= 2 * pool.count:
                yield from _taken(running)
        while running:
            yield from _taken(running)
    finally:
        for future in running:
            future.cancel()


def _taken(running: dict[Future[R], T]) -> list[tuple[T, R]]:
    """Take what is finished, one call at least, off the calls that run."""
    finished = wait(running, return_when=FIRST_COMPLETED).done
    return [(running.pop(future), future.result()) for future in finished]


def _cluster(address: str) -> Workers:
    """Return an executor on a Dask cluster, which itself hands out again what a worker lost."""
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        fact = "Dask is not installed: pip install 'dsis[cluster]'"
        raise InputError.of("--scheduler", address, fact) from None
    # What it would say of a lost connection, call by call, is raised as `WorkersLostError`.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        distributed.comm.resolve_address(address)  # a client that cannot waits 20 s for nobody
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except ValueError as error:
        fact = f"is no address of a Dask scheduler, such as tcp://host:8786 ({error})"
        raise InputError.of("--scheduler", address, fact) from None
    except OSError as error:
        fact = f"no Dask scheduler answers there within {CONNECT_S} s ({error})"
        raise InputError.of("--scheduler", address, fact) from None
    try:
        _refuse_unlike(address, client.run(versions))
    except InputError:
        client.close()
        raise
    lost = (distributed.KilledWorker, distributed.client.FutureCancelledError)
    pool = _Cluster(client)
    return Workers(lambda: pool, sum(client.nthreads().values()), lost, tries=1)


class _Cluster(Executor):
    """Dask's executor, and its connection, which ends with it."""

    def __init__(self, client: Any) -> None:
        self._client, self._pool = client, client.get_executor(pure=False)

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        return cast("Future[R]", self._pool.submit(fn, *args, **kwargs))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._pool.shutdown(wait=wait and not cancel_futures)  # else it cancels
        self._client.close()


def versions() -> dict[str, str]:
    """Return what the bytes of a result may depend on: processor family and versions."""
    return {"processor": platform.machine()} | {name: version(name) for name in _SAME_ON_ALL}


def _refuse_unlike(address: str, found: dict[str, dict[str, str]]) -> None:
    """Refuse a cluster whose workers might give other bytes than this process, or that has none."""
    here = versions()
    facts = [] if found else ["must have workers: none has joined it"]
    facts += [
        f"worker {worker} has {name} {theirs[name]}, must have {own} as here"
        for worker, theirs in found.items()
        for name, own in here.items()
        if theirs[name] != own
    ]
    if facts:
        raise InputError(Fault("--scheduler", address, fact) for fact in facts)
