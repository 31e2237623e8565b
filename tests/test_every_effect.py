"""Promise: every effect of the registry does what it states, and nothing else.

The test walks the registry: a new file in `dsis/effects` is tested the moment it exists.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from dsis.camera import BaseNoise, Camera, Segment, read_camera, write_camera
from dsis.cfa import Cfa, mosaic
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, OperatingPoint, Stage, registry
from dsis.effects.catalogue import catalogue
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.measures import MEASURES, Estimate, measure

Z_MAX = 5.0
REPEATS, FRAMES, ROWS, COLUMNS = 3, 64, 96, 64
EXPOSURE_TIME_S = 0.1
SLOPE_DN, SWITCH_DN, INTERCEPTS_DN2 = 1.5, 1000.0, (30.0, 80.0)
LEVELS_DN = (0.0, 400.0, 5000.0)

BACKGROUND = Camera(
    name="background",
    cfa=Cfa.MONO,
    black_level=500.0,
    white_level=65535.0,
    bit_depth=16,
    noise=BaseNoise(
        segment=(
            Segment(upper_dn=SWITCH_DN, slope=SLOPE_DN, intercept=INTERCEPTS_DN2[0]),
            Segment(slope=SLOPE_DN, intercept=INTERCEPTS_DN2[1]),
        )
    ),
)

KINDS = registry()
every_kind = pytest.mark.parametrize("name", KINDS)


def example_of(kind: type[Effect]) -> Effect:
    """Return an effect with the examples that its fields declare."""
    fields = {n: f for n, f in kind.model_fields.items() if n != "kind"}
    missing = [n for n, f in fields.items() if f.is_required() and not f.examples]
    assert not missing, f"{kind.__name__}: no example of {missing}"
    return kind(**{name: f.examples[0] for name, f in fields.items() if f.examples})


STRONG: dict[str, tuple[dict[str, object], ...]] = {
    "adc_dnl": ({"rms_lsb": 2.0},),
    "amp_glow": ({"dn_per_s": 2e4}, {"dn_per_s": 1e5, "place": "top", "extent": 0.05}),
    "bistable_pattern": ({"amplitude_dn": 30.0}, {"amplitude_dn": 30.0, "frequency": (0, 0.5)}),
    "brighter_fatter": ({"per_dn": 8e-5}, {"per_dn": 2e-4}),
    "crosstalk": ({"fraction": 0.2}, {"fraction": 0.04}),
    "hot_pixels": ({"mean_dn_per_s": 3e4}, {"mean_dn_per_s": 3e4, "pixel_fraction": 0.5}),
    "impulse": ({"mean_dn": 3000.0},),
    "periodic_noise": ({"amplitude_dn": 30.0}, {"amplitude_dn": 30.0, "frequency": (0, 0.2)}),
    "pink_noise": ({"sigma_dn": 20.0},),
    "quantisation": ({"step_dn": 2.5}, {"step_dn": 30.0}, {"step_dn": 100.0}),
    "readout_memory": ({"fraction": 0.8}, {"fraction": 0.8, "lag_pixels": 1, "along": "columns"}),
    "rts": ({"amplitude_dn": 60.0, "pixel_fraction": 0.5, "switch_probability": 0.02},),
    "shading": ({"falloff_percent": 90.0},),
    "spatial_filtering": ({"fraction": 0.2}, {"fraction": 0.04}),
    "tap_mismatch": (
        {"gain_percent": 40.0, "regions": "even_odd_columns"},
        {"gain_percent": 40.0, "regions": "even_odd_rows"},
    ),
}
"""Instances beside the example: what an effect can do only where it is strong is seen with them."""

LEADING_ORDER = {"brighter_fatter", "crosstalk", "readout_memory", "spatial_filtering"}
"""Whose closed forms hold for weak coupling: of infinite planes, or of first order in strength."""


def camera_with(*effects: Effect) -> Camera:
    """Return the background with effects: monochrome unless an effect needs colours."""
    unfit = any(effect.unfit_for(BACKGROUND.read_out) for effect in effects)
    cfa = Cfa.RGGB if unfit else Cfa.MONO
    return BACKGROUND.model_copy(update={"effect": effects, "cfa": cfa})


def point_at(level: float) -> OperatingPoint:
    segment = int(level >= SWITCH_DN)
    return OperatingPoint(
        signal_dn=level,
        slope_dn=SLOPE_DN,
        read_variance_dn2=INTERCEPTS_DN2[segment],
        segment=segment,
        full_scale_dn=65035.0,
        frames=FRAMES,
        rows=ROWS,
        columns=COLUMNS,
        exposure_time_s=EXPOSURE_TIME_S,
    )


@cache
def measured(name: str, level: float, repeat: int, strong: int = -1) -> dict[str, Estimate]:
    """Return the measures of a recording with the effect (empty: none): of Gr where in colour.

    `strong` counts the instances of `STRONG`; -1 is the example.
    """
    camera = BACKGROUND
    if name:
        more = STRONG[name][strong] if strong >= 0 else {}
        camera = camera_with(KINDS[name](**dict(example_of(KINDS[name])) | more))
    step = 1 if camera.cfa is Cfa.MONO else 2
    grid = PixelGrid(step * ROWS, step * COLUMNS, camera.cfa)
    clean = np.full(grid.shape, level, np.float32)
    temporal, sensor = Draw(11, (f"{level}", f"{repeat}")), Draw(12, (f"{repeat}",))
    stack = np.stack(
        [
            camera.expose(clean, temporal, sensor, t, grid, exposure_time_s=EXPOSURE_TIME_S)
            for t in range(FRAMES)
        ]
    )
    return measure(np.ascontiguousarray(stack[:, ::step, step - 1 :: step]))


def changes(name: str, level: float, quantity: str, strong: int = -1) -> tuple[np.ndarray, float]:
    """Return a measure's change in each repeat, and the mean square of both errors together."""
    pairs = [(measured("", level, r)[quantity], measured(name, level, r, strong)[quantity])
             for r in range(REPEATS)]  # fmt: skip
    own = np.mean([b.standard_error**2 + a.standard_error**2 for b, a in pairs])
    return np.array([after.value - before.value for before, after in pairs]), float(own)


