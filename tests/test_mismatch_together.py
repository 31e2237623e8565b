"""Recordings that are simulated side by side are those that are simulated one by one."""

from typing import Any

import numpy as np
import pytest

from analysis.mismatch.layout import Layout
from analysis.mismatch.model import Model, simulate, simulated
from analysis.mismatch.observe import Observation
from analysis.mismatch.simulations import _groups
from analysis.mismatch.state import State
from analysis.mismatch.summed import Looked, SensorSums
from analysis.mismatch.together import _alike, most_together, shared_links, simulated_together
from analysis.mismatch.touches import ALL_SUMS, RECORDED, SPECTRA
from analysis.mismatch.vector import vector
from dsis.camera import Camera
from dsis.draw import Draw
from dsis.effects import Effect, Exposure
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.flicker import Flicker
from dsis.effects.image_lag import ImageLag
from dsis.effects.nonlinearity import Nonlinearity
from dsis.effects.periodic_noise import PeriodicNoise
from dsis.effects.readout_memory import ReadoutMemory
from dsis.effects.row_noise import RowNoise
from dsis.effects.saturation import Saturation
from dsis.exposing import Shared, link_numbers
from dsis.grid import PixelGrid
from effect_examples import KINDS, camera_with, example_of
from mismatch_recordings import camera, recorded, state_of

LIGHT, ROWS, DNL = Flicker(sigma_percent=1.0), RowNoise(sigma_dn=2.0), AdcDnl(rms_lsb=0.3)
BENT = Nonlinearity(percent_full_scale=2.0)
WAVE = PeriodicNoise(amplitude_dn=1.0, frequency=(0.21, 0.13))
OTHER = PeriodicNoise(amplitude_dn=1.5, frequency=(0.21, 0.13))
SCENE = np.linspace(100, 2000, 96 * 128, dtype=np.float32).reshape(96, 128)
SOME: tuple[tuple[Effect, ...], ...] = (
    (LIGHT, ROWS, WAVE, DNL),
    (LIGHT, ROWS, WAVE, AdcDnl(rms_lsb=0.4)),
    (LIGHT, ROWS, OTHER, DNL),
    (LIGHT, ROWS, WAVE),
    (ROWS, WAVE, DNL),
    (LIGHT, ROWS, WAVE, DNL, Saturation(full_well_dn=900.0)),
    (LIGHT, ROWS, WAVE, DNL),
)


@pytest.fixture(scope="module")
def state() -> State:
    return state_of(recorded(camera(), 3, frames=6, levels=(300.0, 900.0), scene=SCENE), camera())


def numbers(state: State, layout: Layout, seen: Observation) -> np.ndarray:
    return vector(layout, seen, state.calibrated.refit(layout, seen.levels)).values


def itself(seen: Observation) -> Observation:
    return seen


def test_side_by_side_is_as_one_by_one(state: State) -> None:
    layout, model = state.setting.layout, state.calibrated.model
    made = [ALL_SUMS, frozenset({SPECTRA}), *[ALL_SUMS] * (len(SOME) - 2)]
    models = [
        model.with_camera(model.camera.model_copy(update={"effect": effects})) for effects in SOME
    ]
    darker = models[0].camera.model_copy(update={"black_level": models[0].camera.black_level + 3})
    models[-1] = model.with_camera(darker)
    together = simulated_together(layout, 5, itself, (list(zip(models, made, strict=True)), 1))
    for own, sums, seen in zip(models, made, together, strict=True):
        alone = simulated(layout, 5, (own, 1, sums))
        np.testing.assert_array_equal(
            numbers(state, layout, seen), numbers(state, layout, alone), strict=True
        )
        assert seen.levels == alone.levels


@pytest.mark.parametrize("threads", [2, 5])
def test_a_lone_recording_is_the_same_in_threads(state: State, threads: int) -> None:
    """Exposures are looked at in any order and summed in their own."""
    layout, model = state.setting.layout, state.calibrated.model
    model = model.with_camera(model.camera.model_copy(update={"effect": SOME[0]}))
    alone = simulated(layout, 5, (model, 1, RECORDED))
    (seen,) = simulate(model, layout, [1], 5, threads, itself, RECORDED)
    np.testing.assert_array_equal(
        numbers(state, layout, seen), numbers(state, layout, alone), strict=True
    )
    assert seen.levels == alone.levels


def test_of_other_light_nothing_is_shared(state: State) -> None:
    layout, model = state.setting.layout, state.calibrated.model
    brighter = Model(model.camera, {name: 1.5 * own for name, own in model.signals.items()})
    one, two = simulated_together(layout, 5, itself, ([(model, ALL_SUMS), (brighter, ALL_SUMS)], 0))
    for seen, own in ((one, model), (two, brighter)):
        assert seen.levels == simulated(layout, 5, (own, 0, ALL_SUMS)).levels


