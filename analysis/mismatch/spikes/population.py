"""Whether far samples are spikes that no law of noise makes: few, strong, positive, one-off."""

from dataclasses import dataclass

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.scenes import SCENE
from analysis.mismatch.source import Source
from analysis.mismatch.spikes.hits import FAR, Hits, Looked, hits_of
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
LOW = 5.0  # noises of the pixel, from which spikes are put aside where strong ones are there
SPIKE = 8.0  # noises of the pixel: what is taken for a spike where there are any
STRONG = 30.0  # noises: no law of noise
_ELECTRONS = 20.0  # of a strong spike: one electron of few may be far out of the noise
_FEW_ELECTRONS = 10.0  # of a lower one, beside strong ones
_LIT = 2.0  # times the variance of the darkest exposure: light tells what an electron is
_LEAST = 3
_BY_TAIL = 0.02  # chance that so many are strong
_MOST = 5e-3  # of the samples
_MANY = 1e-4  # of the samples: from there on none may be left
_COMPLETE = 0.8  # of the spikes, where noise is least, that are strong
_TAIL = 0.25  # as many would be of a tail that falls with the square of the distance, and more
_FALLING = 2.0  # power of the distance with which a tail falls at least, if noise has a variance
_MOSTLY = 0.5  # of the spikes that are strong, where distances of all say that they are no tail
_BY_FALL = 1e-3  # chance that those of a tail are as large
_NEGATIVE = 0.1  # of the spikes
_NORMALLY = 0.99  # chance that normal noise has no more so low
_RETURNING = 0.2  # pixels that come back, beside the spikes
_BLINKING = 0.05  # of them, where they rise as high: others may do so once
_TWICE = 1e-3  # chance that so many pixels are hit twice, or one so often
_TWO, _OFTEN = 2, 10
_NEARLY = 0.9  # of the pixels that are hit twice, that chance hits
_ALONE = 3.0  # times as high as all others of its pixel a spike is that hits one that comes back
_ECHO = 0.1  # of a spike: as much smaller a sample in its row, its column or around it follows it
_LAG = 0.3  # of a spike, that stays at its pixel
_APART = 1 << 20  # exposures, in frames
_LINED = 0.3  # of the spread of samples, that lines make
_CROWDED = 0.2  # strong spikes of a frame in the row or the column of a sample
NEAR = 4  # rows and columns, and frames after


@dataclass(frozen=True)
class Spikes:
    """The spikes of a recording, strongest first, and what follows them.

    Attributes
    ----------
    hits
        One-off positive samples of uniform exposures and scenes.
    echoes
        Samples that a spike drags along: of its row, its column, or its pixel afterwards.
    lower
        Spikes that are too low to be counted.
    shares, uncovered
        Samples that have too little of a spike to be seen one by one, and echoes at places around
        spikes that have no such share; see `with_shares`. None: not asked, or there are none.
    quiet_dn
        Noise of uniform exposures by number, as rows and columns of the colour filter: (2, 2);
        infinite where a spike has no room below the white level.
    lowest
        From how many noises on spikes are put aside.
    """

    hits: Hits
    echoes: Hits
    lower: Hits
    quiet_dn: dict[int, Array]
    lowest: float = SPIKE
    shares: Hits | None = None
    uncovered: Hits | None = None

    @property
    def replaced(self) -> Hits:
        """All samples that are put aside."""
        shares = [] if self.shares is None else [self.shares]
        return Hits.joined([self.hits, self.echoes, self.lower, *shares])


def spikes_of(recording: Recording, source: Source, camera: Camera) -> Spikes | None:
    """Return rare strong spikes; None: there are none that a law of noise could not make.

    Lower ones are told as well, for few below the limit are tails of noise that nothing simulates.
    Of many all are left where they are where lines move by more than pixels: no pixel tells the
    lower ones. A camera that has impulses already is asked nothing.
    """
    if any(effect.kind == "impulse" for effect in camera.effect):
        return None
    found = _beyond(recording, source, camera, FAR)
    return None if found is None else _beyond(recording, source, camera, LOW) or found


