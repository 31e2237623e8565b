"""What is logged of every frame: PSNR, visible noise, and what added physics does to both."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.spec import Spec
from dsis.stimuli.conditions import CODE_MAX
from dsis.stimuli.frames import FrameMaker
from dsis.stimuli.quality import delivered, psnr_db, psnr_float_db
from dsis.visibility import Eye, pixels_per_degree

Frame = NDArray[np.float32]


class Assessor:
    """Compares the frames of a content with its reference.

    Attributes
    ----------
    visible
        Numbers of the frames in which the visible noise is measured.
    """

    def __init__(self, spec: Spec, maker: FrameMaker, visible: tuple[int, ...]) -> None:
        self.eye = Eye(pixels_per_degree(spec.viewing, spec.sequence.height))
        self.visible = visible
        camera = maker.rendering.camera
        base = camera.model_copy(update={"effect": ()})
        self.base_maker = maker.with_camera(base) if camera.effect else None

    def compare(self, display: Frame, reference: Frame, clean_dem: Frame) -> dict[str, Any]:
        """Return the PSNRs of a display frame 0..1."""
        test = delivered(display)
        return {
            "psnr_db": _finite(psnr_db(test, delivered(reference))),
            "psnr_float_db": _finite(psnr_float_db(display, reference)),
            "psnr_demosaicked_db": _finite(psnr_db(test, delivered(clean_dem))),
        }

    def seen(self, display: Frame) -> Frame:
        """Return a display frame as the eye sees it, as delivered."""
        return self.eye.seen(delivered(display).astype(np.float32) / CODE_MAX)

    def visible_noise(self, display: Frame, seen_reference: Frame) -> list[float]:
        """Return the visible noise of a display frame, as delivered: lightness, colour."""
        shown = delivered(display).astype(np.float32) / CODE_MAX
        difference = self.eye.difference(shown, seen_reference)
        return [difference.lightness, difference.colour]

    def without_effects(
        self, frame: int, reference: Frame, seen_reference: Frame
    ) -> dict[str, dict[str, Any]]:
        """Return what the base model alone gives, for clips of camera noise: PSNR, visible noise.

        Empty where the camera has no effects beyond the base model. Same noise fields, so that
        the effects are the whole difference.
        """
        if self.base_maker is None:
            return {}
        noisy = {
            c.stimulus(self.base_maker.job.name)
            for c in self.base_maker.job.conditions
            if c.noise == "sd"
        }
        return {
            name: {
                "psnr_db": _finite(psnr_db(delivered(display), delivered(reference))),
                "visible": self.visible_noise(display, seen_reference),
            }
            for name, display, _ in self.base_maker.frame(frame)
            if name in noisy
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
