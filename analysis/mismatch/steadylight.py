"""Flats of unknown light whose levels are in proportion to their exposure times: the light is one.

A lamp that is left alone while the exposure time is changed is the usual way to make a series of
levels (EMVA 1288, release 4.0, section 6). Where nobody wrote down the light, levels tell it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.layout import sites
from analysis.mismatch.source import Source
from dsis.cfa import Cfa
from dsis.recording import RecordedExposure, Recording

Array = NDArray[np.float64]
_READ = 8  # frames of an exposure
_LEAST = 4  # flats, of as many times
_TIMES = 2.0  # as long the longest as the shortest, at least
_NEAR = 0.05  # of the middle ratio of level to time: a response bends by less
_SCATTER = 1e-3  # of it, beside what frames scatter: a lamp that is left alone is as steady
_CHANCE = 0.01  # of one light, whose levels scatter more by chance
_BENT = 2  # degree of what a response may be bent by, in ratios


def with_steady_light(recording: Recording, source: Source) -> Recording:
    """Return the recording with its exposure times as light of the flats, where levels say so.

    That is where no flat has a light, and levels above darks over times are within 5 % of one
    another and, but for a smooth bend with the level, scatter by 0.1 % and what frames do: light
    that is set anew for each flat scatters more. Flats of the longest times may be darker: they
    are full. Else the recording itself.
    """
    flats, darks = recording.of_kind("flat"), recording.of_kind("dark")
    times = _times(flats)
    few = len(set(times.tolist())) < _LEAST or times.max() < _TIMES * times.min()
    if few or times.min() <= 0 or not darks or any(e.light is not None for e in flats):
        return recording
    level, error, clipped = _levels(recording, source, flats)
    black, unsure, _ = _levels(recording, source, darks)
    darkest = int(level.sum(0).argmin())  # colour of a mosaic: it is full last
    order = np.argsort(_times(darks), kind="stable")
    beneath, doubt = (
        np.interp(times, _times(darks)[order], own[order, darkest]) for own in (black, unsure)
    )
    whole = clipped[:, darkest] <= CLIPPED_SHARE
    signal, errors = level[:, darkest] - beneath, np.hypot(error[:, darkest], doubt)
    if not _steady(times[whole], signal[whole], errors[whole]):
        return recording
    lit = [replace(e, light=e.exposure_time_s) if e.kind == "flat" else e
           for e in recording.exposures]  # fmt: skip
    return replace(recording, exposures=tuple(lit))


def _steady(times: Array, signal: Array, error: Array) -> bool:
    """Return whether signals above black, with errors, are those of one light: (flat,) each."""
    if times.size < _LEAST or signal.min() <= 0:
        return False
    ratio = signal / times / np.median(signal / times)
    near = np.abs(ratio - 1) < _NEAR
    full = (times > times[near].max(initial=0.0)) & (ratio < 1)
    if not (near | full).all() or len(set(times[near].tolist())) < _LEAST:
        return False
    wide = np.hypot(_SCATTER, error[near] / signal[near])
    degree = min(_BENT, int(near.sum()) - 3)
    bends = np.vander(signal[near] / signal[near].max(), 1 + degree) / wide[:, np.newaxis]
    values = ratio[near] / wide
    rest = values - bends @ np.linalg.lstsq(bends, values, rcond=None)[0]
    return bool(chi2.sf(rest @ rest, values.size - bends.shape[1]) > _CHANCE)


def _times(exposures: Sequence[RecordedExposure]) -> Array:
    return np.array([e.exposure_time_s for e in exposures])


def _levels(
    recording: Recording, source: Source, exposures: Sequence[RecordedExposure]
) -> tuple[Array, Array, Array]:
    """Return levels, their errors by the frames' scatter, and shares that are clipped.

    (exposure, channel) each.
    """
    sensor = recording.sensor
    step = 1 if sensor.cfa is Cfa.MONO else 2
    found = []
    for exposure in exposures:
        numbers = range(min(len(exposure.frames), _READ))
        own = np.array(
            [
                [(plane.mean(), (plane >= sensor.white_level).mean()) for plane in planes]
                for frame in source.frames(exposure.name, numbers)
                for planes in [[frame[y::step, x::step] for y, x in sites(sensor.cfa).values()]]
            ]
        )  # (frame, channel, number)
        means = own[..., 0]
        many = len(means) > 1
        error = (
            means.std(0, ddof=1) / len(means) ** 0.5 if many else np.full(means.shape[1], np.inf)
        )
        found.append((means.mean(0), error, own[..., 1].mean(0)))
    level, error, clipped = (np.stack(parts) for parts in zip(*found, strict=True))
    return level, error, clipped
