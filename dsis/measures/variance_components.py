"""Level and variance components of a stack of frames of one uniform exposure.

The temporal residual (frame minus mean frame) is split by the balanced two-way random model
z(t, y, x) = f(t) + r(t, y) + c(t, x) + e(t, y, x) (Searle, Casella & McCulloch, "Variance
components", 1992, chapter 4): frame, row, column and pixel variance, each unbiased and each blind
to the others. The fixed pattern is the spatial variance of the mean frame less what the temporal
noise leaves in it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MEASURES = {
    "level": "DN",
    "pixel_variance": "DN^2",
    "row_variance": "DN^2",
    "column_variance": "DN^2",
    "frame_variance": "DN^2",
    "fixed_pattern_variance": "DN^2",
}


@dataclass(frozen=True)
class Estimate:
    """A measured value and its standard error, in the unit of the measure."""

    value: float
    standard_error: float


def measure(stack: NDArray[np.float32]) -> dict[str, Estimate]:
    """Return every measure of a stack (frame, row, column) of one channel, DN above black.

    Needs two frames, rows and columns at least. Standard errors are those of Gaussian components.
    """
    frames, rows, columns = stack.shape
    data = stack.astype(np.float64)
    mean_frame = data.mean(0)
    z = data - mean_frame
    # The mean frame takes one of T degrees of freedom from every temporal sum of squares.
    share = (frames - 1) / frames
    frame_means = z.mean((1, 2))
    row_means = z.mean(2) - frame_means[:, None]
    column_means = z.mean(1) - frame_means[:, None]
    pixels = z - (row_means + frame_means[:, None])[:, :, None] - column_means[:, None, :]

    dof_frame = frames * share
    dof_row, dof_column = dof_frame * (rows - 1), dof_frame * (columns - 1)
    dof_pixel = dof_frame * (rows - 1) * (columns - 1)
    ms_frame = rows * columns * float((frame_means**2).sum()) / dof_frame
    ms_row = columns * float((row_means**2).sum()) / dof_row
    ms_column = rows * float((column_means**2).sum()) / dof_column
    ms_pixel = float((pixels**2).sum()) / dof_pixel

    def error(*terms: tuple[float, float]) -> float:
        """Return the standard error of a sum of mean squares: var MS = 2 MS^2 / dof."""
        return float(np.sqrt(sum(2 * square**2 / dof for square, dof in terms)))

    spatial = float(mean_frame.var(ddof=1))
    temporal = ms_pixel + (ms_row - ms_pixel) / columns + (ms_column - ms_pixel) / rows
    pattern = spatial - temporal / frames
    pattern_error = spatial * np.sqrt(2 / (mean_frame.size - 1))
    return {
        "level": Estimate(
            float(mean_frame.mean()),
            float(np.sqrt((ms_frame / frames + max(pattern, 0.0)) / mean_frame.size)),
        ),
        "pixel_variance": Estimate(ms_pixel, error((ms_pixel, dof_pixel))),
        "row_variance": Estimate(
            (ms_row - ms_pixel) / columns, error((ms_row, dof_row), (ms_pixel, dof_pixel)) / columns
        ),
        "column_variance": Estimate(
            (ms_column - ms_pixel) / rows,
            error((ms_column, dof_column), (ms_pixel, dof_pixel)) / rows,
        ),
        "frame_variance": Estimate(
            (ms_frame - ms_row - ms_column + ms_pixel) / (rows * columns),
            error(
                (ms_frame, dof_frame),
                (ms_row, dof_row),
                (ms_column, dof_column),
                (ms_pixel, dof_pixel),
            )
            / (rows * columns),
        ),
        "fixed_pattern_variance": Estimate(pattern, float(pattern_error)),
    }
