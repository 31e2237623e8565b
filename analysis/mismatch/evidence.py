"""What the pictures of a diagnosis are drawn from: plain arrays, no part of `mismatch.json`.

`before` is the re-calibrated base model, `after` the model with the effects that were named. Every
part may be absent: a report shows what there is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Against = Literal["signal_dn", "light", "exposure_time_s", "lag_pixels", "code_before"]


@dataclass(frozen=True, eq=False)
class Curve:
    """A statistic of one channel over the exposures (or over lags, or codes).

    Attributes
    ----------
    channel
        MONO, R, Gr, Gb, B; empty: all together.
    against
        What `x` is.
    x, observed, expected_before, expected_after, sd
        By exposure, in one order: the statistic as recorded, as each model gives it (None: nothing
        was named), and its standard deviation when nothing is wrong; nan where unknown.
    unit
        Of the statistic; empty: a pure number.
    z_before, z_after
        Departures from each model in standard deviations, as the search judged them; None: what
        `sd` makes of the departures.
    sd_after
        The standard deviation when the model with the physics named is right.
    """

    channel: str
    against: Against
    x: Array
    observed: Array
    expected_before: Array
    expected_after: Array | None
    sd: Array
    unit: str = ""
    z_before: Array | None = None
    z_after: Array | None = None
    sd_after: Array | None = None


@dataclass(frozen=True, eq=False)
class Map:
    """A quantity of every pixel of one channel, (row, column) of the channel's own pixels.

    Attributes
    ----------
    recorded, before, after
        Of the recording and of simulations of both models; None: not simulated.
    pitch_px
        Mosaic pixels from one pixel of the channel to the next: 1 mono, 2 Bayer.
    """

    channel: str
    unit: str
    recorded: Array
    before: Array | None = None
    after: Array | None = None
    pitch_px: int = 1


@dataclass(frozen=True)
class Shown:
    """In which map a statistic of fixed patterns departs most, how far, and along which axis."""

    map: str
    axis: Literal["", "rows", "columns"] = ""
    z: float = float("inf")


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Temporal power of one channel over spatial frequency, (row, column // 2 + 1).

    Attributes
    ----------
    power, before, after
        As `dsis.measures.Channel.power_spectrum`, in any unit common to the three.
    pitch_px
        Mosaic pixels from one pixel of the channel to the next: 1 mono, 2 Bayer.
    """

    channel: str
    power: Array
    before: Array | None = None
    after: Array | None = None
    pitch_px: int = 1


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """Temporal power of line means of one channel, from frequency 0 on.

    Attributes
    ----------
    power, before, after
        As `dsis.measures.Channel.row_spectrum`, in any unit common to the three.
    degrees
        Independent frames that a bin is the mean of.
    pitch_px
        Mosaic pixels from one line of the channel to the next: 1 mono, 2 Bayer.
    """

    channel: str
    power: Array
    degrees: float
    before: Array | None = None
    after: Array | None = None
    pitch_px: int = 1


@dataclass(frozen=True, eq=False)
class Series:
    """Means of whole frames of one exposure and channel, DN above black, in the order recorded.

    Attributes
    ----------
    frame_means_dn
        By number of the frame; nan: not looked at.
    sd_before_dn, sd_after_dn
        How far each model lets a frame mean wander; None: unknown, or nothing was named.
    locked
        Numbers of the frames that were kept for the proof.
    """

    channel: str
    frame_means_dn: Array
    sd_before_dn: float | None = None
    sd_after_dn: float | None = None
    locked: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Shift:
    """How far the frames of a scene lie from their mean, as a whole.

    Attributes
    ----------
    right_px, down_px
        By number of the frame; nan: not looked at.
    right_error_px, down_error_px
        Standard errors by the noise of the pixels.
    right_waves, down_waves, degrees
        Mean squares of waves over the rows, by cycles a frame, chance being 1, and their degrees of
        freedom; empty: there are too few rows.
    """

    right_px: Array
    down_px: Array
    right_error_px: float
    down_error_px: float
    right_waves: Array
    down_waves: Array
    degrees: Array


@dataclass(frozen=True, eq=False)
class Histogram:
    """How often each code occurs, from `lowest` on; `before`, `after`: as each model has it.

    Simulated converters are others of the same statistics.
    """

    channel: str
    lowest: int
    counts: Array
    before: Array | None = None
    after: Array | None = None


@dataclass(frozen=True, eq=False)
class Evidence:
    """Everything that is drawn, and how the search was done.

    Attributes
    ----------
    curves
        By statistic, a curve per channel.
    maps
        By `offset_map`, `gain_map`, `time_map`, `variance_map`; `offset_alone_map` and
        `gain_alone_map`: as if there were no other.
    shown_in
        Which of them shows a statistic best; absent: none, single exposures do.
    spectra, row_spectra, column_spectra, series, shifts, codes
        By exposure, or `pooled` over all; row spectra: of row means along columns.
    signal_dn
        Mean signal by exposure, DN above black.
    tests, simulations
        Numbers compared, and simulated recordings that they were compared with.
    threshold_z
        From where on a number counts as a departure.
    familywise_level
        Probability of any departure in a recording that differs in nothing.
    seconds
        Time taken; never written, so that the same numbers give the same bytes.
    """

    curves: Mapping[str, tuple[Curve, ...]] = field(default_factory=dict)
    maps: Mapping[str, tuple[Map, ...]] = field(default_factory=dict)
    shown_in: Mapping[str, Shown] = field(default_factory=dict)
    spectra: Mapping[str, tuple[Spectrum, ...]] = field(default_factory=dict)
    row_spectra: Mapping[str, tuple[LineSpectrum, ...]] = field(default_factory=dict)
    column_spectra: Mapping[str, tuple[LineSpectrum, ...]] = field(default_factory=dict)
    series: Mapping[str, tuple[Series, ...]] = field(default_factory=dict)
    shifts: Mapping[str, Shift] = field(default_factory=dict)
    codes: Mapping[str, tuple[Histogram, ...]] = field(default_factory=dict)
    signal_dn: Mapping[str, float] = field(default_factory=dict)
    tests: int | None = None
    simulations: int | None = None
    threshold_z: float = 5.0
    familywise_level: float = 0.01
    seconds: float | None = None
