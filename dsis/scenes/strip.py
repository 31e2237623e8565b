"""What is asked of a renderer: a scene, a seed, a size and how finely light is sampled."""

from dataclasses import dataclass, replace
from typing import Final, Self

from dsis.errors import Fault, InputError

SCENES: Final = ("city", "landscape")
FEWEST_ROWS: Final = 32
SAMPLES: Final = 4
AMBIENT: Final = 4


@dataclass(frozen=True)
class Strip:
    """A panorama on a cylinder, as it is asked for.

    Attributes
    ----------
    scene
        One of `SCENES`.
    seed
        Not negative; another seed is another place.
    rows, columns
        Size in pixels; column 0 is the left end. What is seen scales with `rows`; more columns show
        more of the same.
    samples
        Points per pixel, the same in every pixel.
    ambient
        Directions of sky light per point.
    """

    scene: str
    seed: int
    rows: int
    columns: int
    samples: int = SAMPLES
    ambient: int = AMBIENT

    def __str__(self) -> str:
        place = f"{self.scene}, seed {self.seed}, {self.columns}x{self.rows}"
        return f"{place}, {self.samples} samples, {self.ambient} sky directions"

    @property
    def pixels(self) -> int:
        """Rows times columns."""
        return self.rows * self.columns

    def covers(self, other: "Strip") -> bool:
        """Tell whether the first columns of this strip are the other."""
        return self.columns >= other.columns and replace(self, columns=other.columns) == other

    def faults(self) -> list[Fault]:
        """Return everything that is out of range."""
        known = self.scene in SCENES
        facts = {
            "scene": None if known else f"is {self.scene!r}, must be one of: {', '.join(SCENES)}",
            "scene_seed": _from(self.seed, 0),
            "rows": _from(self.rows, FEWEST_ROWS),
            "columns": _from(self.columns, 1),
            "samples": _from(self.samples, 1),
            "ambient": _from(self.ambient, 1),
        }
        return [Fault("", key, fact) for key, fact in facts.items() if fact]

    def checked(self) -> Self:
        """Return this; raise `InputError` where there are faults."""
        faults = self.faults()
        if faults:
            raise InputError(faults)
        return self


def _from(value: int, least: int) -> str | None:
    return None if value >= least else f"is {value}, must be {least} or more"
