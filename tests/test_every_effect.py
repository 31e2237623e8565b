"""Promise: every effect of the registry does what it states, and nothing else.

The test walks the registry: a new file in `dsis/effects` is tested the moment it exists.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from scipy import stats

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import OperatingPoint
from dsis.grid import PixelGrid
from dsis.measures import MEASURES, Estimate, measure
from effect_examples import (
    BACKGROUND,
    COLUMNS,
    FRAMES,
    INTERCEPTS_DN2,
    KINDS,
    REPEATS,
    ROWS,
    SLOPE_DN,
    SWITCH_DN,
    Z_MAX,
    camera_with,
    every_kind,
    example_of,
)

EXPOSURE_TIME_S = 0.1
LEVELS_DN = (0.0, 400.0, 5000.0)

STRONG: dict[str, tuple[dict[str, object], ...]] = {
    "adc_dnl": ({"rms_lsb": 2.0},),
    "adc_memory": (
        {"step_dn": 30.0, "period_codes": 512},
        {"step_dn": 30.0, "period_codes": 512, "along": "columns"},
    ),
    "amp_glow": ({"dn_per_s": 2e4}, {"dn_per_s": 1e5, "place": "top", "extent": 0.05}),
    "bistable_pattern": ({"amplitude_dn": 30.0}, {"amplitude_dn": 30.0, "frequency": (0, 0.5)}),
    "brighter_fatter": ({"per_dn": 8e-5}, {"per_dn": 2e-4}, {"anisotropy": -1.0}),
    "crosstalk": ({"fraction": 0.2}, {"fraction": 0.04}),
    "dark_current": (
        {"dn_per_s": 4000.0, "log_sigma": 0.3},
        {"dn_per_s": 4000.0, "log_sigma": 1.0},
    ),
    "hot_pixels": ({"mean_dn_per_s": 3e4}, {"mean_dn_per_s": 3e4, "pixel_fraction": 0.5}),
    "impulse": ({"mean_dn": 3000.0},),
    "periodic_noise": ({"amplitude_dn": 30.0}, {"amplitude_dn": 30.0, "frequency": (0, 0.2)}),
    "pink_noise": ({"sigma_dn": 20.0}, {"sigma_dn": 20.0, "along": "columns"}),
    "quantisation": (
        {"step_dn": 2.5},
        {"step_dn": 30.0},
        {"step_dn": 100.0},
        {"step_dn": 6.0, "phase_dn": 5},
        {"step_dn": 30.0, "phase_dn": 17},
    ),
    "readout_memory": (
        {"fraction": 0.8},
        {"fraction": 0.8, "lag_pixels": 1, "along": "columns"},
        {"fraction": 0.1, "remembers": "signal"},
        {"fraction": -0.1, "lag_pixels": 1, "along": "columns", "remembers": "signal"},
        {"fraction": 0.1, "remembers": "signal", "before_line": "black"},
        {"fraction": 0.1, "along": "columns", "remembers": "signal", "before_line": "black"},
    ),
    "row_banding": ({"sigma_dn": 20.0}, {"sigma_dn": 20.0, "length_rows": 20.0}),
    "rts": (
        {"amplitude_dn": 80.0, "pixel_fraction": 0.2, "heights": "equal"},
        {"amplitude_dn": 80.0, "pixel_fraction": 0.2, "heights": "equal", "levels": "above"},
        {"amplitude_dn": 60.0, "pixel_fraction": 0.5, "switch_probability": 0.02},
        {"amplitude_dn": 110.0, "pixel_fraction": 0.5, "switch_probability": 0.02},
        {"amplitude_dn": 60.0, "pixel_fraction": 0.3, "levels": "above"},
        {"amplitude_dn": 60.0, "pixel_fraction": 0.3, "levels": "either"},
    ),
    "shading": (
        {"falloff_percent": 90.0},
        {"falloff_percent": 20.0, "tilt_down_percent": 30.0, "tilt_right_percent": -20.0},
        {"falloff_percent": 0.0, "bow_down_percent": 30.0, "bow_right_percent": -20.0},
        {"falloff_percent": 40.0, "ring_percent": -20.0, "tilt_down_percent": 10.0},
    ),
    "smooth_prnu": ({"length_pixels": 1.5}, {"sigma_percent": 15.0, "length_pixels": 20.0}),
    "spatial_filtering": ({"fraction": 0.2}, {"fraction": 0.04}),
    "line_settling": (
        {"gain_percent": 40.0, "edge": "bottom", "length_pixels": 4.0},
        {"offset_dn": 300.0, "edge": "right"},
    ),
    "nonlinearity": (
        {"percent_full_scale": 3.0, "exponent": 4.0},
        {"percent_full_scale": 0.5, "exponent": -0.3},
    ),
    "saturation": (
        {"softness_dn": 60.0},
        {"spread_percent": 2.0},
        {"softness_dn": 60.0, "spread_percent": 1.0},
    ),
    "dual_gain_mismatch": ({"gain_error_percent": 5.0, "mean": "kinks"},),
    "tap_mismatch": (
        {"gain_percent": 40.0, "regions": "top_bottom", "seam": 0.3},
        {"gain_percent": 40.0, "regions": "even_odd_columns"},
        {"gain_percent": 40.0, "regions": "even_odd_rows"},
    ),
}
"""Instances beside the example: what an effect can do only where it is strong is seen with them."""

LEADING_ORDER = {"brighter_fatter", "crosstalk", "readout_memory", "spatial_filtering"}
"""Whose closed forms hold for weak coupling: of infinite planes, or of first order in strength."""


def point_at(level: float) -> OperatingPoint:
    segment = int(level >= SWITCH_DN)
    return OperatingPoint(
        signal_dn=level,
        slope_dn=SLOPE_DN,
        read_variance_dn2=INTERCEPTS_DN2[segment],
        segment=segment,
        segment_from_dn=SWITCH_DN * segment,
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
