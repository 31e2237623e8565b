"""Lines that differ the more the longer the exposure have no offsets of their own."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.grown import grown

TIMES = {"dark_0": 0.02, "dark_1": 0.12, "flat_0": 0.02, "flat_1": 0.05}
OFFSET = 0.25  # variance of the offsets, relative to noise of lines
SD = 0.04


def _state(of_time: np.ndarray, statistic: str, seed: int) -> Any:
    """Return a state whose lines differ by offsets, or by what goes with time; it says offsets."""
    keys = [Key(statistic, "exposure", name, "MONO", "") for name in TIMES]
    rng = np.random.default_rng(seed)
    values = np.cbrt(1 + of_time) + rng.normal(0, SD, len(keys))
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(
                exposures=[SimpleNamespace(name=n, exposure_time_s=t) for n, t in TIMES.items()]
            )
        ),
        vector=SimpleNamespace(keys=tuple(keys), values=values),
        null=SimpleNamespace(
            mean=np.full(len(keys), np.cbrt(1 + OFFSET)),
            sd=np.full(len(keys), SD),
            known=np.ones(len(keys), bool),
        ),
    )


@pytest.mark.parametrize(
    ("kind", "statistic"),
    [
        ("dsnu", "fixed_pixel_variance"),
        ("row_fpn", "fixed_row_variance"),
        ("column_fpn", "fixed_column_variance"),
    ],
)
def test_what_grows_with_time_is_no_offset(kind: str, statistic: str) -> None:
    time_s = np.array(list(TIMES.values()))
    without = np.ones(len(TIMES))
    growing = 1.5 * (time_s / time_s.max()) ** 2
    for seed in range(10):
        said = grown(_state(growing, statistic, seed), kind, without)
        assert said is not None
        assert said.share < 1 / 20
        assert "grows with exposure time" in said.why
        still = np.full(len(TIMES), OFFSET)
        assert grown(_state(still, statistic, seed), kind, without) is None


def test_one_exposure_time_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TIMES, "dark_1", 0.02)
    monkeypatch.setitem(TIMES, "flat_1", 0.02)
    of_one = np.array([0.0, 1.5, 0.0, 0.0])
    assert grown(_state(of_one, "fixed_row_variance", 0), "row_fpn", np.ones(4)) is None


def test_gains_and_other_numbers_are_not_asked() -> None:
    growing = np.array([0.0, 1.5, 0.0, 0.2])
    assert grown(_state(growing, "fixed_row_variance", 0), "row_prnu", np.ones(4)) is None
    assert grown(_state(growing, "fixed_row_variance", 0), "column_fpn", np.ones(4)) is None