def _beyond(recording: Recording, source: Source, camera: Camera, farthest: float) -> Spikes | None:
    """Return the spikes among samples that are farther than so many noises; None: there are none.

    Lower ones are put aside as well where samples are looked at from `LOW` on.
    """
    uniform: dict[int, Looked] = {}
    scenes: list[Looked] = []
    for number, exposure in enumerate(recording.exposures):
        if len(exposure.frames) < 2:
            continue
        looked = hits_of(recording, source, camera, number, farthest)
        if exposure.kind == SCENE:
            scenes += [] if looked is None else [looked]
        elif looked is None:
            return None
        else:
            uniform[number] = looked
    if not uniform:
        return None
    hits = Hits.joined([*(own.hits for own in uniform.values()), *(own.hits for own in scenes)])
    count, lined = _samples(recording), any(own.of_lines > _LINED for own in uniform.values())
    echo = _echoes(hits, recording)
    again = _returning(hits, ~echo, recording.rows * recording.columns)
    if again is None:
        return None
    alone = ~echo & ~again
    once = alone & (np.abs(hits.ratio) > SPIKE)
    in_uniform, electron = np.isin(hits.exposure, list(uniform)), _electron_dn(camera, uniform)
    if not _certain(hits.of(once & in_uniform), electron, count):
        return None
    many = (once & in_uniform).sum() > _MANY * count
    if many and lined:
        return None
    spikes = hits.of(once & (hits.ratio > 0))
    spikes = spikes.of(np.argsort(-spikes.ratio, kind="stable"))
    told = hits.of(alone & ~once & (farthest <= LOW))
    lower = _lower(told, electron, count)
    white = recording.sensor.white_level
    quiet = {
        number: np.where(own.level_dn + SPIKE * own.noise_dn < white, own.noise_dn, np.inf)
        for number, own in uniform.items()
    }
    both = Hits.joined([spikes, hits.of(echo & ~again)])
    following = _echoes(both, recording)
    following[: spikes.frame.size] = False
    left = farthest > LOW or lower.frame.size < (told.ratio > 0).sum()
    lowest = SPIKE if left and not many else LOW
    return Spikes(spikes, both.of(following), lower, quiet, lowest)


def _lower(hits: Hits, electron_dn: float, samples: int) -> Hits:
    """Return samples that spikes hit as well, though noise may be as far: lower ones.

    None of them, unless nearly all are on the side of spikes, but what normal noise of so many
    samples has on the other.
    """
    up = (hits.ratio > 0) & (hits.height_dn > _FEW_ELECTRONS * electron_dn)
    down = hits.ratio < 0
    by_chance = scipy.stats.poisson.ppf(_NORMALLY, samples * scipy.stats.norm.sf(LOW))
    return hits.of(up & (down.sum() <= _NEGATIVE * up.sum() + by_chance))


def _electron_dn(camera: Camera, uniform: dict[int, Looked]) -> float:
    """Return what one electron adds, DN, at most: by the camera or by noise that grows with light.

    The model's numbers may be wrong; its shot noise is what no spike may be.
    """
    variance = np.array([float((own.noise_dn**2).mean()) for own in uniform.values()])
    level = np.array([float(own.level_dn.mean()) for own in uniform.values()])
    dimmest = int(level.argmin())
    above = level - level[dimmest]
    lit = (above > 0) & (variance > _LIT * variance[dimmest])
    slopes = (variance[lit] - variance[dimmest]) / above[lit]
    return max([s.slope for s in camera.noise.segment] + [float(s) for s in slopes])


def _samples(recording: Recording) -> int:
    """Return how many samples uniform exposures have that are looked at."""
    uniform = (e for e in recording.exposures if e.kind != SCENE and len(e.frames) >= _TWO)
    return sum(len(e.frames) for e in uniform) * recording.rows * recording.columns


def _certain(once: Hits, electron_dn: float, samples: int) -> bool:
    """Return whether one-off samples are no tail of a law of noise.

    Spikes of one law of heights fall below thirty noises where noise is large: so whether nearly
    all are above is asked of the exposures where it is least, as many as say so. Beside noise whose
    own tail reaches past eight, more than half have to be, and all together so far as no such tail
    does.
    """
    strong = (once.ratio > STRONG) & (once.height_dn > _ELECTRONS * electron_dn)
    positive = once.ratio > 0
    if strong.sum() < _LEAST or positive.sum() > _MOST * samples:
        return False
    if (~positive).sum() > _NEGATIVE * positive.sum():
        return False
    for noise in np.unique(once.quiet_dn)[::-1]:
        own = once.quiet_dn <= noise
        n, of = int((strong & own).sum()), int(own.sum())
        tail = scipy.stats.binom.sf(n - 1, of, _TAIL) > _BY_TAIL
        if n >= max(_LEAST, _COMPLETE * of) and not tail:
            return True
        if n >= max(_LEAST, _MOSTLY * of) and _farther(once.ratio[own & positive]) < _BY_FALL:
            return True
    return False


