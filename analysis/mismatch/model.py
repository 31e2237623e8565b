"""The model of a recording: a camera, and the clean signal of every exposure.

Simulations of it are made in memory, frame numbers as recorded. Draws are counted, so two models
share their noise: the difference that an effect makes is known far better than either.
"""

import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.observe import Observation, observe
from analysis.mismatch.scenes import without_picture
from analysis.mismatch.touches import ALL_SUMS
from dsis.camera import Camera
from dsis.conversion import codes_of
from dsis.draw import Draw, keep_fields
from dsis.effects import Image
from dsis.effects.pink_noise import keep_series
from dsis.exposing import Drawn, Shared, Shutter
from dsis.simulate.shot import tiled
from dsis.workers import Workers, workers

Sites = NDArray[np.float64]
Shots = Callable[[str, int, Shared | None], Image]
T = TypeVar("T")
R = TypeVar("R")
_KEPT_BYTES = 400 << 20  # of pink noise, in each process: 300 frames of VGA
_FIELDS_BYTES = 256 << 20  # of shot and read noise: cheaper to make
_pool: ContextVar[Workers | None] = ContextVar("pool", default=None)
_alone: ContextVar[bool] = ContextVar("alone", default=True)


@dataclass(frozen=True)
class Model:
    """A camera model, and the light of each exposure.

    Attributes
    ----------
    camera
        The camera.
    signals
        Clean signal of each flat and dark before all effects, DN above black, for rows 0, 1 and
        columns 0, 1: (2, 2). Of a scene, for every pixel: (row, column).
    """

    camera: Camera
    signals: Mapping[str, Sites]

    def with_camera(self, camera: Camera) -> "Model":
        """Return the model with another camera."""
        return replace(self, camera=camera)

    def frames(self, layout: Layout, replicate: int, seed: int) -> Callable[[str], Iterator[Image]]:
        """Return what gives the codes of an exposure's frames: float32 (row, column), DN."""
        shot = self.shots(layout, replicate, seed)
        numbers = {e.name: e.numbers for e in layout.exposures}

        def of(name: str) -> Iterator[Image]:
            for number in numbers[name]:
                yield shot(name, number, None)

        return of

    def shots(self, layout: Layout, replicate: int, seed: int) -> Shots:
        """Return what gives the codes of a frame by the name of its exposure and its number.

        Last comes what the frame has in common with other cameras': see `Shared`.
        """
        keep_series(_KEPT_BYTES)
        keep_fields(_FIELDS_BYTES)
        grid = layout.grid
        sensor = Draw(seed).within("sensor", str(replicate))
        times = {e.name: e.exposure_time_s for e in layout.exposures}
        black = self.camera.black_level
        lit: dict[str, tuple[Drawn, Image]] = {}

        def light(name: str) -> tuple[Drawn, Image]:
            picture, signal = name in layout.scenes, self.signals[name]
            camera = without_picture(self.camera) if picture else self.camera
            beyond = [(0, lines) for lines in layout.unseen]
            clean = (
                np.pad(signal.astype(np.float32), beyond, mode="reflect")  # of the same colours
                if picture
                else tiled(signal, grid)
            )
            temporal = Draw(seed).within("exposure", name, str(replicate))
            return camera.drawn(temporal, sensor), clean

        def shot(name: str, number: int, shared: Shared | None) -> Image:
            own = lit.get(name)  # threads may ask for frames of other exposures meanwhile
            if own is None:
                own = light(name)
                lit.clear()
                lit[name] = own
            drawn, clean = own
            image = Shutter(clean, number, grid, times[name]).through(drawn, shared)
            return layout.seen(codes_of(image, black))

        return shot


