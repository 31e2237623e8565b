"""Of one kind there are forms: memory of noise or of the signal, levels about which pixels jump."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import basenumbers, forms
from analysis.mismatch.forms import in_form, other_form
from analysis.mismatch.polish import Polished
from analysis.mismatch.rank import Ranked
from dsis.camera import BaseNoise, Segment
from dsis.effects import registry

GIVEN = BaseNoise(segment=(Segment(slope=0.40, intercept=5.0),))
BLACK_DN = 64.0
USERS: Any = SimpleNamespace(noise=GIVEN, black_level=BLACK_DN)
ERROR = 0.0005


def _calibrated(slope: float) -> Any:
    piece = SimpleNamespace(
        slope=slope, slope_error=ERROR, intercept=5.0, intercept_error=float("nan")
    )
    return SimpleNamespace(fit=SimpleNamespace(pieces=[piece]))


REMEMBERED = {"fraction": 0.05, "lag_pixels": 3}


@pytest.fixture
def of_what(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return what a memory is of, by the slope beside that of the noise and that of the signal."""
    for module in (basenumbers, forms):
        monkeypatch.setattr(module, "joined", lambda _camera, effects, _given: effects[0])
    monkeypatch.setattr(forms, "replicates_for", lambda _setting, _effects: 1)

    def remembers(
        slopes: tuple[float, float],
        alone: float = 0.36,
        cfa: str = "MONO",
        ahead: float = 0.0,
        **own: Any,
    ) -> dict[str, Any]:
        slope = dict(zip(("noise", "signal"), slopes, strict=True))
        setting = SimpleNamespace(
            given=0,
            layout=SimpleNamespace(channels=(cfa,)),
            calibrated=lambda memory, _near: _calibrated(slope[memory.remembers]),
        )
        predictor = SimpleNamespace(
            mean=lambda memory: np.array([ahead * (memory.remembers == "signal")]),
            gain=lambda mean: float(mean[0]),
            loglik=lambda mean: float(mean[0]),
        )
        state: Any = SimpleNamespace(
            camera=SimpleNamespace(),
            setting=setting,
            calibrated=_calibrated(alone),
            predictor=lambda _count: predictor,
        )
        effect = registry()["readout_memory"](**{**REMEMBERED, **own})
        polished = Polished((effect,), 0.0, np.zeros(2), ({},))
        proposal: Any = SimpleNamespace(effect=effect)
        ranked = Ranked(40.0, "readout_memory", proposal, polished)
        (found,) = in_form(state, USERS, [ranked])
        values: dict[str, Any] = dict(found.polished.effects[0])
        return {"remembers": values["remembers"], "fraction": values["fraction"]}

    return remembers


def test_memory_is_of_the_signal_where_numbers_hold_beside_that_alone(of_what: Any) -> None:
    """Kernels (1, f) and (1 - s, s) correlate the same where s / (1 - s) = f."""
    found = of_what((0.36, 0.3998))
    assert found["remembers"] == "signal"
    assert found["fraction"] / (1 - found["fraction"]) == pytest.approx(REMEMBERED["fraction"])


@pytest.mark.parametrize(
    ("slopes", "own"),
    [
        ((0.4001, 0.44), {}),
        ((0.36, 0.38), {}),  # wrong beside either
        ((0.36, 0.3998), {"alone": 0.4}),  # measured in such frames
        ((0.36, 0.3998), {"lag_pixels": 1}),  # as a filter does
        ((0.36, 0.38), {"cfa": "R"}),
        ((0.36, 0.3998), {"cfa": "R", "ahead": -9.0}),  # colours tell
    ],
)
def test_memory_stays_one_of_the_noise(
    of_what: Any, slopes: tuple[float, float], own: dict[str, Any]
) -> None:
    assert of_what(slopes, **own) == {"remembers": "noise", "fraction": REMEMBERED["fraction"]}


