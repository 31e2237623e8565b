"""Fig. 1: the pipeline, with what the noise is at its three stages."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.paper.figures.fig1 import draw_stages
from analysis.paper.jackknife import with_error
from analysis.paper.part import Part, Picture, Row, Table, table_of
from analysis.paper.scene import Scene, scene
from analysis.paper.setting import Setting
from analysis.paper.table1 import NAMES
from dsis.cfa import pattern
from dsis.color import white_balanced
from dsis.covariance import LagCovariance, measured_covariance
from dsis.demosaic import METHODS, demosaic
from dsis.visibility import VisibleNoise

Image: TypeAlias = NDArray[np.float32]

FIELDS = 8
RAMP_PX = (128, 1024)  # rows, columns of a grey ramp in equal steps of exposure
RAMP = (0.004, 4.0)  # scene light, 1 is diffuse white
BINS = 32
RAMP_FRAME = 1000  # its first noise field: far from those of City
LAGS = ((0, 1), (1, 0), (1, 1), (0, 2))
WITHOUT = {"none": "without"} | NAMES


@dataclass(frozen=True)
class Curve:
    """Noise of one channel against the signal at one stage.

    Attributes
    ----------
    signal, variance, skewness, skewness_error
        By bin of the ramp; variance in the unit of the signal squared, the error that of the mean
        over noise fields.
    """

    signal: NDArray[np.float64]
    variance: NDArray[np.float64]
    skewness: NDArray[np.float64]
    skewness_error: NDArray[np.float64]


def recompute(setting: Setting, folder: Path) -> Part:
    """Measure the noise at the three stages, on a grey ramp and on City."""
    city = scene("city", setting, 1)
    draw_stages(_stages(city), city.camera.segments, folder / "fig1_stages")
    correlations, moments = _correlations(city)
    seen, shown = _visible(city)
    rows = (*_equation_2(city), *_strengthened(moments), *_colourful(seen))
    picture = Picture(
        "fig1_stages",
        "Variance and skewness of the noise against the signal at the three stages, by channel, on "
        "a grey ramp: 1 raw data (line: m x + t, with the step of the dual-gain read-out), 2 after "
        "white balance and bilinear demosaicking, 3 after the colour transform, in 8-bit codes.",
    )
    return Part("fig1", "Fig. 1", _says(), rows, (picture,), (correlations, shown))


def _says() -> tuple[str, ...]:
    stages = (
        "The paper's Fig. 1 names three stages: 1 raw data, 2 demosaicked, 3 display. Here the "
        "noise is measured at each: noisy less noise-free data that went the same way. In the raw "
        "data it is independent, Gaussian and linear in the signal; white balance multiplies it "
        "by g_c, equation (2); demosaicking correlates it; the colour transform bends its "
        "variance, skews it and mixes the channels."
    )
    colour = (
        "'More colorful' is counted as the share of the visible noise energy (S-CIELAB at the "
        "test's viewing distance) that lies in a* and b*. Stages 1 and 2 are shown through the "
        "display's gamma alone, without matrix and tone curve."
    )
    cannot = (
        "The paper's pipeline is a figure of boxes without numbers, and its colour transform is "
        "not stated (here: the ACES view of a pinned OpenColorIO configuration): the rows test "
        "its sentences."
    )
    return (stages, colour, cannot)


def _stages(city: Scene) -> tuple[dict[str, Curve], ...]:
    """Return the curves of R, G, B at stages 1, 2 and 3."""
    light = np.geomspace(*RAMP, RAMP_PX[1], dtype=np.float32)
    ramp = np.broadcast_to(light[np.newaxis, :, np.newaxis], (*RAMP_PX, 3))
    clean = city.camera.clean_raw(np.ascontiguousarray(ramp))
    still = _through(city, clean, "bilinear")
    noise: list[list[Image]] = [[], [], []]
    for field in range(FIELDS):
        noisy = city.noisy(clean, RAMP_FRAME + field)
        seen = _through(city, noisy, "bilinear")
        noise[0].append(noisy - clean)
        noise[1].append(seen[0] - still[0])
        noise[2].append((seen[1] - still[1]) * np.float32(255))
    signals = (clean, still[0], still[1] * np.float32(255))
    return tuple(
        {colour: _curve(signal, stack, c) for c, colour in enumerate("RGB")}
        for signal, stack in zip(signals, noise, strict=True)
    )


def _curve(signal: Image, noise: list[Image], channel: int) -> Curve:
    """Return the curve of a channel, averaged over columns of nearly one signal."""
    edge = 4
    stack = np.stack(noise)[:, edge:-edge, :, channel].astype(np.float64)
    fields, rows = stack.shape[:2]
    values = stack.reshape(fields, rows, BINS, -1).transpose(0, 2, 1, 3).reshape(fields, BINS, -1)
    variance = np.square(values).mean(axis=2)
    skewness = (values**3).mean(axis=2) / variance**1.5
    level = signal[edge:-edge, :, channel].mean(axis=0).reshape(BINS, -1).mean(axis=1)
    error = skewness.std(axis=0, ddof=1) / np.sqrt(fields)
    return Curve(level, variance.mean(axis=0), skewness.mean(axis=0), error)


def _through(city: Scene, raw: Image, method: str) -> tuple[Image, Image]:
    """Return stage 2 (white-balanced, demosaicked; "none": full planes) and stage 3, display."""
    if method == "none":
        balanced = white_balanced(raw, city.camera.white_balance)
    else:
        sampled = city.balanced_mosaic(raw)
        balanced = demosaic(sampled, city.camera.cfa, method, full_scale=city.full_scale)
    return balanced, city.display_of_balanced(balanced)


def _correlations(city: Scene) -> tuple[Table, dict[tuple[str, int], list[LagCovariance]]]:
    clean = city.clean(0)
    moments: dict[tuple[str, int], list[LagCovariance]] = {}
    still = {method: _through(city, clean, method) for method in WITHOUT}
    for field in range(FIELDS):
        noisy = city.noisy(clean, field)
        raw = city.balanced_mosaic(noisy) - city.balanced_mosaic(clean)
        moments.setdefault(("mosaic", 1), []).append(measured_covariance(raw[..., np.newaxis]))
        for method in WITHOUT:
            pairs = zip(_through(city, noisy, method), still[method], strict=True)
            for stage, (seen, reference) in enumerate(pairs, start=2):
                parts = moments.setdefault((method, stage), [])
                parts.append(measured_covariance(seen - reference))
    rows = []
    for (method, stage), parts in sorted(moments.items(), key=lambda item: item[0][1]):
        pooled = with_error(parts, LagCovariance.pooled)[0]
        between = with_error(parts, LagCovariance.between_channels)[0]
        cells: list[object] = [float(pooled[lag]) for lag in LAGS]
        pairs_of = ((0, 1), (0, 2), (1, 2)) if len(between) == 3 else ()
        cells += [float(between[pair]) for pair in pairs_of] or ["", "", ""]
        rows.append((str(stage), WITHOUT.get(method, "mosaic"), *cells))
    lags = [f"({k},{c})" for k, c in LAGS]
    header = ("stage", "demosaicking", *lags, "red, green", "red, blue", "green, blue")
    caption = "Correlation of the camera's noise on City at the three stages, with neighbours "
    caption += "(pooled as in Table 1) and between the channels"
    return table_of("fig1_correlation", caption, header, rows), moments


def _strengthened(moments: dict[tuple[str, int], list[LagCovariance]]) -> list[Row]:
    """Return what the colour transform adds to the correlations."""
    rows = []
    for method in METHODS:
        for name, statistic, at in (
            ("with the right neighbour", LagCovariance.pooled, (0, 1)),
            ("of red and green", LagCovariance.between_channels, (0, 1)),
        ):
            at2, error2 = (x[at] for x in with_error(moments[method, 2], statistic))
            at3, error3 = (x[at] for x in with_error(moments[method, 3], statistic))
            what = f"{NAMES[method]}: correlation {name}, stage 3 less stage 2"
            remark = f'"Color transformations can strengthen the correlation": {at2:.3f} to '
            rows.append(
                Row(
                    what,
                    None,
                    float(at3 - at2),
                    float(np.hypot(error2, error3)),
                    "",
                    remark + f"{at3:.3f}",
                )
            )
    return rows


def _equation_2(city: Scene) -> list[Row]:
    """Return the factors by which white balance multiplies the noise."""
    clean = city.clean(0)
    noise = city.noisy(clean, 0) - clean
    balanced = city.balanced_mosaic(clean + noise) - city.balanced_mosaic(clean)
    colours = np.tile(pattern(city.camera.cfa), (clean.shape[0] // 2 + 1, clean.shape[1] // 2 + 1))
    colours = colours[: clean.shape[0], : clean.shape[1]]
    rows = []
    for c, gain in enumerate(city.camera.white_balance):
        at = colours == c
        found = float(balanced[at].std() / noise[..., c][at].std())
        what = f"equation (2): sd of n_wb / sd of n, {'RGB'[c]}"
        rows.append(Row(what, gain, found, None, "", "published: g_c of the simulated camera"))
    return rows


def _visible(city: Scene) -> tuple[dict[tuple[str, str, int], VisibleNoise], Table]:
    """Return the visible noise by (noise, method, stage), and the table of it."""
    clean = city.clean(0)
    reference = city.rendering.reference(clean)
    seen, rows = {}, []

    def add(noise: str, method: str, stage: int, test: Image, still: Image) -> None:
        visible = city.eye.difference(np.clip(test, 0, 1), city.eye.seen(np.clip(still, 0, 1)))
        seen[noise, method, stage] = visible
        rows.append((noise, WITHOUT[method], str(stage), visible.energy, _share(visible)))

    white = city.white(reference, 0)
    add("AWGN", "none", 3, white, reference)
    for method in METHODS:
        still = city.white_demosaicked(reference, method)
        add("AWGN", method, 3, city.white_demosaicked(white, method), still)
    noisy = city.noisy(clean, 0)
    for method in WITHOUT:
        test, still_ = _through(city, noisy, method), _through(city, clean, method)
        linear = (_gamma(x / city.full_scale) for x in (test[0], still_[0]))
        add("SD", method, 1 if method == "none" else 2, next(linear), next(linear))
        add("SD", method, 3, test[1], still_[1])
    header = ("noise", "demosaicking", "stage", "visible energy, ΔE²", "chroma share")
    caption = "Visible noise energy on City and the share of it that is colour, against the "
    caption += "noise-free frame that went the same way"
    return seen, table_of("fig1_visible", caption, header, rows)


def _gamma(linear: Image) -> Image:
    shown: Image = np.maximum(linear, np.float32(0)) ** np.float32(1 / 2.4)
    return shown


def _share(visible: VisibleNoise) -> float:
    """Return the part of visible noise that is colour."""
    return visible.colour / visible.energy


def _colourful(seen: dict[tuple[str, str, int], VisibleNoise]) -> list[Row]:
    rows = []
    for noise in ("AWGN", "SD"):
        before = seen[noise, "none", 3]
        for method in METHODS:
            after = seen[noise, method, 3]
            change = _share(after) - _share(before)
            remark = f'"appears more colorful": chroma energy x {after.colour / before.colour:.2f}'
            remark += f", its share {_share(before):.3f} to {_share(after):.3f}: "
            remark += "holds" if change > 0 else "lightness noise grows faster still"
            what = f"{noise}, {NAMES[method]}: change of the chroma share of visible noise"
            rows.append(Row(what, None, change, None, "", remark))
    return rows
