"""A virtual sensor of a camera model: its frames before the converter.

The converter is left to `cells`, for what it does is known exactly; and draws are counted, so that
two models share their noise: what an effect changes is known far better than either simulation.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from analysis.mismatch.prove.held import MOST_CLIPPED, Held, HeldExposure
from analysis.mismatch.prove.sites import site_means, spread_over
from dsis.camera import BaseNoise, Camera
from dsis.draw import Draw
from dsis.effects import Effect, Image, Stage
from dsis.effects.saturation import Saturation
from dsis.simulate.shot import tiled

Array = NDArray[np.float64]
Signals = Mapping[str, NDArray[np.float64]]
LEAST_DN2 = 0.01  # codes are whole: less noise cannot be seen
_ABOVE = 8.0  # standard deviations of light: no noise of it is farther off
_SAMPLES = 400_000  # of an exposure, in frames that nothing was learned from


class Analogue(Camera):
    """A camera without the links of its converter: signals are neither rounded nor clipped."""

    def chain(self) -> tuple[Effect, ...]:
        """Return the links before the converter."""
        return tuple(link for link in super().chain() if not of_converter(link))


def of_converter(link: Effect) -> bool:
    """Return whether a link makes codes of signals."""
    return (link.stage, link.rank) >= (Stage.CODE, 0)


def base_of(camera: Camera) -> Camera:
    """Return the base model alone: Gaussian noise of variance m x + t, whole codes."""
    noise = BaseNoise(shot="gaussian", segment=camera.noise.segment)
    return camera.model_copy(update={"effect": (), "saturation_dn": None, "noise": noise})


@dataclass(frozen=True)
class Stack:
    """Frames of one exposure of a virtual sensor: float32 (frame, row, column), DN above black.

    Attributes
    ----------
    training
        As many as the recording's; a proof learns the sensor's pattern from them.
    fresh
        Frames after them.
    """

    training: Image
    fresh: Image


def clean_signal(held: Held, exposure: HeldExposure, signals: Signals) -> Image:
    """Return the clean signal of an exposure: uniform, or of a scene the training mean.

    A flat without a signal of its own, for all its frames are locked, has that of its light, by the
    ratio of signal to light in the others; where light is unknown it has its own mean level.
    """
    if exposure.kind == "scene":
        return (exposure.mean_dn - held.black_dn).astype(np.float32)
    if exposure.name in signals:
        return tiled(signals[exposure.name], held.grid)
    if exposure.kind == "dark":
        return tiled(np.zeros((2, 2)), held.grid)
    ratios = [
        np.broadcast_to(signals[e.name], (2, 2)) / e.light
        for e in held.exposures
        if e.light and e.kind == "flat" and e.name in signals
    ]
    if exposure.light and ratios:
        return tiled(np.median(ratios, 0) * exposure.light, held.grid)
    darks = [e.training_means_dn.mean() for e in held.exposures if e.kind == "dark" and e.trained]
    black = float(np.mean(darks)) if darks else held.black_dn
    means = np.maximum(site_means(exposure.codes, held.cfa).mean(0) - black, 0.0)
    return spread_over(means, held.shape, held.cfa).astype(np.float32)


def filled(camera: Camera, held: Held, signals: Signals) -> frozenset[str]:
    """Return the exposures of which too many samples reach the full well of a camera.

    The share is that of the clean signal with the base model's noise, of all pixels.
    """
    limits = [own for own in camera.effect if isinstance(own, Saturation)]
    wells = [own.full_well_dn for own in limits]
    wells += [camera.saturation_dn] if camera.saturation_dn else []
    if not wells:
        return frozenset()
    apart_dn2 = sum((own.full_well_dn * own.spread_percent / 100) ** 2 for own in limits)
    found = set()
    for exposure in held.exposures:
        clean = clean_signal(held, exposure, signals)
        noise = np.maximum(base_of(camera).segments.variance_dn2(clean), LEAST_DN2)
        sd = np.sqrt(noise + apart_dn2)
        if float(ndtr((clean - min(wells)) / sd).mean()) > MOST_CLIPPED:
            found.add(exposure.name)
    return frozenset(found)


def virtual_sensor(camera: Camera, held: Held, signals: Signals, seed: int) -> dict[str, Stack]:
    """Return the frames of a virtual sensor, by exposure."""
    analogue = Analogue.model_construct(**{n: getattr(camera, n) for n in Camera.model_fields})
    sensor = sensor_draw(seed)
    fresh = int(np.clip(round(_SAMPLES / held.grid.rows / held.grid.columns), 4, 32))
    stacks = {}
    for exposure in held.exposures:
        clean = clean_signal(held, exposure, signals)
        temporal = Draw(seed).within("proof", exposure.name)
        frames = [
            analogue.expose(
                clean,
                temporal,
                sensor,
                number,
                held.grid,
                exposure_time_s=exposure.exposure_time_s,
            )
            for number in range(exposure.trained + fresh)
        ]
        # What is far above white would move means as no code can; light that is above it has noise.
        whole = np.minimum(np.stack(frames), _top(camera, held, clean))
        stacks[exposure.name] = Stack(whole[: exposure.trained], whole[exposure.trained :])
    return stacks


def _top(camera: Camera, held: Held, clean: Image) -> np.float32:
    """Return the highest value that is kept, DN above black: white, or above all of the light.

    A full well keeps light that would be above white below it, and neighbours of another colour
    take some of what is just below white: beside them the base model's noise is asked for, whole.
    """
    white, brightest = np.float32(held.white_code - held.black_dn), clean.max(keepdims=True)
    variance = base_of(camera).segments.variance_dn2(brightest)
    return max(white, np.float32((brightest + _ABOVE * np.sqrt(variance)).item()))


def sensor_draw(seed: int) -> Draw:
    """Return the random fields of the virtual sensor."""
    return Draw(seed).within("proof", "sensor")
