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
_ASKED = 200  # spikes, for each place the strongest that leave it free
_SURE = 6.0  # standard errors of a share
_LEAST = 0.25  # noises of a pixel: of less than that no sample is put aside
_OF_MEDIAN = np.pi / 2  # variance of a median of normal values, over that of their mean


@dataclass(frozen=True)
class _Around:
    """Samples at places around spikes, one entry each.

    Attributes
    ----------
    spike, place
        Which spike it is, and which of the places.
    at
        Exposure, frame, row and column: (sample, 4).
    """

    spike: Indices
    place: Indices
    at: Indices

    @classmethod
    def of(cls, recording: Recording, spikes: Spikes) -> "_Around":
        """Return the samples at all places around spikes that are not put aside already."""
        hits = spikes.hits
        at = _at(hits)[:, np.newaxis] + np.insert(_AROUND, 0, 0, axis=1)
        frames = np.array([len(exposure.frames) for exposure in recording.exposures])
        ends = np.broadcast_to((0, recording.rows, recording.columns), (len(hits.frame), 3)).copy()
        ends[:, 0] = frames[hits.exposure]
        own = at[:, :, 1:]
        spike, place = np.nonzero(((own >= 0) & (own < ends[:, np.newaxis])).all(2))
        found = cls(spike, place, at[spike, place])
        return found.which(~_among(found.at, _at(spikes.replaced), recording))

    def which(self, some: NDArray[np.generic]) -> "_Around":
        """Return some of them."""
        return _Around(self.spike[some], self.place[some], self.at[some])

    def first(self, count: int) -> "_Around":
        """Return so many of each place, of the strongest spikes."""
        order = np.argsort(self.place, kind="stable")
        begin = np.searchsorted(self.place[order], np.arange(len(_AROUND)))
        rank = np.arange(order.size) - begin[self.place[order]]
        return self.which(order[rank < count])

    def in_exposures(self) -> "_Around":
        """Return them by exposure."""
        return self.which(np.argsort(self.at[:, 0], kind="stable"))


def with_shares(spikes: Spikes, recording: Recording, source: Source, camera: Camera) -> Spikes:
    """Return spikes with the samples that surely have a share of one, and are not put aside yet.

    Of these the share is taken off. Asked is the recording without the spikes: of a pixel that one
    hit, too, the noise is that of the other frames. The share of each place around a spike is a
    mean by least squares, less the median of all places: noise of few electrons is skewed, and
    its median lies below all of it.
    """
    look = partial(_samples, recording, source, camera)
    around, heights_dn = _Around.of(recording, spikes), spikes.hits.height_dn
    few = around.first(_ASKED).in_exposures()
    if not few.spike.size:
        return spikes
    seen, spike_dn = look(few), heights_dn[few.spike]
    frames = np.array([len(recording.exposures[number].frames) for number in seen.exposure])
    spread = 1 + np.where(frames > 2, _OF_MEDIAN, 1.0) / (frames - 1)
    weight = spike_dn / (seen.noise_dn**2 * spread)
    told, square = (
        np.bincount(few.place, weight * own, len(_AROUND)) for own in (seen.height_dn, spike_dn)
    )
    asked = square > 0
    share = np.where(asked, told / np.where(asked, square, 1.0), 0.0)
    share -= np.median(share[asked])
    sure = asked & (np.abs(share) * np.sqrt(square) > _SURE)
    if not sure.any():
        return spikes
    quiet = np.full(len(recording.exposures), np.inf)
    np.minimum.at(quiet, spikes.hits.exposure, spikes.hits.quiet_dn)
    share = np.where(sure, share, 0.0)
    taken_dn = share[around.place] * heights_dn[around.spike]
    every = around.which(np.abs(taken_dn) > _LEAST / 2 * quiet[around.at[:, 0]]).in_exposures()
    if not every.spike.size:
        return spikes
    seen, taken_dn = look(every), share[every.place] * heights_dn[every.spike]
    enough = np.abs(taken_dn) > _LEAST * seen.noise_dn
    unsure = spikes.hits.clipped[every.spike]  # higher than is known
    shares = _taken_off(seen.of(enough), taken_dn[enough], unsure[enough], recording, source)
    return replace(spikes, shares=shares, uncovered=_uncovered(spikes, _AROUND[sure], recording))


def _samples(recording: Recording, source: Source, camera: Camera, around: _Around) -> Hits:
    """Return the samples at some places, in order of exposures."""
    numbers = np.unique(around.at[:, 0])
    return Hits.joined(
        [
            samples_at(
                recording, source, camera, int(number), around.at[around.at[:, 0] == number, 1:]
            )
            for number in numbers
        ]
    )


def _taken_off(
    seen: Hits,
    taken_dn: Array,
    unsure: NDArray[np.bool_],
    recording: Recording,
    source: Source,
) -> Hits:
    """Return samples, each once, that have instead what they have less all shares of spikes.

    Where a share is `unsure` what the pixel has in the other frames is there instead.
    """
    ids, first, which = np.unique(
        _numbers(_at(seen), recording), return_index=True, return_inverse=True
    )
    less_dn = np.bincount(which, taken_dn, ids.size)
    known = np.bincount(which, unsure, ids.size) == 0
    own = seen.of(first)
    codes = np.zeros(ids.size)
    for number in np.unique(own.exposure):
        frames = np.unique(own.frame[own.exposure == number])
        name = recording.exposures[number].name
        for frame, image in zip(frames, source.frames(name, frames.tolist()), strict=True):
            here = (own.exposure == number) & (own.frame == frame)
            codes[here] = image[own.row[here], own.column[here]]
    left = np.clip(np.rint(codes - less_dn), 0, recording.sensor.white_level)
    return replace(own, instead=np.where(known, left, own.instead).astype(own.instead.dtype))


def _uncovered(spikes: Spikes, places: Indices, recording: Recording) -> Hits:
    """Return the echoes that lie at other places around spikes than those that have a share."""
    at = _at(spikes.hits)[:, np.newaxis] + np.insert(places, 0, 0, axis=1)
    return spikes.echoes.of(~_among(_at(spikes.echoes), at.reshape(-1, 4), recording))


def _at(hits: Hits) -> Indices:
    """Return exposure, frame, row and column: (sample, 4)."""
    return np.stack([hits.exposure, hits.frame, hits.row, hits.column], 1)


def _numbers(at: Indices, recording: Recording) -> Indices:
    """Return a number for each sample, another for each place: (sample,)."""
    frames = max(len(exposure.frames) for exposure in recording.exposures)
    sizes = (frames + 2 * _REACH, recording.rows + 2 * _REACH, recording.columns + 2 * _REACH)
    number = at[:, 0]
    for axis, size in enumerate(sizes):
        number = number * size + at[:, 1 + axis] + _REACH
    return number


def _among(some: Indices, others: Indices, recording: Recording) -> NDArray[np.bool_]:
    return np.isin(_numbers(some, recording), _numbers(others, recording))
