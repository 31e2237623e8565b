"""Promise: what camera models share in a proof is made once, and no number differs by that."""

from itertools import permutations

import numpy as np
import pytest

from analysis.mismatch.prove import learning
from analysis.mismatch.prove.learning import Bases
from analysis.mismatch.prove.proof import loglik_of
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import camera, held_of, recorded, signals

ROWS = registry()["row_noise"](sigma_dn=0.8)
DNL = registry()["adc_dnl"](rms_lsb=0.3)
SPIKES = registry()["impulse"](per_megapixel_frame=500.0, mean_dn=900.0)
STEPS = registry()["quantisation"](step_dn=4.0)
PHOTONS = registry()["poisson_shot_noise"]()
CAMERAS = [camera(*own) for own in ((ROWS,), (ROWS, DNL), (DNL, SPIKES), (STEPS,), (PHOTONS,))]


@pytest.fixture(name="sensors")
def _sensors(monkeypatch: pytest.MonkeyPatch) -> list[Camera]:
    """Return a list of the cameras of which a virtual sensor is made from now on."""
    made: list[Camera] = []
    virtual_sensor = learning.virtual_sensor

    def watched(own: Camera, *others: object) -> object:
        made.append(own)
        return virtual_sensor(own, *others)  # type: ignore[arg-type] # as they are

    monkeypatch.setattr(learning, "virtual_sensor", watched)
    return made


def test_a_base_model_is_simulated_once_whatever_is_asked_first(sensors: list[Camera]) -> None:
    """Converters and photons, of which a base model's residuals know, are not mixed up."""
    held = held_of(recorded(camera(ROWS), 40))
    alone = [loglik_of(held, own, signals(), seed=1) for own in CAMERAS]
    assert sum(not own.effect for own in sensors) == len(CAMERAS)
    for order in [*permutations(range(len(CAMERAS)))][::40]:
        sensors.clear()
        bases = Bases(held, signals(), 1)
        for k in order:
            told = loglik_of(held, CAMERAS[k], signals(), seed=1, bases=bases)
            assert told.levels == alone[k].levels
            for name, own in told.frames.items():
                assert np.array_equal(own, alone[k].frames[name])
        assert sum(not own.effect for own in sensors) == 1
