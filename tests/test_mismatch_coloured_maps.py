"""Maps whose pixels are alike in neighbours show no pattern of single pixels."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from analysis.mismatch.coloured import coloured
from exposing import effect


@pytest.mark.parametrize("shape", [(40, 60), (61, 97), (96, 128)])
@pytest.mark.parametrize(
    ("width", "pattern", "denied"),
    [(1.0, 0.0, True), (2.0, 0.3, True), (2.0, 1.5, False), (0.0, 1.0, False)],
)
def test_what_neighbours_have_in_common_is_no_pattern_of_single_pixels(
    shape: tuple[int, int], width: float, pattern: float, denied: bool
) -> None:
    """A field of variance 1 that a Gaussian of `width` pixels has smoothed, in noise of 1."""
    rng = np.random.default_rng(5)
    field = gaussian_filter(rng.normal(0, 1, shape), width) if width else np.zeros(shape)
    image = field / (field.std() or 1.0) + np.hypot(1, pattern) * rng.normal(0, 1, shape)
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "offset"): (image, 1.0)})),
        mismatches=[SimpleNamespace(statistic="fixed_correlation_0_1")],
        camera=SimpleNamespace(effect=()),
    )
    assert (coloured(state, "dsnu") is not None) == denied
    assert coloured(state, "prnu") is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("field", "pattern", "filtered", "denied"),
    [(0.45, 0.0, False, True), (0.45, 0.45, False, False), (0.45, 0.0, True, False)],
)
def test_of_a_field_that_falls_slowly_the_finest_waves_have_little(
    field: float, pattern: float, filtered: bool, denied: bool, seed: int
) -> None:
    """Exponentially alike over 1.5 pixels: the median bin has half of its mean power."""
    rng, shape = np.random.default_rng(seed), (96, 128)
    down, across = np.fft.fftfreq(shape[0])[:, None], np.fft.fftfreq(shape[1])
    falls = (1 + (2 * np.pi * 1.5) ** 2 * (down**2 + across**2)) ** -0.75
    smooth = np.fft.ifft2(np.fft.fft2(rng.normal(0, 1, shape)) * falls).real
    image = field * smooth / smooth.std() + np.hypot(1, pattern) * rng.normal(0, 1, shape)
    names = ["fixed_correlation_0_1", *(["correlation_0_1"] if filtered else [])]
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "gain"): (image, 1.0)})),
        mismatches=[SimpleNamespace(statistic=name) for name in names],
        camera=SimpleNamespace(effect=()),
    )
    assert (coloured(state, "prnu") is not None) == denied


@pytest.mark.parametrize(("pattern", "denied"), [(0.25, True), (0.75, False)])
@pytest.mark.parametrize("left", ["fixed_patch_variance", "fixed_spectral_peak"])
def test_beside_alike_neighbours_single_pixels_must_be_seen_by_themselves(
    pattern: float, denied: bool, left: str
) -> None:
    """Of a sixteenth of the noise's variance the median bin says nothing for certain."""
    rng, found = np.random.default_rng(9), []
    for _ in range(20):
        image = np.hypot(1, pattern) * rng.normal(0, 1, (48, 64))
        state: Any = SimpleNamespace(
            setting=SimpleNamespace(
                seen=SimpleNamespace(images={("MONO", "offset"): (image, 1.0)})
            ),
            mismatches=[SimpleNamespace(statistic=left)],
            camera=SimpleNamespace(effect=()),
        )
        found.append(coloured(state, "dsnu") is not None)
    assert (sum(found) > 15) == (denied and left == "fixed_patch_variance")
    assert denied or not any(found)


@pytest.mark.parametrize("seed", range(3))
def test_beside_a_filter_of_the_model_the_finest_waves_say_nothing(seed: int) -> None:
    """It smooths pattern and noise: of white ones next to nothing is left of these."""
    rng, shape = np.random.default_rng(seed), (96, 128)
    white = np.hypot(1.0, 1.5) * rng.normal(0, 1, shape)
    beside = sum(np.roll(white, by, axis) for by in (-1, 1) for axis in (0, 1))
    image = 0.6 * white + 0.1 * beside + 0.3 * gaussian_filter(rng.normal(0, 1, shape), 3.0) / 0.1
    image /= np.sqrt(0.36 + 4 * 0.01)  # of the noise, filtered as well
    known = effect("spatial_filtering", fraction=0.1)
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "offset"): (image, 1.0)})),
        mismatches=[SimpleNamespace(statistic="fixed_patch_variance")],
        camera=SimpleNamespace(effect=(known,)),
    )
    with_filter = coloured(state, "dsnu")
    state.camera.effect = ()
    assert coloured(state, "dsnu") is not None
    assert with_filter is None


def test_of_few_columns_there_are_no_finest_waves() -> None:
    rng = np.random.default_rng(2)
    image = gaussian_filter(rng.normal(0, 1, (64, 5)), 1.5) * 8 + rng.normal(0, 1, (64, 5))
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "offset"): (image, 1.0)})),
        mismatches=[SimpleNamespace(statistic="fixed_patch_variance")],
        camera=SimpleNamespace(effect=()),
    )
    with np.errstate(all="raise"):
        found = coloured(state, "dsnu")
    assert found is None or 0 <= found.share <= 1
