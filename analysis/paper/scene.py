"""City and Landscape before the paper's camera, exposed so that its noise is the paper's.

The paper prints neither slopes and intercepts of its camera nor the exposure. What it prints is
what the noise did: 31.51 dB for signal-dependent noise without demosaicking and 35.51 dB for white
noise, on City. So the camera is the shipped one, and the light is set until City has 31.51 dB.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from analysis.paper.published import AWGN_SIGMA, SD_PSNR_DB
from analysis.paper.setting import Setting
from dsis.camera import Camera
from dsis.cfa import mosaic
from dsis.color import DisplayTransform, white_balanced
from dsis.scenes import panorama
from dsis.spec import SHIPPED, Sequence, Test, read_spec
from dsis.stimuli.conditions import CODE_MAX, Rendering
from dsis.stimuli.panoramas import strip_of
from dsis.stimuli.quality import delivered, psnr_db
from dsis.stimuli.source import Source, source_of
from dsis.visibility import Eye, pixels_per_degree

Frame = NDArray[np.float32]

SPEC = "seybold.toml"
FPS = 25.0
FRAMES = 8  # the most that a part takes, but for Table 2
_STOPS = (-3.0, 12.0)  # of under-exposure, in which the paper's noise is looked for


@dataclass(frozen=True)
class Scene:
    """A content of the paper's test, seen by its camera.

    Attributes
    ----------
    name
        "city" or "landscape".
    source
        Linear light, frame by frame.
    rendering
        From raw signals to display frames; its camera has the exposure sought.
    eye
        At the test's distance: of 1080 rows, as much as the frames show of them.
    """

    name: str
    source: Source
    rendering: Rendering
    eye: Eye

    @property
    def camera(self) -> Camera:
        """The camera."""
        return self.rendering.camera

    @property
    def full_scale(self) -> float:
        """Signal that code 255 corresponds to for demosaicking, DN."""
        return self.camera.diffuse_white_dn or 1.0

    def clean(self, frame: int) -> Frame:
        """Return the clean raw signal of a frame, three planes, DN above black."""
        return self.camera.clean_raw(self.source.light(frame))

    def noisy(self, clean: Frame, frame: int) -> Frame:
        """Return the camera's noisy version of it, in whole codes."""
        return self.rendering.noisy_raw(clean, self.name, 0, frame)

    def white(self, reference: Frame, frame: int) -> Frame:
        """Return the display frame with the paper's white noise, 0..1 and beyond."""
        return self.rendering.noisy_display(reference, AWGN_SIGMA, self.name, 0, frame) / CODE_MAX

    def white_demosaicked(self, display: Frame, method: str) -> Frame:
        """Return a display frame mosaicked and demosaicked, as `awgn_dem` is."""
        return self.rendering.mosaicked_display(display * CODE_MAX, method) / CODE_MAX

    def balanced_mosaic(self, raw: Frame) -> Frame:
        """Return raw planes after white balance, sampled at the colour filters: stage 1."""
        return mosaic(white_balanced(raw, self.camera.white_balance), self.camera.cfa)

    def balanced_variance(self, clean: Frame) -> Frame:
        """Return the variance of each sample of the mosaic after white balance, equation (2).

        g_c^2 (m x + t + 1/12): the last term is the rounding to whole codes.
        """
        variance = self.camera.segments.variance_dn2(clean) + np.float32(1 / 12)
        gains = np.asarray(self.camera.white_balance, np.float32)
        return mosaic(variance * gains**2, self.camera.cfa)

    def display_of_balanced(self, balanced: Frame) -> Frame:
        """Return the display frame of demosaicked, white-balanced signals: stage 2 to 3."""
        light = self.camera.scene_light_of_balanced(balanced)
        return self.rendering.transform.display_from_scene(light)

    def under_exposed(self, stops: float) -> "Scene":
        """Return the scene with 2^-stops of the light and as much more gain after."""
        white = self.full_scale * 2.0**-stops
        camera = self.camera.model_copy(update={"diffuse_white_dn": white})
        return replace(self, rendering=replace(self.rendering, camera=camera))


@lru_cache(maxsize=4)
def scene(name: str, setting: Setting, frames: int) -> Scene:
    """Return a content, exposed as City is when its noise is the paper's."""
    found = _scene(name, setting, frames)
    return found.under_exposed(_stops(setting))


@lru_cache(maxsize=4)
def _stops(setting: Setting) -> float:
    """Return the stops of under-exposure that give City the paper's PSNR without demosaicking."""
    city = _scene("city", setting, 1)
    light = city.source.light(0)

    def excess_db(stops: float) -> float:
        seen = city.under_exposed(stops)
        clean = seen.camera.clean_raw(light)
        noisy = seen.rendering.display(seen.noisy(clean, 0))
        reference = seen.rendering.reference(clean)
        return psnr_db(delivered(noisy), delivered(reference)) - SD_PSNR_DB

    return float(brentq(excess_db, *_STOPS, xtol=0.002))


def _scene(name: str, setting: Setting, frames: int) -> Scene:
    test = read_spec(SHIPPED / SPEC, seed=setting.seed)
    width, height = setting.size
    size = Sequence(width=width, height=height, fps=FPS, seconds=frames / FPS)
    viewing = test.spec.viewing
    resized = Test(
        test.spec.model_copy(update={"sequence": size}),
        test.camera,
        test.folder,
        test.footage,
        test.sigma,
    )
    content = next(c for c in test.contents() if c.name == name)
    transform = DisplayTransform(test.spec.color)
    longest = max(FRAMES, setting.denoised_frames)
    strip = strip_of(content, size.model_copy(update={"seconds": longest / FPS}))
    if (
        strip is not None
    ):  # rendered once and on all threads: the cache serves all that ask for less
        panorama(strip, threads=setting.jobs)
    source = source_of(content, resized, transform)
    rendering = Rendering(test.camera, transform, setting.seed, 0.5 / FPS, setting.jobs)
    eye = Eye(pixels_per_degree(viewing, test.spec.sequence.height))
    return Scene(name, source, rendering, eye)
