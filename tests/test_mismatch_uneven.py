"""What grows with exposure time in a part of the sensor only is no dark current."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.uneven import uneven
from dsis.effects import registry
from mismatch_recordings import camera, recorded

TIME_S, NOISE_DN = 0.5, 0.3
RATE = 4.0  # DN / s
DARK_CURRENT = registry()["dark_current"](dn_per_s=RATE)


def _state(
    growth_dn: Any, scope: str = "time", *others: Any, left: tuple[float, float] = (20.0, 0.0)
) -> Any:
    """Return a state with a map of what grows with time, as it is measured: its mean is zero."""
    images = {}
    for channel in ("R", "B"):
        image = growth_dn + np.random.default_rng(1).normal(0, NOISE_DN, (64, 96))
        images[channel, "time"] = (image - image.mean(), NOISE_DN)
    regressors = SimpleNamespace(scales={"time": TIME_S})
    return SimpleNamespace(
        setting=SimpleNamespace(
            seen=SimpleNamespace(images=images),
            layout=SimpleNamespace(regressors=lambda _: regressors),
        ),
        vector=SimpleNamespace(),
        null=SimpleNamespace(
            keys=(Key("fixed_smooth_variance", scope, "", "R"), Key("fixed_smooth_tilt", scope)),
            departures=lambda _: np.array(left),
        ),
        camera=SimpleNamespace(effect=(DARK_CURRENT, *others)),
    )


def _glow(extent: float) -> Any:
    y, x = np.arange(64)[:, None], np.arange(96)
    shape = np.exp(-np.hypot(y, x) / (extent * 96))
    return shape / shape.mean() * RATE * TIME_S


@pytest.mark.parametrize("extent", [0.1, 0.2])
def test_a_glow_is_no_dark_current(extent: float) -> None:
    said = uneven(_state(_glow(extent)), DARK_CURRENT)
    assert said is not None
    assert said.share < 0.5
    assert "a part of the sensor" in said.why


@pytest.mark.parametrize("growth", [0.0, 0.4 * _glow(0.1)])
def test_dark_current_is_believed_alone_and_beside_a_glow(growth: Any) -> None:
    state = _state(RATE * TIME_S + growth)
    assert uneven(state, registry()["dark_current"](dn_per_s=RATE)) is None


def test_what_is_explained_or_another_effect_denies_nothing() -> None:
    assert uneven(_state(_glow(0.1), "gain"), DARK_CURRENT) is None
    assert uneven(_state(_glow(0.1)), registry()["row_noise"](sigma_dn=1.0)) is None
    assert uneven(_state(_glow(0.1)), None) is None
    named = registry()["amp_glow"](dn_per_s=300.0)
    assert uneven(_state(_glow(0.1), "time", named), DARK_CURRENT) is None


def test_the_least_of_sixteen_parts_is_low_by_chance() -> None:
    """Even, ten errors of a part high: the lowest of them denies nothing."""
    growth = 10 * NOISE_DN / (64 * 96 / 16 * 2) ** 0.5
    assert uneven(_state(growth), registry()["dark_current"](dn_per_s=growth / TIME_S)) is None


@pytest.mark.parametrize(("left", "denied"), [((0.0, 5.0), True), ((3.0, 3.0), False)])
def test_beside_a_surface_a_weak_dark_current_is_not_told(left: Any, denied: bool) -> None:
    """Channels together show the surface; that every part grows, nothing does."""
    growth = NOISE_DN / (64 * 96 / 16 * 2) ** 0.5
    weak = registry()["dark_current"](dn_per_s=growth / TIME_S)
    assert (uneven(_state(growth, left=left), weak) is not None) == denied


def test_a_glow_that_has_no_word_stays_unexplained() -> None:
    glow = registry()["amp_glow"](dn_per_s=300.0, place="top_left", extent=0.15)
    words = VOCABULARY - {"amp_glow"}
    found = find_mismatch(camera(), recorded(camera(glow), 7), seed=3, vocabulary=words)
    assert found.verdict == "unexplained"
    assert any(m.statistic.startswith("fixed_smooth") for m in found.unexplained)
