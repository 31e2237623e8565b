"""An effect that hides behind another: nothing calls for it before that is taken in."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import confirmed
from analysis.mismatch.explaining import UNCALLED
from analysis.mismatch.fitted import Fitted
from analysis.mismatch.judge import NOTHING
from analysis.mismatch.jumped import jumped
from dsis.effects.hot_pixels import HotPixels

HIDDEN, OTHER = (Stub(name=name, kind=name, proposal=None) for name in ("smooth_prnu", "shading"))
PATCHES = Stub(statistic="fixed_patch_variance", z=4.4)
HALF_LEFT = Stub(statistic="fixed_patch_variance", z=2.3)


def _search(*left: Any) -> Any:
    """Return a search whose states leave open what is `left`, whatever camera they have."""
    return Stub(
        named=[HIDDEN, OTHER],
        without=lambda _, named: named,
        setting=Stub(nulls=8),
        step=None,
        left=left,
    )


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the effects without which states are asked for."""
    found: list[str] = []

    def of(setting: Any, camera: Any, _: Any, near: Any) -> Any:
        assert setting is near.setting
        found.append(camera.name)
        return Stub(mismatches=near.left)

    monkeypatch.setattr(confirmed, "State", Stub(of=of))
    return found


@pytest.mark.parametrize(
    ("why", "without", "with_it", "denied"),
    [
        (NOTHING, (PATCHES,), (), False),
        (NOTHING, (PATCHES,), (HALF_LEFT,), True),  # it explains less than half
        (NOTHING, (), (), True),
        ("another makes it", (PATCHES,), (), True),
    ],
)
def test_what_explains_nothing_is_asked_by_the_state_without_it(
    why: str,
    without: tuple[Any, ...],
    with_it: tuple[Any, ...],
    denied: bool,
    asked: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    judge = Stub(denied_by_rest=lambda some, _: (HIDDEN, why) if HIDDEN in some else None)
    monkeypatch.setattr(confirmed, "Judge", lambda *_: judge)
    state: Any = Stub(setting=object(), mismatches=with_it, left=without)
    base: Any = Stub(mismatches=())
    found = confirmed.denied_by_rest(_search(), state, base)
    assert found == ((HIDDEN, why) if denied else None)
    assert asked == (["smooth_prnu"] if why == NOTHING else [])


def test_the_next_effect_is_asked_where_one_is_needed_after_all(
    asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    judge = Stub(denied_by_rest=lambda some, _: (some[0], NOTHING) if some else None)
    monkeypatch.setattr(confirmed, "Judge", lambda *_: judge)
    state: Any = Stub(setting=object(), mismatches=(), left=(PATCHES,))
    base: Any = Stub(mismatches=())
    assert confirmed.denied_by_rest(_search(), state, base) is None
    assert asked == ["smooth_prnu", "shading"]


@pytest.mark.parametrize(("without", "denied"), [((PATCHES,), False), ((), True)])
def test_what_nothing_calls_for_is_kept_where_all_frames_need_it_beside_the_others(
    without: tuple[Any, ...], denied: bool, asked: list[str]
) -> None:
    def uncalled(some: Any) -> Any:
        return (HIDDEN, UNCALLED) if HIDDEN in some else None

    state: Any = Stub(setting=object(), mismatches=(), left=without)
    found = confirmed._unless_needed(_search(), state, uncalled)
    assert found == ((HIDDEN, UNCALLED) if denied else None)
    assert asked == ["smooth_prnu"]


@pytest.mark.parametrize("called", [True, False])
def test_what_all_frames_called_for_last_is_explained(called: bool) -> None:
    nothing: Any = Stub(mismatches=())
    search: Any = Stub(
        base=nothing, left=None, _beside=lambda _: {"saturation"}, _named_beside=lambda _: set()
    )
    last: Any = Stub(mismatches=(PATCHES,) if called else ())
    hidden: Any = HIDDEN
    assert Fitted.explained_by(search, hidden, nothing, nothing, last) is called
    assert Fitted.explained_by(search, hidden, nothing, nothing) is False


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("name", "below", "denied"),
    [("time", 8, False), ("time", 16, True), ("offset", 8, True), ("offset", 0, False)],
)
def test_a_few_that_noise_may_have_below_deny_no_hot_pixels_that_grow(
    name: str, below: int, denied: bool, seed: int
) -> None:
    """Noise alone has 2.9 of 12288 pixels below -3.5; of offsets any law may have more."""
    rng = np.random.default_rng(seed)
    image = np.clip(rng.normal(0, 1, (96, 128)), -3.2, 3.2)
    few = rng.choice(image.size, 7 + below, replace=False)
    image.flat[few] = np.append(rng.uniform(4.2, 4.9, 7), rng.uniform(-4.2, -3.9, below))
    hot = HotPixels(pixel_fraction=0.003, mean_dn_per_s=10.0)
    state: Any = Stub(
        setting=Stub(
            layout=Stub(uniform=[Stub(exposure_time_s=t) for t in (0.01, 0.5)]),
            seen=Stub(images={("MONO", name): (image, 1.0)}),
        ),
        camera=Stub(effect=(hot,)),
        mismatches=(),
    )
    assert (jumped(state, hot) is not None) == denied
