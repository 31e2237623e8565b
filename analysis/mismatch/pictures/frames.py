"""Spectra, frame means and codes: as recorded, and as both models simulate them."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import SpectrumSums
from analysis.mismatch.bank.motion import AXES
from analysis.mismatch.evidence import Histogram, LineSpectrum, Series, Shift, Spectrum
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.observe import Observation
from analysis.mismatch.pictures.album import Album, wander_dn
from analysis.mismatch.split import Split

Array = NDArray[np.float64]
Albums = Sequence[Album]
POOLED = "pooled"


def spectra(album: Album, before: Albums, after: Albums) -> dict[str, tuple[Spectrum, ...]]:
    """Return the power of all exposures together, white noise at 1, by channel."""

    def of(channel: str) -> Callable[[Album], Array]:
        return lambda one: one.spectra[channel].power / one.spectra[channel].weight[""][0]

    some = tuple(
        Spectrum(name, of(name)(album), *_means(of(name), before, after), pitch_px=_pitch(name))
        for name in album.spectra
        if _moves(name, (album, *before, *after))
    )
    return {POOLED: some} if some else {}


def line_spectra(
    album: Album, before: Albums, after: Albums, axis: str
) -> dict[str, tuple[LineSpectrum, ...]]:
    """Return the power of `rows` or `columns` means: all exposures together, and each alone.

    All together are weighted as suits what stands out most: alike in DN, or growing with the light.
    """
    found: dict[str, tuple[LineSpectrum, ...]] = {}
    pooled = []
    for name, sums in album.spectra.items():
        if not _moves(name, (album, *before, *after)):
            continue
        key = _weighting(sums, axis)

        def of(one: Album, channel: str = name, by: str = key) -> Array:
            own = one.spectra[channel]
            return (own.rows[by] if axis == "rows" else own.columns) / own.weight[by][0]

        pooled.append(
            LineSpectrum(
                name, of(album), sums.degrees(key), *_means(of, before, after), _pitch(name)
            )
        )
    if pooled:
        found[POOLED] = tuple(pooled)
    # Codes that stand still may move in a simulation, or the other way round.
    shown = [place for place in album.lines if all(place in a.lines for a in (*before, *after))]
    for exposure in dict.fromkeys(place[0] for place in shown):
        places = [place for place in shown if place[0] == exposure]
        found[exposure] = tuple(_line(album, before, after, place, axis) for place in places)
    return found


def _line(album: Album, before: Albums, after: Albums, place: Place, axis: str) -> LineSpectrum:
    def of(one: Album) -> Array:
        lines = one.lines[place]
        return lines.rows if axis == "rows" else lines.columns

    degrees = album.lines[place].degrees
    models = _means(of, before, after)
    return LineSpectrum(place[1], of(album), degrees, *models, _pitch(place[1]))


def _weighting(sums: SpectrumSums, axis: str) -> str:
    """Return which weighting shows the larger peak."""
    if axis == "columns" or not sums.weight["signal"][0]:
        return ""
    numbers = sums.numbers()
    alike, of_light = (
        numbers[name][0] for name in ("row_spectrum_peak", "row_spectrum_peak of light")
    )
    return "signal" if of_light > alike else ""


def series(
    layout: Layout, split: Split, album: Album, before: Albums, after: Albums
) -> dict[str, tuple[Series, ...]]:
    """Return frame means by exposure; nan: frames that were not looked at."""
    found: dict[str, tuple[Series, ...]] = {}
    for exposure in layout.exposures:
        locked = split.locked.get(exposure.name, ())
        size = 1 + max((*exposure.numbers, *locked))
        some = []
        for channel in layout.channels:
            place = (exposure.name, channel)
            means = np.full(size, np.nan)
            means[list(exposure.numbers)] = album.means[place]
            spread = (wander_dn(before, place), wander_dn(after, place))
            some.append(Series(channel, means, *spread, locked=tuple(locked)))
        found[exposure.name] = tuple(some)
    return found


def shifts(layout: Layout, seen: Observation) -> dict[str, Shift]:
    """Return how scenes move from frame to frame, by exposure."""
    found = {}
    for exposure in layout.pictures:
        if exposure.name not in seen.shifts:
            continue
        own = seen.shifts[exposure.name]
        along = {axis: np.full(1 + max(exposure.numbers), np.nan) for axis in AXES}
        for axis, pixels in own.along.items():
            along[axis][list(exposure.numbers)] = pixels
        right, down = AXES
        errors = own.errors[right], own.errors[down]
        none = np.zeros(0)
        waves = own.waves.get(right, none), own.waves.get(down, none)
        found[exposure.name] = Shift(along[right], along[down], *errors, *waves, own.degrees)
    return found


def codes(album: Album, before: Albums, after: Albums) -> dict[str, tuple[Histogram, ...]]:
    """Return the counts of codes around the median, by exposure."""
    found: dict[str, list[Histogram]] = {}
    for place, own in album.codes.items():

        def of(one: Album, at: Place = place, lowest: int = own.lowest) -> Array:
            return one.codes[at].at(lowest, album.codes[at].counts.size)

        some = found.setdefault(place[0], [])
        some.append(Histogram(place[1], own.lowest, own.counts, *_means(of, before, after)))
    return {exposure: tuple(some) for exposure, some in found.items()}


def _means(
    of: Callable[[Album], Array], before: Albums, after: Albums
) -> tuple[Array | None, Array | None]:
    """Return the mean of an array over the simulations of each model; None: not simulated."""
    one, two = (
        np.mean([of(a) for a in some], axis=0) if some else None for some in (before, after)
    )
    return one, two


def _moves(channel: str, albums: Albums) -> bool:
    """Return whether a channel has a spectrum in all of them: codes may stand still in one."""
    return all(one.spectra[channel].weight[""][0] for one in albums)


def _pitch(channel: str) -> int:
    return 1 if channel == "MONO" else 2
