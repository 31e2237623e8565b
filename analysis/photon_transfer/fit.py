"""Fit the paper's camera model to a recording: statistics -> black level -> segments -> figures.

Every decision that a reader of the numbers must know of is a sentence in `Fit.remarks`.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import Any

import numpy as np
from scipy import stats

from analysis.photon_transfer.beyond import FittedEffect, effects_of, pooled_current, with_spread
from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.distribution import Distribution, noise_distribution
from analysis.photon_transfer.emva1288 import figures_of_merit
from analysis.photon_transfer.levels import (
    FittedLevel,
    dark_of,
    leave_out,
    levels_of,
    points_of,
    saturation_of,
    with_residual,
)
from analysis.photon_transfer.lines import Line, Points
from analysis.photon_transfer.model_figures import model_figures
from analysis.photon_transfer.patterns import PatternSums
from analysis.photon_transfer.pedestal import black_level
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.remarks import (
    CONVERTER,
    SATURATED,
    UNREACHED,
    remark_on_fit,
    remarks_on_clipped_darks,
    remarks_on_description,
    remarks_on_patterns,
    remarks_on_unknown,
)
from analysis.photon_transfer.segments import SegmentFit, fit_segments, lines_between
from analysis.photon_transfer.statistics import LevelStatistics, expose_statistics
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.errors import InputError
from dsis.recording.copies import Same, copied_exposures
from dsis.recording.hygiene import CLIPPED_SHARE, Inspection
from dsis.simulate.maps import SensorMaps

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class ChannelFit:
    """What one channel by itself says.

    Attributes
    ----------
    dark
        Its black level and dark current; None without darks.
    lines
        Its own slope and intercept in each segment; None where it has fewer than two levels there.
    figures
        EMVA 1288's figures of merit; empty without darks.
    """

    dark: DarkLine | None
    lines: tuple[Line | None, ...]
    figures: tuple[Quantity, ...]


@dataclass(frozen=True)
class Fit:
    """The camera model that a recording asks for, and how well it is known.

    Attributes
    ----------
    name, cfa, white_level, bit_depth
        The sensor's.
    black_dn, black_se_dn
        Black level of such sensors, over all channels. The error is that of temporal noise and of
        this one sensor's fixed pattern, whose mean is part of what was measured; None where darks
        are missing (nominal level).
    black_noise_se_dn
        The part of it that is temporal noise: the error of this sensor's own black level, which is
        what slopes and intercepts depend on, for flats hold the same pattern.
    segments
        Slopes (DN), intercepts (DN^2, rounding's 1/12 taken off) and switches (DN above black).
    levels
        Every level of every channel, used or not.
    channels
        Each channel by itself.
    homogeneity_p
        How likely chance makes the channels' lines differ as they do; nan with one channel.
    saturation_dn
        Where the charge stops growing below the white level; None where it was not seen.
    full_well_dn, full_well_reached, full_well_means
        `saturation_dn` where it was seen; else a lower limit: white level less black level where
        the converter clips, the largest level used where nothing does. And which of these.
    quantities
        Gain, read noise, full well and dynamic range of the fitted model.
    distribution
        Noise at one level, for the figure; None where there is no usable flat.
    effects
        Dark current, fixed patterns by their parts, shading and coarse codes where they are
        certain: part of the camera.
    maps
        Offset and gain of every pixel, best linear estimates; None with fewer than four darks or
        flats of use.
    remarks
        What limits these numbers, in sentences.
    """

    name: str
    cfa: Cfa
    white_level: float
    bit_depth: int
    black_dn: float
    black_se_dn: float | None
    black_noise_se_dn: float | None
    segments: SegmentFit
    levels: tuple[FittedLevel, ...]
    channels: dict[str, ChannelFit]
    homogeneity_p: float
    saturation_dn: float | None
    full_well_dn: float
    full_well_reached: bool
    full_well_means: str
    quantities: tuple[Quantity, ...]
    distribution: Distribution | None
    effects: tuple[FittedEffect, ...]
    maps: SensorMaps | None = field(compare=False, repr=False)
    remarks: tuple[str, ...]

    @property
    def camera(self) -> Camera:
        """The camera model; raises `InputError` where the fit is no possible camera."""
        ends = [switch.middle_dn for switch in self.segments.switches]
        pieces = []
        for number, line in enumerate(self.segments.lines):
            if line.slope_dn < 0:
                fact = f"is {line.slope_dn:.4g} +- {line.slope_se_dn:.2g} DN, must not be negative"
                raise InputError.of(
                    self.name, f"noise.segment[{number}].slope", f"{fact}: record more levels"
                )
            pieces.append(
                Segment(
                    upper_dn=ends[number] if number < len(ends) else None,
                    slope=line.slope_dn,
                    intercept=line.intercept_dn2,
                    slope_se=line.slope_se_dn,
                    intercept_se=line.intercept_se_dn2,
                )
            )
        return Camera(
            name=self.name,
            cfa=self.cfa,
            black_level=max(self.black_dn, 0.0),
            white_level=self.white_level,
            bit_depth=self.bit_depth,
            saturation_dn=self.saturation_dn,
            noise=BaseNoise(segment=tuple(pieces)),
            effect=tuple(fitted.effect for fitted in self.effects),
        )


def fit_camera(
    recording: Recorded,
    segments: int | None = None,
    *,
    threads: int = 1,
    progress: Progress | None = None,
    distribution_of: str | None = None,
) -> Fit:
    """Return the camera model of a recording, in one pass over its frames (see `_measured`).

    Parameters
    ----------
    recording
        Darks and flats; scenes are passed over. The flat of the distribution is read again.
    segments
        Number of read-out segments; None: as many as the data need.
    threads
        Exposures measured at the same time; the result does not depend on it.
    progress
        Called with (exposures done, exposures in all, name of the exposure).
    distribution_of
        The exposure whose noise distribution is kept; None: the flat nearest half of the range.

    Raises
    ------
    InputError
        Where no camera can be fitted: why each exposure is of no use.
    """
    remarks: list[str] = []
    measured, inspection, sums = _measured(recording, threads, progress)
    copies = inspection.copies(recording)
    copied = copied_exposures(copies)
    measured = [replace(s, copied_frames=s.exposure in copied) for s in measured]
    step, phase = inspection.step_dn(), inspection.phase_dn()
    remarks += _remarks_on_frames(recording, inspection, copies, step)
    names = list(dict.fromkeys(np.ravel(channel_names(recording.sensor.cfa)).tolist()))
    darks = {name: dark_of(measured, name, step, phase) for name in names}
    levels = levels_of(measured, darks, recording.sensor.black_level, step, phase)
    saturation = saturation_of(levels)
    levels = leave_out(levels, saturation, remarks)
    sums.without(recording, {v.statistics.exposure for v in levels if v.left_out})
    current = with_spread(pooled_current(darks), sums.currents(recording, levels))
    rate, apart = (current.value, bool(current.beside)) if current is not None else (0.0, False)
    patterns = sums.patterns(recording, levels, rate, apart=apart)
    black = black_level(recording.sensor.black_level, darks, patterns.dark, remarks, patterns.why)
    points = points_of(levels)
    found = _fit(recording, levels, points, segments, black.noise_se_dn or 0.0)
    levels = [with_residual(level, found) for level in levels]
    lines = {}
    for name in names:
        own = points.scattered(found.scatter).part(points.channel == name)
        lines[name] = lines_between(own, found.switches)
    alike = _homogeneity(found, lines, points.scattered(found.scatter))
    used = [level for level in levels if not level.left_out and level.statistics.kind == "flat"]
    full, full_means = _full_well(inspection.white_level, levels, saturation, black.level_dn)
    channels = {
        name: ChannelFit(
            darks[name],
            lines[name][0],
            figures_of_merit([s for s in measured if s.channel == name], step),
        )
        for name in names
    }
    remarks += remarks_on_clipped_darks(measured, recording.sensor.black_level)
    remarks += remarks_on_description(measured, recording.sensor.black_level)
    remark_on_fit(found, alike, darks, levels, remarks, full_well_means=full_means)
    remarks += remarks_on_patterns(patterns)
    remarks += remarks_on_unknown({name: channel.figures for name, channel in channels.items()})
    return Fit(
        name=recording.sensor.name,
        cfa=recording.sensor.cfa,
        white_level=float(recording.sensor.white_level),
        bit_depth=recording.sensor.bit_depth,
        black_dn=black.level_dn,
        black_se_dn=black.se_dn,
        black_noise_se_dn=black.noise_se_dn,
        segments=found,
        levels=tuple(levels),
        channels=channels,
        homogeneity_p=alike,
        saturation_dn=saturation,
        full_well_dn=full,
        full_well_reached=full_means == SATURATED,
        full_well_means=full_means,
        quantities=model_figures(found, full, full_means),
        distribution=noise_distribution(recording, _chosen(distribution_of, used, recording)),
        effects=effects_of(current, patterns, step, phase),
        maps=patterns.maps,
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _full_well(
    white: float, levels: Sequence[FittedLevel], saturation: float | None, black: float
) -> tuple[float, str]:
    """Return the largest signal, DN above black, and what it is."""
    if saturation is not None:
        return saturation, SATURATED
    flats = [level for level in levels if level.statistics.kind == "flat"]
    if any(level.statistics.clipped_high > CLIPPED_SHARE for level in flats):
        return white - black, CONVERTER
    return max(level.x_dn for level in flats if not level.left_out), UNREACHED


def _measured(
    recording: Recorded, threads: int, progress: Progress | None
) -> tuple[list[LevelStatistics], Inspection, PatternSums]:
    """Return what one pass over darks and flats shows.

    Codes in steps may not reach the white level: where the last step ends below it, a second pass
    counts as clipped what is at the last step.
    """
    white = float(recording.sensor.white_level)
    measured, inspection, sums = _pass(recording, white, threads, progress)
    short = (white - inspection.phase_dn()) % inspection.step_dn()
    return _pass(recording, white - short, threads, None) if short else (measured, inspection, sums)


def _pass(
    recording: Recorded, white: float, threads: int, progress: Progress | None
) -> tuple[list[LevelStatistics], Inspection, PatternSums]:
    """Return the statistics of darks and flats, in the recording's order, and what was seen."""
    exposures = [e for e in recording.exposures if str(e.kind) in ("dark", "flat")]
    inspection, sums = Inspection(white), PatternSums()
    done, lock = 0, Lock()

    def measure(exposure: Any) -> list[LevelStatistics]:
        nonlocal done
        part = expose_statistics(recording, exposure, inspection, sums)
        with lock:
            done += 1
            if progress is not None:
                progress(done, len(exposures), str(exposure.name))
        return part

    with ThreadPoolExecutor(max(threads, 1)) as pool:
        # The longest first: no thread is left with a long one while others have nothing to do.
        order = sorted(range(len(exposures)), key=lambda i: -len(exposures[i].frames))
        running = {i: pool.submit(measure, exposures[i]) for i in order}
        parts = [running[i].result() for i in range(len(exposures))]
    return [s for part in parts for s in part], inspection, sums


def _remarks_on_frames(
    recording: Recorded, inspection: Inspection, copies: Sequence[Same], step_dn: int
) -> list[str]:
    """Return what the frames show of themselves: copies, clipping, odd codes, scenes."""
    # Levels at the white level are named where they are left out.
    said = inspection.remarks(recording.exposures, copies)
    found = [r for r in said if "at the white level" not in r]
    scenes = sum(str(e.kind) not in ("dark", "flat") for e in recording.exposures)
    if scenes:
        found.append(f"{scenes} exposure(s) of kind scene are not used.")
    if step_dn > 1:
        found.append(
            f"Codes come in steps of {step_dn} DN: rounding is taken as {step_dn}^2 / 12 DN^2, and "
            "the camera model has the effect quantisation."
        )
    return found


def _fit(
    recording: Recorded,
    levels: Sequence[FittedLevel],
    points: Points,
    segments: int | None,
    black_se: float,
) -> SegmentFit:
    name = recording.sensor.name
    flats = [level for level in levels if level.statistics.kind == "flat"]
    if not any(not level.left_out for level in flats):
        reasons = dict.fromkeys(f"{level.statistics.exposure}: {level.left_out}" for level in flats)
        why = "; ".join(list(reasons)[:8]) or "the recording has no exposure of kind flat"
        raise InputError.of(name, "exposure", f"no flat can be used ({why})")
    try:
        return fit_segments(points, segments, black_se)
    except ValueError as error:
        key = "exposure" if segments is None else f"--segments {segments}"
        fact = f"too few usable levels, darks counted as one: {error}"
        raise InputError.of(name, key, fact) from None


def _homogeneity(
    fit: SegmentFit,
    lines: dict[str, tuple[tuple[Line | None, ...], float, int]],
    points: Points,
) -> float:
    """Return how likely chance makes the channels differ as they do."""
    parts = list(lines.values())
    if len(parts) < 2 or any(line is None for own, _, _ in parts for line in own):
        return float("nan")
    separate, parameters = sum(part[1] for part in parts), sum(part[2] for part in parts)
    _, pooled, fewer = lines_between(points, fit.switches)
    return float(stats.chi2.sf(max(pooled - separate, 0.0), parameters - fewer))


def _chosen(wanted: str | None, used: Sequence[FittedLevel], recording: Recorded) -> str:
    names = [exposure.name for exposure in recording.exposures]
    if wanted is not None:
        if wanted not in names:
            fact = f"is {wanted!r}, must be an exposure of the recording: {', '.join(names[:20])}"
            raise InputError.of(recording.sensor.name, "distribution_of", fact)
        return wanted
    half = 0.5 * max(level.x_dn for level in used)
    return min(used, key=lambda level: abs(level.x_dn - half)).statistics.exposure