def change(name: str, level: float, quantity: str, strong: int = -1) -> tuple[float, float]:
    """Return the mean change of a measure over the repeats, and its standard error.

    Beside the errors of both measurements, what the effect itself scatters from one recording to
    the next: a sign or a phase per frame, a few strong pixels.
    """
    found, own = changes(name, level, quantity, strong)
    return float(found.mean()), float(np.sqrt((own + found.var(ddof=1)) / REPEATS))


@pytest.mark.parametrize("level", LEVELS_DN)
def test_background_measures_what_the_base_model_says(level: float) -> None:
    variance = point_at(level).variance_dn2
    known = {"level": level, "pixel_variance": variance, "code_spacing": 1.0}
    for repeat in range(REPEATS):
        for quantity, found in measured("", level, repeat).items():
            expected = known.get(quantity, found.null_value)
            assert abs(found.value - expected) < Z_MAX * found.standard_error, quantity


@every_kind
@pytest.mark.parametrize("level", LEVELS_DN)
def test_effect_changes_the_measures_it_states_and_no_other(name: str, level: float) -> None:
    effect = example_of(KINDS[name])
    assert effect.measures <= set(MEASURES)
    stated = effect.contributions(point_at(level))
    assert set(stated) <= effect.measures
    assert_changes(name, level, stated)


@pytest.mark.parametrize(
    ("name", "strong"), [(n, i) for n, s in STRONG.items() for i in range(len(s))]
)
@pytest.mark.parametrize("level", LEVELS_DN)
def test_a_strong_effect_too_changes_no_other_measure(name: str, level: float, strong: int) -> None:
    """Strength shows what an example hides; closed forms of leading order do not reach so far."""
    effect = KINDS[name](**dict(example_of(KINDS[name])) | STRONG[name][strong])
    stated = effect.contributions(point_at(level)) if name not in LEADING_ORDER else {}
    assert_changes(name, level, stated, strong)


def assert_changes(name: str, level: float, stated: Mapping[str, float], strong: int = -1) -> None:
    for quantity in MEASURES:
        if quantity in KINDS[name].measures and quantity not in stated:
            continue  # declared, without a closed form
        found, error = change(name, level, quantity, strong)
        if strong >= 0 and np.isnan(found):
            continue  # so coarse that one code is left: correlations and spacing are unknown
        says = stated.get(quantity, 0.0)
        assert abs(found - says) < Z_MAX * error, f"{quantity}: {found:.4g}, stated {says:.4g}"


@pytest.mark.parametrize("name", ["crosstalk", "spatial_filtering"])
def test_neighbours_correlate_as_stated_up_to_twice_the_example(name: str) -> None:
    """The limit that `OperatingPoint.filtered` states: borders show beyond."""
    level, strong = 5000.0, len(STRONG[name]) - 1
    effect = KINDS[name](**dict(example_of(KINDS[name])) | STRONG[name][strong])
    assert_changes(name, level, effect.contributions(point_at(level)), strong)


