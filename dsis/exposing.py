"""A frame on its way through the links of a camera, and what links that cameras share made of it.

Links are effects in the order that light and charge meet them. Draws are counted: links that are
the same make the same of a frame, whatever comes behind them.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from dsis.draw import Draw
from dsis.effects import Effect, Exposure, Image, ReadOut, Stage
from dsis.grid import PixelGrid


@dataclass(frozen=True)
class Shared:
    """What links made of one frame, for cameras that have links in common.

    Images are numbered from the clean one, 0, on. A link that leaves an image as it is, as one of
    the light does with a dark, makes no new one: what the next link makes of it is known as well.

    Attributes
    ----------
    numbers
        Of the camera's links: the same number is the same link, with the same fields and read-out;
        see `link_numbers`.
    again
        Which of these other cameras have, that come later.
    made
        The image a link made, and its number, by the number of the link, of the image that it had,
        and of that which light alone makes; filled while the frame is made.
    ended
        The number of the last image, alone; -1 of one that no other camera has.
    """

    numbers: Sequence[int]
    again: Collection[int]
    made: dict[tuple[int, int, int], tuple[int, Image]]
    ended: list[int] = field(default_factory=list)


def link_numbers(chains: Sequence[Sequence[Effect]], read_outs: Sequence[int]) -> list[list[int]]:
    """Return a number for each link of some chains: the same where it makes the same of an image.

    `read_outs` are numbers of what each camera's effects know of it. A second link of one kind has
    fields of its own; one that remembers earlier frames hangs on all links before it, one that asks
    for the expected signal as it arrives on those that respond.
    """
    known: dict[Any, list[tuple[Any, int]]] = {}
    found = []
    total = 0
    for chain, read_out in zip(chains, read_outs, strict=True):
        seen: dict[str, int] = {}
        numbers: list[int] = []
        for link in chain:
            count = seen[link.kind] = seen.get(link.kind, 0) + 1
            before = tuple(numbers) if link.looks_back else ()
            if link.asks_what_arrives:
                before += tuple(n for n, own in zip(numbers, chain, strict=False) if own.responds)
            same = known.setdefault((link.kind, count, read_out, before), [])
            number = next((own for other, own in same if other == link), None)
            if number is None:
                number = total = total + 1
                same.append((link, number))
            numbers.append(number)
        found.append(numbers)
    return found


@dataclass(frozen=True)
class Drawn:
    """Links of a camera with the random fields of an exposure: the same in all its frames.

    Attributes
    ----------
    steps
        Each link, what it draws anew for every frame, and what it draws once for the sensor.
    read_out
        As `Exposure` has it.
    """

    steps: tuple[tuple[Effect, Draw, Draw], ...]
    read_out: ReadOut

    @classmethod
    def of(
        cls, links: Sequence[Effect], read_out: ReadOut, temporal: Draw, sensor: Draw
    ) -> "Drawn":
        """Return links with their fields: a second effect of one kind has fields of its own."""
        return cls(tuple(_drawn(links, temporal, sensor)), read_out)


@dataclass(frozen=True)
class Shutter:
    """One frame that is exposed: see `dsis.camera.Camera.expose`."""

    clean: Image
    frame: int
    grid: PixelGrid
    exposure_time_s: float
    earlier_clean: Callable[[int], Image] | None = None
    threads: int = 1

    def through(self, drawn: Drawn, shared: Shared | None = None) -> Image:
        """Return what links make of the frame; `shared` where other cameras make it too."""
        if shared is None:
            return self._after(drawn, len(drawn.steps), 0)
        image, lit, expected = self.clean, False, self.clean
        number, of_light, common = 0, 0, True
        for place, link_number in enumerate(shared.numbers):
            link = drawn.steps[place][0]
            if not lit and link.stage > Stage.LIGHT:
                lit, expected, of_light = True, image, number
            asked = link_number, number, of_light
            known = shared.made.get(asked) if common else None
            if known is None:
                made = link.apply(image, self._exposure(drawn, place, 0, expected))
                if _same(made, image):
                    known = number, image
                else:  # what no other camera has behind it is kept no longer
                    common &= link_number in shared.again
                    known = len(shared.made) + 1, made
                if common:
                    shared.made[asked] = known
            number, image = known
        shared.ended.append(number if common else -1)
        return image

    def _after(self, drawn: Drawn, links: int, back: int) -> Image:
        """Return what the first `links` links make of the frame `back` frames earlier."""
        image = self.earlier_clean(back) if back and self.earlier_clean else self.clean
        lit, expected = False, image
        for place in range(links):
            link = drawn.steps[place][0]
            if not lit and link.stage > Stage.LIGHT:
                lit, expected = True, image
            image = link.apply(image, self._exposure(drawn, place, back, expected))
        return image

    def _exposure(self, drawn: Drawn, place: int, back: int, expected: Image) -> Exposure:
        """Return what the link at a place may know of the frame `back` frames earlier."""
        _, temporal, sensor = drawn.steps[place]
        # Before the first frame the counter runs backwards: it has 32 bits.
        number = (self.frame - back) % 2**32
        earlier = partial(self._before, drawn, place, back)
        arriving = partial(self._arriving, drawn, place, back, expected)
        known = (expected, drawn.read_out, earlier, self.exposure_time_s, self.threads, arriving)
        return Exposure(self.grid, number, temporal, sensor, *known)

    def _arriving(self, drawn: Drawn, links: int, back: int, expected: Image) -> Image:
        """Return what those of the first links that respond make of the expected signal."""
        image = expected
        for place in range(links):
            link = drawn.steps[place][0]
            if link.responds:
                image = link.apply(image, self._exposure(drawn, place, back, expected))
        return image

    def _before(self, drawn: Drawn, links: int, back: int, k: int) -> Image:
        return self._after(drawn, links, back + k)


def _same(made: Image, image: Image) -> bool:
    """Return whether a link left an image as it is; most differ in their first row."""
    return np.array_equal(made[0], image[0]) and np.array_equal(made, image)


def _drawn(
    chain: Sequence[Effect], temporal: Draw, sensor: Draw
) -> Iterator[tuple[Effect, Draw, Draw]]:
    """Yield each link with its random fields."""
    seen: dict[str, int] = {}
    for link in chain:
        kind = link.kind
        count = seen[kind] = seen.get(kind, 0) + 1
        if count == 1:
            yield link, temporal, sensor
        else:
            yield link, temporal.within(f"{kind} {count}"), sensor.within(f"{kind} {count}")
