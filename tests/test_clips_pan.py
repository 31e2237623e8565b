"""Promise: clips pan by parts of a pixel at the contrast of the optics."""

import math
from pathlib import Path

import numpy as np
import pytest

from cinema import CINEMA
from delivered import COLUMNS, ROWS, built, codes_of
from dsis.manifest import read_manifest
from dsis.optics import transfer

PAN_FRAMES, PAN_PX = 6, 2


@pytest.mark.parametrize("sign", [1, -1])
def test_a_window_moving_right_moves_the_picture_left(sign: int, tmp_path: Path) -> None:
    """A still with no room to spare: the window goes from one of its ends to the other."""
    travel = PAN_PX * (PAN_FRAMES - 1)
    light = np.full((ROWS, COLUMNS + travel, 3), 0.1)
    light[:, 40] = 0.9
    content = {"light": light, "pan_px_per_frame": float(sign * PAN_PX)}
    settings = {"frames": PAN_FRAMES, "noise": ["awgn", "sd"], "demosaic": ["none", "bilinear"]}
    out = built(tmp_path, {"line": content}, **settings)
    first = 40 if sign > 0 else 40 - travel
    places = [first - sign * PAN_PX * frame for frame in range(PAN_FRAMES)]
    for clip in read_manifest(out).clips:
        brightest = codes_of(out, clip.stimulus).mean(axis=(1, 3)).argmax(axis=1)
        assert brightest.tolist() == places, clip.stimulus


# One grating per channel, (cycles per pixel down, right): along, across and oblique to the pan.
GRATINGS = ((0.0131, 0.1237), (0.2113, 0.0173), (0.1731, 0.2477))
SPARE_PX = 128  # around the window: the reflected borders are far away


def gratings(scale: int, travel: int) -> np.ndarray:
    rows, columns = ROWS + SPARE_PX, COLUMNS + SPARE_PX + travel
    y, x = np.mgrid[0 : rows * scale, 0 : columns * scale] / scale
    waves = [np.cos(2 * np.pi * (fy * y + fx * x)) for fy, fx in GRATINGS]
    return 0.5 + 0.4 * np.stack(waves, axis=2)


@pytest.mark.parametrize(("pan", "scale"), [(0.25, 1), (-0.7, 1), (0.25, 2), (0.5, 2), (3.0, 1)])
def test_gratings_pan_by_parts_of_a_pixel_at_the_contrast_of_the_optics(
    pan: float, scale: int, tmp_path: Path
) -> None:
    """Each frame is the analytic wave, 8-bit rounding apart; `transfer` has its own tests."""
    light = gratings(scale, math.ceil(abs(pan) * (PAN_FRAMES - 1)))
    content = {"light": light, "pan_px_per_frame": pan, "oversampling": scale}
    out = built(tmp_path, {"waves": content}, frames=PAN_FRAMES, optics=CINEMA)
    clip = codes_of(out, "waves__reference")
    y, x = np.mgrid[0:ROWS, 0:COLUMNS]
    for channel, (fy, fx) in enumerate(GRATINGS):
        contrast = 0.4 * float(transfer(CINEMA, np.array(fy), np.array(fx)))
        phases = []
        for frame, picture in enumerate(clip[..., channel]):
            moved = 2 * np.pi * (fy * y + fx * (x + pan * frame))
            known = np.stack([np.ones(x.size), np.cos(moved).ravel(), np.sin(moved).ravel()], 1)
            fit = np.linalg.lstsq(known, picture.ravel(), rcond=None)[0]
            # Rounding to codes 0.5, of light to half floats 0.06, tails of the borders 0.09.
            assert np.abs(known @ fit - picture.ravel()).max() < 0.65
            assert fit[0] == pytest.approx(127.5, abs=0.1)
            assert math.hypot(fit[1], fit[2]) == pytest.approx(255 * contrast, abs=0.1)
            phases.append(math.atan2(fit[2], fit[1]))
        turned = np.angle(np.exp(1j * (np.array(phases) - phases[0])))
        # A tenth of a code, as above.
        assert np.abs(turned).max() < 0.1 / (255 * contrast)
