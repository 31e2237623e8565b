"""Odds of what makes a gain uneven: against dense matrices, by their rates, and in the search."""

import sys
from math import log
from pathlib import Path
from types import SimpleNamespace as Stub
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import numpy as np
import pytest
from planter.light import blots
from scipy.stats import binom

from analysis.mismatch import find_mismatch
from analysis.mismatch.clues import Clues
from analysis.mismatch.gainmap import gains_beside
from analysis.mismatch.gainodds import _STRENGTHS, Cause, _Modes, _with, evidence_beside, evidences
from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.observe import observe
from analysis.mismatch.rivalled import rivalled
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.cfa import Cfa
from dsis.effects import Effect
from exposing import effect
from mismatch_recordings import TWO_LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

SHAPE = (96, 128)
ODDS = log(20)  # which chance has in one of 20 at most (Markov's inequality)
Y, X = np.mgrid[-1 : 1 : SHAPE[0] * 1j, -1 : 1 : SHAPE[1] * 1j]
LINE, COLUMN = np.mgrid[: SHAPE[0], : SHAPE[1]]
MADE = {
    Cause.LIGHT: Y + X / 2,
    Cause.HALVES_OF_ROWS: np.sign(Y),
    Cause.HALVES_OF_COLUMNS: np.sign(X),
    Cause.TOP: np.exp(-LINE / 5.0),
    Cause.BOTTOM: np.exp(-LINE[::-1] / 5.0),
    Cause.LEFT: np.exp(-COLUMN / 5.0),
    Cause.RIGHT: np.exp(-COLUMN[:, ::-1] / 5.0),
}


def _shaped(cause: Cause, z: float, seed: int) -> np.ndarray:
    """Return a map of noise 1 with a shape of so many standard errors."""
    noise = np.random.default_rng(seed).normal(size=SHAPE)
    if cause is Cause.FIELD:
        return noise + z / 50 * blots(seed, SHAPE, 6.0)
    shape = MADE[cause] - MADE[cause].mean()
    return noise + z * shape / np.linalg.norm(shape)


def test_shapes_beside_noise_are_as_likely_as_dense_matrices_say() -> None:
    """The size of all noise integrated over: |C|^(-1/2) (y' C^-1 y)^(-N/2) by plain algebra."""
    rng = np.random.default_rng(2)
    count, lines = 14, 9
    shapes, variances = rng.normal(size=(2, lines)), rng.uniform(0.5, 3, (3, count))
    seen = rng.normal(size=count)
    own = _Modes((5, 6), seen, variances, np.zeros(3), 3)
    found, beside = _with(shapes, own), _with(shapes[:1], own, shapes[1:] * 3)
    padded = np.hstack([shapes, np.zeros((2, count - lines))])
    for i, noise in enumerate(variances):
        for j, strength in enumerate(_STRENGTHS):
            for made, second in ((found, strength), (beside, 9.0)):
                whole = np.diag(noise) + padded.T @ np.diag([strength, second]) @ padded
                square = seen @ np.linalg.solve(whole, seen)
                expected = -np.linalg.slogdet(whole)[1] / 2 - count / 2 * np.log(square)
                assert made[i, j] == pytest.approx(expected + np.log(noise).sum() / 2)


@pytest.mark.parametrize("cause", Cause)
def test_what_is_there_is_the_likeliest(cause: Cause) -> None:
    """A field leans a little by chance: beside it the others are hardly less likely."""
    for seed in range(5):
        found = evidences(_shaped(cause, 15.0, seed))
        others = max(value for one, value in found.items() if one is not cause)
        assert found[cause] > ODDS
        assert found[cause] > others + (-ODDS if cause is Cause.FIELD else ODDS)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 50.0])
def test_the_unit_of_a_map_says_nothing(scale: float) -> None:
    image = _shaped(Cause.LIGHT, 8.0, 1)
    assert evidences(scale * image) == pytest.approx(evidences(image))


def test_noise_has_odds_no_oftener_than_one_in_so_many() -> None:
    """Noise of lines beside it, in half of the maps."""
    rng, tries = np.random.default_rng(3), 120
    often = dict.fromkeys(Cause, 0)
    for k in range(tries):
        image = rng.normal(size=SHAPE) + (k % 2) * 0.3 * rng.normal(size=(SHAPE[0], 1))
        for cause, value in evidences(image).items():
            often[cause] += value > ODDS
    assert max(often.values()) <= binom.isf(1e-3, tries, 1 / 20)


