"""Promise: effects that share charge or remember it correlate noise as their kernels say.

Measured without dsis's own measures; tolerances are five standard errors.
"""

from typing import Any

import numpy as np
import pytest
import scipy.signal
from pydantic import ValidationError

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect
from dsis.effects.effect import OperatingPoint
from dsis.grid import PixelGrid
from exposing import BLACK_DN, SIDE, Z_MAX, apply, camera, effect, recorded, white

SAME_NOISE = (
    0.03  # of a change seen in one and the same noise: 2^18 pixels, correlation's own error
)


def correlation(image: np.ndarray, dy: int, dx: int) -> float:
    z = image - image.mean()
    rows, columns = z.shape
    pairs = z[: rows - dy, : columns - dx] * z[dy:, dx:]
    return float(pairs.mean() / z.var())


CORRELATION_ERROR = 1.5 / SIDE  # 1 / sqrt(n), with room for Bartlett's factor


@pytest.mark.parametrize("fraction", [0.01, 0.05, 0.15])
@pytest.mark.parametrize("along", ["both", "rows", "columns"])
def test_crosstalk_correlates_by_its_kernel(fraction: float, along: str) -> None:
    made = apply(effect("crosstalk", fraction=fraction, along=along), white(mean=500))
    neighbours = 4 if along == "both" else 2
    own = 1 - neighbours * fraction
    norm = own**2 + neighbours * fraction**2
    expected = 2 * own * fraction / norm
    for lag, axis in (((0, 1), "rows"), ((1, 0), "columns")):
        rho = expected if along in ("both", axis) else 0.0
        assert abs(correlation(made, *lag) - rho) < Z_MAX * CORRELATION_ERROR
    assert abs(made.var() / white().var() - norm) < Z_MAX * np.sqrt(2) / SIDE
    assert made.mean() == pytest.approx(white(mean=500).mean(), abs=1e-4)  # charge is kept


@pytest.mark.parametrize("kind", ["crosstalk", "spatial_filtering"])
def test_a_single_charge_is_shared_with_its_neighbours(kind: str) -> None:
    point = np.zeros((9, 9))
    point[4, 4] = 1000.0
    expected = np.zeros((9, 9))
    expected[4, 4] = 880.0
    expected[[3, 5, 4, 4], [4, 4, 3, 5]] = 30.0
    made = apply(effect(kind, fraction=0.03), point)
    np.testing.assert_allclose(made, expected, atol=1e-3)


def test_brighter_fatter_grows_with_the_square_of_the_signal() -> None:
    per_dn = 2e-6
    deficits, covariances = [], []
    levels = np.array([1000.0, 2000.0, 4000.0, 8000.0])
    for s in levels:
        before = white(np.sqrt(s), 512, s)
        after = apply(effect("brighter_fatter", per_dn=per_dn), before)
        assert after.mean() == pytest.approx(before.mean(), rel=1e-6)  # a flat keeps its mean
        # The same noise before and after: the change is far more certain than each variance.
        deficits.append((before.var() - after.var()) / s)
        covariances.append((correlation(after, 0, 1) - correlation(before, 0, 1)) * after.var() / s)
    f = per_dn * levels
    np.testing.assert_allclose(deficits, 8 * f - 20 * f**2, rtol=SAME_NOISE)
    np.testing.assert_allclose(covariances, 2 * f - 8 * f**2, rtol=SAME_NOISE)


@pytest.mark.parametrize("anisotropy", [0.4, -1.0])
def test_brighter_fatter_has_a_rate_along_each_axis(anisotropy: float) -> None:
    before = white(np.sqrt(8000.0), 512, 8000.0)
    after = apply(effect("brighter_fatter", per_dn=2e-6, anisotropy=anisotropy), before)
    assert after.mean() == pytest.approx(before.mean(), rel=1e-6)
    rates = np.array([1 + anisotropy, 1 - anisotropy]) * 2e-6 * 8000
    for (dy, dx), f in zip([(0, 1), (1, 0)], rates, strict=True):
        covariance = (correlation(after, dy, dx) - correlation(before, dy, dx)) * after.var() / 8000
        # The kernel's correlation with itself, at its own lag: 2 f (1 - 2 sum f).
        np.testing.assert_allclose(
            covariance, 2 * f * (1 - 2 * rates.sum()), rtol=SAME_NOISE, atol=1e-4
        )


