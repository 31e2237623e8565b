"""Sizes that panoramas are rendered at for other uses than a test of one's own."""

from dataclasses import dataclass
from typing import Final

from dsis.errors import Fault, InputError
from dsis.scenes.strip import Strip

OVERSAMPLING: Final = 2
"""Pixels of a panorama per sensor pixel: the optics act before the sampling."""


@dataclass(frozen=True)
class Preset:
    """A size of clips.

    Attributes
    ----------
    width, height
        Of the frames, sensor pixels.
    travel
        How far the window can slide, sensor pixels: 250 frames at a width in 19 s and 25 fps.
    """

    width: int
    height: int
    travel: int


PRESETS: Final = {
    "quick": Preset(480, 270, 250),
    "standard": Preset(960, 540, 500),
    "lab": Preset(1920, 1080, 1000),
}


def preset_strip(preset: str, scene: str, seed: int) -> Strip:
    """Return what is rendered for a preset; raise `InputError` that names all that is wrong."""
    faults = []
    if preset not in PRESETS:
        fact = f"is {preset!r}, must be one of: {', '.join(PRESETS)}"
        faults.append(Fault("", "preset", fact))
    size = PRESETS.get(preset, PRESETS["quick"])
    strip = Strip(
        scene, seed, OVERSAMPLING * size.height, OVERSAMPLING * (size.width + size.travel)
    )
    faults += strip.faults()
    if faults:
        raise InputError(faults)
    return strip