def test_models_of_each_light_are_made_side_by_side(state: State) -> None:
    layout, model = state.setting.layout, state.calibrated.model
    brighter = Model(model.camera, {name: 1.5 * own for name, own in model.signals.items()})
    rows = model.camera.model_copy(update={"effect": (ROWS,)})
    wide = model.with_camera(model.camera.model_copy(update={"white_level": 2.0**20 - 1}))
    some = [wide, model, brighter, model.with_camera(rows), wide, brighter.with_camera(rows)]
    assert _alike(some) == [[0], [1, 3], [2, 5], [4]]
    made = simulated_together(layout, 5, itself, ([(own, ALL_SUMS) for own in some], 0))
    for seen, own in zip(made, some, strict=True):
        assert seen.levels == simulated(layout, 5, (own, 0, ALL_SUMS)).levels


def test_chains_begin_alike_up_to_what_differs() -> None:
    cameras = [camera(*effects) for effects in SOME]
    chains = [own.chain() for own in cameras]
    for own, chain in zip(cameras, chains, strict=True):
        links = shared_links(cameras[0], own)
        assert chain[:links] == chains[0][:links]
    assert shared_links(cameras[0], cameras[1]) == len(chains[0]) - 2
    other = camera(*SOME[0], segments=((0.6, 20.0, None),))
    assert shared_links(cameras[0], other) == 0


def test_links_have_a_number_for_what_they_make() -> None:
    """The same link, its place among those of its kind, the read-out; of a lag all before it."""
    lag, row = ImageLag(fraction=0.1), RowNoise(sigma_dn=1.0)
    chains = [(LIGHT, lag, ROWS), (LIGHT, lag, ROWS), (lag, row, ROWS), (LIGHT, ROWS)]
    first, again, other, darker = link_numbers(chains, [0, 0, 0, 1])
    assert first == again
    assert not set(first).intersection(other)  # the lag has no light before it, ROWS are second
    assert not set(first).intersection(darker)


def test_memory_of_noise_hangs_on_what_responds_before_it() -> None:
    memory = ReadoutMemory(fraction=0.1, lag_pixels=1)
    chains = [(LIGHT, *own, ROWS, memory) for own in ((), (BENT,), (BENT,))]
    straight, bent, again = (own[-1] for own in link_numbers(chains, [0, 0, 0]))
    assert straight != bent == again


@pytest.mark.parametrize("signal", [0.0, 700.0])
@pytest.mark.parametrize("kind", KINDS)
def test_a_frame_is_the_same_beside_other_cameras(kind: str, signal: float) -> None:
    """Effects that remember earlier frames, or redraw noise, among them."""
    made = camera_with(example_of(KINDS[kind]))
    if kind != "image_lag":
        made = made.model_copy(update={"effect": (*made.effect, ImageLag(fraction=0.02))})
    bare = made.model_copy(update={"effect": made.effect[1:]})
    grid = PixelGrid(12, 16, made.cfa)
    clean = np.full(grid.shape, signal, np.float32)
    cameras = [made, bare, made, bare]
    links = link_numbers([own.chain() for own in cameras], [0] * len(cameras))
    kept: dict[tuple[int, int, int], tuple[int, np.ndarray]] = {}
    for place, own in enumerate(cameras):
        again = {number for later in links[place + 1 :] for number in later}
        frames = [
            Camera.expose(
                own, clean, Draw(1), Draw(2), 4, grid, exposure_time_s=0.01, shared=shared
            )
            for shared in (None, Shared(links[place], again, kept))
        ]
        np.testing.assert_array_equal(*frames, strict=True)


def test_what_light_does_to_a_dark_is_made_and_looked_at_once(
    state: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    layout, model = state.setting.layout, state.calibrated.model
    effects = [(own, ROWS) for own in (Flicker(sigma_percent=1.0), Flicker(sigma_percent=2.0))]
    models = [model.with_camera(model.camera.model_copy(update={"effect": own})) for own in effects]
    looked, rows = [], []
    whole, apply = SensorSums.looked, RowNoise.apply

    def counted(self: SensorSums, name: str, *rest: Any) -> Looked:
        looked.append(name)
        return whole(self, name, *rest)

    def made(self: RowNoise, image: np.ndarray, exposure: Exposure) -> np.ndarray:
        rows.append(exposure.temporal.scope)
        return apply(self, image, exposure)

    monkeypatch.setattr(SensorSums, "looked", counted)
    monkeypatch.setattr(RowNoise, "apply", made)
    simulated_together(layout, 5, itself, ([(own, ALL_SUMS) for own in models], 1))
    for e in layout.uniform:
        times = 1 if e.kind == "dark" else 2
        assert looked.count(e.name) == times
        assert sum(e.name in scope for scope in rows) == times * len(e.numbers)


def test_groups_hold_each_once_and_are_enough_for_all_jobs() -> None:
    parting = {f"camera {i}": i % 5 for i in range(9)}
    missing = [(key, number) for number in range(2) for key in parting]
    groups = _groups(missing, parting, 4, 2)
    assert sorted((key, n) for keys, n in groups for key in keys) == sorted(missing)
    assert len(groups) == 8
    assert max(len(keys) for keys, _ in groups) <= 4
    assert _groups(missing[:1], parting, 4, 2) == [(["camera 0"], 0)]


def test_few_large_frames_are_held_at_once(state: State) -> None:
    assert most_together(state.setting.layout) > 16
    large = state.setting.layout.__class__((), 4000, 6000, *[camera().cfa, 64.0, 4095.0, {}, {}])
    assert most_together(large) == 1