@pytest.mark.parametrize("cfa", [Cfa.RGGB, Cfa.MONO])
def test_spatial_filtering_couples_sites_of_one_colour(cfa: Cfa) -> None:
    step = 1 if cfa is Cfa.MONO else 2
    made = apply(
        effect("spatial_filtering", fraction=0.05),
        white(mean=500),
        grid=PixelGrid(SIDE, SIDE, cfa),
    )
    assert made.mean() == pytest.approx(white(mean=500).mean(), abs=1e-4)
    expected = 2 * 0.8 * 0.05 / (0.8**2 + 4 * 0.05**2)
    for dy, dx in ((0, step), (step, 0)):
        assert abs(correlation(made, dy, dx) - expected) < Z_MAX * CORRELATION_ERROR
    if step == 2:
        assert abs(correlation(made, 0, 1)) < Z_MAX * CORRELATION_ERROR


@pytest.mark.parametrize("cfa", [Cfa.RGGB, Cfa.MONO])
@pytest.mark.parametrize(("along", "apart"), [("rows", (0, 1)), ("columns", (1, 0))])
def test_spatial_filtering_may_smooth_along_one_axis(
    cfa: Cfa, along: str, apart: tuple[int, int]
) -> None:
    step = 1 if cfa is Cfa.MONO else 2
    one = effect("spatial_filtering", fraction=0.06, along=along)
    made = apply(one, white(mean=500), grid=PixelGrid(SIDE, SIDE, cfa))
    own = 1 - 2 * 0.06
    expected = 2 * own * 0.06 / (own**2 + 2 * 0.06**2)
    for lag in ((0, 1), (1, 0)):
        rho = expected if lag == apart else 0.0
        assert abs(correlation(made, *(step * k for k in lag)) - rho) < Z_MAX * CORRELATION_ERROR
    assert made.mean() == pytest.approx(white(mean=500).mean(), abs=1e-4)


