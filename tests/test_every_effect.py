"""Promise: every effect of the registry does what it states, and nothing else.

The test walks the registry: a new file in `dsis/effects` is tested the moment it exists.
"""

from pathlib import Path

import numpy as np
import pytest

from dsis.camera import BaseNoise, Camera, Segment, read_camera, write_camera
from dsis.cfa import Cfa, mosaic
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, OperatingPoint, Stage, registry
from dsis.grid import PixelGrid
from dsis.measures import MEASURES, Estimate, measure

Z_MAX = 5.0
FRAMES, GRID = 100, PixelGrid(96, 64, Cfa.MONO)
LEVELS_DN = (0.0, 400.0, 5000.0)

BACKGROUND = Camera(
    name="background",
    cfa=Cfa.MONO,
    black_level=500.0,
    white_level=65535.0,
    bit_depth=16,
    noise=BaseNoise(
        segment=(
            Segment(upper_dn=1000.0, slope=0.5, intercept=30.0),
            Segment(slope=0.5, intercept=80.0),
        )
    ),
)

EFFECTS = list(registry().values())


def example_of(kind: type[Effect]) -> Effect:
    """Return an effect with the examples that its fields declare."""
    fields = {n: f for n, f in kind.model_fields.items() if n != "kind" and f.is_required()}
    missing = [name for name, field in fields.items() if not field.examples]
    assert not missing, f"{kind.__name__}: no example of {missing}"
    return kind(**{name: field.examples[0] for name, field in fields.items()})


def recording(camera: Camera, level: float) -> np.ndarray:
    clean = np.full(GRID.shape, level, np.float32)
    temporal, sensor = Draw(11, (f"{level}",)), Draw(12)
    frames = [camera.expose(clean, temporal, sensor, t, GRID) for t in range(FRAMES)]
    return np.stack(frames)


@pytest.fixture(scope="module")
def background() -> dict[float, dict[str, Estimate]]:
    return {level: measure(recording(BACKGROUND, level)) for level in LEVELS_DN}


@pytest.mark.parametrize("level", LEVELS_DN)
def test_background_measures_what_the_base_model_says(
    background: dict[float, dict[str, Estimate]], level: float
) -> None:
    variance = 0.5 * level + (80.0 if level >= 1000 else 30.0) + 1 / 12
    expected = dict.fromkeys(MEASURES, 0.0) | {"level": level, "pixel_variance": variance}
    for name, value in expected.items():
        found = background[level][name]
        assert abs(found.value - value) < Z_MAX * found.standard_error, name


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.model_fields["kind"].default)
@pytest.mark.parametrize("level", LEVELS_DN)
def test_effect_changes_the_measures_it_states_and_no_other(
    kind: type[Effect], level: float, background: dict[float, dict[str, Estimate]]
) -> None:
    effect = example_of(kind)
    assert effect.measures <= set(MEASURES)
    stated = effect.contributions(OperatingPoint(signal_dn=level))
    assert set(stated) <= effect.measures
    found = measure(recording(BACKGROUND.model_copy(update={"effect": (effect,)}), level))
    for name in MEASURES:
        if name in effect.measures and name not in stated:
            continue  # declared, without a closed form
        before, after = background[level][name], found[name]
        change = after.value - before.value
        error = np.hypot(before.standard_error, after.standard_error)
        z = (change - stated.get(name, 0.0)) / error
        assert abs(z) < Z_MAX, f"{name}: {change:.4g}, stated {stated.get(name, 0.0):.4g}"


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.model_fields["kind"].default)
def test_effect_is_seen_at_some_level(
    kind: type[Effect], background: dict[float, dict[str, Estimate]]
) -> None:
    """An example too weak to be measured would make the contract empty."""
    effect = example_of(kind)
    z = 0.0
    for level in LEVELS_DN:
        found = measure(recording(BACKGROUND.model_copy(update={"effect": (effect,)}), level))
        for name in effect.measures:
            before, after = background[level][name], found[name]
            error = np.hypot(before.standard_error, after.standard_error)
            z = max(z, abs(after.value - before.value) / error)
    assert z > 2 * Z_MAX


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.model_fields["kind"].default)
class TestLaws:
    def exposure(self, grid: PixelGrid, frame: int, image: np.ndarray) -> Exposure:
        return Exposure(grid, frame, Draw(1), Draw(2), image)

    def test_a_crop_sees_the_same_effect(self, kind: type[Effect]) -> None:
        image = np.random.default_rng(0).uniform(0, 3000, (40, 50)).astype(np.float32)
        effect = example_of(kind)
        grid = PixelGrid(40, 50, Cfa.RGGB)
        whole = effect.apply(image, self.exposure(grid, 4, image))
        part = image[5:30, 7:44]
        crop_grid = PixelGrid(25, 37, Cfa.RGGB, 5, 7)
        crop = effect.apply(part, self.exposure(crop_grid, 4, part))
        np.testing.assert_array_equal(crop, whole[5:30, 7:44])

    def test_a_mosaic_is_the_sampled_planes(self, kind: type[Effect]) -> None:
        planes = np.random.default_rng(0).uniform(0, 3000, (20, 30, 3)).astype(np.float32)
        sampled = mosaic(planes, Cfa.GBRG)
        effect = example_of(kind)
        full = effect.apply(planes, self.exposure(PixelGrid(20, 30), 1, planes))
        single = effect.apply(sampled, self.exposure(PixelGrid(20, 30, Cfa.GBRG), 1, sampled))
        np.testing.assert_array_equal(single, mosaic(full, Cfa.GBRG))

    def test_the_given_image_is_left_alone(self, kind: type[Effect]) -> None:
        image = np.full((16, 16), 100.0, np.float32)
        image.flags.writeable = False
        grid = PixelGrid(16, 16, Cfa.MONO)
        made = example_of(kind).apply(image, self.exposure(grid, 0, image))
        assert made.dtype == np.float32
        assert made.shape == image.shape

    def test_it_loads_from_toml_as_it_was_written(self, kind: type[Effect], tmp_path: Path) -> None:
        camera = BACKGROUND.model_copy(update={"effect": (example_of(kind),)})
        write_camera(camera, tmp_path / "camera.toml")
        assert read_camera(tmp_path / "camera.toml") == camera

    def test_it_documents_itself(self, kind: type[Effect]) -> None:
        assert kind.__doc__
        assert len(kind.__doc__) > 80
        assert kind.reference
        assert isinstance(kind.stage, Stage)
        assert kind.measures


