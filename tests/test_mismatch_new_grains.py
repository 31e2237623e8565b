"""Light in grains leaves in means of few frames what neighbours share, as a field of gains does."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.newgrains import of_new_grains
from dsis.effects import registry

ROWS, COLUMNS, FRAMES, LEVEL, NOISE = 120, 160, 8, 1000.0, 10.0
FIELD = registry()["smooth_prnu"](sigma_percent=0.1, length_pixels=2.0)
SITES = {"0_1": (0, 1), "1_0": (1, 0)}
Array = NDArray[np.float64]


def _grains(rng: np.random.Generator, *shape: int) -> Array:
    """Return noise of variance 1 whose neighbours in a block of four have a quarter in common."""
    white = rng.normal(size=(*shape, ROWS + 1, COLUMNS + 1))
    return np.asarray(
        white[..., 1:, 1:] + white[..., :-1, 1:] + white[..., 1:, :-1] + white[..., :-1, :-1]
    ) / 2  # fmt: skip


def _state(seed: int, new: float, fixed: float, *, known: bool = True) -> Any:
    """Return a state with the mean of frames whose noise has grains, and that has a field."""
    rng = np.random.default_rng(seed)
    frames = LEVEL + NOISE * (
        np.sqrt(1 - new) * rng.normal(size=(FRAMES, ROWS, COLUMNS))
        + np.sqrt(new) * _grains(rng, FRAMES)
    )
    frames += fixed * NOISE / FRAMES**0.5 * _grains(rng)
    apart = (frames - frames.mean(0)) / frames.std(0, ddof=1)
    values = [
        float((apart[:, y:, x:] * apart[:, : ROWS - y, : COLUMNS - x]).mean())
        for y, x in SITES.values()
    ]
    keys = [
        SimpleNamespace(
            exposure="flat", channel="MONO", statistic=f"correlation_{name}", scope="exposure"
        )
        for name in SITES
    ]
    sd = NOISE / FRAMES**0.5
    layout = SimpleNamespace(
        uniform=[SimpleNamespace(name="flat", numbers=range(FRAMES))],
        signal_dn={("flat", "MONO"): LEVEL},
        variance_dn2={("flat", "MONO"): NOISE**2},
    )
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=layout,
            seen=SimpleNamespace(images={("MONO", "gain"): (frames.mean(0) - LEVEL, sd)}),
        ),
        vector=SimpleNamespace(keys=keys, values=np.array(values)),
        null=SimpleNamespace(mean=np.zeros(2), sd=np.full(2, 0.002), known=np.ones(2, bool)),
        mismatches=[SimpleNamespace(statistic=key.statistic) for key in keys if known],
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("new", [0.1, 0.3])
def test_grains_that_are_new_in_each_frame_are_no_field(seed: int, new: float) -> None:
    said = of_new_grains(_state(seed, new, 0.0), FIELD)
    assert said is not None
    assert said.share < 0.5
    assert "anew" in said.why


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("new", [0.0, 0.05])
def test_a_field_is_believed_beside_fewer_grains(seed: int, new: float) -> None:
    assert of_new_grains(_state(seed, new, 0.5), FIELD) is None


def test_of_what_the_model_knows_of_grains_nothing_is_asked() -> None:
    assert of_new_grains(_state(1, 0.3, 0.0, known=False), FIELD) is None
    assert of_new_grains(_state(1, 0.3, 0.0), registry()["prnu"](sigma_percent=0.1)) is None
