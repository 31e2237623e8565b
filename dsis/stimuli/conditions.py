"""The four noise conditions of a frame, exactly as the paper has them.

======== ========================================================================================
awgn_rgb noise-free display image + N(0, sigma) on all three channels
awgn_dem the same noise on the mosaicked display image, then demosaicked
sd_rgb   linear full-colour raw + signal-dependent noise, white balance, colour transform
sd_dem   the same noise on the mosaic, white balance, demosaicking, colour transform
======== ========================================================================================

There is one reference: noise-free and never mosaicked. Level n is n stops of under-exposure: the
signal is divided by 2^n before the noise and multiplied back after.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.camera import Camera
from dsis.cfa import mosaic, pattern
from dsis.color import DisplayTransform
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.noise import awgn
from dsis.spec import Spec

Frame = NDArray[np.float32]

CODE_MAX = np.float32(255)
_PIXELS_IN_CACHE = 1 << 14


@dataclass(frozen=True)
class Condition:
    """One cell of the test: kind of noise, demosaicking method (or `none`), level in stops."""

    noise: str
    demosaic: str
    level: int

    def stimulus(self, content: str) -> str:
        """Return the stimulus' name, `content__noise__demosaic__level`."""
        return f"{content}__{self.noise}__{self.demosaic}__{self.level}"


def conditions_of(spec: Spec) -> tuple[Condition, ...]:
    """Return all conditions of a test, levels outermost."""
    c = spec.conditions
    return tuple(Condition(n, d, level) for level in c.levels for n in c.noise for d in c.demosaic)


@dataclass(frozen=True)
class Rendering:
    """From raw signals to display frames; the same for every content and frame of a test.

    Frames are float32 (row, column, 3): raw in DN above black before white balance, display 0..1
    and not clipped but for the reference.

    Attributes
    ----------
    camera
        The camera model.
    transform
        From scene light to display.
    seed
        Seed of all noise of the test.
    exposure_time_s
        Exposure time of a frame, s.
    threads
        Threads inside one frame.
    """

    camera: Camera
    transform: DisplayTransform
    seed: int
    exposure_time_s: float
    threads: int = 1

    def display(self, raw: Frame) -> Frame:
        """Return the display frame of full-colour raw data: white balance, colour transform."""
        return self._seen(raw, self.camera.scene_light)

    def display_demosaicked(self, raw: Frame, method: str) -> Frame:
        """Return the display frame of raw data sampled at the colour filters and demosaicked."""
        full_scale = self.camera.diffuse_white_dn or 1.0
        balanced = mosaic(raw, self.camera.cfa)
        for (row, column), channel in np.ndenumerate(pattern(self.camera.cfa)):
            balanced[row::2, column::2] *= np.float32(self.camera.white_balance[channel])
        full = demosaic(
            balanced, self.camera.cfa, method, full_scale=full_scale, threads=self.threads
        )
        return self._seen(full, self.camera.scene_light_of_balanced)

    def _seen(self, field: Frame, scene_light: Callable[[Frame], Frame]) -> Frame:
        """Return the display frame of a field, in runs of rows that stay in the cache."""
        display = np.empty(field.shape, np.float32)
        rows = max(1, _PIXELS_IN_CACHE // field.shape[1])
        for top in range(0, len(field), rows):
            block = slice(top, top + rows)
            display[block] = self.transform.display_from_scene(scene_light(field[block]))
        return display

    def shown(self, noise: str, field: Frame, method: str) -> Frame:
        """Return the display frame 0..1 of a field: raw data (`sd`) or code values (`awgn`)."""
        if noise == "sd":
            return (
                self.display(field) if method == "none" else self.display_demosaicked(field, method)
            )
        return (field if method == "none" else self.mosaicked_display(field, method)) / CODE_MAX

    def reference(self, clean: Frame) -> Frame:
        """Return the reference of a clean raw frame: clipped to what the display can show."""
        display = self.display(clean)
        return np.clip(display, np.float32(0), np.float32(1), out=display)

    def noisy_raw(
        self,
        clean: Frame,
        content: str,
        level: int,
        frame: int,
        earlier: Callable[[int], Frame] | None = None,
    ) -> Frame:
        """Return whole codes less black at `level`, multiplied back: the raw data of `sd_rgb`.

        `earlier(k)` gives the clean signal k frames before, for effects that remember; without it
        the scene stands still.
        """
        stops = np.float32(2.0**level)
        grid = PixelGrid(clean.shape[0], clean.shape[1])
        temporal = Draw(self.seed, ("content", content, f"level {level}"))
        sensor = Draw(self.seed, ("sensor",))
        before = None if earlier is None else lambda back: earlier(back) / stops
        raw = self.camera.expose(
            clean / stops if level else clean,
            temporal,
            sensor,
            frame,
            grid,
            exposure_time_s=self.exposure_time_s,
            earlier_clean=before,
            threads=self.threads,
        )
        return raw * stops if level else raw

    def noisy_display(
        self, reference: Frame, sigma: float, content: str, level: int, frame: int
    ) -> Frame:
        """Return reference + N(0, sigma): code values 0..255, not rounded; sigma in codes."""
        grid = PixelGrid(reference.shape[0], reference.shape[1])
        draw = Draw(self.seed, ("content", content, f"level {level}"))
        return awgn(reference * CODE_MAX, sigma, draw, grid, frame)

    def mosaicked_display(self, codes: Frame, method: str) -> Frame:
        """Return a display image, code values 0..255, mosaicked and demosaicked: code values."""
        sampled = mosaic(codes, self.camera.cfa)
        return demosaic(
            sampled, self.camera.cfa, method, full_scale=float(CODE_MAX), threads=self.threads
        )
