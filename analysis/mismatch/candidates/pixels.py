"""The law of single pixels' noise: Poisson, tails, pixels that differ or jump, spikes, codes."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from math import exp, log, sqrt

import numpy as np

from analysis.mismatch.bank.codephase import KIND as CODES
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.candidates.steps import absent, fractional_step
from analysis.mismatch.clues import Clues
from analysis.mismatch.jumping import NAME as JUMPING
from dsis.measures import Lattice

_SWITCHING = (0.35, 0.1)  # a frame: seen in the noise, and in maps of few frames too
_QUIET = 4.0  # times the least variance: there spikes stand out


def _poisson(clues: Clues) -> Sequence[Proposal]:
    if clues.camera.noise.shot == "poisson":
        return []
    return proposals("poisson_shot_noise", [])


def _tails(clues: Clues) -> Sequence[Proposal]:
    k, _ = clues.amplitude("kurtosis", lambda place: clues.read_share(place) ** 2)
    if k <= 0:
        return []
    return proposals("heavy_tailed_read_noise", ["tail_df"], tail_df=4 + 6 / max(k, 0.02))


def _spread(clues: Clues) -> Sequence[Proposal]:
    """Start from how far variances of pixels scatter: by exp(4 s^2) - 1 of the mean, squared.

    Where frames are too few for that, from the kurtosis, which is three times as much.
    """
    top = bottom = 0.0
    for place, (value, sd) in clues.excess("variance_spread").items():
        white = 2 / (clues.frames(place[0]) - 1)  # of the mean, squared: what chance scatters
        unit = exp(min(value, 10.0)) * white / (1 + white)
        own, error = unit - white / (1 + white), unit * sd
        share = clues.read_share(place) ** 2
        top, bottom = top + own * share / error**2, bottom + (share / error) ** 2
    square = top / bottom if bottom > 0 else 0.0
    if square <= 0:
        k, _ = clues.amplitude("kurtosis", lambda place: clues.read_share(place) ** 2)
        square = k / 3
    if square <= 0:
        return []
    return proposals(
        "read_noise_spread", ["log_sigma"], log_sigma=min(sqrt(log(1 + square) / 4), 1.5)
    )


def _rts(clues: Clues) -> Sequence[Proposal]:
    """Start from what frames show, or from shares of pixels.

    And from the height that the mean excess variance then asks for.
    """
    found: list[Proposal] = []
    if clues.jumps is not None:
        shown = clues.jumps.model_dump(exclude={"kind"})
        found += proposals("rts", ["pixel_fraction", "amplitude_dn"], **shown)
    k, error = clues.amplitude("kurtosis", lambda place: clues.read_share(place) ** 2)
    k = max(k, error)  # few pixels show in maps before they show in the mean
    if not np.isfinite(k):
        return found
    read = max(float(clues.fit.line_dn2(np.zeros(1))[0]), 0.02)
    for fraction in (0.001, 0.003, 0.01, 0.03, 0.1):
        # The kurtosis of a mixture: 3 f E[(a^2/4)^2] / V^2, E[a^4] = 24 A^4.
        height = (k * read**2 / (3 * fraction * 24 / 16)) ** 0.25
        for switching in _SWITCHING:
            found += proposals(
                "rts",
                ["pixel_fraction", "amplitude_dn"],
                pixel_fraction=fraction,
                amplitude_dn=height,
                switch_probability=switching,
            )
    return found


def _impulse(clues: Clues) -> Sequence[Proposal]:
    k, _ = clues.amplitude("kurtosis", lambda place: clues.read_share(place) ** 2)
    if k <= 0:
        return []
    place = min(clues.places, key=lambda p: clues.layout.variance_dn2[p])
    v, without = clues.seen.levels[place].variance_dn2, clues.layout.variance_dn2[place]
    most = clues.layout.white_dn - clues.layout.black_dn
    # E[h^4] = 24 mean^4: kurtosis p 24 mean^4 / V^2.
    heights = (min(height * sqrt(without), most) for height in (20.0, 100.0, 500.0))
    starts = [(k * v**2 / (24 * mean**4), mean) for mean in heights]
    starts += _counted(clues, most)
    found: list[Proposal] = []
    for share, mean in starts:
        if share > 1e-8:
            found += proposals(
                "impulse",
                ["per_megapixel_frame", "mean_dn"],
                per_megapixel_frame=min(share * 1e6, 9e4),
                mean_dn=mean,
            )
    return found


def _counted(clues: Clues, most_dn: float) -> list[tuple[float, float]]:
    """Return share and mean height of spikes, as those far outside of the noise say."""
    levels = clues.seen.levels
    dark = _QUIET * min(levels[place].bulk_dn2 for place in clues.places)
    own = [levels[p] for p in clues.places if levels[p].bulk_dn2 <= dark]
    if not own:
        return []
    share = float(np.mean([level.far for level in own])) / 2  # both differences of a frame see it
    excess = float(np.mean([level.variance_dn2 - level.bulk_dn2 for level in own]))
    if not share > 0 or not excess > 0:
        return []
    return [(share, min(sqrt(excess / (2 * share)), most_dn))]  # E[h^2] = 2 mean^2


def _quantisation(clues: Clues) -> Sequence[Proposal]:
    """Propose the step and the phase of all codes; where few stray, those of most exposures.

    A step that is no whole number leaves some codes out, see `fractional_step`.
    """
    lattices = list(clues.seen.lattices.values())
    step = reduce(Lattice.joined, lattices).step if lattices else 1
    if step <= 1:
        step = _step_of_most(clues)
        lattices = [own for own in lattices if own.step % step == 0]
    if step <= 1 or not lattices:
        middles = clues.seen.middles.values()
        found = fractional_step(middles, absent(middles))
        if found is None:
            return []
        made = proposals("quantisation", [], step_dn=found[0], phase_dn=found[1])
        return [replace(one, errors={"step_dn": 0.0, "phase_dn": 0.0}) for one in made]
    phase = Counter(own.phase(step) for own in lattices).most_common(1)[0][0]
    return proposals("quantisation", [], step_dn=float(step), phase_dn=phase)


def _step_of_most(clues: Clues) -> int:
    steps = [
        2 ** clues.vector.values[i]
        for i, key in enumerate(clues.vector.keys)
        if key.statistic == "code_spacing" and clues.null.known[i]
    ]
    return max(round(float(np.median(steps))), 1) if steps else 1


def _dnl(clues: Clues) -> Sequence[Proposal]:
    values = [v for v, _ in clues.excess("code_imbalance").values()]
    rms = float(np.median(values)) if values else 0.0
    in_step = max(
        (p.power for (_, kind), p in clues.seen.peaks.items() if kind == CODES), default=0
    )
    rms = max(rms, in_step)
    if rms <= 0:
        rms = 0.3
    return proposals("adc_dnl", ["rms_lsb"], rms_lsb=min(max(rms, 0.02), 1.5))


CANDIDATES = (
    Candidate("poisson_shot_noise", ("skewness",), _poisson),
    Candidate(
        "heavy_tailed_read_noise", ("kurtosis", "kurtosis_within_pixels", "variance_spread"), _tails
    ),
    Candidate(
        "read_noise_spread", ("variance_spread", "variance_persistence", "kurtosis"), _spread
    ),
    Candidate(
        "rts",
        ("variance_spread", "variance_persistence", "kurtosis", "one_off_outliers",
         "noisy_pixels", "frame_correlation", "outlying_pixels", JUMPING),
        _rts,
    ),
    Candidate("impulse", ("one_off_outliers", "kurtosis", "skewness"), _impulse),
    Candidate("quantisation", ("code_spacing", "code_imbalance"), _quantisation),
    Candidate("adc_dnl", ("code_imbalance",), _dnl),
)  # fmt: skip