@every_kind
def test_effect_is_seen_at_some_level(name: str) -> None:
    """An example too weak to be measured would make the contract empty."""
    z = []
    for level in LEVELS_DN:
        for quantity in KINDS[name].measures:
            # Judged by what the measure does where nothing is there.
            error = measured("", level, 0)[quantity].standard_error * np.sqrt(2 / REPEATS)
            found, _ = change(name, level, quantity)
            z.append(abs(found) / error if np.isfinite(found) else 0.0)
    assert max(z) > 2 * Z_MAX


@every_kind
def test_what_is_declared_without_a_closed_form_is_seen(name: str) -> None:
    """A measure that no strength changes is declared in vain, and hides what the effect is not."""
    effect = example_of(KINDS[name])
    stated = {q for level in LEVELS_DN for q in effect.contributions(point_at(level))}
    for quantity in sorted(effect.measures - stated):
        assert any(
            seen(name, quantity, level, strong)
            for strong in range(-1, len(STRONG.get(name, ())))
            for level in LEVELS_DN
        ), quantity


def seen(name: str, quantity: str, level: float, strong: int) -> bool:
    """Tell whether a measure changes by more than the errors of both recordings allow.

    The sign of some changes is each sensor's own, so that their mean says nothing: squares are
    summed, and judged by the chance that one normal deviate has of passing `Z_MAX`.
    """
    found, own = changes(name, level, quantity, strong)
    square = float(found @ found) / own if own > 0 else 0.0
    # False where the measure is unknown.
    return square > stats.chi2.isf(2 * stats.norm.sf(Z_MAX), found.size)


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
        nothing = KINDS[name](**dict(example) | {strength: 0.0})
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


def test_temporal_effects_change_from_frame_to_frame_and_fixed_ones_do_not() -> None:
    """What holds for all frames shows in fixed measures or the level, and in no other draw."""
    grid = PixelGrid(32, 32, Cfa.RGGB)
    image = np.full(grid.shape, 1000.0, np.float32)
    read_out = camera_with().model_copy(update={"cfa": Cfa.RGGB}).read_out
    temporal = {
        "bistable_pattern", "black_level_drift", "column_noise", "flicker", "impulse",
        "line_flicker", "periodic_noise", "pink_noise", "row_noise", "rts",
    }  # fmt: skip

    def made(effect: Effect, frame: int, sensor: int) -> np.ndarray:
        exposure = Exposure(
            grid, frame, Draw(1), Draw(sensor), image, read_out, lambda _: image, 0.2
        )
        return effect.apply(image, exposure)

    for name, kind in KINDS.items():
        effect = example_of(kind)
        frames = np.array([made(effect, frame, 5) for frame in range(8)])
        assert (np.ptp(frames, 0).max() > 0) == (name in temporal), name


def test_another_effect_leaves_the_noise_of_the_others_as_it_was() -> None:
    """The row offsets themselves are the whole difference, to a code of rounding."""
    grid = PixelGrid(ROWS, COLUMNS, Cfa.MONO)
    clean = np.full(grid.shape, 3000.0, np.float32)
    camera = camera_with(KINDS["row_noise"](sigma_dn=4.0))
    before = BACKGROUND.expose(clean, Draw(1), Draw(2), 3, grid)
    after = camera.expose(clean, Draw(1), Draw(2), 3, grid)
    offsets = 4.0 * Draw(1).rows("row_noise", grid, 3)[:, np.newaxis]
    assert np.abs(after - before - offsets).max() <= 1.0


def test_a_second_effect_of_a_kind_has_noise_of_its_own() -> None:
    grid = PixelGrid(512, 8, Cfa.MONO)
    clean = np.full(grid.shape, 3000.0, np.float32)
    rows = KINDS["row_noise"](sigma_dn=40.0)
    one, two = (
        camera_with(*effects).expose(clean, Draw(1), Draw(2), 3, grid).mean(1) - 3000
        for effects in ((rows,), (rows, rows))
    )
    second = two - one
    assert abs(np.corrcoef(one, second)[0, 1]) < Z_MAX / np.sqrt(512)
    assert abs(second.var() / 40**2 - 1) < Z_MAX * np.sqrt(2 / 512)


