"""From camera to display: white balance, and OpenColorIO's view transforms of a pinned config.

OpenColorIO's exact arithmetic takes some 0.17 s per megapixel for the ACES view, most of it for
curves of single channels. On the way to the display those come from tables (`dsis.curves`), which
agree with it to a thousandth of an 8-bit code, to a sixtieth in near-black shadows; all else, and
the way back, is OpenColorIO's own.
"""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import groupby
from typing import Any

import numpy as np
import PyOpenColorIO as ocio  # noqa: N813 - the name that its own examples use
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, field_validator

from dsis.curves import Curve
from dsis.model import Model

Step = Callable[[NDArray[np.float32]], None]  # changes pixels (pixel, 3) in place

# One version for ever: "-latest" would change stimuli with an upgrade. Only the studio configs
# know the colour spaces of cameras.
STUDIO_CONFIG = "studio-config-v2.2.0_aces-v1.3_ocio-v2.4"
_PIXELS_IN_CACHE = 1 << 14


class Color(Model):
    """Names of colour spaces, in OpenColorIO's words: section `[color]` of a test spec.

    Attributes
    ----------
    display
        What the stimuli are shown on.
    view
        How scene light is rendered for that display.
    scene_space
        Primaries of the linear scene light that a camera delivers.
    """

    display: str = "Rec.1886 Rec.709 - Display"
    view: str = Field("ACES 1.0 - SDR Video", validate_default=True)
    scene_space: str = "Linear ARRI Wide Gamut 3"

    @field_validator("display")
    @classmethod
    def _known_display(cls, display: str) -> str:
        return _one_of(display, list(_config().getDisplays()), f"a display of {STUDIO_CONFIG}")

    @field_validator("view")
    @classmethod
    def _known_view(cls, view: str, info: ValidationInfo) -> str:
        display = info.data.get("display")
        if display is None:  # a fault of its own
            return view
        return _one_of(view, list(_config().getViews(display)), f'a view of "{display}"')

    @field_validator("scene_space")
    @classmethod
    def _known_scene_space(cls, scene_space: str) -> str:
        spaces = [
            space for space in _config().getColorSpaces() if space.getEncoding() == "scene-linear"
        ]
        return _one_of(
            scene_space,
            [space.getName() for space in spaces],
            f"a scene-linear colour space of {STUDIO_CONFIG}",
        )


@dataclass(frozen=True)
class DisplayTransform:
    """The rendering that a `Color` names, and its inverse; may be used from several threads.

    Arrays are float32 (row, column, 3), or any number of leading axes; results are new arrays.
    Each pixel stands alone: a crop of the result is the result of the crop.

    Attributes
    ----------
    color
        Display, view and scene space.
    """

    color: Color

    def display_from_scene(self, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return display code values, 0..1 for what the display can show, *not* clipped.

        Parameters
        ----------
        rgb
            Linear scene light in `scene_space`, 1 being diffuse white; noise may make it
            negative, highlights lie above 1. NaN becomes 0.
        """
        out = np.array(rgb, np.float32, order="C")
        pixels = out.reshape(-1, 3)
        for first in range(0, len(pixels), _PIXELS_IN_CACHE):
            for step in _steps(self.color):
                step(pixels[first : first + _PIXELS_IN_CACHE])
        return out

    def scene_from_display(self, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return linear scene light that renders to display code values `rgb`, 0..1.

        "Un-tone-mapped" comes back within half an 8-bit code everywhere. "ACES 1.0 - SDR Video"
        does so where the smallest of R, G, B is at least 0.8 of the largest; no scene gives the
        most saturated colours of Rec.709 (yellow comes back 142 codes off), and display white is
        0.18 x 2^6.5 = 16.3 times diffuse white.
        """
        return _applied(_inverse(self.color), rgb)

    def scene_from_linear_rec709(self, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return light with linear BT.709 primaries (the rendered scenes') in `scene_space`."""
        return _applied(_into_scene_space(self.color.scene_space), rgb)


def white_balanced(raw: NDArray[np.float32], gains: Sequence[float]) -> NDArray[np.float32]:
    """Multiply the channels of raw light above black, float32 (..., 3), by their gains R, G, B."""
    return raw * np.asarray(gains, np.float32)


def _applied(processor: Any, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
    # The processor works in place, on contiguous pixels.
    out = np.array(rgb, np.float32, order="C")
    processor.applyRGB(out)
    return out


@lru_cache(maxsize=16)
def _inverse(color: Color) -> Any:
    """Return a CPU processor from display to scene with exact arithmetic, here as everywhere.

    OpenColorIO's default replaces log, exp and pow by approximations, which is up to 0.4 of an
    8-bit code off in the ACES views and saves a sixth of the time. Whoever sets OpenColorIO's own
    environment variable OCIO_OPTIMIZATION_FLAGS gets other bytes.
    """
    inverse = ocio.TRANSFORM_DIR_INVERSE
    transform = _config().getProcessor(color.scene_space, color.display, color.view, inverse)
    return transform.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)


@lru_cache(maxsize=16)
def _steps(color: Color) -> tuple[Step, ...]:
    """Return the forward transform as steps that work in place, curves of channels as tables."""
    forward = ocio.TRANSFORM_DIR_FORWARD
    transform = _config().getProcessor(color.scene_space, color.display, color.view, forward)
    exact = transform.getOptimizedProcessor(ocio.OPTIMIZATION_LOSSLESS).createGroupTransform()
    steps: list[Step] = []
    for single, group in groupby(exact, _of_single_channels):
        work = _exact_step(list(group))
        curve = Curve.of(partial(_returned, work)) if single else None
        steps.append(curve.apply if curve else work)
    return tuple(steps)


def _of_single_channels(operation: Any) -> bool:
    """Tell whether an operation is a curve, alike or not, of R, G and B each for itself."""
    return isinstance(
        operation, ocio.LogTransform | ocio.GradingRGBCurveTransform | ocio.ExponentTransform
    )


def _exact_step(operations: list[Any]) -> Step:
    """Return OpenColorIO's own arithmetic for some operations."""
    processor = _config().getProcessor(ocio.GroupTransform(operations))
    cpu = processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
    return partial(_apply_rgb, cpu)


def _apply_rgb(cpu: Any, pixels: NDArray[np.float32]) -> None:
    cpu.applyRGB(pixels)


def _returned(step: Step, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    out = pixels.copy()
    step(out)
    return out


@lru_cache(maxsize=4)
def _into_scene_space(scene_space: str) -> Any:
    transform = _config().getProcessor("Linear Rec.709 (sRGB)", scene_space)
    return transform.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)


@lru_cache(maxsize=1)
def _config() -> Any:
    return ocio.Config.CreateFromBuiltinConfig(STUDIO_CONFIG)


def _one_of(name: str, allowed: list[str], what: str) -> str:
    if name in allowed:
        return name
    near = difflib.get_close_matches(name, allowed, 1, cutoff=0.4)
    hint = f' (did you mean "{near[0]}"?)' if near else ""
    message = f'is "{name}"{hint}, must be {what}: ' + ", ".join(f'"{one}"' for one in allowed)
    raise ValueError(message)
