"""One frame of a content in all its conditions."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dsis.camera import Camera
from dsis.color import DisplayTransform
from dsis.spec import Test
from dsis.stimuli.conditions import CODE_MAX, Rendering
from dsis.stimuli.jobs import Job
from dsis.stimuli.match import solve_sigma
from dsis.stimuli.source import Source, source_of

Frame = NDArray[np.float32]


class FrameMaker:
    """Makes the frames of all clips of one content.

    Attributes
    ----------
    sigma
        Standard deviation of the white noise by level, 8-bit codes.
    """

    def __init__(
        self, job: Job, rendering: Rendering, source: Source, sigma: Mapping[int, float]
    ) -> None:
        self.job, self.rendering, self.source, self.sigma = job, rendering, source, sigma

    @classmethod
    def of(cls, test: Test, job: Job) -> "FrameMaker":
        """Return the maker of a content of a test; renders or reads its source, solves sigma."""
        transform = DisplayTransform(test.spec.color)
        # Half of the frame time, the shutter of 180 degrees that is cinema's rule.
        exposure_time_s = 0.5 / test.spec.sequence.fps
        rendering = Rendering(test.camera, transform, test.spec.seed, exposure_time_s)
        source = source_of(job.content, test, transform)
        levels = sorted({c.level for c in job.conditions if c.noise == "awgn"})
        solved = {
            level: test.sigma[job.name, level]
            if (job.name, level) in test.sigma
            else solve_sigma(test.spec, source, rendering, job.name, level)
            for level in levels
        }
        return cls(job, rendering, source, solved)

    def with_camera(self, camera: Camera) -> "FrameMaker":
        """Return the maker of the same content and noise fields, seen by another camera."""
        make = self.rendering
        rendering = replace(make, camera=camera)
        return FrameMaker(self.job, rendering, self.source, self.sigma)

    def frame(self, frame: int) -> Iterator[tuple[str, Frame, Frame]]:
        """Yield (stimulus, display frame 0..1, demosaicked noise-free frame) of all clips.

        The first is the reference.
        """
        make, job = self.rendering, self.job
        clean = make.camera.clean_raw(self.source.light(frame))
        reference = make.reference(clean)
        yield job.reference, reference, reference
        noise_free = {"sd": clean, "awgn": reference * CODE_MAX}
        clean_dem = {
            (noise, method): make.shown(noise, noise_free[noise], method)
            for noise, method in {(c.noise, c.demosaic) for c in job.conditions}
            if method != "none"
        }
        noisy: dict[tuple[str, int], Frame] = {}
        for c in job.conditions:
            if (c.noise, c.level) not in noisy:
                noisy[c.noise, c.level] = (
                    make.noisy_raw(clean, job.name, c.level, frame, self._clean_before(frame))
                    if c.noise == "sd"
                    else make.noisy_display(
                        reference, self.sigma[c.level], job.name, c.level, frame
                    )
                )
            display = make.shown(c.noise, noisy[c.noise, c.level], c.demosaic)
            yield c.stimulus(job.name), display, clean_dem.get((c.noise, c.demosaic), reference)

    def _clean_before(self, frame: int) -> Callable[[int], Frame]:
        """Return what gives the clean raw signal k frames before; before the first all is still."""
        camera = self.rendering.camera
        return lambda back: camera.clean_raw(self.source.light(max(0, frame - back)))

    def figure_frames(self, number: int) -> dict[tuple[str, int], dict[str, Frame]]:
        """Return one frame of all clips, {(noise, level): {"reference" or demosaic: frame}}."""
        shown = {name: display for name, display, _ in self.frame(number)}
        found: dict[tuple[str, int], dict[str, Frame]] = {}
        for c in self.job.conditions:
            row = found.setdefault((c.noise, c.level), {"reference": shown[self.job.reference]})
            row[c.demosaic] = shown[c.stimulus(self.job.name)]
        return found
