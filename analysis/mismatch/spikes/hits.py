"""Samples of an exposure far from what their pixel has in the other frames."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.scenes import SCENE
from analysis.mismatch.source import Source
from analysis.mismatch.spikes.screen import (
    Array,
    Codes,
    Image,
    Movement,
    Places,
    far_samples,
    movement,
    noise_dn,
    of_lines,
    reference,
    thinned,
)
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.measures.median import median
from dsis.recording import RecordedExposure, Recording

FAR = 6.0  # noises of a pixel: nearer samples are not looked at
_MOST = 2000  # far samples of an exposure: more are no rare spikes
_SHARE = 1e-2  # of its samples
_FEW = 100  # which any exposure may have
_AROUND = 2  # pixels of one colour to each side
_TWO = 2
_STILL = 0.5  # noises, by which a frame may move as a whole


@dataclass(frozen=True)
class Hits:
    """Far samples, one entry each.

    Attributes
    ----------
    exposure
        Its place in the recording.
    frame, row, column
        Where.
    height_dn
        Above the median of the pixel's other frames; what the samples around it, its row and its
        column have in common in that frame is taken off.
    noise_dn
        Of the pixel.
    quiet_dn
        Of its channel in the exposure.
    instead
        The pixel's code without it: the lower median of the other frames, as they would be if they
        had moved as this one.
    clipped
        Whether it is at the white level.
    """

    exposure: NDArray[np.intp]
    frame: NDArray[np.intp]
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    height_dn: Array
    noise_dn: Array
    quiet_dn: Array
    instead: Codes
    clipped: NDArray[np.bool_]

    @property
    def ratio(self) -> Array:
        """Heights in noises of their pixels."""
        return np.asarray(self.height_dn / self.noise_dn)

    def of(self, which: NDArray[np.generic]) -> "Hits":
        """Return some of them."""
        return Hits(*(getattr(self, field.name)[which] for field in fields(self)))

    @classmethod
    def joined(cls, some: list["Hits"]) -> "Hits":
        """Return all of them."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(own, name) for own in some]) for name in names))


@dataclass(frozen=True)
class Looked:
    """What an exposure shows.

    Attributes
    ----------
    hits
        Its far samples.
    noise_dn, level_dn
        By row and column of the colour filter: (2, 2).
    of_lines
        Share of the spread of samples that is that of whole lines.
    """

    hits: Hits
    noise_dn: Array
    level_dn: Array
    of_lines: float


def hits_of(
    recording: Recording, source: Source, camera: Camera, number: int, farthest: float = FAR
) -> Looked | None:
    """Return the far samples of an exposure; None: they are too many to be rare, or it has no pair.

    They are farther than so many noises of their pixel.

    Three frames tell what each pixel has, and one pair how noisy most are.
    """
    exposure = recording.exposures[number]
    frames = len(exposure.frames)
    if frames < _TWO:
        return None
    watch = _Watch.of(recording, source, camera, exposure, farthest)
    most = min(_MOST, max(_FEW, int(_SHARE * frames * recording.rows * recording.columns)))
    places, moved, count = [], [], 0
    for k, frame in enumerate(source.frames(exposure.name, range(frames))):
        own = watch.moved(frame, k)
        found = watch.far(frame, k, own, most - count)
        if found is None:
            return None
        places.append(found)
        moved.append(own)
        count += len(found)
    places = _all_of_the_often_far(places)
    hits = _exact(watch, source, places, moved, number)
    hits = hits.of(np.abs(hits.ratio) > watch.noises)
    return Looked(hits, watch.noise, watch.level, watch.of_lines)


def samples_at(
    recording: Recording, source: Source, camera: Camera, number: int, at: NDArray[np.intp]
) -> Hits:
    """Return samples of an exposure, of frame, row and column `at` (sample, 3), in that order."""
    exposure = recording.exposures[number]
    watch = _Watch.of(recording, source, camera, exposure, FAR)
    frames = range(len(exposure.frames))
    order = np.argsort(at[:, 0], kind="stable")
    places = [at[order][at[order, 0] == k, 1:].astype(np.int32) for k in frames]
    images = enumerate(source.frames(exposure.name, frames))
    moved = [watch.moved(image, k) for k, image in images]
    return _exact(watch, source, places, moved, number).of(np.argsort(order, kind="stable"))


