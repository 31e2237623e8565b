"""Flats of unknown light that a full well hides: their light, and the full well, by numpy."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.layout import Layout, Taken, sites
from analysis.mismatch.limited import lit
from analysis.mismatch.model import Model
from analysis.mismatch.relit import relit
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects import registry
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
FULL = 1800.0
COLOURS = {"R": 0.55, "Gr": 1.0, "Gb": 1.0, "B": 0.84, "MONO": 1.0}
LIGHTS = (250.0, 700.0, 1400.0, 2300.0)


def _layout(cfa: Cfa, light: float | None = None) -> Layout:
    flats = tuple(Taken(f"flat-{i}", "flat", 0.01, light, (0, 1)) for i in range(len(LIGHTS)))
    dark = Taken("dark-0", "dark", 0.01, 0.0, (0, 1))
    return Layout((dark, *flats), 64, 96, cfa, 64.0, 4095.0, {}, {})


def _levels(cfa: Cfa, most: float = np.inf) -> dict[str, Array]:
    found = {"dark-0": np.zeros((2, 2))}
    for i, light in enumerate(LIGHTS):
        own = np.full((2, 2), light)
        if cfa is not Cfa.MONO:
            for channel, at in sites(cfa).items():
                own[at] = light * COLOURS[channel]
        found[f"flat-{i}"] = np.minimum(own, most)
    return found


def _limited(cfa: Cfa) -> Camera:
    return camera(registry()["saturation"](full_well_dn=FULL), cfa=cfa.value)


def test_colours_that_are_not_full_tell_the_light() -> None:
    made = lit(_limited(Cfa.RGGB), _layout(Cfa.RGGB), _levels(Cfa.RGGB, FULL))
    for name, own in _levels(Cfa.RGGB).items():
        np.testing.assert_allclose(made[name][0], own[0])  # red, and the green beside it
        assert made[name][1, 1] == min(own[1, 1], FULL) or name == "flat-3"


def test_without_colours_any_light_far_above_does() -> None:
    levels = _levels(Cfa.MONO, FULL)
    made = lit(_limited(Cfa.MONO), _layout(Cfa.MONO), levels)
    assert (made["flat-3"] > FULL + 3 * (0.5 * FULL) ** 0.5).all()
    assert all((made[name] == levels[name]).all() for name in levels if name != "flat-3")


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_known_light_and_no_full_well_leave_all_as_it_is(cfa: Cfa) -> None:
    levels = _levels(cfa, FULL)
    for made in (
        lit(_limited(cfa), _layout(cfa, 1.0), levels),
        lit(camera(cfa=cfa.value), _layout(cfa), levels),
    ):
        assert all((made[name] == own).all() for name, own in levels.items())


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_levels_stay_what_they_are_with_a_full_well_and_without(cfa: Cfa) -> None:
    levels, bare = _levels(cfa, FULL), camera(cfa=cfa.value)
    made = relit(Model(bare, levels), _limited(cfa), _layout(cfa))
    back = relit(made, bare, _layout(cfa))
    for name, own in levels.items():
        np.testing.assert_allclose(np.minimum(made.signals[name], FULL), own)
        np.testing.assert_allclose(back.signals[name], own)


def _recorded(cfa: Cfa, full: float) -> InMemory:
    """Return numpy's own recording under unknown light: shot noise, a limit, read noise."""
    made = recorded(camera(cfa=cfa.value), 2, rows=48, columns=64, levels=LIGHTS, lit=False)
    assert made.stacks is not None
    rng = np.random.default_rng(5)
    light = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": own for i, own in enumerate(LIGHTS)}
    for name, frames in made.stacks.items():
        shares = np.ones((2, 2))
        if cfa is not Cfa.MONO:
            for channel, at in sites(cfa).items():
                shares[at] = COLOURS[channel]
        mean = light[name] * np.tile(shares, (24, 32))
        charge = np.minimum(rng.normal(mean, np.sqrt(0.5 * mean), frames.shape), full)
        codes = np.rint(64 + charge + rng.normal(0, 20**0.5, frames.shape))
        made.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return made


# A diagnosis simulates dozens of recordings: of both kinds of sensors, and of one without a limit.
@pytest.mark.parametrize(("cfa", "full"), [(Cfa.MONO, FULL), (Cfa.RGGB, FULL), (Cfa.RGGB, np.inf)])
def test_a_full_well_far_below_the_brightest_flat_is_named(cfa: Cfa, full: float) -> None:
    vocabulary = frozenset({"saturation", "nonlinearity"})
    found = find_mismatch(camera(cfa=cfa.value), _recorded(cfa, full), vocabulary=vocabulary)
    named = {one.effect: one.parameters for one in found.omitted_physics}
    assert set(named) == ({"saturation"} if np.isfinite(full) else set())
    if named:
        own = named["saturation"]["full_well_dn"]
        assert abs(own.value - full) < max(5 * own.standard_error, 0.3)