@pytest.mark.parametrize("z", [6.0, 12.0])
@pytest.mark.parametrize("right", [Cause.LIGHT, Cause.TOP, Cause.HALVES_OF_ROWS, Cause.FIELD])
def test_a_wrong_cause_is_believed_no_oftener_than_its_odds(right: Cause, z: float) -> None:
    often, tries = 0, 25
    for seed in range(tries):
        found = evidences(_shaped(right, z, seed))
        best = max(found, key=lambda one: found[one])
        others = max(value for one, value in found.items() if one is not best)
        often += best is not right and found[best] - others > ODDS and found[best] > ODDS
    assert often <= binom.isf(1e-3, tries, 1 / 20)


@pytest.mark.parametrize("z", [10.0, 40.0])
@pytest.mark.parametrize("sign", [-1, 1])
def test_two_causes_at_once_are_no_rivals(z: float, sign: int) -> None:
    """However strong the other is; and of two that are one nothing is left beside it."""
    tilt = MADE[Cause.LIGHT] / np.linalg.norm(MADE[Cause.LIGHT])
    both = _shaped(Cause.TOP, z, 5) + sign * 14 * tilt
    assert evidence_beside(both, Cause.LIGHT, Cause.TOP) > ODDS
    assert evidence_beside(both, Cause.TOP, Cause.LIGHT) > ODDS
    assert evidence_beside(_shaped(Cause.TOP, z, 7), Cause.LIGHT, Cause.TOP) < ODDS


def test_pixels_far_out_and_large_maps_change_little() -> None:
    image = _shaped(Cause.LIGHT, 12.0, 4)
    spoiled = image.copy()
    spoiled[::17, ::23] += 500
    found = evidences(spoiled)
    assert max(found, key=lambda one: found[one]) is Cause.LIGHT
    large = np.random.default_rng(1).normal(size=(700, 900)) + np.linspace(-0.05, 0.05, 900)
    found = evidences(large)
    assert max(found, key=lambda one: found[one]) is Cause.LIGHT


@pytest.mark.parametrize("shape", [(3, 4), (4, 4), (5, 40), (64, 5)])
def test_small_maps_and_maps_without_noise_say_nothing_wrong(shape: tuple[int, int]) -> None:
    found = evidences(np.random.default_rng(1).normal(size=shape))
    assert all(value < ODDS for value in found.values())
    assert not evidences(np.zeros(shape))


def _beside(recording: InMemory, *effects: Any, cfa: str = "MONO") -> Clues:
    """Return clues of a recording's own maps."""
    source, numbers = Source(recording), Split.of(recording).development
    layout = layout_of(recording, numbers, source.frames)
    seen = observe(layout, lambda name: source.frames(name, numbers[name]), keep=True)
    nothing: Any = None
    return Clues(layout, seen, nothing, nothing, nothing, camera(*effects, cfa=cfa))


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_edges_of_shared_charge_are_no_decays(cfa: str) -> None:
    """Pixels at an edge have fewer neighbours: their lines differ, by what sharing explains."""
    shared = effect("brighter_fatter", per_dn=2e-5)
    clues = _beside(recorded(camera(shared, cfa=cfa), 3), shared, cfa=cfa)
    image = gains_beside(clues, [shared])
    assert image is not None
    assert max(evidences(image).values()) < ODDS