@pytest.mark.parametrize(
    ("slopes", "remembers", "left"),
    [
        ((0.4005, 0.447), "signal", "noise"),
        ((0.407, 0.447), "signal", "noise"),  # nearly right: what is named besides has errors
        ((0.44, 0.447), "signal", "signal"),
        ((0.36, 0.4005), "noise", "signal"),
        ((0.4005, 0.447), "noise", "noise"),
    ],
)
def test_what_is_named_since_may_tell_the_other_form(
    slopes: tuple[float, float], remembers: str, left: str
) -> None:
    """Crosstalk, which was not known yet, had made numbers wrong beside the right form."""
    slope = dict(zip(("noise", "signal"), slopes, strict=True))
    effect = registry()["readout_memory"](**REMEMBERED, remembers=remembers)
    beside = registry()["crosstalk"](fraction=0.012)

    def camera(*effects: Any) -> Any:
        made = SimpleNamespace(effect=effects)
        made.model_copy = lambda update: camera(*update["effect"])
        return made

    def calibrated(own: Any, _near: Any = None) -> Any:
        (memory,) = [one for one in own.effect if one.kind == "readout_memory"]
        return _calibrated(slope[memory.remembers])

    model = camera(beside, effect)
    layout = SimpleNamespace(channels=("MONO",))
    state: Any = SimpleNamespace(
        camera=model,
        setting=SimpleNamespace(layout=layout, calibrated=calibrated, given=0),
        calibrated=calibrated(model),
    )
    found = other_form(state, GIVEN, effect)
    memory: Any = effect if found is None else found[0]
    assert memory.remembers == left
    if found is not None:
        assert tuple(found[1].effect) == (beside, memory)
    assert other_form(state, GIVEN, beside) is None


@pytest.mark.parametrize(("ahead", "remembers"), [(9.0, "signal"), (0.5, "noise")])
def test_colours_tell_what_a_memory_is_of_at_odds(
    of_what: Any, ahead: float, remembers: str
) -> None:
    found = of_what((0.4001, 0.44), cfa="R", ahead=ahead)  # beside noise the numbers hold
    assert found["remembers"] == remembers
    again = {"remembers": "signal", "fraction": 0.05, "ahead": ahead}
    assert of_what((0.4001, 0.44), cfa="R", **again)["remembers"] == remembers


def test_no_filter_takes_away_what_neighbours_have_in_common(of_what: Any) -> None:
    found = of_what((0.43, 0.3998), lag_pixels=1, fraction=-0.05)
    assert found["remembers"] == "signal"


@pytest.mark.parametrize(
    ("gains", "fitted_black", "levels"),
    [
        ({"above": 20.0, "either": 52.0}, {}, "about"),  # odds below 20
        ({"above": 20.0, "either": 60.0}, {}, "either"),
        ({"above": 70.0, "either": 60.0}, {}, "above"),
        ({"above": 71.0, "either": 70.0}, {"above": 63.5}, "either"),
        ({"above": 70.0, "either": 71.0}, {"either": 64.5}, "above"),
    ],
)
def test_pixels_jump_about_the_level_that_maps_show(
    monkeypatch: pytest.MonkeyPatch,
    gains: dict[str, float],
    fitted_black: dict[str, float],
    levels: str,
) -> None:
    monkeypatch.setattr(forms, "joined", lambda _camera, effects, _given: effects[0])
    monkeypatch.setattr(forms, "replicates_for", lambda _setting, _effects: 1)
    gains = {"about": 50.0, **gains}
    predictor = SimpleNamespace(
        mean=lambda effect: np.array([gains[effect.levels]]),
        gain=lambda mean: float(mean[0]),
        loglik=lambda mean: float(mean[0]),
    )

    def calibrated(effect: Any, _near: Any) -> Any:
        black = fitted_black.get(effect.levels, BLACK_DN)
        return SimpleNamespace(model=SimpleNamespace(camera=SimpleNamespace(black_level=black)))

    state: Any = SimpleNamespace(
        camera=None,
        calibrated=None,
        setting=SimpleNamespace(given=0, calibrated=calibrated),
        predictor=lambda _count: predictor,
    )
    effect = registry()["rts"](pixel_fraction=0.002, amplitude_dn=20.0)
    proposal: Any = SimpleNamespace(effect=effect)
    polished = Polished((effect,), 0.0, np.array([50.0]), ({},))
    fitted = [Ranked(90.0, "rts", proposal, polished), Ranked(40.0, "rts", proposal, polished)]
    best, behind = in_form(state, USERS, fitted)
    assert dict(best.polished.effects[0])["levels"] == levels
    assert best.gain == 40.0 + gains[levels]
    assert dict(behind.polished.effects[0])["levels"] == levels
    assert behind.gain == fitted[1].gain
