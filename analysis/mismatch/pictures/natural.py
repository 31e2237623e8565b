"""Numbers of the bank back in the units that people use: DN^2, DN, percent."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, expm1, isfinite

from analysis.mismatch.bank.key import is_cube_root
from analysis.mismatch.layout import Place
from analysis.mismatch.state import State
from analysis.mismatch.vector import expected_dn2
from dsis.measures.fixed_pattern import Smooth

UNITS = {
    "pixel_variance": "DN^2",
    "row_variance": "DN^2",
    "column_variance": "DN^2",
    "frame_variance": "DN^2",
    "fixed_pixel_variance": "DN^2",
    "fixed_row_variance": "DN^2",
    "fixed_column_variance": "DN^2",
    "fixed_smooth_variance": "DN^2",
    "level": "DN",
    "code_spacing": "DN",
    "channel_ratio": "%",
}
Numbers = Mapping[str, float]
Back = Callable[[float], float]


@dataclass(frozen=True)
class Scale:
    """What the transformed numbers of one exposure and channel are multiples of.

    Attributes
    ----------
    rows, columns, frames
        Of the channel's frames.
    pixel_dn2
        Variance of a pixel over time, as recorded.
    expected_dn2
        The same as the model's base numbers have it.
    """

    rows: int
    columns: int
    frames: int
    pixel_dn2: float
    expected_dn2: float

    @classmethod
    def of(cls, state: State, place: Place) -> "Scale":
        """Return the scale beside a model."""
        layout, seen = state.setting.layout, state.setting.seen
        step = 1 if layout.channels == ("MONO",) else 2
        level = seen.level(place)
        if level is None:
            message = f"{place} was not observed"
            raise ValueError(message)
        return cls(
            layout.rows // step,
            layout.columns // step,
            next(len(e.numbers) for e in layout.exposures if e.name == place[0]),
            level.variance_dn2,
            expected_dn2(layout, place, state.calibrated.residual),
        )


def back(statistic: str, scale: Scale, numbers: Numbers) -> Back:
    """Return what turns a transformed number into its unit.

    `numbers` are all transformed numbers of the place: mean squares are ratios to finer ones.
    """
    if statistic in UNITS and is_cube_root(statistic):
        unit = _finer_dn2(statistic, scale, numbers)
        return lambda x: (x**3 - 1) * unit
    if statistic == "variance_spread":
        white = 2 / (scale.frames - 1)
        return lambda x: (exp(x) - white) / (1 + white)
    if statistic == "pixel_variance":
        return lambda x: scale.expected_dn2 * exp(x)
    return _power_of_two if statistic == "code_spacing" else float


def shared(statistic: str) -> Back:
    """Return the same for a number of several channels or exposures: mean squares stay ratios."""
    if statistic.endswith("variance"):
        return lambda x: x**3
    return _percent if statistic == "channel_ratio" else float


def _finer_dn2(statistic: str, scale: Scale, numbers: Numbers) -> float:
    """Return what a ratio of mean squares of 2 stands for, DN^2."""
    n, m, pixel = scale.rows, scale.columns, scale.pixel_dn2
    smooth = Smooth.of(n, m)
    kinds = int(smooth.mixed.sum()) + 2 * smooth.degree
    still = pixel / scale.frames
    pattern = still * _cube(numbers, "fixed_pixel_variance")
    lines = _cube(numbers, "row_variance") + _cube(numbers, "column_variance") - 1
    return {
        "row_variance": pixel / m,
        "column_variance": pixel / n,
        "frame_variance": pixel * max(lines, 1.0) / (n * m),
        "fixed_pixel_variance": still,
        "fixed_row_variance": pattern / m,
        "fixed_column_variance": pattern / n,
        "fixed_smooth_variance": pattern * kinds / (n * m),
    }[statistic]


def _cube(numbers: Numbers, name: str) -> float:
    value = numbers.get(name, 1.0)
    return value**3 if isfinite(value) else 1.0


def _power_of_two(x: float) -> float:
    return float(2.0**x)


def _percent(x: float) -> float:
    return 100 * expm1(x)
