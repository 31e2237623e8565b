"""A response that is bent by another law than a parabola: found as the smooth bend it is."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates import CANDIDATES
from dsis.effects.nonlinearity import Nonlinearity
from mismatch_recordings import InMemory, camera, recorded, responding, state_of

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
LEVELS = (150.0, 600.0, 1200.0, 1900.0, 2600.0, 3300.0)
SLOPE, READ, BLACK, WHITE = 0.5, 6.0, 64.0, 4095.0
END = 0.85 * (WHITE - BLACK)


def _gamma(size: float) -> Callable[[Array], Array]:
    def law(q: Array) -> Array:
        u = np.maximum(q, 1e-9) / END
        return size * END * u * np.log(u)

    return law


def _cubic(size: float) -> Callable[[Array], Array]:
    return lambda q: size * END * (q / END) * (1 - (q / END) ** 2)


def _knee(size: float) -> Callable[[Array], Array]:
    """Straight, then a soft roll-off from 60 % of the line's length on."""
    return lambda q: -size * END * 0.08 * np.logaddexp(0, (q / END - 0.6) / 0.08)


def _recording(seed: int, law: Callable[[Array], Array]) -> InMemory:
    return responding(seed, LEVELS, lambda charge: charge + law(charge))


def _bend(effect: Nonlinearity, q: Array) -> Array:
    """Return the bend that an effect's docstring states, DN."""
    dense = np.linspace(1e-6, 1, 20001)
    top = np.abs((dense - dense ** (1 + effect.exponent)) / effect.exponent).max()
    size = effect.percent_full_scale / 100 * (WHITE - BLACK) / top
    u = q / END
    return np.asarray(size * (u - u ** (1 + effect.exponent)) / effect.exponent)


def _beside_scale(bend: Array, q: Array) -> Array:
    """Return what of a bend no scale of the light explains."""
    return np.asarray(bend - q * (bend @ q) / (q @ q))


LAWS = {"gamma": _gamma(0.004), "cubic": _cubic(0.006), "knee": _knee(0.006)}


@pytest.mark.parametrize("law", LAWS)
def test_a_bend_of_another_law_starts_near_what_made_it(law: str) -> None:
    bent = LAWS[law]
    state = state_of(_recording(3, bent), camera(segments=((SLOPE, READ, None),)))
    starts = [one.effect for one in CANDIDATES["nonlinearity"].propose(state.clues())]
    other = [one for one in starts if isinstance(one, Nonlinearity) and one.exponent != 1]
    assert len(other) == 1
    q = np.array(LEVELS)
    true = _beside_scale(bent(q), q)
    left = _beside_scale(_bend(other[0], q) - bent(q), q)
    assert np.abs(left).max() < 0.3 * np.abs(true).max()


@pytest.mark.parametrize("percent", [0.6, -0.6])
def test_variances_say_how_much_a_response_bends_where_light_is_unknown(percent: float) -> None:
    """Of a parabola: its derivative widens noise, or narrows it."""
    true = Nonlinearity(percent_full_scale=percent)
    bare = camera(segments=((SLOPE, READ, None),))
    made = recorded(bare.model_copy(update={"effect": (true,)}), 6, levels=LEVELS, lit=False)
    state = state_of(made, bare)
    (start,) = (one.effect for one in CANDIDATES["nonlinearity"].propose(state.clues()))
    assert isinstance(start, Nonlinearity)
    assert start.percent_full_scale == pytest.approx(percent, rel=0.4)


@pytest.mark.long
@pytest.mark.parametrize("law", ["gamma"])
def test_whatever_its_law_a_smooth_bend_is_named(law: str) -> None:
    bent = LAWS[law]
    found = find_mismatch(camera(segments=((SLOPE, READ, None),)), _recording(4, bent), seed=0)
    assert [one.effect for one in found.omitted_physics] == ["nonlinearity"]


def test_three_levels_tell_no_exponent() -> None:
    made = _recording(5, LAWS["cubic"])
    few = {f"flat-{i}" for i in (0, 2, 4)} | {"dark-0", "dark-1"}
    exposures = tuple(e for e in made.exposures if e.name in few)
    less = InMemory(made.sensor, exposures, made.rows, made.columns, made.folder, made.stacks)
    state = state_of(less, camera(segments=((SLOPE, READ, None),)))
    starts = [one.effect for one in CANDIDATES["nonlinearity"].propose(state.clues())]
    assert starts
    assert all(isinstance(one, Nonlinearity) and one.exponent == 1 for one in starts)


def test_a_parabola_is_written_as_ever() -> None:
    assert "exponent" not in Nonlinearity(percent_full_scale=1.0).model_dump()
    assert Nonlinearity(percent_full_scale=1.0, exponent=2.0).model_dump()["exponent"] == 2.0


def test_a_response_that_would_fall_is_refused_by_both_numbers() -> None:
    with pytest.raises(
        ValueError, match=r"exponent is 9, .* percent_full_scale = 15: .* must rise"
    ):
        Nonlinearity(percent_full_scale=15.0, exponent=9.0)
