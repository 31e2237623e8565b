"""Camera to display: OpenColorIO's views against closed forms, and from several threads."""

import json
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray

from dsis.color import STUDIO_CONFIG, Color, DisplayTransform, white_balanced
from dsis.errors import InputError
from dsis.model import structure

VIEWS = ["ACES 1.0 - SDR Video", "Un-tone-mapped"]
CODE = 1.0 / 255.0
D65_XY = (0.3127, 0.3290)
REC_709_XY = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)]
P3_XY = [(0.680, 0.320), (0.265, 0.690), (0.150, 0.060)]


def transform(view: str, scene_space: str = "Linear ARRI Wide Gamut 3") -> DisplayTransform:
    return DisplayTransform(Color(view=view, scene_space=scene_space))


def grey(*values: float) -> NDArray[np.float32]:
    return np.repeat(np.array(values, np.float32)[None, :, None], 3, axis=2)


def scene(seed: int = 1, rows: int = 40, columns: int = 61) -> NDArray[np.float32]:
    """Linear light as noisy raw gives it: dark negatives, mid-tones, highlights."""
    light = np.exp(np.random.default_rng(seed).normal(-2.0, 1.5, (rows, columns, 3)))
    light[: rows // 8] *= -0.02
    light[rows // 8 : rows // 4] *= 30.0
    return light.astype(np.float32)


def xyz_from_primaries(primaries_xy: list[tuple[float, float]]) -> NDArray[np.float64]:
    columns = np.array([[x / y, 1.0, (1.0 - x - y) / y] for x, y in primaries_xy]).T
    x, y = D65_XY
    white = np.array([x / y, 1.0, (1.0 - x - y) / y])
    return columns * np.linalg.solve(columns, white)


def display_colours(steps: int) -> NDArray[np.float32]:
    axis = np.linspace(0.0, 1.0, steps)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).astype(np.float32)


def test_grey_of_18_percent_without_tone_mapping() -> None:
    shown = transform("Un-tone-mapped").display_from_scene(grey(0.18))
    np.testing.assert_allclose(shown, 0.18 ** (1.0 / 2.4), atol=1e-6)
    np.testing.assert_allclose(shown, 0.4894, atol=5e-5)  # four printed decimals


def test_grey_of_18_percent_through_aces() -> None:
    shown = transform("ACES 1.0 - SDR Video").display_from_scene(grey(0.18))
    # The output transform's own numbers: 4.8 cd/m2 between a black of 0.02 and a white of 48,
    # gamma 0.9811 for the dim surround, gamma 2.4 for the display.
    np.testing.assert_allclose(shown, ((4.8 - 0.02) / (48.0 - 0.02)) ** (0.9811 / 2.4), atol=5e-5)
    np.testing.assert_allclose(shown, 0.3895, atol=5e-5)


def test_display_white_through_aces_is_six_and_a_half_stops_above_grey() -> None:
    light = transform("ACES 1.0 - SDR Video").scene_from_display(grey(1.0))
    np.testing.assert_allclose(light, 0.18 * 2.0**6.5, rtol=1e-4)


def test_rec_709_without_tone_mapping_is_a_gamma_of_2_4() -> None:
    light = np.random.default_rng(2).random((30, 41, 3), dtype=np.float32) * 2.0
    shown = transform("Un-tone-mapped", "Linear Rec.709 (sRGB)").display_from_scene(light)
    np.testing.assert_allclose(shown, light.astype(np.float64) ** (1.0 / 2.4), atol=1e-3 * CODE)


def test_other_primaries_of_the_same_white_without_tone_mapping() -> None:
    light = scene()
    shown = transform("Un-tone-mapped", "Linear P3-D65").display_from_scene(light)
    to_rec_709 = np.linalg.solve(xyz_from_primaries(REC_709_XY), xyz_from_primaries(P3_XY))
    linear = np.clip(light.astype(np.float64) @ to_rec_709.T, 0.0, None)
    # Compared as light, because the gamma's slope is infinite at black; float32 on both sides.
    np.testing.assert_allclose(shown.astype(np.float64) ** 2.4, linear, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("view", VIEWS)
def test_neutral_stays_neutral(view: str) -> None:
    shown = transform(view).display_from_scene(grey(*np.geomspace(1e-4, 50.0, 500)))
    assert np.ptp(shown, axis=2).max() < 0.01 * CODE
    assert (np.diff(shown[0, :, 1]) >= 0.0).all()


@pytest.mark.parametrize("view", VIEWS)
def test_darkest_and_brightest_raw_stay_finite(view: str) -> None:
    shown = transform(view).display_from_scene(grey(-1.0, -1e-3, 0.0, 8.0, 100.0))
    assert np.isfinite(shown).all()
    assert (shown[0, :3] < 0.25 * CODE).all()
    assert (shown[0, -1] > 1.0).all()  # clipping is the caller's


@pytest.mark.parametrize("scene_space", ["Linear ARRI Wide Gamut 3", "Linear Rec.709 (sRGB)"])
def test_round_trip_without_tone_mapping(scene_space: str) -> None:
    colours = display_colours(17)
    there = transform("Un-tone-mapped", scene_space)
    back = there.display_from_scene(there.scene_from_display(colours))
    np.testing.assert_allclose(back, colours, atol=0.5 * CODE)


def test_round_trip_through_aces() -> None:
    colours = display_colours(33).reshape(-1, 3)
    muted = colours[colours.min(axis=1) >= 0.8 * colours.max(axis=1)]
    there = transform("ACES 1.0 - SDR Video")
    back = there.display_from_scene(there.scene_from_display(muted))
    np.testing.assert_allclose(back, muted, atol=0.5 * CODE)


@pytest.mark.parametrize("view", VIEWS)
def test_threads_do_not_change_a_byte(view: str) -> None:
    pictures = [scene(seed) for seed in range(12)]
    there = transform(view)
    alone = [there.display_from_scene(picture).tobytes() for picture in pictures]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(there.display_from_scene, pictures))
    assert [picture.tobytes() for picture in together] == alone


@pytest.mark.parametrize("view", VIEWS)
def test_a_crop_is_shown_as_in_the_whole(view: str) -> None:
    light = scene()
    before = light.copy()
    whole = transform(view).display_from_scene(light)
    crop = transform(view).display_from_scene(light[3:22:2, 5:18])
    np.testing.assert_array_equal(crop, whole[3:22:2, 5:18])
    np.testing.assert_array_equal(light, before)


def test_a_pickled_transform_does_the_same() -> None:
    there = transform("ACES 1.0 - SDR Video")
    again = pickle.loads(pickle.dumps(there))  # noqa: S301 - written in this line
    assert (
        again.display_from_scene(scene()).tobytes() == there.display_from_scene(scene()).tobytes()
    )


def test_white_balance_multiplies_channels() -> None:
    raw = np.array([[[10.0, 20.0, -3.0]]], np.float32)
    balanced = white_balanced(raw, (2.0, 1.0, 1.5))
    assert balanced.dtype == np.float32
    np.testing.assert_array_equal(balanced, np.array([[[20.0, 20.0, -4.5]]], np.float32))


def test_defaults_are_those_of_the_contract() -> None:
    assert json.loads(structure(Color, {}, "test.toml").model_dump_json()) == {
        "display": "Rec.1886 Rec.709 - Display",
        "view": "ACES 1.0 - SDR Video",
        "scene_space": "Linear ARRI Wide Gamut 3",
    }
    assert "latest" not in STUDIO_CONFIG


@pytest.mark.parametrize(
    ("values", "key", "says"),
    [
        ({"display": "Rec.1886"}, "display", "sRGB - Display"),
        ({"view": "ACES 1.0"}, "view", "Un-tone-mapped"),
        ({"scene_space": "ARRI Wide Gamut 3"}, "scene_space", "Linear Rec.709 (sRGB)"),
        ({"scene_space": "ARRI LogC3 (EI800)"}, "scene_space", "scene-linear"),
        ({"display": "ST2084-P3-D65 - Display"}, "view", "HDR Video"),  # the default view is SDR
    ],
)
def test_unknown_names_are_refused_with_the_known_ones(
    values: dict[str, str], key: str, says: str
) -> None:
    with pytest.raises(InputError) as refused:
        structure(Color, values, "test.toml", "color")
    (fault,) = refused.value.faults
    assert fault.key == f"color.{key}"
    assert says in fault.fact
    assert all(value in str(fault) for value in values.values())


def test_close_names_are_suggested() -> None:
    with pytest.raises(InputError, match=r'did you mean "Linear ARRI Wide Gamut 3"\?'):
        structure(Color, {"scene_space": "ARRI Wide Gamut 3"}, "test.toml", "color")
