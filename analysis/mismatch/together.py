"""Simulated recordings of several cameras side by side: what their chains begin with is made once.

Cameras that are compared differ by an effect or a parameter, and have the same draws: up to the
first link that is another, a frame of one is a frame of the other. So frames of one exposure are
made camera by camera, each from where it parts from an earlier one, and then looked at.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import takewhile
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.model import Model, simulated
from analysis.mismatch.observe import Kept, Observation, finished, observing
from dsis.camera import Camera
from dsis.exposing import Begun, Shared

R = TypeVar("R")
_MOST_BYTES = 256 << 20  # in each process, of all cameras that are looked at together
_PIXEL_BYTES = 128  # sums over frames and exposures that a camera takes for each pixel
_LARGEST_CODE = 65535
Work = tuple[Sequence[tuple[Model, frozenset[str]]], int]
"""Models, what of each is made (see `observe`), and the number of the replicate."""


def most_together(layout: Layout) -> int:
    """Return of how many cameras recordings may be simulated side by side."""
    pixels = layout.rows * layout.columns
    frames = max((len(e.numbers) for e in layout.uniform), default=0)
    return max(_MOST_BYTES // (pixels * (_PIXEL_BYTES + 2 * frames)), 1)


def simulated_together(
    layout: Layout, seed: int, tell: Callable[[Observation], R], which: Work
) -> list[R]:
    """Return what one simulated recording of each of some models tells; see `simulate`."""
    some, replicate = which
    models = [model for model, _ in some]
    if len(models) < 2 or not _alike(models):
        return [tell(simulated(layout, seed, (model, replicate, made))) for model, made in some]
    frames = _Frames(models, layout, replicate, seed)
    running = [
        observing(layout, own, None, Kept(places=False, made=made))
        for own, (_, made) in zip(frames.of, some, strict=True)
    ]
    for exposure in layout.uniform:
        frames.take(exposure)
        for one in running:
            next(one)
    return [tell(finished(one)) for one in running]


def _alike(models: Sequence[Model]) -> bool:
    """Return whether models have one light, and codes that frames can be kept as."""
    first, *others = models
    lights = (
        own.signals.keys() == first.signals.keys()
        and all(np.array_equal(own.signals[name], light) for name, light in first.signals.items())
        for own in others
    )
    return all(lights) and all(own.camera.white_level <= _LARGEST_CODE for own in models)


class _Frames:
    """Codes of one exposure's frames, of each model; scenes are made when they are asked for."""

    def __init__(self, models: Sequence[Model], layout: Layout, replicate: int, seed: int) -> None:
        self.shots = [model.shots(layout, replicate, seed) for model in models]
        self.starts = shared_links([model.camera for model in models])
        self.kept: list[list[NDArray[np.uint16]]] = [[] for _ in models]
        alone = [model.frames(layout, replicate, seed) for model in models]
        scenes = layout.scenes

        def of(place: int, name: str) -> Iterator[NDArray[np.generic]]:
            if name in scenes:
                yield from alone[place](name)
            while self.kept[place]:
                yield self.kept[place].pop(0)

        self.of = [lambda name, place=place: of(place, name) for place in range(len(models))]

    def take(self, exposure: Taken) -> None:
        """Make the frames of an exposure."""
        wanted = [
            {links for earlier, links in self.starts if earlier == place}
            for place in range(len(self.shots))
        ]
        for number in exposure.numbers:
            made: list[dict[int, Begun]] = []
            for place, (shot, (earlier, links)) in enumerate(
                zip(self.shots, self.starts, strict=True)
            ):
                start = made[earlier][links] if links else None
                shared = Shared(start, wanted[place])
                codes = shot(exposure.name, number, shared)
                made.append(shared.found)
                self.kept[place].append(codes.astype(np.uint16))


def shared_links(cameras: Sequence[Camera]) -> list[tuple[int, int]]:
    """Return for each camera the earlier one that begins most alike, and with how many links.

    No links: it begins like none. The last link is each camera's own.
    """
    chains = [camera.chain() for camera in cameras]
    found = []
    for place, (camera, chain) in enumerate(zip(cameras, chains, strict=True)):
        alike = [
            sum(
                1
                for _ in takewhile(lambda pair: pair[0] == pair[1], zip(chain, other, strict=False))
            )
            if _read_out_alike(camera, cameras[i])
            else 0
            for i, other in enumerate(chains[:place])
        ]
        most = max(alike, default=0)
        found.append((alike.index(most) if most else 0, min(most, len(chain) - 1)))
    return found


def _read_out_alike(one: Camera, other: Camera) -> bool:
    """Return whether effects know the same of two cameras: see `ReadOut`."""
    known = ("cfa", "noise", "black_level", "white_level")
    return all(getattr(one, name) == getattr(other, name) for name in known)