def test_links_are_sorted_as_light_and_charge_meet_them() -> None:
    effects = tuple(example_of(kind) for kind in reversed(KINDS.values()))
    kinds = [link.kind for link in camera_with(*effects).chain()]
    stages = [link.stage for link in camera_with(*effects).chain()]
    assert stages == sorted(stages)
    assert kinds.index("prnu") < kinds.index("dark_current") < kinds.index("shot_noise")
    assert kinds.index("shot_noise") < kinds.index("crosstalk") < kinds.index("read_noise")
    assert kinds.index("read_noise") < kinds.index("row_noise")
    assert kinds[-1] == "conversion"


def test_all_effects_together_are_simulated() -> None:
    effects = tuple(example_of(kind) for kind in KINDS.values())
    grid = PixelGrid(24, 32, Cfa.RGGB)
    clean = np.full(grid.shape, 2000.0, np.float32)
    camera = camera_with(*effects)
    frames = [
        camera.expose(clean, Draw(1), Draw(2), 1, grid, exposure_time_s=0.1, threads=threads)
        for threads in (1, 2)
    ]
    np.testing.assert_array_equal(*frames)
    np.testing.assert_array_equal(frames[0], np.rint(frames[0]))


class TestRefusals:
    def read(self, tmp_path: Path, effects: str, *, segments: int = 1, cfa: str = "MONO") -> Camera:
        upper = "[[noise.segment]]\nupper_dn = 100.0\nslope = 1.0\nintercept = 2.0\n"
        text = f"""schema = "dsis-camera/1"
name = "x"
cfa = "{cfa}"
black_level = 10
white_level = 1023
bit_depth = 10
[noise]
{upper if segments == 2 else ""}
[[noise.segment]]
slope = 1.0
intercept = 2.0
"""
        path = tmp_path / "camera.toml"
        path.write_text(text + effects)
        return read_camera(path)

    def test_what_a_camera_cannot_have(self, tmp_path: Path) -> None:
        text = """[[effect]]
kind = "channel_imbalance"
gain_percent = 1.0
[[effect]]
kind = "dual_gain_mismatch"
gain_error_percent = 1.0
"""
        with pytest.raises(InputError) as refused:
            self.read(tmp_path, text)
        assert "effect[0] (channel_imbalance): needs a Bayer mosaic" in str(refused.value)
        assert "effect[1] (dual_gain_mismatch): needs a second" in str(refused.value)
        self.read(tmp_path, text, segments=2, cfa="RGGB")

    def test_a_second_gain_belongs_to_the_base_model(self, tmp_path: Path) -> None:
        text = '[[effect]]\nkind = "dual_gain"\n[[effect]]\nkind = "row_nois"\n'
        with pytest.raises(InputError) as refused:
            self.read(tmp_path, text)
        first, second = str(refused.value).splitlines()
        assert first.endswith(
            "effect[0].kind: is 'dual_gain', which is no effect: write a second [[noise.segment]]"
        )
        assert "effect[1].kind: is 'row_nois' (did you mean row_noise?)" in second

    @pytest.mark.parametrize(("level", "bits", "says"), [
        ("1022.5", "10", r"white_level is 1022\.5, must be a whole number"),
        ("1023", "25", "bit_depth is 25, must be <= 24: frames are computed in single precision"),
    ])  # fmt: skip
    def test_codes_that_cannot_be(self, tmp_path: Path, level: str, bits: str, says: str) -> None:
        path = tmp_path / "camera.toml"
        write_camera(BACKGROUND, path)
        text = path.read_text().replace("white_level = 65535.0", f"white_level = {level}")
        path.write_text(text.replace("bit_depth = 16", f"bit_depth = {bits}"))
        with pytest.raises(InputError, match=says):
            read_camera(path)

    def test_a_law_given_twice(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="poisson_shot_noise is given 2 times"):
            self.read(tmp_path, '[[effect]]\nkind = "poisson_shot_noise"\n' * 2)

    def test_growth_without_an_exposure_time(self, tmp_path: Path) -> None:
        camera = self.read(tmp_path, '[[effect]]\nkind = "dark_current"\ndn_per_s = 3.0\n')
        grid = PixelGrid(4, 4, Cfa.MONO)
        clean = np.zeros((4, 4), np.float32)
        with pytest.raises(InputError, match=r"dark_current.*exposure time"):
            camera.expose(clean, Draw(1), Draw(2), 0, grid)
        camera.expose(clean, Draw(1), Draw(2), 0, grid, exposure_time_s=0.0)
