"""Light that leans and halves that differ are told apart by the map of the gain itself."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.layout import Layout
from analysis.mismatch.mapped import as_maps_show
from analysis.mismatch.polish import Polished
from analysis.mismatch.rank import Ranked
from dsis.cfa import Cfa
from dsis.effects.shading import Shading
from dsis.effects.tap_mismatch import TapMismatch
from mismatch_recordings import camera

ROWS, COLUMNS, TOP_DN, NOISE_DN = 96, 128, 1000.0, 1.0
TILT = Proposal(
    Shading(falloff_percent=0.0, tilt_right_percent=0.1), ("tilt_right_percent",), frozenset()
)
HALVES = Proposal(TapMismatch(gain_percent=0.1), ("gain_percent",), frozenset())


def _state(image: Any) -> Any:
    """Return a state whose only map is `image`; both effects change one of its two numbers."""
    layout = Layout((), ROWS, COLUMNS, Cfa.MONO, 0.0, 4095.0, {}, {})
    clues = SimpleNamespace(
        layout=layout,
        camera=camera(),
        image=lambda name: {"MONO": (image, NOISE_DN)} if name == "gain" else {},
        scale=lambda _name, _channel: TOP_DN,
    )
    null = SimpleNamespace(mean=np.zeros(2), sd=np.ones(2), known=np.ones(2, bool))
    return SimpleNamespace(clues=lambda: clues, null=null)


def _ranked(proposal: Proposal, gain: float, mean: tuple[float, float] = (9.0, 0.0)) -> Ranked:
    polished = Polished((proposal.effect,), 0.0, np.array(mean), ({},))
    return Ranked(gain, proposal.effect.kind, proposal, polished)


def _map(shape: str, z: float, seed: int) -> Any:
    """Return a map of white noise with a lean or a step of columns of so many standard errors."""
    line = np.linspace(-1, 1, COLUMNS)
    own = {"lean": line, "step": np.sign(line), "none": 0 * line}[shape]
    size = np.sqrt((own**2).sum() * ROWS) or 1.0
    noise = np.random.default_rng(seed).standard_normal((ROWS, COLUMNS))
    return NOISE_DN * (z * own / size + noise)


@pytest.mark.parametrize(("shape", "right"), [("lean", "shading"), ("step", "tap_mismatch")])
def test_the_map_tells_which(shape: str, right: str) -> None:
    """Whatever the numbers said: a shared part of sqrt(3)/2 leaves z / 2 to tell them by."""
    first = [
        as_maps_show(_state(_map(shape, 12.0, seed)), order)[0].kind
        for seed in range(20)
        for order in ([_ranked(TILT, 40.0), _ranked(HALVES, 36.0)],
                      [_ranked(HALVES, 40.0), _ranked(TILT, 36.0)])
    ]  # fmt: skip
    assert first.count(right) >= 39  # of 40: 18 nats, +- 6


def test_what_maps_do_not_tell_stays_as_it_was() -> None:
    for seed in range(10):
        order = [_ranked(HALVES, 40.0), _ranked(TILT, 36.0)]
        assert as_maps_show(_state(_map("none", 0.0, seed)), order) == order


def test_effects_that_change_other_numbers_are_no_rivals() -> None:
    order = [_ranked(TILT, 40.0), _ranked(HALVES, 36.0, (0.0, 9.0))]
    assert as_maps_show(_state(_map("step", 30.0, 1)), order) == order


def test_smooth_light_of_any_form_is_no_step() -> None:
    """A curve that no shading has: the step would come nearer to it than a lean does."""
    line = np.linspace(-1, 1, COLUMNS)
    for seed, size in enumerate((0.2, 0.3, 0.5, 1.0)):
        curve = size * (line - line**3) + _map("none", 0.0, seed)
        order = [_ranked(TILT, 40.0), _ranked(HALVES, 36.0)]
        assert as_maps_show(_state(curve), order) == order


def test_numbers_that_are_sure_need_no_map() -> None:
    order = [_ranked(TILT, 400.0), _ranked(HALVES, 20.0)]
    assert as_maps_show(_state(_map("step", 12.0, 1)), order) == order


def test_every_proposal_of_light_falls_behind_halves() -> None:
    both = Proposal(
        Shading(falloff_percent=0.1, tilt_right_percent=0.1),
        ("falloff_percent", "tilt_right_percent"),
        frozenset({"tilt_right_percent"}),
    )
    order = [_ranked(TILT, 40.0), _ranked(both, 39.0), _ranked(HALVES, 36.0)]
    one, *others = as_maps_show(_state(_map("step", 14.0, 3)), order)
    assert one.kind == "tap_mismatch"
    assert one.gain == 40.0
    assert all(2.0 <= other.gain < 37.0 for other in others)


def test_a_map_without_noise_says_nothing_wrong() -> None:
    order = [_ranked(TILT, 40.0), _ranked(HALVES, 36.0)]
    assert as_maps_show(_state(np.zeros((ROWS, COLUMNS))), order)[0].kind == "shading"


def test_a_clear_map_keeps_apart_what_the_numbers_tie() -> None:
    order = [_ranked(HALVES, 40.0), _ranked(TILT, 39.0)]
    one, other = as_maps_show(_state(_map("step", 14.0, 2)), order)
    assert one.kind == "tap_mismatch"
    assert one.gain - other.gain > 10
