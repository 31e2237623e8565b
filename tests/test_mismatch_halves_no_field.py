"""A part of the sensor whose gain is another is no field of gains that neighbours share."""

from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from analysis.mismatch import rivalled as told
from analysis.mismatch.gainodds import Cause, evidences, without_field
from dsis.effects.smooth_prnu import SmoothPrnu

SHAPE = (96, 128)
FIELD = SmoothPrnu(sigma_percent=0.1, length_pixels=10.0)


def _field(seed: int, sigma: float = 0.15) -> np.ndarray:
    made = gaussian_filter(np.random.default_rng(seed + 50).normal(size=SHAPE), 7, mode="wrap")
    return np.asarray(sigma * made / made.std())


def _halves(size: float) -> np.ndarray:
    return size * (np.arange(SHAPE[1]) >= SHAPE[1] // 2) + np.zeros(SHAPE)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("halves", "field", "denied"),
    [(0.1, 0.0, True), (0.0, 0.15, False), (0.1, 0.15, False), (0.0, 0.0, False)],
)
def test_halves_alone_deny_a_field(
    monkeypatch: pytest.MonkeyPatch, halves: float, field: float, seed: int, *, denied: bool
) -> None:
    image = np.random.default_rng(seed).normal(size=SHAPE) + _halves(halves) + _field(seed, field)
    monkeypatch.setattr(told, "gains_beside", lambda *_: image)

    class State:
        camera: Any = type("Camera", (), {"effect": (FIELD,)})

        def clues(self) -> None:
            return None

    state: Any = State()
    denial = told.rivalled(state, FIELD)
    assert (denial is not None) == denied
    if denial is not None:
        assert "a left and a right part" in denial.why


def test_what_is_alone_and_what_is_beside_make_up_what_evidences_say() -> None:
    image = np.random.default_rng(1).normal(size=SHAPE) + _halves(0.1) + _field(1, 0.08)
    causes = (Cause.LIGHT, Cause.HALVES_OF_COLUMNS, Cause.TOP)
    both = evidences(image)  # with a field or without
    for cause, odds in without_field(image, causes).items():
        assert odds.seen - odds.behind == pytest.approx(both[Cause.FIELD])
        assert np.logaddexp(odds.seen, odds.seen + odds.beside) == pytest.approx(both[cause])
    assert without_field(np.zeros(SHAPE), causes) == {}
