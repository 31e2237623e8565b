"""A comb of codes that single electrons make is unknown where flats leave read noise unknown."""

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.combs import unknown_combs
from analysis.mismatch.layout import Layout, Taken
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import registry
from mismatch_recordings import camera

NAMES = ("dark", "low", "high")
SIGNAL = {("dark", "MONO"): 0.0, ("low", "MONO"): 500.0, ("high", "MONO"): 9000.0}
KEYS = (
    *(Key("code_imbalance", "exposure", name, "MONO") for name in NAMES),
    *(Key("skewness", "exposure", name, "MONO") for name in NAMES),
)


def _camera(intercept: float, error: float, *, counts: str, slope: float = 30.0) -> Camera:
    """Return a camera of two segments, the second of known or unknown read noise."""
    first = Segment(slope=0.5, intercept=20.0, upper_dn=2000.0, slope_se=0.01, intercept_se=0.1)
    second = Segment(
        slope=slope, intercept=intercept, upper_dn=None, slope_se=0.1, intercept_se=error
    )
    effects = (registry()["poisson_shot_noise"](),) if counts == "effect" else ()
    shot = "poisson" if counts == "shot" else "gaussian"
    noise = BaseNoise(shot=shot, segment=(first, second))
    return camera(*effects).model_copy(update={"noise": noise})


def _unknown(one: Camera) -> list[bool]:
    taken = tuple(Taken(n, "dark" if n == "dark" else "flat", 0.01, None, (0, 1)) for n in NAMES)
    layout = Layout(taken, 8, 8, Cfa.MONO, 64.0, 65535.0, SIGNAL, dict.fromkeys(SIGNAL, 20.0))
    return unknown_combs(one, layout, KEYS).tolist()


def _depth(read_dn2: float, slope: float) -> float:
    """Return how much more frequent codes at whole electrons are: of drawn electrons."""
    rng = np.random.default_rng(1)
    drawn = slope * rng.poisson(300, 400_000) + np.sqrt(read_dn2) * rng.normal(size=400_000)
    return float(2 * np.abs(np.exp(2j * np.pi * drawn / slope).mean()))


@pytest.mark.parametrize(
    ("intercept", "error"), [(-128.0, 1155.0), (60.0, 1.0), (60.0, 60.0), (2400.0, 500.0)]
)
@pytest.mark.parametrize("counts", ["effect", "shot", "none"])
def test_a_comb_is_unknown_where_its_depth_is(intercept: float, error: float, counts: str) -> None:
    deep, shallow = (_depth(max(intercept + k * error, 0.0), 30.0) for k in (-1, 1))
    unknown = deep / shallow > 2 and counts != "none"
    assert _unknown(_camera(intercept, error, counts=counts)) == [
        False,
        False,
        unknown,
        *3 * [False],
    ]


def test_electrons_far_below_the_read_noise_make_no_comb() -> None:
    assert _depth(400.0, 0.5) < 0.01
    assert not any(_unknown(_camera(400.0, 20.0, counts="shot", slope=0.5)))
