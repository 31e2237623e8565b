"""Promise: sums of numbers speak where locked pixels see too little, and never against them."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from analysis.mismatch import trial
from analysis.mismatch.finding import Gain
from analysis.mismatch.given import Ratio
from analysis.mismatch.prove import Loglik
from analysis.mismatch.trial import Trial
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa

FRAMES = 4
CAMERA = Camera(
    name="any",
    cfa=Cfa.MONO,
    black_level=64.0,
    white_level=4095.0,
    bit_depth=12,
    noise=BaseNoise(segment=(Segment(slope=1.0, intercept=9.0),)),
)


@pytest.mark.parametrize(
    ("of_pixels", "nats", "certain"),
    [
        (Gain(0.1, (-0.5, 0.7)), 8.0, True),  # pixels see too little
        (Gain(-3.0, (-4.0, -2.0)), 8.0, False),  # pixels are sure that it is worse
        (Gain(3.0, (2.0, 4.0)), -8.0, True),  # pixels suffice
    ],
)
def test_who_decides(
    monkeypatch: pytest.MonkeyPatch, of_pixels: Gain, nats: float, certain: bool
) -> None:
    frames = Loglik({"dark": np.zeros(FRAMES)}, {"dark": 0.0})
    monkeypatch.setattr(trial, "loglik_of", lambda *_, **__: frames)
    monkeypatch.setattr(trial, "heldout_gain", lambda *_, **__: of_pixels)
    numbers = SimpleNamespace(
        setting=SimpleNamespace(jobs=1, layout=SimpleNamespace(large=False)),
        frames=FRAMES,
        gain=lambda *_: Ratio(nats, 1.0, nats > 0),
    )
    held = cast("Any", object())
    judge = Trial(cast("Any", None), cast("Any", None), held, cast("Any", numbers), 0)
    model = SimpleNamespace(signals={})
    final = SimpleNamespace(camera=CAMERA, calibrated=SimpleNamespace(model=model))
    found = judge.gains(cast("Any", final), {"row_noise": CAMERA})["row_noise"]
    assert found.certain == certain
    own = nats / FRAMES if certain and of_pixels.ci95[0] < 0 else of_pixels.nats_per_frame
    assert found.gain.nats_per_frame == pytest.approx(own)
