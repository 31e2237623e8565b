"""What a recording can tell: its levels with their variances, and what other effects add."""

from dataclasses import dataclass, field

import numpy as np

from third.camera import Array, Camera

ROUNDING = 1 / 12  # variance of rounding to whole codes, DN^2
CLEAR = 4  # standard deviations that a level keeps from the white level


@dataclass(frozen=True)
class Cells:
    """Levels that do not clip, by exposure and site of the mosaic; then by whole exposure.

    Attributes
    ----------
    exposure, site
        Number of the exposure and of the colour site.
    signal, variance, frames, pixels, time
        Of each cell: DN, DN^2, frames, pixels, s.
    slope, read_share, shot_share
        Of its read-out path, and what share of the variance is read noise and shot noise.
    dark
        Whether it is of a dark.
    whole_signal, whole_square, whole_variance, whole_read_share, whole_frames, whole_time
        Means over the sites of the exposures of which no site clips.
    """

    exposure: Array
    site: Array
    signal: Array
    variance: Array
    read_share: Array
    shot_share: Array
    slope: Array
    frames: Array
    pixels: Array
    time: Array
    dark: Array
    whole_signal: Array
    whole_square: Array
    whole_variance: Array
    whole_read_share: Array
    whole_frames: Array
    whole_time: Array

    @classmethod
    def of(cls, camera: Camera) -> "Cells":
        """Return the cells of a camera's plan."""
        places = [(y, x) for y in (0, 1) for x in (0, 1)] if camera.mosaic else [(0, 0)]
        rows = [
            row
            for number, exposure in enumerate(camera.exposures)
            if exposure.kind != "scene"
            for site, place in enumerate(places)
            if (row := _cell(camera, number, site, exposure.signal_dn * camera.response[place]))
        ]
        columns = np.array(rows).T
        numbers = columns[0].astype(int)
        dark = np.array([camera.exposures[number].kind == "dark" for number in numbers])
        signal, variance, read_share, frames, time = columns[[2, 3, 4, 7, 9]]
        whole = [i for i in sorted(set(numbers)) if (numbers == i).sum() == len(places)]
        means = [
            np.array([values[numbers == i].mean() for i in whole])
            for values in (signal, signal**2, variance, read_share, frames, time)
        ]
        return cls(numbers, *[*columns[1:], dark, *means])

    @property
    def flats(self) -> int:
        """Number of flats with a level that does not clip."""
        return len(set(self.exposure[~self.dark]))


@dataclass
class Floors:
    """What effects that are planted already hide: standard deviations, DN or relative."""

    pixel_offset: float = 0.0
    pixel_gain: float = 0.0
    row_noise: float = 0.0
    column_noise: float = 0.0
    frame_offset: float = 0.0
    frame_gain: float = 0.0


@dataclass(frozen=True)
class Bench:
    """A camera, what its recording can tell, and the floors that fill up as effects are planted."""

    camera: Camera
    cells: Cells
    floors: Floors = field(default_factory=Floors)


def _cell(camera: Camera, number: int, site: int, signal: float) -> tuple[float, ...]:
    """Return the numbers of a cell; empty where it clips."""
    exposure, path = camera.exposures[number], camera.path_at(signal)
    variance = path.slope * signal + path.intercept + ROUNDING
    if signal + CLEAR * variance**0.5 > camera.full:
        return ()
    return (
        number,
        site,
        signal,
        variance,
        path.intercept / variance,
        path.slope * signal / variance,
        path.slope,
        exposure.frames,
        camera.pixels / (4 if camera.mosaic else 1),
        exposure.time_s,
    )