def simulate(
    model: Model,
    layout: Layout,
    replicates: Sequence[int],
    seed: int,
    jobs: int,
    tell: Callable[[Observation], R],
    made: frozenset[str] = ALL_SUMS,
) -> Iterator[R]:
    """Yield what observations of simulated recordings tell, one for each replicate number.

    Whoever simulates tells: an observation is large, and what is told of it takes time. `made` as
    of `observe`. Of a single one exposures are made, and looked at, side by side.
    """
    threads = jobs if len(replicates) == 1 and _alone.get() else 1
    work = partial(_told, layout, seed, tell, threads)
    return in_turn(work, [(model, one, made) for one in replicates], jobs)


def _told(
    layout: Layout,
    seed: int,
    tell: Callable[[Observation], R],
    threads: int,
    which: tuple[Model, int, frozenset[str]],
) -> R:
    return tell(simulated(layout, seed, which, threads))


def simulated(
    layout: Layout, seed: int, which: tuple[Model, int, frozenset[str]], threads: int = 1
) -> Observation:
    """Return the observation of one simulated recording, of a model and replicate number.

    Last what of it is made: see `observe`.
    """
    model, replicate, made = which
    frames = model.frames(layout, replicate, seed)
    return observe(layout, frames, places=False, made=made, threads=threads)


@contextmanager
def processes(jobs: int) -> Iterator[None]:
    """Let `each` use so many processes; with one job there are none, nor where none may start.

    Within such a context there are those of the outer one.
    """
    if jobs <= 1 or _pool.get() is not None or multiprocessing.current_process().daemon:
        yield
        return
    with workers(jobs, kind="processes") as pool:
        for _ in range(jobs):  # they start, and import, while the recording is read
            pool.submit(_started)
        token = _pool.set(pool)
        try:
            yield
        finally:
            _pool.reset(token)


def _started() -> None:
    """Do nothing: whoever is asked to has imported all this by then."""


def each(work: Callable[[T], R], items: Sequence[T], jobs: int) -> list[R]:
    """Return `work` of each item, in order, by the processes there are, else by threads.

    A frame is small work: threads would wait for one another's Python. Work, items and results are
    pickled.
    """
    return list(in_turn(work, items, jobs))


def in_turn(work: Callable[[T], R], items: Sequence[T], jobs: int) -> Iterator[R]:
    """Yield what `each` returns, one by one as soon as it is there."""
    pool = _pool.get()
    if pool is None or jobs <= 1 or (len(items) < 2 and _alone.get()):
        yield from in_threads(work, items, jobs)
        return
    running = [pool.submit(work, item) for item in items]
    try:
        for one in running:
            yield one.result()
    finally:
        for one in running:
            one.cancel()


def apart(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Return `work` of each item, in order, by the processes there are, else one by one.

    For what threads must not do at once.
    """
    pool = _pool.get()
    return [work(item) for item in items] if pool is None else each(work, items, pool.count)


def side_by_side(work: Callable[[T], R], items: Sequence[T], jobs: int) -> list[R]:
    """Return `work` of each item, in order: work that mostly waits for `each`, by threads.

    Each item's single simulations go to a process; without processes items follow one another.
    """
    if _pool.get() is None or jobs <= 1 or len(items) < 2:
        return [work(item) for item in items]

    def beside_others(item: T) -> R:
        _alone.set(False)
        return work(item)

    with ThreadPoolExecutor(jobs) as threads:
        running = [threads.submit(copy_context().run, beside_others, item) for item in items]
        try:
            return [one.result() for one in running]
        finally:
            for one in running:
                one.cancel()


def both(one: Callable[[], T], other: Callable[[], R], jobs: int) -> tuple[T, R]:
    """Return what two calls return, made side by side: see `side_by_side`."""
    calls: list[Callable[[], Any]] = [one, other]
    first, second = side_by_side(_called, calls, jobs)
    return first, second


def _called(call: Callable[[], R]) -> R:
    return call()


def in_threads(work: Callable[[T], R], items: Sequence[T], jobs: int) -> list[R]:
    """Return `work` of each item, in order, by so many threads."""
    if jobs <= 1 or len(items) < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(work, items))