def test_fixed_patterns_are_fixed_and_temporal_noise_is_not() -> None:
    image = np.full((32, 32), 1000.0, np.float32)
    grid = PixelGrid(32, 32, Cfa.MONO)
    prnu, rows = registry()["prnu"](sigma_percent=1.0), registry()["row_noise"](sigma_dn=2.0)

    def made(effect: Effect, frame: int, sensor: int) -> np.ndarray:
        return effect.apply(image, Exposure(grid, frame, Draw(1), Draw(sensor), image))

    np.testing.assert_array_equal(made(prnu, 0, 5), made(prnu, 9, 5))
    assert np.abs(made(prnu, 0, 5) - made(prnu, 0, 6)).max() > 1
    assert np.abs(made(rows, 0, 5) - made(rows, 1, 5)).max() > 1


def test_another_effect_leaves_the_noise_of_the_others_as_it_was() -> None:
    """The row offsets themselves are the whole difference, to a code of rounding."""
    clean = np.full(GRID.shape, 3000.0, np.float32)
    effect = registry()["row_noise"](sigma_dn=4.0)
    with_rows = BACKGROUND.model_copy(update={"effect": (effect,)})
    before = BACKGROUND.expose(clean, Draw(1), Draw(2), 3, GRID)
    after = with_rows.expose(clean, Draw(1), Draw(2), 3, GRID)
    offsets = 4.0 * Draw(1).rows("row_noise", GRID, 3)[:, np.newaxis]
    assert np.abs(after - before - offsets).max() <= 1.0


def test_links_are_sorted_as_light_and_charge_meet_them() -> None:
    effects = tuple(example_of(kind) for kind in reversed(EFFECTS))
    chain = BACKGROUND.model_copy(update={"effect": effects}).chain()
    kinds = [link.kind for link in chain]
    assert [link.stage for link in chain] == sorted(link.stage for link in chain)
    assert kinds.index("prnu") < kinds.index("shot_noise") < kinds.index("read_noise")
    assert kinds.index("read_noise") < kinds.index("row_noise")
    assert kinds[-1] == "conversion"
