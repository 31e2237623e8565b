"""Promise: coefficients of smooth surfaces are projections, whatever the number of rows."""

import numpy as np
import pytest

from dsis.measures.fixed_pattern import Smooth


@pytest.mark.parametrize("rows", [14, 15, 16, 17])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_coefficients_are_sums_over_rows_and_columns(rows: int, kind: type[np.floating]) -> None:
    images = np.random.default_rng(rows).normal(size=(2, rows, 21)).astype(kind)
    smooth = Smooth.of(rows, 21)
    expected = np.einsum(
        "kyx,yi,xj->kij", images.astype(np.float64), smooth.along_rows, smooth.along_columns
    )
    np.testing.assert_allclose(smooth.coefficients(images), expected, rtol=1e-10, atol=1e-10)