def test_spatial_filtering_with_its_diagonals_is_a_box() -> None:
    point = np.zeros((9, 9))
    point[4, 4] = 1000.0
    box = np.zeros((9, 9))
    box[3:6, 3:6] = 20.0
    box[4, 4] = 840.0
    made = apply(effect("spatial_filtering", fraction=0.02, diagonal=1.0), point)
    np.testing.assert_allclose(made, box, atol=1e-3)
    kernel = scipy.signal.correlate2d(box[3:6, 3:6], box[3:6, 3:6]) / 1000**2
    made = apply(effect("spatial_filtering", fraction=0.02, diagonal=1.0), white(mean=500))
    for lag in ((0, 1), (1, 1), (2, 0)):
        rho = kernel[2 + lag[0], 2 + lag[1]] / kernel[2, 2]
        assert abs(correlation(made, *lag) - rho) < Z_MAX * CORRELATION_ERROR


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"fraction": 0.02, "along": "rows", "diagonal": 0.5}, "needs along = 'both', not 'rows'"),
        ({"fraction": 0.15, "diagonal": 0.5}, "makes a pixel give away 0.9, above 0.8"),
    ],
)
def test_kernels_of_spatial_filtering_that_are_none(parameters: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        effect("spatial_filtering", **parameters)


@pytest.mark.parametrize(("along", "lag"), [("rows", (0, 4)), ("columns", (4, 0))])
@pytest.mark.parametrize("fraction", [0.3, -0.3])
def test_readout_memory_correlates_at_its_lag_only(
    along: str, lag: tuple[int, int], fraction: float
) -> None:
    one = effect("readout_memory", fraction=fraction, lag_pixels=4, along=along)
    made = apply(one, white(mean=700.0), expected=700.0)
    assert abs(made.mean() - 700) < Z_MAX * 13 / SIDE
    for other in [(0, k) for k in range(1, 6)] + [(k, 0) for k in range(1, 6)]:
        rho = fraction / (1 + fraction**2) if other == lag else 0.0
        assert abs(correlation(made, *other) - rho) < Z_MAX * CORRELATION_ERROR, other


def test_image_lag_correlates_shot_noise_in_time_and_leaves_a_trail() -> None:
    f = 0.1
    one = camera(effect("image_lag", fraction=f), slope=4.0)
    stack = recorded(one, 2000.0, 24)
    z = stack - 2000
    rho = f * (1 - f) / ((1 - f) ** 2 + f**2)
    n = z[1:].size
    assert abs((z[1:] * z[:-1]).mean() / (z**2).mean() - rho) < Z_MAX / np.sqrt(n)
    variance = 4.0 * 2000 * ((1 - f) ** 2 + f**2) + 1 / 12
    assert abs((z**2).mean() / variance - 1) < Z_MAX * np.sqrt(2 * (1 + 2 * rho**2) / n)
    still = camera(effect("image_lag", fraction=f))
    grid = PixelGrid(4, 4, Cfa.MONO)
    dark = np.zeros((4, 4), np.float32)
    trail = still.expose(dark, Draw(1), Draw(1), 5, grid, earlier_clean=lambda k: dark + 1000 * k)
    np.testing.assert_array_equal(trail, 100.0)


def test_readout_memory_remembers_offsets_and_no_cut() -> None:
    """Offsets of columns are seen again two columns on; charge that a full well cuts is not."""
    memory = effect("readout_memory", fraction=0.1, lag_pixels=2)
    offsets = effect("column_fpn", sigma_dn=30.0)
    full, bare = (
        camera(offsets, *own).model_copy(update={"saturation_dn": 900.0}) for own in ((memory,), ())
    )
    (stack,), (plain,) = recorded(full, 1000.0, 1), recorded(bare, 1000.0, 1)
    again = 0.1 * (plain[:, :-2] - 900)
    np.testing.assert_allclose(stack[:, 2:] - plain[:, 2:], again, atol=1.1)  # both are rounded
    np.testing.assert_array_equal(stack[:, :2], plain[:, :2])


@pytest.mark.parametrize(("along", "lag"), [("rows", (0, 3)), ("columns", (3, 0))])
@pytest.mark.parametrize("fraction", [0.2, -0.2])
def test_a_memory_of_the_signal_is_a_kernel_on_one_side(
    along: str, lag: tuple[int, int], fraction: float
) -> None:
    """Foreign oracle: scipy's causal filter (1 - f, 0, 0, f), but for the first samples."""
    own = {"fraction": fraction, "lag_pixels": 3, "along": along, "remembers": "signal"}
    image = white(mean=700.0)
    made = apply(effect("readout_memory", **own), image, expected=0.0)  # whatever was expected
    axis = 1 if along == "rows" else 0
    by_scipy = scipy.signal.lfilter([1 - fraction, 0, 0, fraction], [1], image, axis=axis)
    first = np.s_[:, :3] if axis else np.s_[:3]
    by_scipy[first] = image[first]
    np.testing.assert_allclose(made, by_scipy, rtol=2e-6)
    kernel = (1 - fraction) ** 2 + fraction**2
    assert abs(made.var() / image.var() - kernel) < Z_MAX * np.sqrt(2) / SIDE
    rho = fraction * (1 - fraction) / kernel
    assert abs(correlation(made, *lag) - rho) < Z_MAX * CORRELATION_ERROR


@pytest.mark.parametrize(("along", "axis"), [("rows", 1), ("columns", 0)])
def test_lines_that_begin_at_black_are_filtered_from_nothing(along: str, axis: int) -> None:
    """Foreign oracle: scipy's causal filter, from its first sample on."""
    own = {"fraction": 0.2, "lag_pixels": 3, "along": along, "remembers": "signal"}
    image = white(mean=700.0)
    one = effect("readout_memory", **own, before_line="black")
    by_scipy = scipy.signal.lfilter([0.8, 0, 0, 0.2], [1], image, axis=axis)
    np.testing.assert_allclose(apply(one, image), by_scipy, rtol=2e-6)
    point = OperatingPoint(
        signal_dn=700.0,
        slope_dn=1.0,
        read_variance_dn2=100.0,
        segment=0,
        full_scale_dn=4e3,
        frames=2,
        rows=image.shape[0],
        columns=image.shape[1],
    )
    lost = one.contributions(point)["level"]
    assert abs(by_scipy.mean() - image.mean() - lost) < 0.1 * abs(lost)
    assert "fixed_row_variance" in one.changes
    assert "fixed_row_variance" not in effect("readout_memory", **own).changes


def test_a_memory_of_the_signal_mixes_colours_where_its_lag_is_odd() -> None:
    light = np.tile([[400.0, 100.0], [100.0, 50.0]], (8, 8))
    for lag, expected in ((1, [[370.0, 130.0], [95.0, 55.0]]), (2, light[:2, :2])):
        own = {"fraction": 0.1, "lag_pixels": lag, "remembers": "signal"}
        made = apply(effect("readout_memory", **own), light)
        np.testing.assert_allclose(made[:2, lag + lag % 2 :][:, :2], expected, rtol=1e-6)


def _of_a_sawtooth(mean: float, sd: float, period: float, at: float) -> tuple[float, float, float]:
    """Return mean, mean square and mean slope of frac((c - at) / period) - 1/2 of normal codes c.

    From its Fourier series; a wave of a normal variate shrinks by exp(-variance / 2).
    """
    k = np.arange(1, 20000)
    angle = 2 * np.pi * k * (mean - at) / period
    fade = np.exp(-2 * (np.pi * k * sd / period) ** 2)
    first = -(np.sin(angle) * fade / (np.pi * k)).sum()
    # Its square is a parabola: 1/12 + sum of cos(k t) / (pi k)^2.
    second = 1 / 12 + (np.cos(angle) * fade / (np.pi * k) ** 2).sum()
    return first, second, -(2 / period * np.cos(angle) * fade).sum()


@pytest.mark.parametrize(("along", "lag"), [("rows", (0, 1)), ("columns", (1, 0))])
@pytest.mark.parametrize(("mean", "at"), [(30.0, 86.0), (30.0, 100.0), (158.0, 70.0), (47.0, 3.0)])
@pytest.mark.parametrize("step", [2.0, -2.0])
def test_a_converter_carries_its_residue_over(
    along: str, lag: tuple[int, int], mean: float, at: float, step: float
) -> None:
    """Means, variances and covariances (Stein's lemma) of a sawtooth of normal codes.

    The codes are those converted, whose mean and variance the carried residue has moved.
    """
    sd, period = 9.0, 64
    one = effect("adc_memory", step_dn=step, period_codes=period, at_code=at, along=along)
    before = white(sd, 1024, mean)
    made = apply(one, before)
    first, square = 0.0, 0.0
    for _ in range(20):
        converted = (
            before.mean() + BLACK_DN + step * first,
            (before.var() + step**2 * square) ** 0.5,
        )
        first, second, slope = _of_a_sawtooth(*converted, period, at)
        square = second - first**2
    carried = made - before
    n = before.size
    assert abs(carried.mean() - step * first) < Z_MAX * abs(step) / np.sqrt(n)
    assert abs(carried.var() - step**2 * square) < Z_MAX * step**2 / np.sqrt(n)
    shifted = carried[lag[0] :, lag[1] :]
    own = before[: before.shape[0] - lag[0], : before.shape[1] - lag[1]]
    covariance = float(((own - own.mean()) * shifted).mean())
    assert abs(covariance - step * sd**2 * slope) < Z_MAX * abs(step) * sd / np.sqrt(n)
    for other in [(0, 1), (1, 0), (1, 1), (0, 2), (2, 0)]:
        if other != lag:
            assert abs(correlation(made, *other)) < Z_MAX * 1.5 / 1024


RESPONSES = [
    effect("nonlinearity", percent_full_scale=-3.0),
    effect("saturation", full_well_dn=1500.0, softness_dn=400.0),
    effect("dual_gain_mismatch", gain_error_percent=4.0),
    effect("tap_mismatch", gain_percent=2.0, regions="left_right"),
    effect("crosstalk", fraction=0.03),
    effect("brighter_fatter", per_dn=5e-6),
]


@pytest.mark.parametrize("response", RESPONSES, ids=lambda own: own.kind)
def test_memory_of_noise_leaves_the_level_that_a_response_gives(response: Effect) -> None:
    """Without noise there is none to remember, whatever bends, cuts or scales the signal.

    Of what noise there is the share is remembered: frames are whole codes, and so is the noise.
    """
    shares = np.tile([[1.0, 0.7], [0.7, 0.4]], (SIDE // 2, SIDE // 2))
    light, grid = (1800 * shares).astype(np.float32), PixelGrid(SIDE, SIDE, Cfa.RGGB)
    memory = effect("readout_memory", fraction=0.3, lag_pixels=3, along="columns")

    def frame(*effects: Effect, slope: float = 0.0) -> np.ndarray:
        own = camera(*effects, slope=slope, cfa=Cfa.RGGB, switch=1000.0)
        return own.expose(light, Draw(1), Draw(2), 0, grid)

    still, noisy = frame(response), frame(response, slope=0.1)
    assert not np.array_equal(still, frame())
    np.testing.assert_array_equal(frame(response, memory), still)
    remembered = frame(response, memory, slope=0.1) - noisy
    np.testing.assert_allclose(remembered[3:], 0.3 * (noisy - still)[:-3], atol=1.3)
    np.testing.assert_array_equal(remembered[:3], 0)
