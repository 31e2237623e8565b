"""A decay that is told from smooth surfaces by the means of lines."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.edged import edged, outlined
from analysis.mismatch.layout import Layout
from dsis.cfa import Cfa
from exposing import effect

SHAPE = (96, 64)
NOISE = 1.0
LENGTHS = np.geomspace(1.0, 24.0, 16)  # of decays, up to a quarter of the rows
SITES = {
    "mono": {"MONO": (0, 0)},
    "mosaic": {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)},
}


def _state(
    means: np.ndarray, rng: np.random.Generator, sites: str = "mono", seen: str = "gain"
) -> Any:
    """Return a recording whose map, `seen`, has these row means beside white noise.

    Channels of a mosaic have signals of different size.
    """
    image, step = means[:, None] + rng.normal(0, NOISE, SHAPE), 1 + (sites == "mosaic")
    scales = dict(zip(SITES[sites], (500.0, 1000.0, 1000.0, 700.0), strict=False))
    plain = Layout((), *SHAPE, Cfa.MONO if sites == "mono" else Cfa.RGGB, 0.0, 4095.0, {}, {})
    layout = Stub(
        rows=SHAPE[0],
        columns=SHAPE[1],
        sites=plain.sites,
        from_edge=plain.from_edge,
        regressors=lambda channel: Stub(scales={"gain": scales[channel]}),
    )
    units = scales if seen == "gain" else dict.fromkeys(scales, 1.0)
    images = {
        (channel, seen): (image[y::step, x::step] * units[channel], NOISE * units[channel])
        for channel, (y, x) in SITES[sites].items()
    }
    return Stub(setting=Stub(layout=layout, seen=Stub(images=images)), image=image)


def _best(state: Any, number: str = "gain_percent") -> Any:
    """Return the decay that fits the row means best, of both edges and all lengths."""
    means = state.image.mean(1) - state.image.mean()
    gains = {}
    for edge, distance in (("top", np.arange(96.0)), ("bottom", np.arange(96.0)[::-1])):
        for length in LENGTHS:
            shape = np.exp(-distance / length)
            shape -= shape.mean()
            gains[float(shape @ means) ** 2 / float(shape @ shape)] = edge, length
    edge, length = gains[max(gains)]
    return effect("line_settling", **{number: 0.1}, length_pixels=float(length), edge=edge)


@pytest.mark.parametrize("degree", [2, 3, 4])
@pytest.mark.parametrize("strength", [10.0, 20.0, 40.0])
@pytest.mark.parametrize("sites", SITES)
def test_smooth_light_is_rarely_taken_for_a_decay(sites: str, degree: int, strength: float) -> None:
    """At odds of 20, in one of 20 at most: light that falls from one edge, and any other."""
    rng, draws = np.random.default_rng(int(strength) + degree), 100
    u = np.linspace(-1, 1, SHAPE[0])
    taken = {"any": 0, "edge": 0}
    for _ in range(draws):
        lights = {
            "any": np.polynomial.legendre.legval(u, [0.0, *rng.normal(size=degree)]),
            "edge": (1 + u) ** degree,
        }
        for name, light in lights.items():
            own = light - light.mean()
            own *= strength * NOISE / np.sqrt(SHAPE[1]) / np.linalg.norm(own)
            state = _state(own, rng, sites)
            taken[name] += outlined(state, _best(state))
    assert max(taken.values()) <= 0.05 * draws + 5 * np.sqrt(0.05 * draws)


@pytest.mark.parametrize("length", [3.0, 6.0, 10.0])
@pytest.mark.parametrize("sites", SITES)
def test_a_decay_is_told(sites: str, length: float) -> None:
    rng, draws, found = np.random.default_rng(5), 40, 0
    for _ in range(draws):
        own = np.exp(-np.arange(96.0)[::-1] / length)
        own -= own.mean()
        own *= 15 * NOISE / np.sqrt(SHAPE[1]) / np.linalg.norm(own)
        state = _state(own, rng, sites)
        found += outlined(state, _best(state))
    assert found > 0.7 * draws


@pytest.mark.parametrize("sites", SITES)
def test_a_decay_of_offsets_is_told_and_a_smooth_surface_is_none(sites: str) -> None:
    rng, draws = np.random.default_rng(6), 40
    u, line = np.linspace(-1, 1, SHAPE[0]), np.arange(96.0)[::-1]
    found = {"decay": 0, "surface": 0}
    for _ in range(draws):
        surface = np.polynomial.legendre.legval(u, [0.0, *rng.normal(size=4)])
        for name, own in (("decay", np.exp(-line / 6)), ("surface", surface)):
            means = own - own.mean()
            means *= 15 * NOISE / np.sqrt(SHAPE[1]) / np.linalg.norm(means)
            state = _state(means, rng, sites, "offset")
            found[name] += outlined(state, _best(state, "offset_dn"))
    assert found["decay"] > 0.7 * draws
    assert found["surface"] <= 0.05 * draws + 5 * np.sqrt(0.05 * draws)


def test_what_is_no_decay_is_not_asked() -> None:
    state = _state(np.zeros(96), np.random.default_rng(0))
    assert not outlined(state, effect("line_settling", offset_dn=1.0, length_pixels=5.0))
    assert not outlined(state, effect("prnu", sigma_percent=1.0))


@pytest.mark.parametrize("length", [0.0, 3.0, 9.0, 16.0])
def test_light_that_falls_to_both_ends_is_no_decay_from_them(length: float) -> None:
    """cos^4 from the middle, whose ends two long decays follow; or lines that settle at one end."""
    rng, u, denied = np.random.default_rng(3), np.linspace(-1, 1, SHAPE[0]), length > 0
    settles = np.exp(-np.arange(SHAPE[0]) / length) if denied else 0.0
    means = 4.0 * settles if denied else 4.0 * (1 + u**2 / 3) ** -2
    state = _state(means, rng)
    state.mismatches = [Stub(statistic="fixed_edge")]
    assert (edged(state, "shading") is not None) == denied
    state.mismatches = []
    assert edged(state, "shading") is None


@pytest.mark.parametrize("kind", ["shading", "tap_mismatch"])
@pytest.mark.parametrize("lines", [1, 6])
def test_an_edge_of_one_line_denies_no_halves_and_no_fall(kind: str, lines: int) -> None:
    """Charge of the last line has a neighbour on one side only; lines that settle are several."""
    rng, u = np.random.default_rng(4), np.linspace(-1, 1, SHAPE[0])
    means = np.where(u < 0, -1.0, 1.0) if kind == "tap_mismatch" else -(u**2) / 3
    settles = np.exp(-np.arange(SHAPE[0]) / lines) if lines > 1 else np.arange(SHAPE[0]) == 0
    several = lines > 1
    state = _state((0.2 if several else 1.0) * means + (6.0 if several else 3.0) * settles, rng)
    state.mismatches = [Stub(statistic="fixed_edge")]
    assert (edged(state, kind) is not None) == several
