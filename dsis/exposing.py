"""A frame on its way through the links of a camera, and what links that cameras share made of it.

Links are effects in the order that light and charge meet them. Draws are counted: links that are
the same make the same of a frame, whatever comes behind them.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

from dsis.draw import Draw
from dsis.effects import Effect, Exposure, Image, ReadOut, Stage
from dsis.grid import PixelGrid


@dataclass(frozen=True)
class Begun:
    """What the first links of a chain made of a frame.

    Attributes
    ----------
    links
        How many.
    image
        What they made, DN above black.
    lit
        Whether some of them are behind the light.
    expected_dn
        As `Exposure` has it.
    """

    links: int
    image: Image
    lit: bool
    expected_dn: Image


@dataclass
class Shared:
    """What cameras whose chains begin alike have of one frame.

    Attributes
    ----------
    start
        What an earlier camera's first links, the same as this one's, made of the frame; None: it
        goes through all links.
    wanted
        Numbers of first links of which later cameras need what they made.
    found
        That, by their number; filled while the frame is made.
    """

    start: Begun | None = None
    wanted: Collection[int] = ()
    found: dict[int, Begun] = field(default_factory=dict)


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
        steps, read_out = drawn.steps, drawn.read_out
        first = shared or Shared()

        def after(links: int, back: int) -> Image:
            """Return what the first `links` links make of the frame `back` frames earlier."""
            light = self.earlier_clean(back) if back and self.earlier_clean else self.clean
            own = first if links == len(steps) and not back else Shared()
            begun = own.start or Begun(0, light, lit=False, expected_dn=light)
            image, lit, expected = begun.image, begun.lit, begun.expected_dn
            # Before the first frame the counter runs backwards: it has 32 bits.
            number = (self.frame - back) % 2**32
            for place in range(begun.links, links):
                link, temporal, sensor = steps[place]
                if not lit and link.stage > Stage.LIGHT:
                    lit, expected = True, image
                exposure = Exposure(
                    self.grid,
                    number,
                    temporal,
                    sensor,
                    expected,
                    read_out,
                    partial(before, place, back),
                    self.exposure_time_s,
                    self.threads,
                )
                image = link.apply(image, exposure)
                if place + 1 in own.wanted:
                    own.found[place + 1] = Begun(place + 1, image, lit, expected)
            return image

        def before(links: int, back: int, k: int) -> Image:
            return after(links, back + k)

        return after(len(steps), 0)


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
