"""What samples around a spike, and of its pixel afterwards, have of it: a share, too small to see.

Charge that crosses to neighbours, a read-out that remembers and a pixel that keeps some give every
spike the same small share. Of spikes of hundreds of standard deviations that is a few, at samples
that no one tells one by one, and all together make tails that no noise has.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.source import Source
from analysis.mismatch.spikes.hits import Hits, samples_at
from analysis.mismatch.spikes.population import Spikes
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]
_REACH = 2  # rows and columns
_AROUND: Indices = np.array(
    [
        *(
            (0, down, right)
            for down in range(-_REACH, _REACH + 1)
            for right in range(-_REACH, _REACH + 1)
            if down or right
        ),
        (1, 0, 0),
        (2, 0, 0),
    ]
)
"""Frames later, rows and columns away."""
_ASKED = 200  # spikes, the strongest in noises of their pixel
_SURE = 6.0  # standard errors of a share
_LEAST = 0.25  # noises of a pixel: of less than that no sample is put aside


@dataclass(frozen=True)
class _Around:
    """Samples at places around spikes, one entry each.

    Attributes
    ----------
    place
        Which of the places it is.
    spike_dn
        How high that spike is.
    seen
        The sample.
    """

    place: Indices
    spike_dn: Array
    seen: Hits


def with_shares(spikes: Spikes, recording: Recording, source: Source, camera: Camera) -> Spikes:
    """Return spikes with the samples that surely have a share of one, and are not put aside yet.

    Asked is the recording without the spikes: of a pixel that one hit, too, the noise is that of
    the other frames.
    The share that each place around a spike has is a mean over the strongest ones, by least
    squares; samples that are put aside already tell none.
    """
    look = partial(_around, recording, source, camera, spikes)
    strongest = spikes.hits.of(np.arange(_ASKED)[: spikes.hits.frame.size])
    few = look(strongest, _AROUND, np.full(len(_AROUND), np.inf))
    weight = few.spike_dn / few.seen.noise_dn**2
    count = len(_AROUND)
    told = np.bincount(few.place, weight * few.seen.height_dn, count)
    square = np.bincount(few.place, weight * few.spike_dn, count)
    sure = np.abs(told) > _SURE * np.sqrt(square)
    if not sure.any():
        return spikes
    share = np.abs(told[sure] / square[sure])
    every = look(spikes.hits, _AROUND[sure], share)
    enough = share[every.place] * every.spike_dn > _LEAST * every.seen.noise_dn
    return replace(spikes, shares=_once(every.seen.of(enough)))


def _around(
    recording: Recording,
    source: Source,
    camera: Camera,
    spikes: Spikes,
    hits: Hits,
    places: Indices,
    shares: Array,
) -> _Around:
    """Return the samples at places around some spikes that are not put aside already.

    Where a place's share of a spike is as much as half of the least at the spike's own colour.
    """
    at = _at(hits)[:, np.newaxis] + np.insert(places, 0, 0, axis=1)
    frames = np.array([len(exposure.frames) for exposure in recording.exposures])
    ends = np.broadcast_to((0, recording.rows, recording.columns), (len(hits.frame), 3)).copy()
    ends[:, 0] = frames[hits.exposure]
    own = at[:, :, 1:]
    inside = ((own >= 0) & (own < ends[:, np.newaxis])).all(2)
    least = _LEAST / 2 * hits.quiet_dn[:, np.newaxis]
    which, place = np.nonzero(inside & (shares * hits.height_dn[:, np.newaxis] > least))
    some = at[which, place]
    free = ~_among(some, _at(spikes.replaced))
    which, place, some = which[free], place[free], some[free]
    order = np.argsort(some[:, 0], kind="stable")
    seen = [
        samples_at(recording, source, camera, int(number), some[some[:, 0] == number, 1:])
        for number in np.unique(some[:, 0])
    ]
    return _Around(
        place[order],
        hits.height_dn[which[order]],
        Hits.joined([hits.of(np.zeros(0, np.intp)), *seen]),
    )


def _at(hits: Hits) -> Indices:
    """Return exposure, frame, row and column: (sample, 4)."""
    return np.stack([hits.exposure, hits.frame, hits.row, hits.column], 1)


def _among(some: Indices, others: Indices) -> NDArray[np.bool_]:
    known = set(map(tuple, others.tolist()))
    return np.array([tuple(own) in known for own in some.tolist()], bool)


def _once(hits: Hits) -> Hits:
    """Return samples, each of them once."""
    _, first = np.unique(_at(hits), axis=0, return_index=True)
    return hits.of(np.sort(first))
