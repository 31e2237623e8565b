"""Promise: every effect is the same in a crop and in a mosaic, loads, and explains itself.

The test walks the registry: a new file in `dsis/effects` is tested the moment it exists.
"""

from pathlib import Path

import numpy as np
import pytest

from dsis.camera import read_camera, write_camera
from dsis.cfa import Cfa, mosaic
from dsis.draw import Draw
from dsis.effects import Exposure, Stage
from dsis.effects.catalogue import catalogue
from dsis.grid import PixelGrid
from effect_examples import KINDS, camera_with, every_kind, example_of


@every_kind
class TestLaws:
    def exposure(self, grid: PixelGrid, frame: int, image: np.ndarray) -> Exposure:
        return Exposure(
            grid,
            frame,
            Draw(1),
            Draw(2),
            image,
            camera_with().model_copy(update={"cfa": grid.cfa or Cfa.GBRG}).read_out,
            earlier=lambda k: image / np.float32(1 + k),
            exposure_time_s=0.2,
        )

    @pytest.mark.parametrize("cfa", [Cfa.RGGB, Cfa.MONO, None])
    def test_a_crop_sees_the_same_effect(self, name: str, cfa: Cfa | None) -> None:
        effect = example_of(KINDS[name])
        grid = PixelGrid(40, 50, cfa)
        image = np.random.default_rng(0).uniform(0, 3000, grid.shape).astype(np.float32)
        whole = effect.apply(image, self.exposure(grid, 4, image))
        part = image[5:30, 7:44]
        crop = effect.apply(part, self.exposure(PixelGrid(25, 37, cfa, 5, 7, 40, 50), 4, part))
        margin = effect.reach_pixels()
        inside = (slice(margin, 25 - margin), slice(margin, 37 - margin))
        np.testing.assert_array_equal(crop[inside], whole[5:30, 7:44][inside])

    def test_what_draws_nothing_is_the_same_on_every_sensor_and_in_every_frame(
        self, name: str
    ) -> None:
        effect = example_of(KINDS[name])
        grid = PixelGrid(40, 50, Cfa.RGGB)
        image = np.random.default_rng(0).uniform(0, 3000, grid.shape).astype(np.float32)
        one = self.exposure(grid, 4, image)
        others = [one._replace(frame=i, temporal=Draw(i), sensor=Draw(2 * i)) for i in range(5, 15)]
        deviates = np.random.default_rng(1).normal(size=grid.shape).astype(np.float32)

        def made(exposure: Exposure) -> np.ndarray:
            image_after = effect.apply(image, exposure)
            return np.stack([image_after, effect.reshape(deviates, exposure)])

        alike = all(np.array_equal(made(one), made(other)) for other in others)
        assert (alike and not effect.reshapes) == (not effect.draws)

    @pytest.mark.parametrize("cfa", [Cfa.RGGB, Cfa.MONO])
    def test_who_asks_for_earlier_frames_says_so(self, name: str, cfa: Cfa) -> None:
        effect, grid = example_of(KINDS[name]), PixelGrid(40, 50, cfa)
        image = np.random.default_rng(0).uniform(0, 3000, grid.shape).astype(np.float32)
        asked: list[int] = []

        def earlier(k: int) -> np.ndarray:
            asked.append(k)
            return image

        exposure = self.exposure(grid, 4, image)._replace(earlier=earlier)
        effect.reshape(effect.apply(image, exposure), exposure)
        assert bool(asked) == effect.looks_back

    def test_a_mosaic_is_the_sampled_planes(self, name: str) -> None:
        effect = example_of(KINDS[name])
        if effect.reach_pixels():
            return  # couples neighbouring sites: a mosaic's are of other colours
        planes = np.random.default_rng(0).uniform(0, 3000, (20, 30, 3)).astype(np.float32)
        sampled = mosaic(planes, Cfa.GBRG)
        full = effect.apply(planes, self.exposure(PixelGrid(20, 30), 1, planes))
        single = effect.apply(sampled, self.exposure(PixelGrid(20, 30, Cfa.GBRG), 1, sampled))
        np.testing.assert_array_equal(single, mosaic(full, Cfa.GBRG))

    def test_reshaped_noise_too_is_the_same_in_a_crop_and_in_a_mosaic(self, name: str) -> None:
        if not KINDS[name].reshapes:
            return  # leaves the base noise alone
        camera = camera_with(example_of(KINDS[name])).model_copy(update={"cfa": Cfa.GBRG})
        planes = np.random.default_rng(0).uniform(0, 3000, (80, 30, 3)).astype(np.float32)
        sampled = mosaic(planes, Cfa.GBRG)
        full = camera.expose(planes, Draw(1), Draw(2), 3, PixelGrid(80, 30), threads=2)
        single = camera.expose(sampled, Draw(1), Draw(2), 3, PixelGrid(80, 30, Cfa.GBRG))
        np.testing.assert_array_equal(single, mosaic(full, Cfa.GBRG))
        crop_grid = PixelGrid(60, 20, Cfa.GBRG, 7, 5)
        crop = camera.expose(sampled[7:67, 5:25], Draw(1), Draw(2), 3, crop_grid)
        np.testing.assert_array_equal(crop, single[7:67, 5:25])

    def test_the_given_image_is_left_alone(self, name: str) -> None:
        image = np.full((16, 16), 100.0, np.float32)
        image.flags.writeable = False
        grid = PixelGrid(16, 16, Cfa.MONO)
        made = example_of(KINDS[name]).apply(image, self.exposure(grid, 0, image))
        assert made.dtype == np.float32
        assert made.shape == image.shape

    def test_without_strength_nothing_happens(self, name: str) -> None:
        example = example_of(KINDS[name])
        strength = next((n for n, v in example if isinstance(v, float)), None)
        if strength is None or name in {"heavy_tailed_read_noise", "crosstalk", "saturation"}:
            return  # no parameter whose zero is "none"
        if name == "quantisation":
            return  # a step of 1 rounds
        grid = PixelGrid(16, 16, Cfa.RGGB)
        image = np.random.default_rng(0).uniform(0, 3000, grid.shape).astype(np.float32)
        none = {strength: 0.0, "gain_percent": 0.0} if name == "line_settling" else {strength: 0.0}
        nothing = KINDS[name](**dict(example) | none)
        np.testing.assert_array_equal(nothing.apply(image, self.exposure(grid, 2, image)), image)

    def test_it_loads_from_toml_as_it_was_written(self, name: str, tmp_path: Path) -> None:
        camera = camera_with(example_of(KINDS[name]))
        write_camera(camera, tmp_path / "camera.toml")
        assert read_camera(tmp_path / "camera.toml") == camera

    def test_it_documents_itself(self, name: str) -> None:
        kind = KINDS[name]
        assert kind.__doc__
        assert len(kind.__doc__) > 80
        assert kind.reference
        assert kind.confounders
        assert isinstance(kind.stage, Stage)
        assert kind.measures

    def test_bounds_are_kept(self, name: str) -> None:
        example = example_of(KINDS[name])
        for field, info in KINDS[name].model_fields.items():
            if isinstance(getattr(example, field), float):
                assert info.metadata, f"{field} has no bounds"
                with pytest.raises(ValueError, match=field):
                    KINDS[name](**dict(example) | {field: -1e9})


def test_the_page_of_effects_is_up_to_date() -> None:
    """If not: python -m dsis.effects.catalogue > docs/effects.md."""
    page = Path(__file__).resolve().parents[1] / "docs" / "effects.md"
    assert page.read_text(encoding="utf-8") == catalogue()
