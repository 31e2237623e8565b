"""Flats of unknown light whose levels are in proportion to their exposure times: the light is one.

A lamp that is left alone while the exposure time is changed is the usual way to make a series of
levels (EMVA 1288, release 4.0, section 6). Where nobody wrote down the light, levels tell it.
"""

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
    flats = recording.of_kind("flat")
    times = np.array([e.exposure_time_s for e in flats])
    few = len(set(times.tolist())) < _LEAST or times.min() <= 0
    if few or times.max() < _TIMES * times.min() or any(e.light is not None for e in flats):
        return recording
    darks = [_levels(recording, source, e) for e in recording.of_kind("dark")]
    if not darks:
        return recording
    order = np.argsort([e.exposure_time_s for e in recording.of_kind("dark")], kind="stable")
    at = np.array([e.exposure_time_s for e in recording.of_kind("dark")])[order]
    levels = [_levels(recording, source, e) for e in flats]
    # Of a mosaic the darkest colour is full last.
    of = int(np.argmin([sum(means[c] for means, _, _ in levels) for c in range(len(levels[0][0]))]))
    black, unsure = (np.array([darks[i][k][of] for i in order]) for k in (0, 1))
    signal = np.array([m[of] for m, _, _ in levels]) - np.interp(times, at, black)
    error = np.hypot([e[of] for _, e, _ in levels], np.interp(times, at, unsure))
    clipped = np.array([share[of] > CLIPPED_SHARE for _, _, share in levels])
    if _steady(times[~clipped], signal[~clipped], error[~clipped]):
        lit = {e.name: e.exposure_time_s for e in flats}
        return replace(
            recording,
            exposures=tuple(
                replace(e, light=lit[e.name]) if e.name in lit else e for e in recording.exposures
            ),
        )
    return recording


def _steady(times: Array, signal: Array, error: Array) -> bool:
    """Return whether signals above black, with errors, are those of one light: (flat,) each."""
    if times.size < _LEAST or signal.min() <= 0:
        return False
    ratio = signal / times
    near = np.abs(ratio / np.median(ratio) - 1) < _NEAR
    full = (times > times[near].max(initial=0.0)) & (ratio < np.median(ratio))
    if not (near | full).all() or len(set(times[near].tolist())) < _LEAST:
        return False
    ratio, x = ratio[near] / np.median(ratio), signal[near] / signal[near].max()
    wide = np.hypot(_SCATTER, error[near] / signal[near])
    bends = np.vander(x, 1 + min(_BENT, ratio.size - 3)) / wide[:, np.newaxis]
    rest = ratio / wide - bends @ np.linalg.lstsq(bends, ratio / wide, rcond=None)[0]
    return bool(chi2.sf(rest @ rest, ratio.size - bends.shape[1]) > _CHANCE)


def _levels(
    recording: Recording, source: Source, exposure: RecordedExposure
) -> tuple[Array, Array, Array]:
    """Return level, its error by the frames' scatter, and the share that is clipped, by channel."""
    sensor, numbers = recording.sensor, range(min(len(exposure.frames), _READ))
    step = 1 if sensor.cfa is Cfa.MONO else 2
    means, clipped = [], []
    for frame in source.frames(exposure.name, numbers):
        planes = [frame[y::step, x::step] for y, x in sites(sensor.cfa).values()]
        means.append([float(plane.mean()) for plane in planes])
        clipped.append([float((plane >= sensor.white_level).mean()) for plane in planes])
    own = np.array(means)
    error = own.std(0, ddof=1) if len(own) > 1 else np.full(own.shape[1], np.inf)
    return own.mean(0), error / len(own) ** 0.5, np.array(clipped).mean(0)
