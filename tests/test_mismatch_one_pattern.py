"""Mean frames of several exposures show one fixed pattern: their numbers scatter together."""

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.parts import parts
from analysis.mismatch.null import drawn_together

SHAPE, SENSORS = (32, 48), 600
STATISTICS = ("fixed_column_variance", "fixed_smooth_variance", "fixed_correlation_0_1")


@pytest.mark.parametrize("of_columns", [0.0, 0.5])
def test_numbers_scatter_together_as_the_pattern_in_them_does(of_columns: float) -> None:
    """Pixels, and columns besides, of some sensors under three lights; noise of each is its own."""
    sizes = (0.0, 1.0, 2.0)
    found = {statistic: np.empty((SENSORS, len(sizes))) for statistic in STATISTICS}
    pixels = np.empty((SENSORS, len(sizes)))
    for sensor in range(SENSORS):
        rng = np.random.default_rng([sensor, 4])
        pattern = rng.standard_normal(SHAPE) + of_columns * rng.standard_normal(SHAPE[1])
        for k, size in enumerate(sizes):
            numbers = parts(size * pattern + rng.standard_normal(SHAPE), 1.0).numbers
            pixels[sensor, k] = numbers["fixed_pixel_variance"][0]
            for statistic, values in found.items():
                values[sensor, k] = numbers[statistic][0]
    keys = tuple(
        Key(name, "exposure", f"flat-{k}", "MONO")
        for name in ("fixed_pixel_variance", *STATISTICS)
        for k in range(len(sizes))
    )
    mean = np.concatenate([own.mean(0) for own in (pixels, *found.values())])
    part = drawn_together(keys, mean, np.ones(len(keys), np.bool_))[len(sizes) :]
    for (name, values), own in zip(found.items(), part.reshape(len(STATISTICS), -1), strict=True):
        seen = np.corrcoef(values.T)
        assert own[0] < 0.05  # of a dark
        for i, j in ((0, 2), (1, 2)):
            chance, together = 4 / SENSORS**0.5, own[i] * own[j]
            if of_columns and name == "fixed_smooth_variance":  # of columns, and of other waves
                assert seen[i, j] < together + chance
            else:
                assert seen[i, j] == pytest.approx(together, abs=chance)


def test_numbers_that_are_of_no_pattern_have_no_part_in_it() -> None:
    keys = (
        Key("fixed_pixel_variance", "exposure", "flat", "R"),
        Key("row_variance", "exposure", "flat", "R"),
        Key("fixed_row_variance", "gain", "", "R"),
        Key("fixed_row_variance", "exposure", "flat", "B"),
    )
    known = np.array([True, True, True, False])
    np.testing.assert_array_equal(drawn_together(keys, np.full(4, 2.0), known)[1:], 0.0)
