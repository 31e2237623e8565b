"""Spectra of the temporal noise, of line means and of maps, with the line that stands out."""

from collections.abc import Sequence

import numpy as np
import scipy.stats
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS, GREY, INK
from analysis.mismatch.bank.robust import drawn_in
from analysis.mismatch.evidence import Array, LineSpectrum, Map, Spectrum
from analysis.mismatch.finding import Where
from analysis.mismatch.report.figures.maps import PANELS
from analysis.mismatch.report.figures.ticks import plain_numbers
from analysis.mismatch.report.numbers import plain

LINE_SIZE_INCHES = (9.6, 3.2)
_CELLS = (96, 48)  # of the picture of a spectrum, down and across
_MARK = "#ffffff"


def size_inches(spectra: Sequence[Spectrum]) -> tuple[float, float]:
    """Return width and height of a figure with a line of panels for each channel."""
    panels = len(_panels(spectra[0]))
    return 1.2 + 2.4 * panels, 3.9 * len(spectra)


def of_maps(maps: Sequence[Map]) -> Spectrum:
    """Return the spectra of maps beyond rows and columns, those of channels summed.

    Each is over its median, and pixels that stand far out count as so far out as others ever are.
    """
    first = maps[0]
    before = [one.before for one in maps if one.before is not None]
    after = [one.after for one in maps if one.after is not None]
    return Spectrum(
        first.channel if len(maps) == 1 else "",
        _power([one.recorded for one in maps]),
        _power(before) if before else None,
        _power(after) if after else None,
        first.pitch_px,
    )


def draw(figure: Figure, spectra: Sequence[Spectrum], where: Where) -> None:
    """Draw power over frequency, in decades above its median; the line that was found is ringed."""
    grid = figure.subplots(len(spectra), len(_panels(spectra[0])), squeeze=False)
    for line, one in zip(grid, spectra, strict=True):
        nyquist = 0.5 / one.pitch_px
        median = float(np.median(one.power[1:, 1:]))
        decades = [
            _coarse(np.fft.fftshift(np.log10(np.maximum(p, 1e-12 * median) / median), axes=0))
            for p in _panels(one).values()
        ]
        low, top = float(np.quantile(decades[0], 0.01)), max(float(decades[0].max()), 0.3)
        for axes, title, image in zip(line, _panels(one), decades, strict=True):
            drawn = axes.imshow(
                image,
                cmap="cividis",
                vmin=low,
                vmax=top,
                extent=(0, nyquist, nyquist, -nyquist),
                interpolation="none",
                aspect="equal",
            )
            of = "" if one.channel in ("", "MONO") else f"{one.channel}, "
            axes.set_title(f"{of}{title}", loc="left", fontsize=8.5)
            axes.set_xlabel("cycles/pixel along a row", fontsize=8)
        line[0].set_ylabel("cycles/pixel along a column", fontsize=8)
        if where.spatial_frequency is not None:
            _ring(line[0], where.spatial_frequency, nyquist)
        figure.colorbar(drawn, ax=list(line), label="power over median, decades", pad=0.02)


def draw_lines(figure: Figure, spectra: Sequence[LineSpectrum], where: Where, axis: int) -> None:
    """Draw the power of line means: recorded, models, and what chance stays below.

    `axis`: which of the two frequencies of `where` runs along x (0: columns, 1: rows).
    """
    panels = np.ravel(figure.subplots(1, len(spectra), squeeze=False, sharey=True))
    for axes, one in zip(panels, spectra, strict=True):
        frequency = np.linspace(0, 0.5 / one.pitch_px, one.power.size)[1:]
        axes.plot(frequency, one.power[1:], color=INK, lw=0.9, label="recorded")
        if one.before is not None:
            axes.plot(frequency, one.before[1:], color=ALARM, lw=1.0, label="base model")
            limit = one.before[1:] * _largest_by_chance(one.degrees, frequency.size)
            axes.plot(frequency, limit, color=GREY, ls=(0, (4, 3)), lw=0.9, label="chance, 99 %")
        if one.after is not None:
            axes.plot(frequency, one.after[1:], color=COLOURS[0], lw=1.1, label="physics named")
        axes.set_yscale("log")
        plain_numbers(axes.yaxis)
        axes.set_xlabel("cycles/pixel")
        axes.grid(visible=True)
        axes.set_title(one.channel if len(spectra) > 1 else "Power of line means", loc="left")
        if where.spatial_frequency is not None:
            peak = folded(where.spatial_frequency[axis], 0.5 / one.pitch_px)
            axes.axvline(abs(peak), color=ALARM, lw=0.8, ls=(0, (1, 1.5)))
            axes.annotate(
                f" {abs(peak):.4g}", (abs(peak), 0.93), xycoords=("data", "axes fraction")
            )
    panels[0].set_ylabel("power, relative")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _power(images: Sequence[Array]) -> Array:
    rows, columns = np.min([image.shape for image in images], axis=0)
    total: Array = np.zeros((rows, columns // 2 + 1))
    for image in images:
        own = image[:rows, :columns]
        rest = own - own.mean(0) - own.mean(1)[:, np.newaxis]
        power = np.abs(np.fft.rfft2(drawn_in(rest))) ** 2
        middle = np.median(power[1:, 1:])
        power[0], power[:, 0] = middle, middle  # lines were taken off
        total += power / (middle or 1.0)
    return total


def folded(frequency: float, nyquist: float) -> float:
    """Return where a frequency of the mosaic shows in a channel that samples more coarsely."""
    period = 2 * nyquist
    return (frequency + nyquist) % period - nyquist


def _panels(one: Spectrum) -> dict[str, Array]:
    images = zip(PANELS, (one.power, one.before, one.after), strict=True)
    return {title: image for title, image in images if image is not None}


def _coarse(image: Array) -> Array:
    """Return blocks of bins, each its largest one, so that a single line is seen on a page."""
    down, across = (max(1, size // cells) for size, cells in zip(image.shape, _CELLS, strict=True))
    rows, columns = image.shape[0] // down, image.shape[1] // across
    blocks = image[: rows * down, : columns * across].reshape(rows, down, columns, across)
    return np.asarray(blocks.max((1, 3)))


def _ring(axes: Axes, at: tuple[float, float], nyquist: float) -> None:
    x, y = (folded(value, nyquist) for value in at)
    if x < 0:
        x, y = -x, -y
    axes.plot(x, y, "o", mfc="none", mec=_MARK, ms=11, mew=1.3, clip_on=False, zorder=5)
    axes.annotate(
        f"({plain(at[0])}, {plain(at[1])})",
        (x, y),
        (0, -9),
        textcoords="offset points",
        color=_MARK,
        ha="right" if x > nyquist / 2 else "left",
        va="top",
        fontsize=8,
    )


def _largest_by_chance(degrees: float, bins: int) -> float:
    """Return what the largest of white noise's bins stays below in 99 %, over their mean."""
    shape = max(degrees, 1.0)
    return float(scipy.stats.gamma.ppf(1 - 0.01 / bins, shape)) / shape
