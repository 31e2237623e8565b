"""Equation (5): predicted against measured covariance of demosaicked camera noise, by region."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.paper.figures.equation5 import draw_levels, draw_regions
from analysis.paper.jackknife import with_error
from analysis.paper.part import Part, Picture, Row, Table, table_of
from analysis.paper.regions import REGIONS, regions
from analysis.paper.scene import Scene, scene
from analysis.paper.setting import Setting
from analysis.paper.table1 import NAMES
from dsis.covariance import (
    LagCovariance,
    linearised_covariance,
    measured_covariance,
    predicted_covariance,
)
from dsis.demosaic import METHODS, demosaic
from dsis.draw import Draw

FIELDS = 16  # of noise, for what is measured
PROBES = 4  # of small noise, for what is linearised
STOPS = (-4.0, -2.0, 0.0, 2.0)  # of under-exposure beside the paper's noise
LEVEL_FIELDS = 4

Image: TypeAlias = NDArray[np.float32]
Region: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True)
class Compared:
    """Prediction and measurement in one region.

    Attributes
    ----------
    method, region
        Demosaicking, and where ("all", "flat", "edge", "texture").
    measured, error
        All correlations by lag and channel pair, and their standard errors over noise fields.
    predicted
        The same, predicted, by the point of linearisation; exact for bilinear ("exact").
    sd_ratio
        Predicted over measured standard deviation, by the point of linearisation.
    """

    method: str
    region: str
    measured: NDArray[np.float64]
    error: NDArray[np.float64]
    predicted: dict[str, NDArray[np.float64]]
    sd_ratio: dict[str, float]

    def worst(self, point: str) -> float:
        """Return the largest absolute deviation of a predicted correlation."""
        return float(np.abs(self.predicted[point] - self.measured).max())


def recompute(setting: Setting, folder: Path) -> Part:
    """Compare equation (5) with measurements on City."""
    city = scene("city", setting, 1)
    found = _compare(city, setting, FIELDS, with_regions=True)
    levels = {stops: _levels(city.under_exposed(stops), setting) for stops in STOPS}
    draw_regions(found, folder / "equation5_regions")
    draw_levels(levels, folder / "equation5_levels")
    exact = next(c for c in found if c.method == "bilinear" and c.region == "all")
    rows = (
        Row(
            "bilinear, largest |predicted \u2212 measured| correlation",
            0.0,
            exact.worst("exact"),
            float(exact.error.max()),
            remark='the paper: "For linear debayering methods the above approximation is exact"; '
            f"largest of {exact.measured.size} entries, the error that of the least certain",
        ),
    )
    pictures = (
        Picture(
            "equation5_regions",
            "Predicted against measured correlations of demosaicked signal-dependent noise on "
            "City: all distances up to 2 pixels, all pairs of channels. Full marks: linearised at "
            "the clean mosaic (bilinear: exact); hollow marks: at noisy ones.",
        ),
        Picture(
            "equation5_levels",
            "Largest deviation of a predicted correlation against the strength of the noise, full "
            "lines linearised at the clean mosaic, dashed lines at noisy ones; 0 is the paper's "
            "noise, each stop halves the light.",
        ),
    )
    return Part("equation5", "Equation (5)", _says(found), rows, pictures, (_table(found),))


def _says(found: list[Compared]) -> tuple[str, ...]:
    return (
        (
            "Equation (5) makes demosaicked noise Gaussian with covariance BΣB\u1d40: Σ diagonal, "
            "the variances m x + t of the samples of the mosaic after white balance, B the "
            "demosaicking. For bilinear demosaicking B is a known filter at each Bayer phase, and "
            "nothing is approximated. DLMMSE and Lu-Tan weigh samples by the picture: their "
            "Jacobian takes the place of B, probed by small noise at the clean mosaic, or at "
            "mosaics with noise. What remains is what a linear model of them cannot say."
        ),
        (
            "Measured is demosaicked(noisy) less demosaicked(clean) on one frame of City with "
            f"{FIELDS} independent fields of the camera's noise (bilinear: {4 * FIELDS}), rounded "
            "and clipped to codes. Flat, edge and texture are told apart by the structure tensor "
            "of the noise-free frame."
        ),
        _reading(found),
    )


def _reading(found: list[Compared]) -> str:
    """Say where the linearisation holds, in numbers."""
    parts = []
    for method in METHODS[1:]:
        by_region = {c.region: c for c in found if c.method == method}
        numbers = ", ".join(
            f"{by_region[region].worst('clean'):.3f} and {by_region[region].worst('noisy'):.3f} "
            f"({region})"
            for region in REGIONS
        )
        parts.append(f"{NAMES[method]} {numbers}")
    return (
        "Linearised at the clean mosaic and at noisy ones, the largest deviation of a correlation "
        f"is {'; '.join(parts)}. Where the picture is flat, the noise itself steers the weights "
        "of Lu-Tan: its Jacobian at the clean mosaic is not that at which it works."
    )


def _levels(city: Scene, setting: Setting) -> list[Compared]:
    return _compare(city, setting, LEVEL_FIELDS, with_regions=False)


def _compare(city: Scene, setting: Setting, fields: int, *, with_regions: bool) -> list[Compared]:
    """Return the comparison for each method and region."""
    clean = city.clean(0)
    masks: dict[str, Region | None] = {"all": None}
    if with_regions:
        masks |= regions(city.rendering.reference(clean) * np.float32(255))
    measured = _measured(city, clean, masks, setting, fields)
    return [
        _compared(method, region, parts, _predictions(city, clean, method, masks[region], setting))
        for (method, region), parts in measured.items()
    ]


def _measured(
    city: Scene, clean: Image, masks: dict[str, Region | None], setting: Setting, fields: int
) -> dict[tuple[str, str], list[LagCovariance]]:
    """Return the moments of the demosaicked noise of independent fields, by method and region.

    Bilinear, the fastest, gets four times as many.
    """
    cfa, full_scale = city.camera.cfa, city.full_scale
    mosaic = city.balanced_mosaic(clean)
    still = {method: demosaic(mosaic, cfa, method, full_scale=full_scale) for method in METHODS}

    def one(field: int) -> dict[tuple[str, str], LagCovariance]:
        noisy = city.balanced_mosaic(city.noisy(clean, field))
        moments = {}
        for method in METHODS if field < fields else METHODS[:1]:
            noise = demosaic(noisy, cfa, method, full_scale=full_scale) - still[method]
            for name, mask in masks.items():
                moments[method, name] = measured_covariance(noise, region=mask)
        return moments

    with ThreadPoolExecutor(setting.jobs) as pool:
        found = list(pool.map(one, range(4 * fields)))
    return {key: [moments[key] for moments in found if key in moments] for key in found[0]}


def _predictions(
    city: Scene, clean: Image, method: str, mask: Region | None, setting: Setting
) -> dict[str, LagCovariance]:
    """Return what equation (5) says, by the point of linearisation."""
    cfa, variance = city.camera.cfa, city.balanced_variance(clean)
    if method == "bilinear":
        return {"exact": predicted_covariance(variance, cfa, region=mask)}
    points: tuple[Literal["clean", "noisy"], ...] = ("clean", "noisy")
    return {
        around: linearised_covariance(
            city.balanced_mosaic(clean),
            variance,
            cfa,
            method,
            Draw(setting.seed, ("equation 5",)),
            full_scale=city.full_scale,
            around=around,
            draws=PROBES,
            region=mask,
            threads=setting.jobs,
        )
        for around in points
    }


def _compared(
    method: str, region: str, parts: list[LagCovariance], predicted: dict[str, LagCovariance]
) -> Compared:
    measured, error = with_error(parts, LagCovariance.correlations)
    total = float(with_error(parts, _total)[0])
    return Compared(
        method,
        region,
        measured,
        error,
        {point: moments.correlations() for point, moments in predicted.items()},
        {point: float(_total(moments) / total) ** 0.5 for point, moments in predicted.items()},
    )


def _total(moments: LagCovariance) -> NDArray[np.float64]:
    return np.asarray(moments.variance.sum())


def _table(found: list[Compared]) -> Table:
    rows = []
    for c in found:
        rows += [
            (NAMES[c.method], c.region, point, c.worst(point), float(c.error.max()), ratio)
            for point, ratio in c.sd_ratio.items()
        ]
    header = (
        "method",
        "region",
        "linearised at",
        "largest deviation of a correlation",
        "s.e. of the least certain",
        "predicted / measured sd",
    )
    return table_of("equation5_regions", "Equation (5) by region", header, rows)
