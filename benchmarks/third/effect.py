"""What a hidden effect is: a pattern drawn for a camera, its z at a size, and what it does."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np

from third.camera import Array, Exposure
from third.cells import Bench


class Effect(ABC):
    """An effect on its way into a recording: drawn, then given a size, then made ready.

    The chain calls every step of every effect; a step that an effect has no part in hands on what
    it was given. Images are stacks (frame, row, column) in DN above black.

    Attributes
    ----------
    kind
        Its name, as in docs/effects.md where it is listed.
    group
        Effects of one group cannot be told apart in one recording.
    order
        Place among the effects of a recording: earlier ones hide later ones.
    least, most
        Bounds of the size.
    sized
        Whether it has a size that sets its z; else the camera does.
    has_neighbour, neighbouring_share
        Whether there is a law beside the exact one, and how often that is taken.
    needs
        What a camera must be: keywords of `draw_camera`.
    charge_rank
        Place among the effects on charge.
    warm_up
        Frames that go before those recorded.
    instalments
        Parts in which charge arrives; more than one: `gathered` puts them together.
    counts_photons
        Whether photons are counted instead of drawn from a normal law.
    """

    kind: ClassVar[str]
    group: ClassVar[str] = ""
    order: ClassVar[int] = 5
    least: ClassVar[float] = 1e-9
    most: float = 1e9
    listed: ClassVar[bool] = True
    sized: ClassVar[bool] = True
    has_neighbour: ClassVar[bool] = True
    neighbouring_share: ClassVar[float] = 0.3
    needs: ClassVar[dict[str, Any]] = {}
    also_right: ClassVar[tuple[str, ...]] = ()
    charge_rank: ClassVar[int] = 0
    warm_up: ClassVar[int] = 0
    instalments: ClassVar[int] = 1
    counts_photons: ClassVar[bool] = False

    def __init__(self, bench: Bench, chance: np.random.Generator) -> None:
        self.bench, self.chance = bench, chance
        self.camera, self.cells = bench.camera, bench.cells
        self.neighbouring = self.has_neighbour and bool(chance.random() < self.neighbouring_share)
        self.size, self.z = 0.0, 0.0
        self.draw()

    def draw(self) -> None:  # noqa: B027 - few effects need it
        """Draw what does not depend on the size."""

    def camera_fits(self) -> bool:
        """Tell whether the recording can show it."""
        return True

    def size_fits(self) -> bool:
        """Tell whether the size found is one that a camera can have."""
        return True

    @abstractmethod
    def z_of(self, size: float) -> float:
        """Return how far it stands out at a size."""

    def leave_floor(self) -> None:  # noqa: B027 - few effects need it
        """Tell the bench what it hides of later effects."""

    def make_ready(self) -> None:  # noqa: B027 - few effects need it
        """Draw fixed fields, now that the size is known."""

    def parameters(self) -> dict[str, Any]:
        """Return what the key says of it, in the words of docs/effects.md."""
        return {}

    def lit(self, light: Array, exposure: Exposure) -> Array:  # noqa: ARG002 - of other effects
        """Return the expected signal after what it does to light."""
        return light

    def warmed(self, light: Array, exposure: Exposure) -> Array:  # noqa: ARG002
        """Return the expected signal with what grows in the dark."""
        return light

    def gathered(self, parts: list[Array]) -> Array:
        """Return the charge of all instalments."""
        return np.asarray(sum(parts))

    def charged(self, charge: Array) -> Array:
        """Return the charge after shot noise as it is read."""
        return charge

    def amplified(self, charge: Array) -> Array:
        """Return what the amplifiers make of charge."""
        return charge

    def read_noise(self, shape: tuple[int, ...]) -> Array | None:  # noqa: ARG002
        """Return read noise of variance 1; None: it leaves that as it is."""
        return None

    def switched(self, volts: Array, light: Array) -> Array:  # noqa: ARG002
        """Return voltages after the choice of the read-out path, by the light of the plan."""
        return volts

    def read_out(self, volts: Array, exposure: Exposure) -> Array:  # noqa: ARG002
        """Return voltages with what the read-out adds."""
        return volts

    def remembered(self, volts: Array, expected: Array) -> Array:  # noqa: ARG002
        """Return voltages with what is left of those read before; expected: the mean frame."""
        return volts

    def filtered(self, volts: Array) -> Array:
        """Return voltages after a filter of the camera."""
        return volts

    def codes(self, volts: Array) -> Array | None:  # noqa: ARG002
        """Return codes of voltages above code 0; None: they are rounded."""
        return None

    def delivered(self, codes: Array, exposure: Exposure) -> Array:  # noqa: ARG002
        """Return codes as the grabber hands them over."""
        return codes


def has_two_times(bench: Bench) -> bool:
    """Tell whether darks differ in exposure time by more than a factor of three."""
    darks = [e.time_s for e in bench.camera.exposures if e.kind == "dark"]
    times = np.unique(np.round(darks, 9))
    return len(times) >= 2 and bool(times.max() > 3 * times.min())
