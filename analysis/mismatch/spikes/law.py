"""How often spikes hit and how high they are, and what that says of frames it was not told by.

Spikes of mean height m are exponential above any limit, so those above `SPIKE` noises of an
exposure tell m wherever it is; of all hits a share exp(-limit / m) is seen there, and none where
all is at the white level. At that level a height is known to be no less.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, gamma, log, nan, pi, sqrt

import numpy as np
import scipy.optimize
import scipy.sparse
import scipy.sparse.csgraph
import scipy.stats
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.special import gammainc

from analysis.mismatch.finding import Gain
from analysis.mismatch.spikes.hits import Hits
from analysis.mismatch.spikes.population import NEAR, SPIKE, Spikes
from dsis.recording import Recording

Array = NDArray[np.float64]
Frames = Mapping[str, Sequence[int]]
MOST_NATS = 100.0  # that one spike may count
_ENDS = (0.025, 0.975)
_FOURTH = 4
_BLURRED = 1.0  # noises
_FAR_OFF = 2 * (NEAR + 1)  # of exposures and frames from one another, where samples are near
_WIDEST = 1e3  # times the mean of what is seen: where the mean height is looked for


@dataclass(frozen=True)
class SpikeLaw:
    """Spikes of exponential height that hit every sample alike.

    Attributes
    ----------
    share, share_error
        Of samples hit; the error is that of a Poisson count of tracks, samples that touch.
    mean_dn, mean_error_dn
        Mean height above the pixel's median.
    """

    share: float
    share_error: float
    mean_dn: float
    mean_error_dn: float


@dataclass(frozen=True)
class _Seen:
    """Samples looked at above their limits, and the spikes above these."""

    samples: Array
    limits_dn: Array
    hits: Hits

    @classmethod
    def of(cls, spikes: Spikes, recording: Recording, frames: Frames) -> "_Seen":
        samples, limits, which = [], [], np.zeros(spikes.hits.frame.size, bool)
        for number, noise in spikes.quiet_dn.items():
            own = frames.get(recording.exposures[number].name, ())
            samples.append(np.full(4, len(own) * recording.rows * recording.columns / 4))
            limits.append(SPIKE * noise.reshape(-1))
            here = (spikes.hits.exposure == number) & np.isin(spikes.hits.frame, list(own))
            which |= here & np.isfinite(noise)[spikes.hits.row % 2, spikes.hits.column % 2]
        return cls(np.concatenate(samples), np.concatenate(limits), spikes.hits.of(which))


def law_of(spikes: Spikes, recording: Recording, frames: Frames) -> SpikeLaw | None:
    """Return the likeliest law of the spikes of some frames; None: they have none.

    Its log-likelihood is n log s - s sum(samples exp(-limit / m)) - sum(height) / m - u log m with
    n hits, u of which are below the white level.
    """
    seen = _Seen.of(spikes, recording, frames)
    n, heights = seen.hits.frame.size, seen.hits.height_dn
    if not n:
        return None
    known = max(int((~seen.hits.clipped).sum()), 1)

    def less(log_mean: float) -> float:
        m = exp(log_mean)
        shown = float(seen.samples @ np.exp(-seen.limits_dn / m))
        return n * log(shown) + float(heights.sum()) / m + known * log_mean

    start = log(float(heights.mean()))
    ends = (start - log(_WIDEST), start + log(_WIDEST))
    mean = exp(float(scipy.optimize.minimize_scalar(less, bounds=ends, method="bounded").x))
    share = n / float(seen.samples @ np.exp(-seen.limits_dn / mean))
    sizes = _tracks(seen.hits)
    error = sqrt(float(sizes @ sizes)) / n  # of a compound Poisson count
    return SpikeLaw(share, share * error, mean, mean * max(error, 1 / sqrt(known)))


def left_dn4(spikes: Spikes | None, recording: Recording) -> dict[str, float]:
    """Return what spikes that are too low to be put aside add to fourth moments, DN^4, by exposure.

    Noise beside them, and what it makes of that of their pixel, moves the limit outwards on the
    whole, as high powers have it. So do the samples around spikes that have something of them, as
    often as they are seen: a share of the height, or of its square as of charge that repels charge,
    whichever is more.
    """
    everything = {e.name: range(len(e.frames)) for e in recording.exposures}
    law = None if spikes is None else law_of(spikes, recording, everything)
    if spikes is None or law is None:
        return {}
    themselves = _Dragged(1, np.ones(1), np.ones(1))
    around = _dragged(spikes)
    found: dict[str, float] = {}
    for number, noise in spikes.quiet_dn.items():
        sites = noise[np.isfinite(noise)]
        if not sites.size:
            continue  # at the white level: there is no room for them
        ends = (spikes.lowest + _BLURRED) * sites
        more = max(own.below_dn4(law, ends) for own in around)
        left = (themselves.below_dn4(law, ends) + more) * sites.size / noise.size
        found[recording.exposures[number].name] = left
    return found


@dataclass(frozen=True)
class _Dragged:
    """Samples that have c h^p of a spike of height h: factors c, and how many a spike has."""

    power: int
    factors: Array
    times: Array

    def below_dn4(self, law: SpikeLaw, ends_dn: Array) -> float:
        """Return the mean fourth power of those below some limits, of all samples.

        Of exponential heights of mean m, up to H: s c^4 m^(4p) times the integral of x^(4p) exp(-x)
        from 0 to H / m, with c H^p the limit.
        """
        if not self.factors.size:
            return 0.0
        order = _FOURTH * self.power
        highest = (ends_dn[:, np.newaxis] / self.factors) ** (1 / self.power)
        below = gammainc(order + 1, highest / law.mean_dn).mean(0) * gamma(order + 1)
        each = self.times * self.factors**_FOURTH * law.mean_dn**order
        return law.share * float(each @ below)


def _dragged(spikes: Spikes) -> list[_Dragged]:
    """Return samples seen around spikes by each power, of so many as are high enough for them.

    Not at places whose share of spikes is put aside, however small.
    """
    hits = spikes.hits
    echoes = spikes.echoes if spikes.uncovered is None else spikes.uncovered
    if not echoes.frame.size:
        return [_Dragged(1, np.zeros(0), np.zeros(0))]
    at, here = (
        np.stack([_FAR_OFF * own.exposure, _FAR_OFF * own.frame, own.row, own.column], 1)
        for own in (hits, echoes)
    )
    near = KDTree(at).query_ball_point(here, NEAR, p=np.inf)
    tallest = np.array([max(hits.height_dn[own], default=np.inf) for own in near])
    found = []
    for power in (1, 2):
        factors = echoes.height_dn / tallest**power
        factors = factors[factors > 0]
        seen = np.sort(hits.height_dn**power / (spikes.lowest * hits.noise_dn))
        shown = seen.size - np.searchsorted(seen, 1 / factors)
        found.append(_Dragged(power, factors, 1 / np.maximum(shown, 1)))
    return found


def heldout_gain(
    spikes: Spikes, recording: Recording, law: SpikeLaw | None, locked: Frames
) -> Gain:
    """Return what locked frames gain by a law that the others tell, nats per frame.

    A spike counts ln of its density beside that of normal noise, `MOST_NATS` at most, and every
    sample costs the share of spikes that would be seen there. Frames without a spike are many and
    those with one alike: the interval is that of the Poisson count of tracks (Garwood, Biometrika
    28, 1936), which frames drawn anew do not tell where it is small.
    """
    frames = sum(
        len(locked.get(recording.exposures[number].name, ())) for number in spikes.quiet_dn
    )
    if law is None or not frames:
        return Gain(nan, (-np.inf, np.inf))
    seen = _Seen.of(spikes, recording, locked)
    cost = law.share * float(seen.samples @ np.exp(-seen.limits_dn / law.mean_dn))
    sd, z = seen.hits.noise_dn, seen.hits.ratio
    density = log(law.share / law.mean_dn) - seen.hits.height_dn / law.mean_dn
    noise = -0.5 * z**2 - np.log(sd * sqrt(2 * pi))
    nats = np.clip(density - noise, -MOST_NATS, MOST_NATS)
    n = _tracks(seen.hits).size
    one = float(nats.sum()) / n if n else MOST_NATS
    low = scipy.stats.chi2.ppf(_ENDS[0], 2 * n) / 2 if n else 0.0
    high = scipy.stats.chi2.ppf(_ENDS[1], 2 * n + 2) / 2
    value, *ends = ((count * one - cost) / frames for count in (float(n), float(low), float(high)))
    return Gain(value, (ends[0], ends[1]))


def _tracks(hits: Hits) -> Array:
    """Return how many samples each track has: those of a frame that touch."""
    if not hits.frame.size:
        return np.zeros(0)
    # Other exposures and frames lie two apart.
    at = np.stack([2 * hits.exposure, 2 * hits.frame, hits.row, hits.column], 1)
    one, other = KDTree(at).query_pairs(1.0, p=np.inf, output_type="ndarray").T
    touch = scipy.sparse.coo_array((np.ones(one.size), (one, other)), shape=(len(at), len(at)))
    _, labels = scipy.sparse.csgraph.connected_components(touch, directed=False)
    return np.bincount(labels).astype(np.float64)
