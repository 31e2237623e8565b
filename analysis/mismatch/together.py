"""Simulated recordings of several cameras side by side: what their chains begin with is made once.

Cameras that are compared differ by an effect or a parameter, and have the same draws: the same link
makes the same of the same image. So frames of one exposure are made camera by camera, of what
earlier ones had in common, and then looked at: a dark, of which effects of the light make nothing,
once for all.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import takewhile
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.model import Model, simulated
from analysis.mismatch.observe import Kept, Observation, Shown, finished, observing
from dsis.camera import Camera
from dsis.effects import Image
from dsis.exposing import Shared, link_numbers

R = TypeVar("R")
_MOST_BYTES = 640 << 20  # in each process, of all cameras that are looked at together
_PIXEL_BYTES = 192  # a pixel: sums over frames and exposures, images that links made
_SAMPLE_BYTES = 4  # amplitudes of frames, where they are kept
_LARGEST_CODE = 65535
Work = tuple[Sequence[tuple[Model, frozenset[str]]], int]
"""Models, what of each is made (see `observe`), and the number of the replicate."""


def most_together(layout: Layout) -> int:
    """Return of how many cameras recordings may be simulated side by side."""
    pixels = layout.rows * layout.columns
    frames = [len(e.numbers) for e in layout.uniform]
    kept = _SAMPLE_BYTES * sum(frames) if layout.keeps_amplitudes else 0
    of_pixel = _PIXEL_BYTES + 2 * max(frames, default=0) + kept
    return max(_MOST_BYTES // (pixels * of_pixel), 1)


def simulated_together(
    layout: Layout, seed: int, tell: Callable[[Observation], R], which: Work
) -> list[R]:
    """Return what one simulated recording of each of some models tells; see `simulate`."""
    some, replicate = which
    found: dict[int, R] = {}
    for places in _alike([model for model, _ in some]):
        own = [some[place] for place in places]
        if len(own) > 1:
            seen = _side_by_side(layout, seed, own, replicate)
        else:
            seen = iter([simulated(layout, seed, (own[0][0], replicate, own[0][1]))])
        found.update(zip(places, map(tell, seen), strict=True))
    return [found[place] for place in range(len(some))]


def _side_by_side(
    layout: Layout, seed: int, some: Sequence[tuple[Model, frozenset[str]]], replicate: int
) -> Iterator[Observation]:
    """Return the observations of models of one light."""
    frames = _Frames([model for model, _ in some], layout, replicate, seed)
    # What is asked for as well is looked at once where frames are the same.
    seen: dict[tuple[int, frozenset[str]], Shown] = {}
    alike = list(range(len(some)))

    def looked(place: int, made: frozenset[str], look: Callable[[], Shown]) -> Shown:
        which = alike[place], made
        if which not in seen:
            seen[which] = look()
        frames.kept[place].clear()
        return seen[which]

    running = [
        observing(layout, own, None, Kept(places=False, made=made, looked=partial(looked, i, made)))
        for i, (own, (_, made)) in enumerate(zip(frames.of, some, strict=True))
    ]
    for exposure in layout.uniform:
        alike[:] = frames.take(exposure)
        seen.clear()
        for one in running:
            next(one)
    return map(finished, running)


def _alike(models: Sequence[Model]) -> list[list[int]]:
    """Return places of models of one light each, and of codes that frames can be kept as."""
    found: list[list[int]] = []
    for place, own in enumerate(models):
        same = (some for some in found if _may_share(models[some[0]], own))
        group = next(same, None)
        if group is None:
            found.append([place])
        else:
            group.append(place)
    return found


def _may_share(one: Model, other: Model) -> bool:
    lights = one.signals, other.signals
    return (
        max(one.camera.white_level, other.camera.white_level) <= _LARGEST_CODE
        and lights[0].keys() == lights[1].keys()
        and all(np.array_equal(lights[0][name], own) for name, own in lights[1].items())
    )


class _Frames:
    """Codes of one exposure's frames, of each model; scenes are made when they are asked for."""

    def __init__(self, models: Sequence[Model], layout: Layout, replicate: int, seed: int) -> None:
        cameras = [model.camera for model in models]
        self.shots = [model.shots(layout, replicate, seed) for model in models]
        read_outs = [
            next(i for i, other in enumerate(cameras) if _read_out_alike(other, camera))
            for camera in cameras
        ]
        self.links = link_numbers([camera.chain() for camera in cameras], read_outs)
        self.again = [
            frozenset(number for own in self.links[place + 1 :] for number in own)
            for place in range(len(models))
        ]
        self.kept: list[list[NDArray[np.uint16]]] = [[] for _ in models]
        alone = [model.frames(layout, replicate, seed) for model in models]
        scenes = layout.scenes

        def of(place: int, name: str) -> Iterator[NDArray[np.generic]]:
            if name in scenes:
                yield from alone[place](name)
            while self.kept[place]:
                yield self.kept[place].pop(0)

        self.of = [lambda name, place=place: of(place, name) for place in range(len(models))]

    def take(self, exposure: Taken) -> list[int]:
        """Make the frames of an exposure; return for each model the first that has the same."""
        ends: list[tuple[int, ...]] = [() for _ in self.shots]
        for number in exposure.numbers:
            made: dict[tuple[int, int, int], tuple[int, Image]] = {}
            for place, shot in enumerate(self.shots):
                shared = Shared(self.links[place], self.again[place], made)
                codes = shot(exposure.name, number, shared)
                self.kept[place].append(codes.astype(np.uint16))
                (end,) = shared.ended
                ends[place] += (end if end >= 0 else -1 - place,)
        return [ends.index(own) for own in ends]


def shared_links(one: Camera, other: Camera) -> int:
    """Return with how many of the same links two cameras begin; the last is each camera's own."""
    if not _read_out_alike(one, other):
        return 0
    chains = one.chain(), other.chain()
    alike = takewhile(lambda pair: pair[0] == pair[1], zip(*chains, strict=False))
    return min(sum(1 for _ in alike), len(chains[1]) - 1)


def _read_out_alike(one: Camera, other: Camera) -> bool:
    """Return whether effects know the same of two cameras: see `ReadOut`."""
    known = ("cfa", "noise", "black_level", "white_level")
    return all(getattr(one, name) == getattr(other, name) for name in known)