def _farther(ratio: Array) -> float:
    """Return the chance that samples of a tail are as far, which falls with a power of distance.

    Of that the logarithms of distances, from where they begin, are exponential: their sum is a
    gamma variate (Hill, Annals of Statistics 3, 1975).
    """
    return float(scipy.stats.gamma.sf(_FALLING * np.log(ratio / SPIKE).sum(), ratio.size))


def _echoes(hits: Hits, recording: Recording) -> Flags:
    """Return which samples a much stronger one of the frame, or of a frame before, drags along.

    Not where chance puts half as many there. Where spikes are crowded, any has others in its row
    and its column: only around it are they its own.
    """
    order = np.lexsort((hits.frame, hits.exposure))
    own = hits.of(order)
    dragged, after = np.zeros(own.frame.size, bool), np.zeros(own.frame.size, bool)
    time = own.exposure * _APART + own.frame
    size, strong = np.abs(own.height_dn), own.ratio > STRONG
    frames = sum(len(exposure.frames) for exposure in recording.exposures)
    density = float(strong.sum()) / (frames * recording.rows * recording.columns)
    crowded = density * (recording.rows + recording.columns) > _CROWDED
    for i in np.flatnonzero(strong):
        some = slice(*np.searchsorted(time, [time[i], time[i] + NEAR + 1]))
        here, later = time[some] == time[i], time[some] > time[i]
        down, right = np.abs(own.row[some] - own.row[i]), np.abs(own.column[some] - own.column[i])
        beside = (down <= NEAR) & (right <= NEAR)
        if crowded:  # as charge and filters reach, or along a line as a read-out does
            beside &= (down == 0) | (right == 0) | ((down <= _TWO) & (right <= _TWO))
        else:
            beside |= (down == 0) | (right == 0)
        dragged[some] |= here & beside & (size[some] < _ECHO * size[i])
        pixel = (down == 0) & (right == 0)
        after[some] |= later & pixel & (size[some] < _LAG * size[i])
    around = (2 * _TWO + 1) ** 2 + 4 * (NEAR - _TWO)
    if not crowded:
        around = (2 * NEAR + 1) ** 2 + recording.rows + recording.columns
    by_chance = around * density * float((~strong).sum())
    dragged &= dragged.sum() > _TWO * by_chance
    found = np.zeros(dragged.size, bool)
    found[order] = dragged | after
    return found


def _returning(hits: Hits, counted: Flags, pixels: int) -> Flags | None:
    """Return which samples are of pixels that come back; None: those are too many beside others.

    As many pixels as chance hits twice, and more often, do not.
    """
    site = np.stack([hits.row, hits.column])
    _, which = np.unique(site, axis=1, return_inverse=True)
    which = which.reshape(-1)
    times = np.bincount(which, weights=counted, minlength=which.max(initial=0) + 1)
    often = _by_chance(float(times[times <= _TWO].sum()) / pixels, pixels)
    rare = times[(times > 0) & (times <= often)]
    rate = float(rare.sum()) / pixels
    expected = pixels * scipy.stats.poisson.sf(1, rate)
    twice = int((rare >= _TWO).sum())
    chance = scipy.stats.poisson.sf(twice - 1, expected) > _TWICE or expected > _NEARLY * twice
    again = times > (often if chance else 1)
    once = int(((times > 0) & ~again).sum())
    blinks = np.bincount(which[counted & (hits.ratio > STRONG)], minlength=times.size) > 0
    if again.sum() > _RETURNING * once or (again & blinks).sum() > _BLINKING * once:
        return None
    return np.asarray(again[which]) & ~_far_above(hits, which)


def _far_above(hits: Hits, which: NDArray[np.intp]) -> Flags:
    """Return which strong samples are far above all others of their pixel, `which` says.

    A spike may hit a pixel that jumps.
    """
    size = np.abs(hits.height_dn)
    order = np.lexsort((size, which))
    last = np.append(np.diff(which[order]) != 0, True)
    below = np.append(0.0, size[order][:-1])
    below[np.append(True, last[:-1])] = 0.0
    found = np.zeros(which.size, bool)
    found[order] = last & (size[order] > _ALONE * below)
    return found & (hits.ratio > STRONG)


def _by_chance(rate: float, pixels: int) -> int:
    """Return how often chance may hit one of all pixels that are hit at this rate; twice at least.

    Beyond that fewer than one in a thousand recordings has such a pixel.
    """
    times = np.arange(_TWO, _OFTEN)
    return int(times[pixels * scipy.stats.poisson.sf(times, rate) < _TWICE].min(initial=_OFTEN))