def _of_levels(times: tuple[float, float], dark: bool) -> Layout:
    """Return flats of eight levels, each at two exposure times in turn."""
    flats = [
        Taken(f"flat-{i}-{j}", "flat", time, None, (0, 1))
        for i in range(8)
        for j, time in enumerate(times)
    ]
    darks = [Taken("dark", "dark", times[0], 0.0, (0, 1))] if dark else []
    signal = {(own.name, "MONO"): 200.0 * (k // 2 + 1) + k % 2 for k, own in enumerate(flats)}
    signal |= {(own.name, "MONO"): 0.0 for own in darks}
    variance = {place: 4 + 0.1 * value for place, value in signal.items()}
    return Layout((*darks, *flats), *SHAPE, Cfa.MONO, 0.0, 4095.0, signal, variance)


@pytest.mark.parametrize("dark", [True, False])
@pytest.mark.parametrize("times", [(0.01, 0.02), (0.01, 0.0100001)])
def test_levels_at_two_exposure_times_tell_what_grows_with_light(
    times: tuple[float, float], dark: bool
) -> None:
    """Every second of them has one time alone: what grows with it would be told from nothing."""
    layout, flat = _of_levels(times, dark), np.zeros(SHAPE)
    clues: Any = Stub(
        layout=layout,
        image=lambda _: {"MONO": (flat, 1.0)},
        camera=camera(),
        scale=lambda name, channel: layout.regressors(channel).scales[name],
    )
    lean = effect("shading", falloff_percent=0.0, tilt_down_percent=2.0)
    image = gains_beside(clues, [lean])
    assert image is not None
    # A tilt from 2 % less to 2 % more at the edges, taken off even gains.
    assert np.ptp(image) == pytest.approx(4 * (SHAPE[0] - 1) / SHAPE[0], rel=1e-3)
    assert abs(np.corrcoef(image.mean(1), Y[:, 0])[0, 1]) > 0.999


def _state(own: Effect, **images: np.ndarray) -> Any:
    """Return the state of a camera with an effect, whose maps are of noise 1."""
    layout = Layout((), *SHAPE, Cfa.MONO, 0.0, 4095.0, {}, {})
    seen = Stub(images={("MONO", name): (image, 1.0) for name, image in images.items()})
    setting = Stub(layout=layout, seen=seen)
    return Stub(clues=lambda: None, camera=camera(own), setting=setting)


LEANING = {"falloff_percent": 0.0, "tilt_right_percent": 0.3}


@pytest.mark.parametrize(
    ("cause", "denied"), [(Cause.LIGHT, False), (Cause.RIGHT, True), (Cause.FIELD, True)]
)
def test_uneven_light_is_denied_by_what_is_as_likely(
    monkeypatch: pytest.MonkeyPatch, cause: Cause, denied: bool
) -> None:
    image = _shaped(cause, 12.0, 3)
    monkeypatch.setattr("analysis.mismatch.rivalled.gains_beside", lambda *_: image)
    one = effect("shading", **LEANING)
    said = rivalled(_state(one), one)
    assert (said is not None) == denied
    if said is not None:
        assert said.share < 0.5
        assert cause.value in said.why


@pytest.mark.parametrize(("offset", "denied"), [(0.0, True), (0.001, True), (8.0, False)])
def test_a_decay_with_an_offset_is_asked_unless_that_is_sure(
    monkeypatch: pytest.MonkeyPatch, offset: float, denied: bool
) -> None:
    """The map of gains leans, and no more: a decay of it may be light as well."""
    image = _shaped(Cause.LIGHT, 14.0, 3)
    monkeypatch.setattr("analysis.mismatch.rivalled.gains_beside", lambda *_: image)
    one = effect(
        "line_settling", offset_dn=offset, gain_percent=0.3, length_pixels=20.0, edge="bottom"
    )
    rng = np.random.default_rng(4)
    dark = offset * np.exp(-LINE[::-1] / 20.0) + rng.normal(0, 1.0, SHAPE)
    assert (rivalled(_state(one, offset=dark), one) is not None) == denied


def test_only_uneven_gains_are_asked_of_the_map() -> None:
    for one in (
        effect("prnu", sigma_percent=1.0),
        effect("tap_mismatch", gain_percent=1.0, regions="even_odd_rows"),
        effect("line_settling", offset_dn=2.0, gain_percent=0.0, length_pixels=4.0, edge="left"),
    ):
        assert rivalled(_state(one), one) is None


@pytest.mark.long
def test_a_decay_without_its_word_is_no_uneven_light() -> None:
    own = {"offset_dn": 0.0, "gain_percent": 0.5, "length_pixels": 4.0, "edge": "bottom"}
    words = frozenset({"shading", "tap_mismatch", "smooth_prnu", "row_prnu", "column_prnu"})
    true = recorded(camera(effect("line_settling", **own)), 5, columns=64, levels=TWO_LEVELS)
    found = find_mismatch(camera(), true, seed=1, vocabulary=words)
    assert not {"shading", "tap_mismatch"} & {one.effect for one in found.omitted_physics}
    assert found.mismatches