def _all_of_the_often_far(places: list[Places]) -> list[Places]:
    """Return places by frame, in all frames those that are far in most.

    Of such a pixel the reference itself may have been hit, from which the others were far then.
    """
    site, times = np.unique(np.concatenate(places), axis=0, return_counts=True)
    often = site[times > len(places) / 2]
    return [np.unique(np.concatenate([own, often]), axis=0) for own in places]


@dataclass(frozen=True)
class _Watch:
    """How far samples of an exposure are told from the others."""

    exposure: RecordedExposure
    middles: list[Codes]
    farthest: Image
    noises: float
    noise: Array
    level: Array
    of_lines: float
    black: float
    white: float
    step: int
    camera: Camera

    @classmethod
    def of(
        cls,
        recording: Recording,
        source: Source,
        camera: Camera,
        exposure: RecordedExposure,
        noises: float,
    ) -> "_Watch":
        n = len(exposure.frames)
        pair = list(source.frames(exposure.name, [n - 2, n - 1]))
        if n == _TWO:
            middles = pair[::-1]  # each frame is beside the other
        else:
            three = [n // 4, n // 2, n - 1] if n > 3 else [0, 1, 2]
            middles = [reference(list(source.frames(exposure.name, three)))]
        step = 1 if recording.sensor.cfa is Cfa.MONO else 2
        noise, level = np.zeros((2, 2)), np.zeros((2, 2))
        for y in range(step):
            for x in range(step):
                noise[y::step, x::step] = noise_dn(pair[0], pair[1], y, x, step)
                level[y::step, x::step] = median(thinned(middles[0], y, x, step))
        rows, columns = recording.rows, recording.columns
        sd = np.tile(noise, (rows // 2 + 1, columns // 2 + 1))[:rows, :columns]
        black = recording.sensor.black_level
        if exposure.kind == SCENE:  # a picture's bright parts are noisier than most
            line = camera.segments.variance_dn2(middles[0].astype(np.float32) - np.float32(black))
            sd = np.sqrt(np.maximum(sd**2, line))
        farthest = np.ascontiguousarray(noises * sd, np.float32)
        white = recording.sensor.white_level
        lines = of_lines(pair[0], pair[1], step)
        return cls(
            exposure, middles, farthest, noises, noise, level, lines, black, white, step, camera
        )

    def middle(self, frame: int) -> Codes:
        return self.middles[frame % len(self.middles)]

    def moved(self, frame: Codes, number: int) -> Movement:
        scene, middle = self.exposure.kind == SCENE, self.middle(number)
        return movement(frame, middle, self.black, scene=scene, step=self.step)

    def far(self, frame: Codes, number: int, moved: Movement, most: int) -> Places | None:
        middle = self.middle(number)
        found = far_samples(frame, middle, self.farthest, moved, self.black, most)
        if found is None or len(self.middles) == 1:
            return found
        # Of two frames that differ the one counts that is unlike its surroundings.
        here, there = (
            np.array([abs(float(i[y, x]) - self.around(i, y, x)) for y, x in found])
            for i in (frame, middle)
        )
        return found[here > there]

    def around(self, image: NDArray[np.generic], y: int, x: int) -> float:
        """Return the median of the samples of one colour around a sample, without it."""
        reach = _AROUND * self.step
        top, left = (c - min(c // self.step * self.step, reach) for c in (y, x))
        part = np.asarray(
            image[top : y + reach + 1 : self.step, left : x + reach + 1 : self.step], np.float64
        )
        own = np.ones(part.shape, bool)
        own[(y - top) // self.step, (x - left) // self.step] = False
        return float(np.median(part[own]))

    def common(self, frame: Codes, number: int, places: Places) -> Array:
        """Return what surroundings, row and column of places have moved, DN: (place, 3)."""
        change = frame.astype(np.float32) - self.middle(number)
        return np.array(
            [
                (
                    self.around(change, y, x),
                    float(np.median(change[y, x % self.step :: self.step])),
                    float(np.median(change[y % self.step :: self.step, x])),
                )
                for y, x in places
            ]
        ).reshape(-1, 3)


def _exact(
    watch: _Watch, source: Source, places: list[Places], moved: list[Movement], number: int
) -> Hits:
    """Return samples at places of each frame, by all frames of their pixels."""
    frame = np.repeat(np.arange(len(places)), [len(own) for own in places])
    rows, columns = np.concatenate(places).T.astype(np.intp)
    series, common = np.empty((len(places), frame.size)), [np.zeros((0, 3))]
    if frame.size:
        for k, image in enumerate(source.frames(watch.exposure.name, range(len(places)))):
            series[k] = image[rows, columns]
            common.append(watch.common(image, k, places[k]))
    middle = np.minimum.reduce(watch.middles)  # of two frames the one without the spike
    above = middle[rows, columns].astype(np.float64) - watch.black
    beyond = np.stack([own.at(rows, columns, above) for own in moved])
    # Of two frames each has moved from the other: half of that from where both would be.
    shift = beyond / len(watch.middles)
    each = np.arange(frame.size)
    both = enumerate(_at_same_pixels(rows, columns))
    seen = [_seen(watch, series, shift, frame, (rows, columns), one) for one in both]
    heights, noise, instead = np.array(seen).reshape(-1, 3).T
    # What the frame has in common beyond its own movement counts for no spike.
    beside = np.concatenate(common) - beyond[frame, each][:, np.newaxis]
    up, down = np.maximum(beside.max(1), 0), np.minimum(beside.min(1), 0)
    heights = np.where(heights > 0, np.maximum(heights - up, 0), np.minimum(heights - down, 0))
    return Hits(
        np.full(frame.size, number),
        frame,
        rows,
        columns,
        heights,
        noise,
        watch.noise[rows % 2, columns % 2],
        instead.astype(np.uint16),
        series[frame, each] >= watch.white,
    )


def _at_same_pixels(rows: NDArray[np.intp], columns: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Return for each sample the places of all that are of its pixel, itself too, in order."""
    order = np.lexsort((columns, rows))
    new = (np.diff(rows[order]) != 0) | (np.diff(columns[order]) != 0)
    groups = np.split(order, np.flatnonzero(new) + 1)
    found = [order] * rows.size
    for group in groups:
        for i in group:
            found[i] = group
    return found


def _seen(
    watch: _Watch,
    series: Array,
    shift: Array,
    frame: NDArray[np.intp],
    at: tuple[NDArray[np.intp], NDArray[np.intp]],
    which: tuple[int, NDArray[np.intp]],
) -> tuple[float, float, float]:
    """Return the height of a far sample, its pixel's noise, DN, and the code it has without it.

    `which` it is, and all that are of its pixel. No less noise than its channel has, than the pixel
    has in the frames where it is not far, or than light of its level makes. The code is one that
    occurs, unless whole frames moved.
    """
    (rows, columns), (i, here) = at, which
    k, values = frame[i], series[:, i] - shift[:, i]
    others = np.delete(values, k)
    level, site = float(np.median(others)), (rows[i] % 2, columns[i] % 2)
    far = frame[here]
    if far.size == values.size:  # it is asked in all frames
        far = np.flatnonzero(np.abs(values - level) > watch.noises * watch.noise[site])
    calm = np.delete(values, far) if far.size < values.size - 1 else others
    line = watch.camera.segments.variance_dn2
    ends = line(np.maximum(np.array([level, watch.level[site]]) - watch.black, 0.0))
    lit = float(watch.noise[site] ** 2 + max(float(ends[0] - ends[1]), 0.0))
    own = float(calm.var(ddof=1)) if calm.size > 1 else 0.0
    noise = float(np.sqrt(max(lit, own)))
    codes = np.delete(series[:, i], k)
    instead = np.sort(codes)[(codes.size - 1) // 2]
    if np.abs(shift[k, i] - np.delete(shift[:, i], k)).max() > _STILL * noise:
        still = np.sort(others)[(codes.size - 1) // 2]
        instead = np.clip(np.rint(still + shift[k, i]), 0, watch.white)
    return float(values[k] - level), noise, float(instead)
